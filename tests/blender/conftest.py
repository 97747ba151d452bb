# SPDX-License-Identifier: GPL-3.0-or-later
"""Fixtures for tests in a Python that has the bpy module.

BRDFC_EXTENSION_ZIP names the extension under test, BRDFC_TOOL the built brdfc. Blender's user
folders are temporary, so nothing of the user's is touched. BRDFC_ANSWERS may name a folder in which
results of the tool are cached, as runs in several versions of Blender need the same ones.
"""

import contextlib
import json
import os
import shlex
import sys
import tempfile
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import pytest
from tool_cache import ToolCache

# Blender reads this when bpy is first imported.
_RESOURCES = tempfile.TemporaryDirectory(prefix="brdfc-test-")
os.environ["BLENDER_USER_RESOURCES"] = _RESOURCES.name
# Blender leaves the bytecode of each script that it compiles in the folder for temporary files.
tempfile.tempdir = _RESOURCES.name
# Fits that several tests need are made once in each run.
os.environ["BRDFC_CACHE"] = str(Path(_RESOURCES.name) / "cache")

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
def program():
    return _path_from_environment("BRDFC_TOOL", "the built brdfc")


@pytest.fixture(scope="session")
def answers(program, tmp_path_factory):
    folder = os.environ.get("BRDFC_ANSWERS") or tmp_path_factory.mktemp("answers")
    return ToolCache(folder, program)


@pytest.fixture(scope="session")
def tool(answers):
    """Runs the tool: tool("albedo", "lambert", stdin=...) returns stdout."""

    def run(*arguments, stdin=""):
        return answers.ask([str(a) for a in arguments], stdin)

    return run


@pytest.fixture(scope="module")
def by_the_tool(program):
    """The extension calls the tool itself, whose answers are not kept."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("BRDFC_TOOL", str(program))
        yield


@pytest.fixture(scope="session")
def kept_program(program, answers, tmp_path_factory):
    """A program that answers like the tool, which computes each answer only once."""
    path = tmp_path_factory.mktemp("program") / "brdfc"
    command = [sys.executable, Path(__file__).with_name("tool_cache.py"), answers.folder, program]
    path.write_text(f'#!/bin/sh\nexec {shlex.join(map(str, command))} "$@"\n')
    path.chmod(0o755)
    return path


@pytest.fixture(scope="session")
def lean_pack(answers, tmp_path_factory):
    """lean_pack(materials, *options): the folder of a pack for these materials alone, as `brdfc
    build --materials` makes it; to be treated as read-only."""

    def make(materials, *options):
        folder = tmp_path_factory.mktemp("pack")
        file = folder / "materials.json"
        file.write_text(json.dumps({"materials": materials}))
        built = answers.built(["build", "--materials", str(file), *options, "--out", str(folder)])
        return built / "out" / "brdfc_shaders"

    return make


def _compile_each_source_once():
    """Each source is compiled once in a run, in which it is compiled about five times. Blender
    leaves the bytecode in a file. Sources with errors are compiled each time."""
    import cycles.osl

    compile_source, done = cycles.osl.osl_compile, {}

    def osl_compile(path, report):
        source = Path(path).read_bytes()
        made = done.get(source)
        if made is None or not made.is_file():
            ok, output = compile_source(path, report)
            if not ok:
                return ok, output
            made = done[source] = Path(output)
        return True, str(made)

    cycles.osl.osl_compile = osl_compile


@pytest.fixture(scope="session")
def extension(extension_zip):
    """The extension, installed from its zip as by a user; its modules are attributes."""
    import bpy

    _compile_each_source_once()

    bpy.ops.preferences.addon_enable(module="bl_pkg")
    bpy.ops.extensions.package_install_files(
        filepath=str(extension_zip), repo="user_default", enable_on_install=True
    )
    assert PACKAGE in bpy.context.preferences.addons
    modules = (
        "api",
        "common.files",
        "content.group_content",
        "groups.exchange",
        "groups.model_nodes",
        "groups.nodes",
        "lean",
        "operators",
        "packs.device",
        "packs.energy",
        "packs.pack",
        "packs.parameter_values",
        "panels.ui",
        "warnings.checks",
        "warnings.scene_rules",
        "warnings.table",
    )
    from scene_loader import SceneLoader  # which needs bpy

    return SimpleNamespace(
        package=PACKAGE,
        scene_loader=SceneLoader(PACKAGE),
        **{name.split(".")[-1]: import_module(f"{PACKAGE}.{name}") for name in modules},
    )


@pytest.fixture(scope="session")
def batch():
    from helpers import Batch

    return Batch()


@pytest.fixture
def empty(extension):
    """An empty factory file with Cycles and, unlike a new file of a user, with Open Shading
    Language on and without denoising, which takes longer than most pictures of tests, and hides
    what they show. Preferences, including the extension, stay."""
    import bpy

    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    assert PACKAGE in bpy.context.preferences.addons
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.shading_system, scene.cycles.use_denoising = True, False
    return scene


@pytest.fixture
def use_pack(extension, lean_pack):
    """use_pack(materials, *options): makes the extension use a pack for these materials alone,
    until the test ends. Returns the pack's folder."""

    def use(materials, *options):
        folder = lean_pack(materials, *options)
        extension.pack.use(folder)
        return folder

    yield use
    extension.pack.use()


@pytest.fixture
def convert(extension, empty):
    extension.scene_loader.apply_clean_settings(empty)
    return import_module(f"{extension.package}.convert")


@pytest.fixture
def manager():
    """Replaces what modal operators use of Blender's windows, and records what they report."""
    told = []
    window_manager = SimpleNamespace(
        event_timer_add=lambda step, window: told.append("timer") or "timer",
        event_timer_remove=lambda timer: told.append("no timer"),
        progress_begin=lambda low, high: told.append("begin"),
        progress_update=lambda share: told.append(share),
        progress_end=lambda: told.append("end"),
        modal_handler_add=lambda operator: told.append("modal"),
        windows=["window"],
    )
    context = SimpleNamespace(
        window_manager=window_manager,
        window=None,
        workspace=SimpleNamespace(status_text_set=lambda text: told.append(text)),
        temp_override=lambda window: contextlib.nullcontext(),
    )
    return SimpleNamespace(context=context, told=told)
