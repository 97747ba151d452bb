# SPDX-License-Identifier: GPL-3.0-or-later
"""Caches results of the tool by their inputs: several tests, and runs in several versions of
Blender, need the same ones.

As a program it can replace the tool: tool_cache.py FOLDER PROGRAM ARGUMENT...
"""

import contextlib
import fcntl
import hashlib
import json
import shutil
import subprocess
import sys
from pathlib import Path

#: Commands that write nothing but their output.
PRINTING = {"albedo", "closure", "eval", "fit", "list", "probe", "sample"}


class ToolCache:
    def __init__(self, folder, program):
        self.folder = Path(folder).resolve()
        self.folder.mkdir(parents=True, exist_ok=True)
        self.program = Path(program)
        self.digest = hashlib.sha256(self.program.read_bytes()).hexdigest()

    @contextlib.contextmanager
    def of(self, *question):
        """The path of an answer. While this is held, no other process computes it."""
        text = json.dumps([self.digest, *question])
        path = self.folder / hashlib.sha256(text.encode()).hexdigest()
        with path.with_suffix(".lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            yield path

    def run(self, arguments, stdin=""):
        """The tool's output. Raises AssertionError with its message if it fails."""
        command = [self.program, *arguments]
        done = subprocess.run(command, input=stdin, capture_output=True, text=True)
        assert done.returncode == 0, f"{arguments}: {done.stderr}"
        return done.stdout

    def ask(self, arguments, stdin=""):
        """The same as run(), from the cache if possible."""
        if arguments[0] == "build":
            kept = self.built(arguments)
            out = Path(arguments[arguments.index("--out") + 1])
            shutil.copytree(kept / "out", out, dirs_exist_ok=True)
            return (kept / "stdout").read_text()
        if arguments[0] not in PRINTING:
            return self.run(arguments, stdin)
        with self.of(arguments, stdin) as path:
            if not path.exists():
                answer = self.run(arguments, stdin)
                beside = path.with_suffix(".part")
                beside.write_text(answer)
                beside.replace(path)
            return path.read_text()

    def built(self, arguments):
        """A folder, to be treated as read-only, with the output folder of `build` in `out` and its
        output in `stdout`."""

        def names_file(i):
            return arguments[i - 1] in ("--scene", "--materials")

        place = arguments.index("--out") + 1
        question = [
            "" if i == place else Path(a).read_text() if names_file(i) else a
            for i, a in enumerate(arguments)
        ]
        with self.of(*question) as path:
            if not path.exists():
                beside = path.with_suffix(".part")
                shutil.rmtree(beside, ignore_errors=True)
                beside.mkdir()
                arguments = [*arguments[:place], str(beside / "out"), *arguments[place + 1 :]]
                (beside / "stdout").write_text(self.run(arguments))
                beside.rename(path)
            return path


if __name__ == "__main__":
    folder, program, *arguments = sys.argv[1:]
    try:
        print(ToolCache(folder, program).ask(arguments), end="")
    except AssertionError as error:
        sys.exit(str(error))
