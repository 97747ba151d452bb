# SPDX-License-Identifier: GPL-3.0-or-later
"""What the installed extension is called, and where its files are."""

from pathlib import Path

#: The folder of the extension.
ROOT = Path(__file__).resolve().parent.parent
#: The name of its package, by which Blender's preferences know it.
PACKAGE = __package__.rpartition(".")[0]
