# SPDX-License-Identifier: GPL-3.0-or-later
"""The times of sources that `script/test` prints after the build."""

import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).parents[2]
LIB = ROOT / "script" / "lib.sh"
SPIN = """
import sys, time
print("out"), print("err", file=sys.stderr)
while time.process_time() < 0.3: pass
time.sleep(0.4)
sys.exit(3)
"""


def compiled(folder, program, name):
    """Runs a program as the build runs the compiler."""
    command = [ROOT / "script" / "compile_time", sys.executable, "-c", program, "-o", name]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=60)


def test_a_compiler_keeps_its_outputs_and_status_and_its_processor_time_is_recorded(tmp_path):
    start = time.monotonic()
    done = compiled(tmp_path, SPIN, "slow dir/a.o")
    assert time.monotonic() - start > 0.7
    assert (done.stdout, done.stderr, done.returncode) == ("out\n", "err\n", 3)
    seconds, name = (tmp_path / "compile_times").read_text().rstrip("\n").split("\t")
    assert name == "slow dir/a.o"
    assert 0.3 <= float(seconds) < 0.65  # the time of the sleep is not in it


def test_the_five_slowest_sources_and_the_sum_are_printed(tmp_path):
    times = [("CMakeFiles/x.dir/a.cpp.o", s) for s in (99, 0.5)]  # compiled twice: the last counts
    times += [(f"{i}.cpp.o", i) for i in range(1, 8)]
    (tmp_path / "compile_times").write_text("".join(f"{s:.2f}\t{name}\n" for name, s in times))
    command = ["bash", "-c", 'source "$0"; slowest_sources "$1"', LIB, tmp_path]
    printed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    rows = [line.split(maxsplit=1) for line in printed.splitlines()[1:]]
    assert rows[:4] == [
        ["28.5", "all 8 sources"], ["7.0", "7.cpp"], ["6.0", "6.cpp"], ["5.0", "5.cpp"],
    ]  # fmt: skip
    assert len(rows) == 6
    assert not any("a.cpp" in name for _, name in rows)


def test_a_folder_without_times_prints_nothing(tmp_path):
    command = ["bash", "-c", 'source "$0"; slowest_sources "$1"', LIB, tmp_path]
    assert subprocess.run(command, check=True, capture_output=True).stdout == b""
