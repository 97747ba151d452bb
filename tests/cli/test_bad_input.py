# SPDX-License-Identifier: GPL-3.0-or-later
"""Damaged, huge or hostile files, and disks that can't be written: one line gives the reason, the
exit status is 2, and no incomplete file is left. script/fuzz tests the readers with arbitrary
bytes.
"""

import json
import os
import resource
import signal
import struct
import subprocess
import time

import pytest
from support import TOOL, scene

#: Seconds of CPU time after which the system stops the tool, as it must then be in an endless loop;
#: a refusal takes a fraction of a second. CPU time, because wall time depends on the machine's
#: load.
ENDLESS = 20


def run(*arguments, file_limit=None, **options):
    def limit():
        resource.setrlimit(resource.RLIMIT_CPU, (ENDLESS, ENDLESS))
        if file_limit is not None:
            # Writing beyond the limit then fails with an error, as on a full disk, instead of a
            # signal.
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (file_limit, file_limit))

    return subprocess.run(
        [TOOL, *map(str, arguments)],
        capture_output=True,
        text=True,
        preexec_fn=limit,
        timeout=300,
        **options,
    )


def refused(done, *words):
    errors = [line for line in done.stderr.splitlines() if not line.startswith("brdfc build: ")]
    assert done.returncode == 2, (done.returncode, done.stderr)
    assert len(errors) == 1 and errors[0].startswith("brdfc: "), done.stderr
    for word in words:
        assert str(word) in errors[0], errors[0]


# ---- JSON ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("", "JSON"),
        ("[" * 100000, "deep"),
        ('{"a":' * 100000, "deep"),
        ("{" * 3, "JSON"),
        (json.dumps(scene())[:-20], "JSON"),
        ('{"name": "a", "name": "b"}', "twice"),
        (json.dumps(scene()).replace('"spp": 4', '"spp": 1e999'), "1e999"),
        (json.dumps(scene()).replace('"spp": 4', '"spp": -1'), "settings.spp"),
        (json.dumps(scene()).replace('"spp": 4', '"spp": 4' + "0" * 400), ""),
        (json.dumps(scene()).replace('"spp": 4', '"spp": "1"'), "settings.spp"),
        (json.dumps(scene()).replace('"width": 8', '"width": 1000000000'), "settings.width"),
        (json.dumps(scene(objects={})), "objects"),
        (json.dumps(scene(materials=[])), "materials"),
        (json.dumps(scene() | {"name": None}), "name"),
        ("\x00\x01\x02", "JSON"),
        ('"\ud800"', "JSON"),
    ],
    ids=range(16),
)
def test_a_scene_that_is_no_scene(text, word, tmp_path):
    file = tmp_path / "bad.json"
    file.write_bytes(text.encode("utf-8", "surrogatepass"))
    refused(run("render", file, "--out", tmp_path / "a.exr"), "bad.json", word)
    assert [p.name for p in tmp_path.iterdir()] == ["bad.json"]


@pytest.mark.parametrize("command", [("render",), ("build", "--scene"), ("build", "--materials")])
@pytest.mark.parametrize("content", [b"\0\0\0", b"PK\x03\x04", b"v/1\x01", b'{"a": 1}\0'])
def test_a_file_that_is_no_text(content, command, tmp_path):
    """nlohmann takes a byte 0 for the end of the input, and would say so."""
    file = tmp_path / "bad.bin"
    file.write_bytes(content)
    done = run(*command, file, "--out", tmp_path / "a.exr")
    refused(done, "bad.bin: expected JSON, found bytes that are no text")


def test_names_reach_no_path(tmp_path):
    """Names in a scene are only text, even if they look like paths."""
    name = '../../e"vil\n$(touch x)'
    content = scene(name=name, materials={name: {"model": "lambert"}})
    content["objects"][0] |= {"name": name, "material": name}
    file = tmp_path / "s.json"
    file.write_text(json.dumps(content))
    out = tmp_path / "out"
    done = run("scene", file, "--out", out)
    assert done.returncode in (0, 2)
    written = {p.relative_to(tmp_path).parts[0] for p in tmp_path.rglob("*")}
    assert written <= {"s.json", "out"}


# ---- EXR ----------------------------------------------------------------------------------------


def exr_header(width, height):
    """A header without pixels: scan lines, three 32-bit channels, no compression."""

    def attribute(name, kind, data):
        return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(data)) + data

    channels = b"".join(c + b"\0" + struct.pack("<iB3xii", 2, 0, 1, 1) for c in (b"B", b"G", b"R"))
    box = struct.pack("<4i", 0, 0, width - 1, height - 1)
    return (
        struct.pack("<ii", 20000630, 2)
        + attribute("channels", "chlist", channels + b"\0")
        + attribute("compression", "compression", b"\0")
        + attribute("dataWindow", "box2i", box)
        + attribute("displayWindow", "box2i", box)
        + attribute("lineOrder", "lineOrder", b"\0")
        + attribute("pixelAspectRatio", "float", struct.pack("<f", 1))
        + attribute("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0))
        + attribute("screenWindowWidth", "float", struct.pack("<f", 1))
        + b"\0"
    )


@pytest.fixture
def picture(tmp_path):
    file = tmp_path / "s.json"
    file.write_text(json.dumps(scene()))
    done = run("render", file, "--out", tmp_path / "good.exr")
    assert done.returncode == 0, done.stderr
    return tmp_path / "good.exr"


@pytest.mark.many
@pytest.mark.parametrize("kept", [0, 3, 100, 0.5, 0.99])
def test_a_truncated_picture(picture, kept, tmp_path):
    data = picture.read_bytes()
    bad = tmp_path / "bad.exr"
    bad.write_bytes(data[: int(len(data) * kept) if kept < 1 else kept])
    refused(run("compare", bad, picture), "bad.exr")


@pytest.mark.many
@pytest.mark.parametrize(("width", "height"), [(60000, 60000), (2**31 - 1, 1), (30000, 1), (0, 5)])
def test_a_header_that_promises_too_much(picture, width, height, tmp_path):
    bad = tmp_path / "bad.exr"
    bad.write_bytes(exr_header(width, height))
    refused(run("compare", bad, picture), "bad.exr")


def test_an_attribute_that_promises_too_much(picture, tmp_path):
    """OpenEXR would allocate 2 GiB for it."""
    bad = tmp_path / "bad.exr"
    bad.write_bytes(picture.read_bytes().replace(b"chlist\0", b"chlist\0" + b"\xff\xff\xff\x7f"))
    refused(run("compare", bad, picture), "bad.exr", "header")


def test_a_damaged_picture_of_bytes(tmp_path):
    """The PNG library would report it in two lines, one of them its own."""
    bad = tmp_path / "bad.png"
    bad.write_bytes(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR")
    refused(run("compare", bad, bad), "bad.png: damaged PNG file: its header can't be read")


def test_a_picture_that_is_encoded_for_a_display(tmp_path, picture):
    """Its numbers are no radiance, so an error against a reference would mean nothing."""
    shown = tmp_path / "shown.png"
    assert run("compare", picture, picture, "--diff", shown).returncode == 0
    for files in ((shown, picture), (picture, shown), (picture, shown, picture)):
        refused(run("compare", *files), "shown.png: expected an image of floating-point numbers")


def test_a_picture_of_no_known_kind(tmp_path):
    bad = tmp_path / "bad.mp4"
    bad.write_bytes(b"not read")
    refused(run("compare", bad, bad), "bad.mp4", ".exr")


def test_a_picture_with_nan(tmp_path, picture):
    header = exr_header(2, 1)
    offset = len(header) + 8
    line = struct.pack("<q", offset) + struct.pack("<ii", 0, 24)
    bad = tmp_path / "bad.exr"
    bad.write_bytes(header + line + struct.pack("<6f", 1, 1, 1, 1, float("nan"), 1))
    refused(run("compare", bad, bad), "bad.exr", "not finite")


# ---- meshes -------------------------------------------------------------------------------------

PLY = """ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
0 1 0
3 0 1 2
"""


@pytest.mark.parametrize(
    ("name", "text", "accepted"),
    [
        ("empty.obj", "", False),
        ("points.obj", "v 0 0 0\nv 1 0 0\n", False),
        ("missing.obj", "v 0 0 0\nv 1 0 0\nf 1 2 9\n", False),
        ("nan.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", False),
        ("other.blend", "BLENDER", False),
        ("binary.ply", "\x00\x01\x02", False),
        # The importer would search for the end of these forever.
        ("list.ply", PLY.replace("list uchar int vertex_indices", "list 0"), False),
        ("many.ply", PLY.replace("vertex 3", "vertex 2000000000"), False),
        ("faceless.ply", PLY.replace("0 1 0\n", "0 1 0*"), False),
        ("good.ply", PLY, True),
        # No area: nothing to see, and a division by zero to avoid.
        ("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\nv 0 1 0\nf 1 2 4\n", True),
        # Three faces at one edge, one of them flipped.
        (
            "fan.obj",
            "v 0 0 0\nv 0 0 1\nv 1 0 0\nv 0 1 0\nv -1 0 0\nf 1 2 3\nf 1 2 4\nf 2 1 5\n",
            True,
        ),
    ],
)
def test_a_mesh(name, text, accepted, tmp_path):
    (tmp_path / name).write_text(text)
    content = scene()
    content["objects"][0]["shape"] = {"type": "mesh", "file": name}
    file = tmp_path / "s.json"
    file.write_text(json.dumps(content))
    done = run("render", file, "--out", tmp_path / "a.exr")
    if accepted:
        assert done.returncode == 0, done.stderr
    else:
        refused(done, name)
        assert not (tmp_path / "a.exr").exists()


# ---- disks --------------------------------------------------------------------------------------


def contents(folder):
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


@pytest.fixture(scope="module")
def pack(tmp_path_factory):
    """A folder with a pack in it, and the pack's contents."""
    folder = tmp_path_factory.mktemp("pack")
    done = run("build", "--model", "lambert", "--out", folder)
    assert done.returncode == 0, done.stderr
    return folder, contents(folder)


@pytest.mark.parametrize("limit", [0, 1000, 20000])
def test_a_full_disk_leaves_the_old_pack(pack, limit):
    folder, before = pack
    refused(run("build", "--model", "lambert", "--out", folder, file_limit=limit), "written")
    assert contents(folder) == before


def count_files(folder):
    return sum(len(files) for _, _, files in os.walk(folder))


def killed_build(folder, files):
    """Kills a build as soon as it has written so many files. Returns whether that was in time: a
    busy machine may let it finish."""
    command = [TOOL, "build", "--model", "ashikhmin_shirley", "--out", folder]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    staged = folder / f".brdfc-build-{process.pid}"
    end = time.monotonic() + ENDLESS
    while process.poll() is None and not (staged.exists() and count_files(staged) >= files):
        assert time.monotonic() < end, "the build has not begun to write"
        time.sleep(0.001)
    process.kill()
    return process.wait() == -signal.SIGKILL and staged.exists()


@pytest.mark.slow
def test_a_killed_build_leaves_the_old_pack(pack):
    folder, before = pack
    # When it has begun, and while it writes some 270 files.
    for files in (0, 1, 10):
        for _ in range(5):
            in_time = killed_build(folder, files)
            kept = {k: v for k, v in contents(folder).items() if not k.startswith(".brdfc-build-")}
            if in_time:
                break
            before = kept
        assert in_time, "every build ended before it was killed"
        assert kept == before
    done = run("build", "--model", "lambert", "--out", folder)
    assert done.returncode == 0, done.stderr
    # The bytes are equal, and what the killed builds left behind is gone.
    assert contents(folder) == before
    assert not list(folder.glob(".brdfc-build-*"))


def test_a_full_disk_leaves_the_old_picture(tmp_path):
    file = tmp_path / "s.json"
    file.write_text(json.dumps(scene()))
    out = tmp_path / "a.exr"
    assert run("render", file, "--out", out).returncode == 0
    before = contents(tmp_path)
    refused(run("render", file, "--out", out, "--seed", 5, file_limit=100), "a.exr")
    assert contents(tmp_path) == before


@pytest.mark.parametrize(
    "arguments",
    [
        ("build", "--model", "lambert", "--out", "/proc/brdfc"),
        ("render", "s.json", "--out", "/proc/brdfc/a.exr"),
        ("scene", "s.json", "--out", "/proc/brdfc"),
    ],
)
def test_a_place_that_takes_no_files(arguments, tmp_path):
    (tmp_path / "s.json").write_text(json.dumps(scene()))
    refused(run(*arguments, cwd=tmp_path), "/proc/brdfc")


@pytest.mark.parametrize("command", [("build", "--model", "lambert"), ("python",)])
def test_a_folder_that_is_a_file(command, tmp_path):
    file = tmp_path / "file"
    file.write_text("mine")
    refused(run(*command, "--out", file), file, "expected a folder that can be written")
    assert file.read_text() == "mine"


@pytest.mark.parametrize("path", [".", "/dev/null"])
def test_a_scene_that_is_no_file(path, tmp_path):
    refused(run("render", path, "--out", "a.exr", cwd=tmp_path), path, "not a file")


def test_a_pack_is_not_built_over_what_is_not_one(tmp_path):
    """Reported before planning, which may take minutes."""
    mine = tmp_path / "brdfc_shaders" / "mine.txt"
    mine.parent.mkdir()
    mine.write_text("mine")
    refused(run("build", "--scene", "nowhere.json", "--out", tmp_path), mine.parent)
    assert contents(tmp_path) == {"brdfc_shaders/mine.txt": b"mine"}


def test_output_that_nobody_takes():
    with open("/dev/full", "w") as full:
        done = subprocess.run([TOOL, "list"], stdout=full, stderr=subprocess.PIPE, text=True)
    refused(done, "No space left")


def materials(**parameters):
    return {"materials": {"m": {"model": "phong", "parameters": parameters}}}


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ({"materials": {}}, ["at least one material"]),
        (materials(e={"varies": False}), ["materials.m.parameters.e.varies", "true"]),
        (materials(e={"texture": "a.exr"}), ["materials.m.parameters.e", "texture"]),
        (materials(gloss={"varies": True}), ["materials.m.parameters.gloss"]),
        (materials(e=-1), ["materials.m.parameters.e"]),
        (materials() | {"sizeless_lamps": "Sun"}, ["sizeless_lamps", "Sun"]),
        (materials() | {"sizeless_lamps": ["Sun", 3]}, ["sizeless_lamps[1]", "3"]),
        (materials() | {"lamps": ["Sun"]}, ["lamps: expected a whole number", "Sun"]),
        (materials() | {"lights": ["Sun"]}, ["lights", "sizeless_lamps"]),
        (scene(), ["camera"]),
    ],
)
def test_a_list_of_materials(content, words, tmp_path):
    file = tmp_path / "m.json"
    file.write_text(json.dumps(content))
    refused(run("build", "--materials", file, "--out", tmp_path / "out"), "m.json", *words)
    assert not (tmp_path / "out").exists()


def test_a_scene_has_no_values_from_elsewhere(tmp_path):
    file = tmp_path / "s.json"
    content = scene(**materials(e={"varies": True}))
    file.write_text(json.dumps(content))
    refused(run("build", "--scene", file, "--out", tmp_path), "parameters.e", "varies")
    refused(run("build", "--all", "--explain", "--out", tmp_path), "--explain")


@pytest.mark.slow
@pytest.mark.parametrize(
    "command, out, kept", [("python", ".", "brdfc"), ("explorer", "page", "page")]
)
def test_what_can_not_be_written_whole_leaves_what_was_there(tmp_path, command, out, kept):
    """As on a full disk: here files may have 4 KB at most."""
    folder = tmp_path / out
    assert run(command, "--out", folder).returncode == 0

    before = contents(tmp_path / kept)
    limited = 'ulimit -f 4; trap "" XFSZ; exec "$@"'
    done = subprocess.run(
        ["bash", "-c", limited, "bash", TOOL, command, "--out", folder],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 2 and "cannot be written" in done.stderr
    assert contents(tmp_path / kept) == before
