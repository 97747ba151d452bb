# SPDX-License-Identifier: GPL-3.0-or-later
"""The compiled tool of brdfc with its data, as `cmake --install` lays them out."""

import os
import re
import subprocess
import sys
from pathlib import Path

#: Debian 12's packages of the shared libraries that the program and its module for picture files
#: are linked to. They bring others.
PACKAGES = {
    "libOpenColorIO.so.2.1": "libopencolorio2.1",
    "libOpenImageIO.so.2.4": "libopenimageio2.4",
    "libOpenImageIO_Util.so.2.4": "libopenimageio2.4",
    "libarchive.so.13": "libarchive13",
    "libcrypto.so.3": "libssl3",
    "libembree3.so.3": "libembree3-3",
    "libfmt.so.9": "libfmt9",
    "libnlopt_cxx.so.0": "libnlopt-cxx0",
    "libpugixml.so.1": "libpugixml1v5",
    "libstdc++.so.6": "libstdc++6",
    "libtbb.so.12": "libtbb12",
}


def program() -> Path:
    """The program. Raises FileNotFoundError where the wheel was damaged."""
    name = "brdfc.exe" if sys.platform == "win32" else "brdfc"
    path = Path(__file__).with_name("tree") / "bin" / name
    if not path.is_file():
        raise FileNotFoundError(f"{path} is missing: install brdfc-tool again")
    return path


def why_it_cannot_start(path) -> str:
    """What Linux's loader misses for the program, and what helps, on a line; empty where all is
    there."""
    try:
        # What ldd does: libraries are searched, and nothing is run. A few milliseconds.
        done = subprocess.run(
            [path],
            env=os.environ | {"LD_TRACE_LOADED_OBJECTS": "1"},
            capture_output=True,
            text=True,
        )
    except OSError as failed:
        return f"{failed}: expected a system like that on which this wheel was built"
    missing = re.findall(r"^\s*(\S+) => not found$", done.stdout, re.M)
    if missing:
        known = {PACKAGES[name] for name in missing if name in PACKAGES}
        packages = " ".join(sorted(known or set(PACKAGES.values())))
        missed = ", ".join(missing)
        return f"shared libraries are missing: {missed}; on Debian 12: apt-get install {packages}"
    if done.returncode:
        return f"{' '.join(done.stderr.split())}: expected a system at least as new as Debian 12"
    return ""


def main() -> None:
    """Becomes the program, with the arguments of this one."""
    command = [str(program()), *sys.argv[1:]]
    if sys.platform == "win32":  # where exec returns to the shell at once
        sys.exit(subprocess.run(command).returncode)
    if sys.platform == "linux" and (why := why_it_cannot_start(command[0])):
        print(f"brdfc: {why}", file=sys.stderr)
        sys.exit(2)
    os.execv(command[0], command)
