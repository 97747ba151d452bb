# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that are written. Independent of bpy."""

import os


def beside(path):
    """A temporary file beside `path`, which is then renamed to it."""
    return path.with_name(f".{path.name}.{os.getpid()}")
