# SPDX-License-Identifier: GPL-3.0-or-later
"""The program brdfc, which the extension does not contain: finds it, and runs its commands as
jobs."""

import os
import re
import shutil
import sysconfig
from pathlib import Path

import bpy

from .extension import PACKAGE
from .i18n import say
from .jobs import ProgramJob


def find(failure):
    """Path of the program brdfc. Looked for in the extension's preferences, the environment
    variable BRDFC_TOOL, the PATH, and where pip installs programs for the running Python. Raises
    `failure`, a class of exceptions."""
    addon = bpy.context.preferences.addons.get(PACKAGE)
    named = getattr(addon.preferences, "program", "") if addon and addon.preferences else ""
    for what, path in (
        (say("the extension's preferences name it"), bpy.path.abspath(named)),
        (say("BRDFC_TOOL names it"), os.environ.get("BRDFC_TOOL", "")),
    ):
        if not path:
            continue
        # Searches a folder by name, so "brdfc" finds brdfc.exe on Windows in all versions of
        # Python.
        folder, name = os.path.split(path)
        if found := shutil.which(name, path=folder or None):
            return found
        raise failure(say("{path} is not the program brdfc; {who}", path=path, who=what))
    for folders in (None, sysconfig.get_path("scripts")):
        if found := shutil.which("brdfc", path=folders):
            return found
    raise failure(
        say(
            "The program brdfc was not found: give its path in the extension's preferences, or put "
            "it on the PATH"
        )
    )


class ToolJob(ProgramJob):
    """Runs a command of the program brdfc in the job's folder; its stdout goes to `_said`."""

    #: The command's name.
    command = ""

    def __init__(self):
        """Raises `failure` if the program is not found."""
        self._program = find(self.failure)

    def _run(self, *arguments):
        """Starts the command. The folder must be open. Raises `failure`."""
        self._said = Path(self._folder.name) / "said.json"
        try:
            self._start([self._program, self.command, *arguments], self._said)
        except OSError as failed:
            more = f"{self._program}: {failed}"
            raise self.failure(say("The program brdfc does not start", more=more)) from failed

    def _share(self, log):
        """The fraction of models that, by its log, the program has begun or done."""
        counted = re.findall(rf"^brdfc {self.command}: (\d+)/(\d+) ", log, re.M)
        return int(counted[-1][0]) / max(int(counted[-1][1]), 1) if counted else 0.0
