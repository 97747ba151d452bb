# SPDX-License-Identifier: GPL-3.0-or-later
"""Caches finished node groups as .blend files in a folder of the user.

Building a model's nodes takes about a second, as Blender examines the whole tree for each node and
each link; appending them from a file takes a hundredth of that. If a file is missing, damaged or of
another version, the group is built and cached again.
"""

import functools
import hashlib
import os
from pathlib import Path

import bpy

from ..common.extension import PACKAGE, ROOT

_ENDING = ".blend"
#: Environment variable that names the cache folder for a second Blender, in which the package has
#: a name of its own.
FOLDER = "BRDFC_KEPT_NODES"


@functools.cache
def version():
    """Identifies the version of the extension that built the nodes: a hash of its sources."""
    digest = hashlib.sha256()
    for path in sorted(ROOT.rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def _folder():
    """Path of the cache folder, which is made if missing. Raises OSError or ValueError."""
    if given := os.environ.get(FOLDER):
        return Path(given)
    return Path(bpy.utils.extension_path_user(PACKAGE, path="nodes", create=True))


def environment():
    """What a second Blender needs in its environment to use this cache."""
    try:
        return {FOLDER: str(_folder())}
    except (OSError, ValueError):
        return {}


def _name(digest):
    # An earlier Blender may be unable to read the file of a later one.
    return f"{bpy.app.version_string.split()[0]}-{version()}-{digest}{_ENDING}"


def append(digest):
    """Appends the groups cached under a digest and returns them; an empty result if there are
    none."""
    known, libraries = set(bpy.data.node_groups), set(bpy.data.libraries)
    try:
        path = _folder() / _name(digest)
        if not path.is_file():
            return []
        with bpy.data.libraries.load(str(path), link=False) as (there, here):
            here.node_groups = there.node_groups
    except (OSError, ValueError, RuntimeError):
        return []
    finally:
        # The groups are local now, but Blender keeps a reference to the library file.
        for library in [library for library in bpy.data.libraries if library not in libraries]:
            bpy.data.libraries.remove(library)
    return [group for group in bpy.data.node_groups if group not in known]


def keep(group, digest):
    """Caches a node group with the groups inside it; failures to write are ignored."""
    try:
        folder = _folder()
        name = _name(digest)
        part = folder / f"{name}.{os.getpid()}"
        try:
            bpy.data.libraries.write(str(part), {group}, compress=True)
            os.replace(part, folder / name)
        finally:
            part.unlink(missing_ok=True)
        current = f"-{version()}-"
        for path in folder.glob(f"*{_ENDING}"):
            if current not in path.name:
                path.unlink(missing_ok=True)
    except (OSError, ValueError, RuntimeError):
        pass
