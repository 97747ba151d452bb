# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension from a static repository, as made by script/release: installation over HTTP,
updates, and no incomplete installations."""

import hashlib
import json
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path
from types import SimpleNamespace

import bpy
import pytest

#: Making two repositories takes most of the time of these tests.
pytestmark = pytest.mark.together("repository")

CLI = Path(bpy.utils.resource_path("LOCAL")) / "scripts/addons_core/bl_pkg/cli/blender_ext.py"
#: What distinguishes the older version from the newer one.
OLDER, MARK, LEFT_BEHIND = "0.0.1", "\nMARK = 'older'\n", "lamps/left_behind.py"


def files_of(path):
    """Hashes of a zip's members by name."""
    with zipfile.ZipFile(path) as archive:
        return {n: hashlib.sha256(archive.read(n)).hexdigest() for n in archive.namelist()}


def version_of(path):
    with zipfile.ZipFile(path) as archive:
        return tomllib.loads(archive.read("blender_manifest.toml").decode())["version"]


def make_older(source, target):
    """Makes a plausible earlier version of the extension: with other Python code, files and one
    other shader."""
    with zipfile.ZipFile(source) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    toml = members["blender_manifest.toml"].decode()
    toml = re.sub(r'^version = ".*"$', f'version = "{OLDER}"', toml, flags=re.M)
    manifest = json.loads(members["manifest.json"])
    form = manifest["models"]["phong"]["representations"]["sampled"]
    for other in manifest["models"]["phong"]["representations"].values():
        if shader := other.get("shader"):
            members[shader] += b"// as it was\n"
            other["sha256"] = hashlib.sha256(members[shader]).hexdigest()
    assert form["sha256"] == hashlib.sha256(members[form["shader"]]).hexdigest()
    members |= {
        "blender_manifest.toml": toml.encode(),
        "manifest.json": json.dumps(manifest).encode(),
        "api.py": members["api.py"] + MARK.encode(),
        LEFT_BEHIND: b"",
    }
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members.items():
            archive.writestr(name, data)


@pytest.fixture(scope="module")
def repositories(extension_zip, tmp_path_factory):
    """Folders `older` and `newer`, each a repository with one version."""
    root = tmp_path_factory.mktemp("repositories")
    newer, older = root / "newer" / extension_zip.name, root / "older" / "older.zip"
    for path in (newer, older):
        path.parent.mkdir()
    shutil.copy(extension_zip, newer)
    make_older(extension_zip, older)
    for path in (newer, older):
        command = [sys.executable, CLI, "server-generate", f"--repo-dir={path.parent}"]
        done = subprocess.run(command, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
    return SimpleNamespace(root=root, newer=newer, older=older)


@pytest.fixture
def visit(repositories, tmp_path):
    """visit(STAGE...): the results of repository_client.py after each stage."""

    def run(*stages):
        client = Path(__file__).with_name("repository_client.py")
        command = [sys.executable, client, tmp_path, repositories.root, *stages]
        done = subprocess.run(
            [str(c) for c in command], capture_output=True, text=True, timeout=300
        )
        assert done.returncode == 0, done.stderr[-4000:]
        return json.loads(done.stdout)

    return run


def test_the_index_names_version_and_bytes(repositories):
    index = json.loads((repositories.newer.parent / "index.json").read_text())
    (entry,) = index["data"]
    assert entry["id"] == "brdfc_shaders"
    assert entry["version"] == version_of(repositories.newer)
    data = repositories.newer.read_bytes()
    assert entry["archive_hash"] == f"sha256:{hashlib.sha256(data).hexdigest()}"
    assert entry["archive_size"] == len(data)
    assert entry["archive_url"] == f"./{repositories.newer.name}"


def is_whole(found, path, mark=None):
    assert found["enabled"]
    assert found["files"] == files_of(path), "every file of the version, and no other"
    assert found["beside"] == ["brdfc_shaders"], "nothing is left of what was unpacked"
    assert found["marks"] == mark, "the Python that runs is that of the files"
    assert found["values"] == [20, 0.25]


def test_it_installs_and_comes_up_to_date(visit, repositories):
    first, second = visit("older", "newer")
    assert first["said"] == second["said"] == ["", ""]
    is_whole(first, repositories.older, "older")
    assert "outdated" not in first["codes"]
    is_whole(second, repositories.newer)
    # An existing material keeps its shader, and is recognized as outdated.
    assert "outdated" in second["codes"]


@pytest.mark.slow
def test_a_download_that_fails_leaves_the_version_before(visit, repositories):
    first, torn, altered, whole = visit("older", "newer:torn", "newer:altered", "newer")
    is_whole(first, repositories.older, "older")
    for found in (torn, altered):
        is_whole(found, repositories.older, "older")
    is_whole(whole, repositories.newer)


def test_a_first_download_that_fails_leaves_nothing(visit, repositories):
    torn, whole = visit("newer:torn", "newer")
    assert (torn["enabled"], torn["files"], torn["beside"]) == (False, {}, [])
    # Then there is nothing to update.
    assert (whole["enabled"], whole["files"]) == (False, {})
