# SPDX-License-Identifier: GPL-3.0-or-later
"""Compiles shaders with the OSL compiler in Cycles, and collects its error messages."""

import contextlib
import os
import sys
import tempfile
from pathlib import Path

import bpy

from ..common.i18n import say
from ..packs import pack


class CompileError(RuntimeError):
    """Cycles could not compile a shader, or the result differs from what was expected."""


def _find_oslquery():
    """Makes the `oslquery` module importable, by which Cycles reads a script's sockets.

    The Blender application has it on its path. The bpy wheel does not: there it lies in the
    site-packages folder that ships with the wheel.
    """
    try:
        import oslquery  # noqa: F401

        return
    except ImportError:
        pass
    root = Path(bpy.utils.resource_path("LOCAL"))
    # The folder's name has no version on Windows.
    layouts = ("python/lib/python3.*/site-packages", "python/lib/site-packages")
    added = [str(p) for layout in layouts for p in root.glob(layout)]
    # Appended at the end, so that installed modules take precedence.
    sys.path.extend(p for p in added if p not in sys.path)
    try:
        import oslquery  # noqa: F401
    except ImportError as error:
        raise CompileError(
            say(
                "Blender's compiler of shaders can't be loaded",
                more=f"the module oslquery: {error}. A separately installed OpenImageIO in the "
                "same Python gets in its way",
            )
        ) from error


@contextlib.contextmanager
def _captured_stderr():
    """Captures stderr of native code: the OSL compiler reports errors nowhere else."""
    lines = []
    try:
        saved = os.dup(2)
    except OSError:  # a windowed application without a console
        yield lines
        return
    with tempfile.TemporaryFile() as sink:
        os.dup2(sink.fileno(), 2)
        try:
            yield lines
        finally:
            os.dup2(saved, 2)
            os.close(saved)
            sink.seek(0)
            lines += sink.read().decode(errors="replace").splitlines()


@contextlib.contextmanager
def _removed_temporary_files():
    """Blender's compiler writes each shader to a temporary file that it never deletes
    (`cycles.osl.osl_compile()`); within this context they lie in a folder that is deleted."""
    before = tempfile.tempdir
    with tempfile.TemporaryDirectory(prefix="brdfc_", ignore_cleanup_errors=True) as folder:
        tempfile.tempdir = folder
        try:
            yield
        finally:
            tempfile.tempdir = before


def compile_script(script_node, text, what):
    """Compiles a text in a script node; `what` names it in messages. Raises CompileError."""
    import cycles.osl

    if not pack.osl_available():
        raise CompileError(pack.NO_OSL)
    _find_oslquery()
    reports = []
    with _removed_temporary_files(), _captured_stderr() as console:
        # Under Cycles the assignment already compiles; under other engines it does not.
        script_node.script = text
        if not script_node.bytecode:
            cycles.osl.update_script_node(
                script_node, lambda kind, message: reports.append((kind, message))
            )
    if script_node.bytecode and script_node.outputs:
        return
    lines = [line.strip() for line in console if "error" in line.lower()]
    lines += [message for kind, message in reports if "ERROR" in kind]
    detail = "; ".join(dict.fromkeys(lines[:4])) or "the compiler gave no reason"
    raise CompileError(
        say(
            "Blender could not compile the shader of a model",
            more=f"{what}: the shader failed to compile: {detail}",
        )
    )
