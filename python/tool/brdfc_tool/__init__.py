# SPDX-License-Identifier: GPL-3.0-or-later
"""The compiled tool of brdfc with its data, as `cmake --install` lays them out."""

import os
import subprocess
import sys
from pathlib import Path


def program() -> Path:
    """The program. Raises FileNotFoundError where the wheel was damaged."""
    name = "brdfc.exe" if sys.platform == "win32" else "brdfc"
    path = Path(__file__).with_name("tree") / "bin" / name
    if not path.is_file():
        raise FileNotFoundError(f"{path} is missing: install brdfc-tool again")
    return path


def main() -> None:
    """Becomes the program, with the arguments of this one."""
    command = [str(program()), *sys.argv[1:]]
    if sys.platform == "win32":  # where exec returns to the shell at once
        sys.exit(subprocess.run(command).returncode)
    os.execv(command[0], command)
