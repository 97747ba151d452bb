# SPDX-License-Identifier: GPL-3.0-or-later
"""Node groups that were made once are kept in a folder of the user, as files of Blender.

To make a model's nodes takes about a second, since Blender looks at a whole tree for each node and
each link; to append them from a file takes a hundredth of that. A file that is missing, damaged or
of another version is as good as none: the group is made, and kept anew.
"""

import functools
import hashlib
import os
from pathlib import Path

import bpy

from ..common.extension import PACKAGE, ROOT

_ENDING = ".blend"


@functools.cache
def version():
    """What tells nodes of this version of the extension from those of another: its sources."""
    digest = hashlib.sha256()
    for path in sorted(ROOT.rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def _folder():
    """Path of the folder, made if it is missing. Raises OSError or ValueError."""
    return Path(bpy.utils.extension_path_user(PACKAGE, path="nodes", create=True))


def _name(digest):
    # A later Blender may keep what an earlier one can't read.
    return f"{bpy.app.version_string.split()[0]}-{version()}-{digest}{_ENDING}"


def append(digest):
    """Appends what was kept under a digest: the node groups that came with it, none where nothing
    was."""
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
        # What was appended is the file's own, but Blender leaves where it came from.
        for library in [library for library in bpy.data.libraries if library not in libraries]:
            bpy.data.libraries.remove(library)
    return [group for group in bpy.data.node_groups if group not in known]


def keep(group, digest):
    """Keeps a node group with those that it is made of. What can't be written is not kept."""
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
