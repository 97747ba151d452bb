# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs in a Python that has the bpy module. BRDFC_EXTENSION_ZIP names the extension under test,
BRDFC_TOOL the built brdfc. Blender's user folders are scratch, so nothing of the user's is touched.
"""

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


@pytest.fixture(scope="session")
def tool():
    """Runs the generator's tool: tool("albedo", "lambert", stdin=...) returns stdout."""
    program = _path_from_environment("BRDFC_TOOL", "the built brdfc")

    def run(*arguments, stdin=""):
        done = subprocess.run(
            [program, *map(str, arguments)], input=stdin, capture_output=True, text=True
        )
        assert done.returncode == 0, f"{arguments}: {done.stderr}"
        return done.stdout

    return run


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
