# SPDX-License-Identifier: GPL-3.0-or-later
"""Long work that does not block the interface: in steps or in another program. Independent of
bpy."""

import contextlib
import os
import subprocess
import tempfile
from pathlib import Path

from .i18n import say


class Job:
    """Work in steps, between which Blender stays responsive. step() raises the errors; after an
    error, as after cancel(), the file is as it was."""

    result = None

    def step(self):
        """Does a part of the work; returns the fraction done, or None when `result` is set."""
        raise NotImplementedError

    def cancel(self):
        """Gives up. May be called at any time, and repeatedly."""

    def wait(self):
        """Runs all steps; returns the result."""
        while self.step() is not None:
            pass
        return self.result


class ProgramJob(Job):
    """Runs another program, in a temporary folder that is removed when the job is cancelled."""

    #: Seconds that step() waits for the program.
    PATIENCE = 0.05
    #: The exception class of this job's errors.
    failure = RuntimeError

    def _open_folder(self, prefix, files=()):
        """Makes the folder with these files (text by name) and returns its path. Raises
        `failure`."""
        try:
            # On Windows a virus scanner may still hold files that are to be removed.
            self._folder = tempfile.TemporaryDirectory(prefix=prefix, ignore_cleanup_errors=True)
            folder = Path(self._folder.name)
            for name, text in dict(files).items():
                (folder / name).write_text(text, encoding="utf-8")
        except OSError as failed:
            more = str(failed)
            raise self.failure(
                say("The folder for temporary files can't be written", more=more)
            ) from failed
        self._log_file = folder / "log.txt"
        return folder

    def _start(self, command, output=None, environment=()):
        """Starts the program. Its output goes to the log; if a file is given for stdout, only
        stderr does. `environment`: variables that are added. Raises OSError after removing the
        folder."""
        try:
            with contextlib.ExitStack() as files:
                log = files.enter_context(self._log_file.open("wb"))
                said = files.enter_context(output.open("wb")) if output else log
                self._process = subprocess.Popen(
                    [str(c) for c in command],
                    stdin=subprocess.DEVNULL,
                    stdout=said,
                    stderr=log,
                    env=os.environ | dict(environment),
                    # Keeps Windows from opening a console window.
                    creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
                )
        except OSError:
            self._folder.cleanup()
            raise

    def _log(self):
        return self._log_file.read_text(encoding="utf-8", errors="replace")

    def _last_words(self, status):
        """The last output of a program that failed; that of one that crashed is about its work."""
        words = self._log().strip().splitlines()
        if status < 0 or not words:  # negative: ended by a signal
            return f"exit status {status}"
        return words[-1]

    def step(self):
        if self.result is not None:
            return None
        try:
            status = self._process.wait(self.PATIENCE)
        except subprocess.TimeoutExpired:
            return self._share(self._log())
        self.result = self._ended(status)
        return None

    def _share(self, log):
        """The fraction done, from 0 to 1, judging by the program's log."""
        raise NotImplementedError

    def _ended(self, status):
        """The result, when the program has ended with this exit status. Raises `failure`."""
        raise NotImplementedError

    def cancel(self):
        if self._process.poll() is None:
            self._process.kill()
            self._process.wait()
        if self.result is None:
            self._folder.cleanup()
