# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs in a Python that has the bpy module. BRDFC_EXTENSION_ZIP names the extension under test,
BRDFC_TOOL the built brdfc. Blender's user folders are scratch, so nothing of the user's is touched.

BRDFC_ANSWERS, if it is set, names a folder in which what the tool made is kept: runs in several
versions of Blender ask it the same questions.
"""

import contextlib
import fcntl
import hashlib
import json
import os
import subprocess
import tempfile
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import pytest

# Blender reads this when bpy is first imported.
_RESOURCES = tempfile.TemporaryDirectory(prefix="brdfc-test-")
os.environ["BLENDER_USER_RESOURCES"] = _RESOURCES.name

PACKAGE = "bl_ext.user_default.brdfc_shaders"


def _path_from_environment(variable, what):
    value = os.environ.get(variable)
    if not value:
        pytest.fail(f"{variable} is not set; it must name {what}", pytrace=False)
    path = Path(value).resolve()
    if not path.is_file():
        pytest.fail(f"{variable}: {path} does not exist; it must name {what}", pytrace=False)
    return path


@pytest.fixture(scope="session")
def extension_zip():
    return _path_from_environment("BRDFC_EXTENSION_ZIP", "brdfc_shaders-<version>.zip")


#: Commands that write nothing but their output.
PRINTING = {"albedo", "closure", "eval", "fit", "list", "probe", "sample"}


class Answers:
    """Files that were made once, by what they were made of."""

    def __init__(self, folder, program):
        self.folder = Path(folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        self.program = hashlib.sha256(program.read_bytes()).hexdigest()

    @contextlib.contextmanager
    def of(self, *question):
        """The path of the answer; while this is held nobody else makes it."""
        text = json.dumps([self.program, *question])
        path = self.folder / hashlib.sha256(text.encode()).hexdigest()
        with path.with_suffix(".lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            yield path


@pytest.fixture(scope="session")
def program():
    return _path_from_environment("BRDFC_TOOL", "the built brdfc")


@pytest.fixture(scope="session")
def answers(program, tmp_path_factory):
    folder = os.environ.get("BRDFC_ANSWERS") or tmp_path_factory.mktemp("answers")
    return Answers(folder, program)


@pytest.fixture(scope="session")
def tool(program, answers):
    """Runs the generator's tool: tool("albedo", "lambert", stdin=...) returns stdout."""

    def run(*arguments, stdin=""):
        arguments = [str(a) for a in arguments]
        if arguments[0] not in PRINTING:
            return ask(arguments, stdin)
        with answers.of(arguments, stdin) as path:
            if not path.exists():
                answer = ask(arguments, stdin)
                beside = path.with_suffix(".part")
                beside.write_text(answer)
                beside.replace(path)
            return path.read_text()

    def ask(arguments, stdin):
        done = subprocess.run([program, *arguments], input=stdin, capture_output=True, text=True)
        assert done.returncode == 0, f"{arguments}: {done.stderr}"
        return done.stdout

    return run


@pytest.fixture(scope="session")
def lean_pack(tool, answers):
    """lean_pack(materials, *options): the folder of a pack of these alone, as `brdfc build
    --materials` makes it. To be read only."""

    def make(materials, *options):
        with answers.of("pack", materials, options) as path:
            done = path / "brdfc_shaders"
            if not done.exists():
                path.mkdir(exist_ok=True)
                file = path / "materials.json"
                file.write_text(json.dumps({"materials": materials}))
                tool("build", "--materials", file, *options, "--out", path)
            return done

    return make


@pytest.fixture(scope="session")
def extension(extension_zip):
    """The extension, installed from its zip as a person would; its modules as attributes."""
    import bpy

    bpy.ops.preferences.addon_enable(module="bl_pkg")
    bpy.ops.extensions.package_install_files(
        filepath=str(extension_zip), repo="user_default", enable_on_install=True
    )
    assert PACKAGE in bpy.context.preferences.addons
    names = ("api", "checks", "energy", "nodes", "operators", "pack", "scene_loader", "ui")
    return SimpleNamespace(
        package=PACKAGE, **{name: import_module(f"{PACKAGE}.{name}") for name in names}
    )


@pytest.fixture(scope="session")
def batch():
    from helpers import Batch

    return Batch()


@pytest.fixture
def empty(extension):
    """An empty factory file with Cycles. Preferences, and with them the extension, stay."""
    import bpy

    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    assert PACKAGE in bpy.context.preferences.addons
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    return scene


@pytest.fixture
def use_pack(extension, lean_pack):
    """use_pack(materials, *options): the extension takes a pack of these alone, until the test
    ends. Returns the pack's folder."""

    def use(materials, *options):
        folder = lean_pack(materials, *options)
        extension.pack.use(folder)
        return folder

    yield use
    extension.pack.use()
