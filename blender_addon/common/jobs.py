# SPDX-License-Identifier: GPL-3.0-or-later
"""Long work beside the interface: in steps, or by another program. No bpy in here."""

import contextlib
import subprocess
import tempfile
from pathlib import Path

from .i18n import say


class Job:
    """Work in steps, between which Blender stays alive. What is wrong is raised by step(); the file
    is then as it was, as it is after cancel()."""

    result = None

    def step(self):
        """Does a part of the work; returns the share that is done, None once `result` is there."""
        raise NotImplementedError

    def cancel(self):
        """Gives up; may be called at any time, also twice."""

    def wait(self):
        """All of it at once; returns the result."""
        while self.step() is not None:
            pass
        return self.result


class ProgramJob(Job):
    """Another program at work, in a temporary folder that is gone once the job gives up."""

    #: Seconds that step() waits for the program.
    PATIENCE = 0.05
    #: What is raised where something is wrong.
    failure = RuntimeError

    def _open_folder(self, prefix, files=()):
        """Makes the folder, with texts by name, and returns its path. Raises `failure`."""
        try:
            # On Windows a scanner may still read what is to be removed.
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

    def _start(self, command, output=None):
        """Starts the program; what it prints goes into the log, or to a file where one is given
        and errors alone into the log. Raises OSError, and the folder is gone then."""
        try:
            with contextlib.ExitStack() as files:
                log = files.enter_context(self._log_file.open("wb"))
                said = files.enter_context(output.open("wb")) if output else log
                self._process = subprocess.Popen(
                    [str(c) for c in command],
                    stdin=subprocess.DEVNULL,
                    stdout=said,
                    stderr=log,
                    # Windows opens no console beside Blender.
                    creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
                )
        except OSError:
            self._folder.cleanup()
            raise

    def _log(self):
        return self._log_file.read_text(encoding="utf-8", errors="replace")

    def _last_words(self, status):
        """Of a program that failed."""
        return (self._log().strip().splitlines() or [f"exit status {status}"])[-1]

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
        """How much is done, from 0 to 1, by what the program has said."""
        raise NotImplementedError

    def _ended(self, status):
        """The result, once the program has ended with this exit status. Raises `failure`."""
        raise NotImplementedError

    def cancel(self):
        if self._process.poll() is None:
            self._process.kill()
            self._process.wait()
        if self.result is None:
            self._folder.cleanup()
