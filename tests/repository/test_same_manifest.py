# SPDX-License-Identifier: GPL-3.0-or-later
"""How `script/release --portable` compares the manifests of two builds of the extension."""

import copy
import json
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "script" / "portable" / "same_manifest.py"
MANIFEST = {
    "version": "1",
    "models": {
        "ward": {
            "parameters": [{"name": "ax", "default": 0.1}],
            "representations": {"aimed": {"error": {"albedo": 1e-7, "relative_l1": 1e-7}}},
        }
    },
}


def aimed(manifest):
    return manifest["models"]["ward"]["representations"]["aimed"]["error"]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda m: None, ""),
        (lambda m: aimed(m).update(albedo=1.2e-7), ""),
        (lambda m: aimed(m).update(albedo=1.4e-7), "error/albedo: 1e-07 and 1.4e-07"),
        (lambda m: aimed(m).update(relative_l1=1.2e-7), "relative_l1: 1e-07 and 1.2e-07"),
        (lambda m: aimed(m).pop("albedo"), "error/albedo: only in A"),
        (lambda m: m.update(version="2"), "version: 1 and 2"),
        (lambda m: m["models"]["ward"]["parameters"][0].update(default=0.2), "0/default: 0.1"),
    ],
)
def test_only_rounding_of_errors_of_albedos_is_allowed(tmp_path, change, said):
    other = copy.deepcopy(MANIFEST)
    change(other)
    files = [tmp_path / "a.json", tmp_path / "b.json"]
    for file, manifest in zip(files, (MANIFEST, other), strict=True):
        file.write_text(json.dumps(manifest))
    done = subprocess.run([sys.executable, SCRIPT, *files], capture_output=True, text=True)
    assert (done.returncode, bool(done.stdout)) == (int(bool(said)), bool(said)), done.stderr
    assert said in done.stdout
