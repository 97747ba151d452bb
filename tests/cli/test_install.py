# SPDX-License-Identifier: GPL-3.0-or-later
"""The installed tool, moved elsewhere, finds its data beside itself and reports what is missing."""

import hashlib
import os
import shutil
import subprocess
from pathlib import Path

import pytest
from support import TOOL

ENVIRONMENT = {k: v for k, v in os.environ.items() if k != "BRDFC_DATA"}


def run(program, *arguments, **environment):
    return subprocess.run(
        [program, *arguments],
        capture_output=True,
        text=True,
        timeout=120,
        cwd="/",
        env=ENVIRONMENT | environment,
    )


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """The folder of an installation that was moved afterwards."""
    folder = tmp_path_factory.mktemp("install")
    command = ["cmake", "--install", Path(TOOL).parent, "--prefix", folder / "first"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return (folder / "first").rename(folder / "moved")


@pytest.fixture
def own(installed, tmp_path):
    """A copy of the data that tests may damage."""
    return Path(shutil.copytree(installed / "share" / "brdfc", tmp_path / "data"))


def test_it_takes_its_data_from_beside_itself(installed):
    done = run(installed / "bin" / "brdfc", "where")
    assert (done.returncode, done.stdout.strip()) == (0, str(installed / "share" / "brdfc"))
    # Also through a symbolic link in another folder.
    link = installed.parent / "brdfc"
    link.symlink_to(installed / "bin" / "brdfc")
    assert run(link, "where").stdout == done.stdout


@pytest.mark.long
def test_it_lists_and_builds_what_the_built_one_does(installed, tmp_path):
    program = installed / "bin" / "brdfc"
    assert "lambert" in run(program, "list").stdout
    hashes = set()
    for tool, out in ((program, tmp_path / "installed"), (TOOL, tmp_path / "built")):
        # Coupled has a stored albedo that takes long to compute.
        done = run(tool, "build", "--model", "lambert", "--model", "coupled", "--out", out)
        assert done.returncode == 0, done.stderr
        assert "no stored" not in done.stderr
        (zip_file,) = out.glob("brdfc_shaders-*.zip")
        hashes.add(hashlib.sha256(zip_file.read_bytes()).hexdigest())
        done = run(tool, "python", "--out", out / "python")
        assert done.returncode == 0, done.stderr
        assert (out / "python" / "LICENSE").read_bytes() and (
            out / "python" / "pyproject.toml"
        ).exists()
        done = run(tool, "explorer", "--out", out / "explorer")
        assert done.returncode == 0, done.stderr
        assert (out / "explorer" / "index.html").exists()
    assert len(hashes) == 1


def test_data_elsewhere_are_named_by_the_environment(installed, own, tmp_path):
    program = installed / "bin" / "brdfc"
    assert run(program, "where", BRDFC_DATA=str(own)).stdout.strip() == str(own)
    done = run(program, "build", "--model", "lambert", "--out", tmp_path, BRDFC_DATA="/nowhere")
    assert done.returncode == 2
    for word in ("BRDFC_DATA=/nowhere", "blender_addon is needed", "share/brdfc"):
        assert word in done.stderr


def test_a_table_that_is_not_stored_is_made_and_said(installed, own, tmp_path):
    (table,) = (own / "data" / "albedos").glob("lambert_*.exr")
    table.unlink()
    program = installed / "bin" / "brdfc"
    done = run(program, "build", "--model", "lambert", "--out", tmp_path, BRDFC_DATA=str(own))
    assert done.returncode == 0, done.stderr
    assert f"no stored albedo of lambert in {own / 'data' / 'albedos'}: making it" in done.stderr


def test_what_was_made_once_is_kept_in_the_users_cache(installed, own, tmp_path):
    """As for a user's own model, for which no data is stored."""
    (table,) = (own / "data" / "albedos").glob("lambert_*.exr")
    table.unlink()
    program, cache, hashes = installed / "bin" / "brdfc", tmp_path / "cache", set()
    said = []
    for out in (tmp_path / "one", tmp_path / "two"):
        command = (program, "build", "--model", "lambert", "--out", str(out))
        done = run(*command, BRDFC_DATA=str(own), BRDFC_CACHE=str(cache))
        assert done.returncode == 0, done.stderr
        said.append("making it" in done.stderr)
        hashes.add(next(out.glob("*.zip")).read_bytes())
    assert said == [True, False]
    assert len(hashes) == 1
    assert [p.name for p in (cache / "albedos").iterdir()] == [table.name]
    assert not table.exists(), "the data are those of the installation"


def test_a_fit_that_is_not_stored_is_announced_before_it_is_made(installed, own):
    shutil.rmtree(own / "data" / "fits")
    command = [installed / "bin" / "brdfc", "fit", "phong", "--over", "e"]
    environment = ENVIRONMENT | {"BRDFC_DATA": str(own)}
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment) as process:
        try:
            line = process.stderr.readline()
        finally:
            process.kill()
    assert line.startswith("brdfc: no stored fit of phong")
    assert f"in {own / 'data' / 'fits'}: making it, which takes about a minute" in line
