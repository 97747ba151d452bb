# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares the report's pictures from a farm of two workers, one of which is killed during its
task, with those of one process. Also tests what is kept, and error messages."""

import json
import os
import signal
import socket
import stat
import subprocess
import sys
import time
from pathlib import Path

import demo_tasks
import OpenImageIO as oiio
import pytest
from demo_farm import Progress
from demo_tasks import Task, TaskError, kept, run_task
from support import ROOT, TOOL, scene

FARM = ROOT / ".env" / "farm" / "bin" / "python"
BLENDER = ROOT / ".env" / "blender-4.5" / "bin" / "python"
#: A tool whose first render never ends, and which records the process id of the worker.
STUCK_ONCE = """#!/bin/sh
if [ "$1" = render ] && mkdir "{folder}" 2>/dev/null; then
  echo $PPID $$ >"{folder}/part" && mv "{folder}/part" "{folder}/processes"
  exec sleep 300
fi
exec "{tool}" "$@"
"""


def ball():
    """A sphere under a lamp, whose picture depends on the seed."""
    lamp = {"type": "point", "position": [2, -4, 3], "power": 500, "radius": 0.5}
    settings = {"width": 8, "height": 8, "spp": 8, "seed": 1, "max_bounces": 1}
    environment = {"color": [0.2, 0.3, 0.4]}
    return scene(name="ball", settings=settings, lights=[lamp], environment=environment)


def until(what, seconds=30):
    """Waits until a function returns a true value, and returns it."""
    end = time.monotonic() + seconds
    while not (found := what()):
        assert time.monotonic() < end, "took too long"
        time.sleep(0.05)
    return found


def alive(process):
    try:
        # a zombie does not count
        return Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


@pytest.fixture
def farm(tmp_path):
    """farm(worker=...): starts the script with these arguments in its own process group; all
    processes end with the test."""
    started = []

    def start(*arguments):
        log = (tmp_path / f"farm-{len(started)}.log").open("w")
        process = subprocess.Popen(
            [ROOT / "script" / "farm", *arguments],
            stdout=log,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        started.append(process)
        return process

    yield start
    for process in started:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def command_of(python, tool, extension, out, source, *more):
    command = [python, ROOT / "script" / "demo_render.py", "--tool", tool, "--extension", extension]
    command += ["--out", out, "--forms", "unit", "--seeds", "2", "--reference-factor", "1"]
    return [*command, *more, source]


def told(folder):
    """runs.json without times and without names of files and machines."""
    runs = json.loads((folder / "runs.json").read_text())
    for run in (runs["reference"], *runs["runs"]):
        for key in ("cpu_seconds", "wall_seconds"):
            run.pop(key, None)
    runs["provenance"].pop("Processor")
    runs.pop("commands")
    return runs


def pixels(file):
    return oiio.ImageBuf(str(file)).get_pixels(oiio.FLOAT).tobytes()


@pytest.mark.long
@pytest.mark.slow
def test_a_farm_renders_what_one_process_does_though_a_worker_is_killed(farm, tmp_path):
    for python in (FARM, BLENDER):
        if not python.is_file():
            pytest.skip(f"{python} is missing; script/test makes it")
    packed = list((ROOT / "build").glob("brdfc_shaders-*.zip"))
    if not packed:
        pytest.skip("build/brdfc_shaders-VERSION.zip is missing; script/test makes it")
    extension = max(packed, key=lambda path: path.stat().st_mtime)
    source = tmp_path / "ball.json"
    source.write_text(json.dumps(ball()))
    # The same program for both, because its bytes are part of the provenance.
    tool, stuck = tmp_path / "brdfc", tmp_path / "stuck"
    tool.write_text(STUCK_ONCE.format(folder=stuck, tool=TOOL))
    tool.chmod(tool.stat().st_mode | stat.S_IXUSR)

    address = f"tcp://127.0.0.1:{free_port()}"
    farm("scheduler", "--port", address.rsplit(":", 1)[1])
    until(lambda: socket.socket().connect_ex(("127.0.0.1", int(address.rsplit(":", 1)[1]))) == 0)
    workers = [farm("worker", address, "--cores", "1") for _ in range(2)]
    far = command_of(FARM, tool, extension, tmp_path / "far", source, "--scheduler", address)
    with (tmp_path / "far.log").open("w") as log:
        running = subprocess.Popen(far, stdout=log, stderr=subprocess.STDOUT)
    until((stuck / "processes").exists)
    worker, sleeper = map(int, (stuck / "processes").read_text().split())
    group = os.getpgid(worker)
    assert group in [w.pid for w in workers] and alive(sleeper)
    os.killpg(group, signal.SIGKILL)
    assert running.wait(60) == 0, (tmp_path / "far.log").read_text()
    assert not alive(sleeper), "what a killed worker had started goes on"

    near = command_of(BLENDER, tool, extension, tmp_path / "near", source)
    subprocess.run(near, check=True, capture_output=True)
    folders = [tmp_path / where / "ball" for where in ("far", "near")]
    files = [{p.name for p in f.iterdir()} for f in folders]
    assert files[0] == files[1]
    pictures = [name for name in files[0] if name.endswith(".exr")]
    # Two seeds of three forms each: with Open Shading Language, without it, and the unit of cost.
    assert len(pictures) == 7 and "reference.exr" in pictures
    for name in pictures:
        assert pixels(folders[0] / name) == pixels(folders[1] / name), name
    assert told(folders[0]) == told(folders[1])

    # An interrupted run: only the task without a record is run again.
    before = {f: f.stat().st_mtime_ns for f in folders[0].glob("*.exr")}
    (folders[0] / "tasks" / "blender-2.json").unlink()
    again = subprocess.run(far, check=True, capture_output=True, text=True)
    assert [line for line in again.stdout.splitlines() if "[" in line][0].startswith(
        "    [1/1] ball/blender-2: "
    )
    changed = {f.name for f, old in before.items() if f.stat().st_mtime_ns != old}
    assert changed == {n for n in pictures if n.endswith("-2.exr")}


def test_no_scheduler(tmp_path):
    if not FARM.is_file():
        pytest.skip(f"{FARM} is missing; script/test makes it")
    address = f"127.0.0.1:{free_port()}"
    done = subprocess.run(
        [ROOT / "script" / "farm", "worker", address], capture_output=True, text=True
    )
    assert done.returncode == 1
    assert f"no scheduler answers at {address}" in done.stderr


def task(folder, code, **changes):
    values = {
        "name": "scene/part",
        "kind": "plan",
        "command": (sys.executable, "-c", code),
        "key": "1",
        "folder": folder,
        "outputs": (folder / "made",),
        "programs": (),
    }
    return Task(**values | changes)


def test_a_task_is_kept_by_its_key_and_outputs(tmp_path):
    made = tmp_path / "made"
    one = task(tmp_path, f"open({str(made)!r}, 'a').write('x')")
    assert kept(one) is None
    record = run_task(one)
    assert record["command"].startswith(demo_tasks.shown([sys.executable])) and kept(one) == record
    assert run_task(one) == record and made.read_text() == "x"
    run_task(task(tmp_path, f"open({str(made)!r}, 'a').write('y')", key="2"))
    assert made.read_text() == "xy" and kept(one) is None
    made.unlink()
    assert kept(task(tmp_path, "", key="2")) is None


def test_a_task_that_fails_names_its_command_and_log(tmp_path):
    with pytest.raises(TaskError) as raised:
        run_task(task(tmp_path, "import sys; sys.exit('no such lamp')"), where="tcp://one:1")
    said = str(raised.value)
    assert "scene/part: failed on tcp://one:1 with status 1" in said and "no such lamp" in said
    assert "sys.exit" in said and str(tmp_path / "part.log") in said
    assert "no such lamp" in (tmp_path / "part.log").read_text()
    with pytest.raises(TaskError, match="wrote no .*made"):
        run_task(task(tmp_path, ""))


def test_a_worker_that_lacks_a_file(tmp_path):
    gone = tmp_path / "gone"
    with pytest.raises(TaskError, match="tcp://one:1 lacks .*gone; a worker needs this checkout"):
        run_task(task(tmp_path, "", programs=((gone, None),)), where="tcp://one:1")
    gone.write_text("other")
    with pytest.raises(TaskError, match="tcp://one:1 has another .*gone"):
        run_task(task(tmp_path, "", programs=((gone, "0" * 64),)), where="tcp://one:1")


def test_the_time_left_is_by_work_and_kind(tmp_path):
    said = []
    progress = Progress(said.append)
    progress.expect("plan", 2, 10)
    progress.expect("reference", 1, 5)
    record = {"wall_seconds": 60.0, "worker": "tcp://one:1"}
    progress.finish(task(tmp_path, "", work=10), record, 2)
    progress.finish(task(tmp_path, "", kind="reference", work=5), record, 2)
    progress.finish(task(tmp_path, "", work=10), record, 2)
    assert said == [
        "[1/3] scene/part: 60.0 s on tcp://one:1",
        "[2/3] scene/part: 60.0 s on tcp://one:1; about 00:00:30 left",
        "[3/3] scene/part: 60.0 s on tcp://one:1",
    ]
