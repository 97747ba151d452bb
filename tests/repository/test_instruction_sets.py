# SPDX-License-Identifier: GPL-3.0-or-later
"""Models are compiled for several instruction sets, whose functions must not be mixed up."""

import re
import subprocess
from pathlib import Path

import pytest
from support import TOOL

SETS = ["x86_64_v3", "x86_64_v4"]


@pytest.mark.parametrize("instructions", SETS)
def test_code_for_a_newer_processor_has_names_of_its_own(instructions):
    """Of two functions with the same name, the linker keeps an arbitrary one: on an older
    processor, the wrong one causes an illegal instruction."""
    folder = Path(TOOL).parent / "generator" / "CMakeFiles" / f"brdfc_models_{instructions}.dir"
    objects = sorted(folder.rglob("*.o"))
    if not objects:
        pytest.skip("this compiler makes one version of each model")
    lines = subprocess.run(
        ["nm", "--demangle", "--defined-only", "--extern-only", *objects],
        capture_output=True,
        text=True,
        check=True,
    ).stdout.splitlines()
    names = [match[1] for line in lines if (match := re.match(r"[0-9a-f]* +[A-Za-z] (.*)", line))]
    assert len(names) > len(objects)
    assert [name for name in names if instructions not in name] == []


@pytest.mark.parametrize("instructions", SETS)
@pytest.mark.parametrize("loop", ["bend_normals", "make_frames", "turn_to_world"])
def test_loops_of_the_reference_take_roots_of_several_numbers_at_a_time(loop, instructions):
    """One line that GCC can't turn into vector instructions makes the whole loop several times
    slower, and nothing else shows it: bending normals took a sixth of the reference's time."""
    symbols = subprocess.check_output(["nm", TOOL], text=True).split()
    clones = [
        s
        for s in symbols
        if f"PathTracer{len(loop)}{loop}E" in s and s.endswith(f"arch_{instructions}")
    ]
    if not any(s.endswith(f"arch_{instructions}") for s in symbols):
        pytest.skip("this compiler makes one version of each function")
    (clone,) = clones
    code = subprocess.check_output(["objdump", "-d", f"--disassemble={clone}", TOOL], text=True)
    roots = re.findall(r"\bvsqrt[sp]d\b", code)
    assert roots
    assert set(roots) == {"vsqrtpd"}
