# SPDX-License-Identifier: GPL-3.0-or-later
"""OpenImageIO, which takes long to load, is in a module of its own that is loaded when a picture is
read or written."""

import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest
from support import ROOT, TOOL, run, scene

MODULE = Path(TOOL).with_name("brdfc_pictures.so")
LIBRARY = re.compile(rb"libOpenImageIO\.so\.(\d)")

CACHE = Path(TOOL).with_name("CMakeCache.txt")

pytestmark = pytest.mark.skipif(
    CACHE.exists() and re.search(r"^BRDFC_PICTURES_MODULE:\w+=OFF$", CACHE.read_text(), re.M),
    reason="built without the module",
)


@pytest.fixture
def program(tmp_path):
    """A copy of the program without its module."""
    (tmp_path / "bin").mkdir()
    return Path(shutil.copy2(TOOL, tmp_path / "bin"))


@pytest.fixture
def picture(tmp_path):
    path = tmp_path / "s.exr"
    (tmp_path / "s.json").write_text(json.dumps(scene()))
    assert run("render", tmp_path / "s.json", "--out", path).returncode == 0
    return path


def call(program, *arguments, **options):
    command = [program, *map(str, arguments)]
    environment = {"BRDFC_DATA": str(ROOT)}
    return subprocess.run(command, capture_output=True, text=True, env=environment, **options)


def test_only_the_module_is_linked_to_openimageio():
    def libraries(file):
        command = ["ldd", file]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout

    assert "libOpenImageIO.so" not in libraries(TOOL)
    assert "libOpenImageIO.so" in libraries(MODULE)
    assert LIBRARY.search(MODULE.read_bytes())


def test_what_needs_no_picture_needs_no_module(program):
    assert call(program, "--version").returncode == 0
    directions = "wi_x,wi_y,wi_z,wo_x,wo_y,wo_z\n0,0,1,0,0.6,0.8\n"
    done = call(program, "eval", "lambert", "rho=0.5", input=directions)
    assert (done.returncode, done.stderr) == (0, "") and done.stdout.count("\n") == 2


def refused(done, *words):
    assert (done.returncode, done.stdout) == (2, ""), done.stderr
    assert done.stderr.startswith("brdfc: ") and done.stderr.count("\n") == 1, done.stderr
    for word in words:
        assert str(word) in done.stderr


def test_a_missing_module_is_said_with_the_places_where_it_was_expected(program, picture):
    beside = program.parent / MODULE.name
    installed = program.parents[1] / "lib" / "brdfc" / MODULE.name
    refused(call(program, "compare", picture, picture), "is missing", beside, installed)
    # Before the time that a picture takes, not after it.
    long = ["--width", "4096", "--height", "4096", "--spp", "1000000"]
    out = picture.with_name("out.exr")
    done = call(program, "render", picture.with_suffix(".json"), "--out", out, *long, timeout=20)
    refused(done, "is missing")
    assert not out.exists()


@pytest.mark.parametrize("place", ["bin", "lib/brdfc"])
def test_it_is_found_beside_the_program_and_where_it_is_installed(program, picture, place):
    folder = program.parents[1] / place
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy2(MODULE, folder)
    assert call(program, "compare", picture, picture).returncode == 0


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda module: module[:40], "too short"),
        (lambda module: b"no library" * 100, "invalid ELF header"),
        (lambda module: LIBRARY.sub(rb"libOpenImageIO.so.0", module), "libOpenImageIO.so.0"),
        (
            lambda module: module.replace(b"brdfc_pictures_library", b"brdfc_pictures_another"),
            "undefined symbol: brdfc_pictures_library",
        ),
    ],
    ids=["cut", "other", "without OpenImageIO", "without its function"],
)
def test_a_broken_module_is_said_with_its_path_and_the_reason(program, picture, change, reason):
    broken = program.parent / MODULE.name
    broken.write_bytes(change(MODULE.read_bytes()))
    refused(call(program, "compare", picture, picture), broken, "can't be loaded", reason)
