# SPDX-License-Identifier: GPL-3.0-or-later
"""Differences of Windows and macOS, simulated: paths, encodings, files in use, program names,
case-insensitive file systems. docs/limits.md says what this can't show."""

import ast
import errno
import json
import os
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections import Counter
from importlib import import_module
from pathlib import Path, PurePosixPath, PureWindowsPath
from types import SimpleNamespace

import bpy
import pytest

SOURCES = sorted((Path(__file__).resolve().parents[2] / "blender_addon").rglob("*.py"))
#: Calls that read or write text, and the position of the mode among their arguments.
TEXT = {"open": 1, "read_text": None, "write_text": None, "fdopen": 1, "NamedTemporaryFile": 0}
#: Device names, which Windows allows for no file, whatever its extension.
RESERVED = {"con", "prn", "aux", "nul"} | {f"{d}{i}" for d in ("com", "lpt") for i in range(10)}
#: Of the 260 characters that Windows allows for a path by default, the user's profile takes some.
LONGEST = 200


# ---- sources -------------------------------------------------------------------------------------


def calls(tree):
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            function = node.func
            yield node, getattr(function, "attr", getattr(function, "id", ""))


def without_encoding(tree):
    """Lines where text is read or written in the system's default encoding."""
    found = []
    for call, name in calls(tree):
        if name not in TEXT:
            continue
        method = isinstance(call.func, ast.Attribute)
        place = TEXT[name] if name != "open" or not method else 0
        given = [k.value for k in call.keywords if k.arg == "mode"]
        if place is not None and len(call.args) > place:
            given.append(call.args[place])
        binary = any("b" in ast.literal_eval(mode) for mode in given)
        if not binary and "encoding" not in {k.arg for k in call.keywords}:
            found.append(call.lineno)
    return found


def joined_with_slashes(tree):
    """Lines where a path is composed with the separator of one system. Names of data-blocks and of
    node groups are not paths."""
    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            for part, after in zip(node.values, node.values[1:], strict=False):
                slash = isinstance(after, ast.Constant) and after.value.startswith(("/", "\\"))
                data = isinstance(part, ast.FormattedValue) and ast.unparse(part.value).endswith(
                    ".name"
                )
                if slash and not data:
                    found.append(node.lineno)
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
            for side in (node.left, node.right):
                if isinstance(side, ast.Constant) and side.value in ("/", "\\"):
                    found.append(node.lineno)
    return found


@pytest.mark.parametrize("check", [without_encoding, joined_with_slashes])
def test_sources_hang_on_no_system(check):
    assert {
        str(p): found for p in SOURCES if (found := check(ast.parse(p.read_text("utf-8"))))
    } == {}


@pytest.mark.parametrize(
    ("check", "source"),
    [
        (without_encoding, "open(p)"),
        (without_encoding, "path.open('w')"),
        (without_encoding, "path.write_text(text)"),
        (joined_with_slashes, "f'{folder}/name'"),
        (joined_with_slashes, "folder + '/' + name"),
    ],
)
def test_the_checks_of_sources_find_it(check, source):
    assert check(ast.parse(source)) == [1]


# ---- the zip -------------------------------------------------------------------------------------


def test_the_zip_unpacks_everywhere(extension_zip):
    with zipfile.ZipFile(extension_zip) as archive:
        names = archive.namelist()
    assert len(names) > 100
    folded = Counter(name.casefold() for name in names)
    assert [name for name, count in folded.items() if count > 1] == []
    for name in names:
        path = PureWindowsPath(name)
        assert PurePosixPath(name).parts == path.parts and not path.is_absolute(), name
        assert name.isascii() and not set(name) & set('<>:"\\|?*'), name
        assert len(name) < LONGEST, name
        for part in path.parts:
            assert part.split(".")[0].casefold() not in RESERVED, name
            assert not part.endswith((".", " ")), name


# ---- files in use --------------------------------------------------------------------------------


@pytest.fixture
def lambert(extension, empty):
    return extension.api.new_material("lambert")


def in_use(source, target):
    """As Windows refuses to replace a file that a program has open."""
    raise PermissionError(errno.EACCES, "The file is used by another process", str(target))


def test_a_file_that_is_in_use_stays_as_it_is(extension, lambert, tmp_path, monkeypatch):
    path = tmp_path / "Matériaux 材料.json"
    path.write_text("before", encoding="utf-8")
    monkeypatch.setattr(os, "replace", in_use)
    with pytest.raises(PermissionError, match="can't be written: it may be open.*another process"):
        extension.api.write_materials(path)
    with pytest.raises(RuntimeError, match="Matériaux 材料.json can't be written: it may be open"):
        bpy.ops.brdfc.write_materials(filepath=str(path))
    assert [p.name for p in tmp_path.iterdir()] == [path.name]
    assert path.read_text(encoding="utf-8") == "before"


def test_a_file_beside_it_that_stays_in_use_hides_no_reason(
    extension, lambert, tmp_path, monkeypatch
):
    monkeypatch.setattr(os, "replace", in_use)
    monkeypatch.setattr(Path, "unlink", lambda self, missing_ok=False: in_use(None, self))
    with pytest.raises(PermissionError, match="m.json can't be written"):
        extension.api.write_materials(tmp_path / "m.json")


def test_temporary_files_that_cannot_be_made(extension, lambert, monkeypatch, program):
    monkeypatch.setenv("BRDFC_TOOL", str(program))

    def refuse(*_, **__):
        raise PermissionError(errno.EACCES, "denied")

    monkeypatch.setattr(tempfile, "TemporaryDirectory", refuse)
    with pytest.raises(extension.api.PlanError, match="temporary files can't be written.*denied"):
        extension.api.start_plan()
    with pytest.raises(RuntimeError, match="folder for temporary files can't be written"):
        bpy.ops.brdfc.bake()
    with pytest.raises(extension.api.LibraryError, match="temporary files can't be written"):
        extension.api.add_library()


# ---- the program brdfc ---------------------------------------------------------------------------


@pytest.fixture
def lean(extension, monkeypatch):
    monkeypatch.delenv("BRDFC_TOOL", raising=False)
    return import_module(f"{extension.package}.lean")


@pytest.fixture
def windows(monkeypatch):
    """Simulates what shutil.which() sees on Windows."""
    monkeypatch.setattr(shutil, "sys", SimpleNamespace(platform="win32"))
    monkeypatch.setattr(
        shutil,
        "_winapi",
        SimpleNamespace(NeedCurrentDirectoryForExePath=lambda command: False),
        raising=False,
    )
    monkeypatch.setenv("PATHEXT", ".exe")


@pytest.mark.parametrize("given", ["brdfc", "brdfc.exe"])
@pytest.mark.parametrize("by", ["variable", "path"])
def test_windows_finds_the_program_with_its_extension(
    lean, windows, monkeypatch, tmp_path, given, by
):
    folder = tmp_path / "Programme (x86)"
    folder.mkdir()
    exe = folder / "brdfc.exe"
    exe.write_bytes(b"")
    exe.chmod(0o755)
    if by == "variable":
        monkeypatch.setenv("BRDFC_TOOL", str(folder / given))
    else:
        monkeypatch.setenv("PATH", str(folder))
    assert Path(lean.program()) == exe


def test_no_console_opens_beside_blender(extension, lean, lambert, monkeypatch, program):
    monkeypatch.setenv("BRDFC_TOOL", str(program))
    seen = {}

    class Started(Exception):
        pass

    def start(command, **options):
        seen.update(options, command=command)
        raise OSError("not started")

    monkeypatch.setattr(subprocess, "Popen", start)
    with pytest.raises(extension.api.PlanError, match="does not start.*not started"):
        extension.api.start_plan()
    assert seen["creationflags"] == 0, "other systems know no flags"
    monkeypatch.setattr(subprocess, "CREATE_NO_WINDOW", 0x08000000, raising=False)
    with pytest.raises(extension.api.PlanError):
        extension.api.start_plan()
    assert seen["creationflags"] == 0x08000000
    assert all(isinstance(part, str) for part in seen["command"])
    seen.clear()
    with pytest.raises(extension.api.LibraryError, match="could not be made.*not started"):
        extension.api.add_library()
    assert seen["creationflags"] == 0x08000000, "nor beside the Blender that makes the library"


# ---- profiles ------------------------------------------------------------------------------------

PROFILE = r"""
import json, os, sys
from pathlib import Path

profile, archive, out = (Path(a) for a in sys.argv[1:])
import bpy

bpy.ops.preferences.addon_enable(module="bl_pkg")
bpy.ops.extensions.package_install_files(
    filepath=str(archive), repo="user_default", enable_on_install=True)
guarded = profile.resolve()
refused = []


def read_only(event, args):
    # Python's own writes; what Blender writes itself is not asked.
    if event == "open":
        path, mode, flags = args
        writes = isinstance(flags, int) and flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT)
    elif event in ("os.mkdir", "os.remove", "os.rename"):
        path, writes = args[0], True
    else:
        return
    if writes and isinstance(path, (str, bytes, os.PathLike)):
        where = Path(os.fsdecode(path)).resolve()
        if guarded in where.parents:
            refused.append(str(where))
            raise PermissionError(13, "read-only", str(where))


sys.addaudithook(read_only)
try:
    (guarded / "probe").write_text("x", encoding="utf-8")
    probe = False
except PermissionError:
    probe = True
from bl_ext.user_default.brdfc_shaders import api
from bl_ext.user_default.brdfc_shaders.groups import model_nodes, nodes
from bl_ext.user_default.brdfc_shaders.packs import pack
from bl_ext.user_default.brdfc_shaders.plotting import plots

scene = bpy.context.scene
api.enable_osl(scene)
material = api.new_material("ward", "aimed", ax=0.2)
material.use_fake_user = True
api.switch_representation(material, "sampled")
api.add_albedo(material)
api.warnings(material, scene)
plots.draw("ward", {})
(out / "liste d'été 材料.json").parent.mkdir(exist_ok=True)
count = api.write_materials(out / "liste d'été 材料.json")
plan = api.plan()
baked = api.bake(plan)
blend = out / "Bällchen.blend"
bpy.ops.wm.save_as_mainfile(filepath=str(blend))
bpy.ops.wm.open_mainfile(filepath=str(blend))
(node,) = model_nodes.group_nodes(bpy.data.materials["Ward"])
print("RESULT", json.dumps({
    "root": str(pack.root), "probe": probe, "count": count, "baked": baked,
    "problem": nodes.script_problem(node.node_tree), "lean": model_nodes.is_baked(node),
    "refused": [r for r in refused if "__pycache__" not in r and not r.endswith("probe")],
    "written": json.loads((out / "liste d'été 材料.json").read_text(encoding="utf-8")),
}))
"""


@pytest.mark.full
def test_a_profile_with_spaces_and_letters_of_other_scripts_and_read_only(
    extension_zip, program, tmp_path
):
    """In a separate Blender, whose Python warns of text in the system's encoding. After
    installation the profile is read-only."""
    profile = tmp_path / "Jörg Müller" / "Профиль 日本 X"
    out, temporary = tmp_path / "Ausgäbe Ordner", tmp_path / "Témp Files"
    for folder in (profile, out, temporary):
        folder.mkdir(parents=True)
    script = tmp_path / "profile.py"
    script.write_text(PROFILE, encoding="utf-8")
    environment = os.environ | {
        "BLENDER_USER_RESOURCES": str(profile),
        "TMPDIR": str(temporary),
        "BRDFC_TOOL": str(program),
        "PYTHONWARNDEFAULTENCODING": "1",
    }
    done = subprocess.run(
        [sys.executable, script, profile, extension_zip, out],
        capture_output=True,
        env=environment,
        encoding="utf-8",
        errors="replace",
    )
    lines = [line for line in done.stdout.splitlines() if line.startswith("RESULT ")]
    assert done.returncode == 0 and lines, done.stderr[-3000:] + done.stdout[-1000:]
    result = json.loads(lines[0].removeprefix("RESULT "))
    assert result["root"].startswith(str(profile)), "installed there"
    assert result["probe"], "the profile refuses to be written"
    assert result["refused"] == [], "nothing but Python's own caches was to be written there"
    assert (result["count"], result["baked"]) == (1, 1)
    assert result["lean"] and result["problem"] is None
    assert result["written"]["materials"]["Ward"]["model"] == "ward"
    own = str(profile / "extensions" / "user_default" / "brdfc_shaders")
    warned = [
        line for line in done.stderr.splitlines() if "EncodingWarning" in line and own in line
    ]
    assert warned == []


@pytest.mark.parametrize(
    "path",
    [
        PureWindowsPath(r"C:\Users\Jörg Müller\Eigene Dateien\materials.json"),
        PureWindowsPath(r"\\Server\Freigabe\materials.json"),
        PurePosixPath("/Users/Jörg Müller/materials.json"),
    ],
)
def test_what_is_written_first_lies_beside_the_file(extension, path):
    """On the same drive, because replacing a file is atomic only there."""
    beside = extension.files.beside(path)
    assert beside.parent == path.parent and beside.name.startswith(".materials.json.")
