# SPDX-License-Identifier: GPL-3.0-or-later
"""Shared by tests of the built tool."""

import json
import os
import shutil
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
#: Absolute, as some tests run it in another folder.
TOOL = str(Path(os.environ.get("BRDFC_TOOL", ROOT / "build" / "brdfc")).resolve())
LISTED = json.loads(subprocess.run([TOOL, "list", "--json"], capture_output=True).stdout)
MODELS = [model["name"] for model in LISTED]
#: The colour configuration of the tool, and its working spaces.
CONFIG = ROOT / "data" / "color" / "config.ocio"
SPACES = ("Linear Rec.709", "Linear Rec.2020", "ACEScg")

#: A browser for tests of pages, or None.
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
CHROMIUM = next(filter(None, map(shutil.which, BROWSERS)), None)


def run(*arguments, config=None):
    """Runs the tool, optionally with another colour configuration."""
    environment = {k: v for k, v in os.environ.items() if k != "OCIO"}
    if config:
        environment["OCIO"] = str(config)
    command = [TOOL, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, env=environment)


def scene(**changes):
    """A scene of one sphere; a change to None removes the key."""
    content = {
        "name": "s",
        "description": "a sphere",
        "settings": {"width": 8, "height": 8, "spp": 4, "seed": 1, "max_bounces": 1},
        "camera": {
            "type": "perspective",
            "position": [0, -4, 0],
            "look_at": [0, 0, 0],
            "up": [0, 0, 1],
            "fov_y_degrees": 25,
        },
        "materials": {"m": {"model": "lambert", "parameters": {"rho": [0.5, 0.5, 0.5]}}},
        "objects": [{"name": "o", "shape": {"type": "sphere"}, "material": "m"}],
        "environment": {"color": [1, 1, 1]},
    } | changes
    return {k: v for k, v in content.items() if v is not None}
