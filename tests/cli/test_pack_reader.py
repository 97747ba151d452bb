# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension reads its own pack, or refuses it with a message, whatever the file contains."""

import importlib
import random
import subprocess
import sys
import types

import pytest
from support import ROOT, TOOL


@pytest.fixture(scope="module")
def manifest(tmp_path_factory):
    out = tmp_path_factory.mktemp("pack")
    done = subprocess.run([TOOL, "build", "--model", "lambert", "--out", out], capture_output=True)
    assert done.returncode == 0, done.stderr
    return (out / "brdfc_shaders" / "manifest.json").read_bytes()


@pytest.fixture
def read(tmp_path, monkeypatch):
    """Reads bytes as a manifest."""
    # Without the package's own __init__, which needs Blender.
    package = types.ModuleType("extension_without_blender")
    package.__path__ = [str(ROOT / "blender_addon")]
    monkeypatch.setitem(sys.modules, package.__name__, package)
    pack = importlib.import_module(f"{package.__name__}.packs.pack")

    def reader(data):
        (tmp_path / "manifest.json").write_bytes(data)
        pack.use(tmp_path)
        return pack.manifest()

    reader.refusal = pack.PackError
    return reader


def test_a_sound_manifest(read, manifest):
    assert list(read(manifest)["models"]) == ["lambert"]


@pytest.mark.parametrize(
    "data",
    [b"", b"[]", b"1", b"null", b"{}", b'{"format": 1}', b'{"format": 2, "models": {}}']
    + [b'{"format": 1, "models": []}', b"[" * 100000, b"\xff\xfe", b'{"format": 1, "models":'],
    ids=range(11),
)
def test_what_is_no_manifest(read, data):
    with pytest.raises(read.refusal, match="manifest.json"):
        read(data)


def test_damaged_manifests(read, manifest):
    rng = random.Random(1)
    refused = 0
    for _ in range(400):
        data = bytearray(manifest)
        for _ in range(rng.randint(1, 3)):
            kind, at = rng.randrange(3), rng.randrange(len(data))
            if kind == 0:
                data[at] = rng.randrange(256)
            elif kind == 1:
                del data[at : at + rng.randint(1, 50)]
            else:
                data = data[:at]
            if not data:
                break
        try:
            read(bytes(data))
        except read.refusal:
            refused += 1
    # Some damaged bytes are in display texts, which can't be checked.
    assert refused > 200
