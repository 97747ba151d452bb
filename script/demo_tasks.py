# SPDX-License-Identifier: GPL-3.0-or-later
"""A task of the report: a command, its inputs, and the record of its results.

Workers of a farm receive this file itself, so it uses only the standard library. The machine that
runs the command writes the record last. If a record with the right key exists, the task need not
run again, even if the program that started it was stopped in between.
"""

import hashlib
import json
import os
import platform
import shlex
import shutil
import socket
import subprocess
import time
import uuid
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


class TaskError(Exception):
    """A message for the terminal: what failed, and where to look."""


@dataclass(frozen=True)
class Task:
    name: str  #: unique: scene, a slash, what is made of it
    kind: str  #: plan, reference, blender or convergence
    command: tuple
    #: SHA-256 of everything that the outputs depend on.
    key: str
    #: Folder of record, log and job list.
    folder: Path
    outputs: tuple
    #: Files that must be the same on the machine where the task runs: SHA-256 by path.
    programs: tuple
    #: The command's option for the number of threads, if it has one.
    threads: str = ""
    #: True if the command prints a list of records as JSON.
    prints_records: bool = False
    #: Work of the task relative to others of its kind: pixels times samples, or another measure of
    #: its run time.
    work: float = 1
    #: Sort key: tasks with smaller values run first.
    order: tuple = ()

    def file(self, suffix):
        return self.folder / f"{self.name.split('/')[1]}{suffix}"


def digest(*parts):
    """SHA-256 over texts and the contents of files, with their order and lengths."""
    total = hashlib.sha256()
    for part in parts:
        data = part.read_bytes() if isinstance(part, Path) else str(part).encode()
        total.update(f"{len(data)}:".encode() + data)
    return total.hexdigest()


def read_json(path):
    return json.loads(path.read_text(encoding="utf-8"))


def write_json(path, value):
    # A name of its own, because two machines may write the same file.
    beside = path.with_name(f".{path.name}.{uuid.uuid4().hex}")
    beside.write_text(json.dumps(value, indent=1) + "\n", encoding="utf-8")
    beside.replace(path)


def shown(command):
    """A command as a user would type it in the root of the repository."""
    short = []
    for word in command:
        path = Path(str(word))
        inside = path.is_absolute() and path.is_relative_to(ROOT)
        short.append(str(path.relative_to(ROOT)) if inside else str(word))
    return shlex.join(short)


def kept(task):
    """The record of a task that was done before, if its outputs still exist."""
    try:
        record = read_json(task.file(".json"))
    except (OSError, ValueError):
        return None
    there = record.get("key") == task.key and all(Path(o).is_file() for o in task.outputs)
    return record if there else None


def processor(cores):
    info = Path("/proc/cpuinfo")
    for line in info.read_text().splitlines() if info.exists() else []:
        if line.startswith("model name"):
            model = line.split(":", 1)[1].strip()
            break
    else:
        model = platform.processor() or platform.machine()
    return f"{model}, {cores or os.cpu_count()} threads"


def check_programs(task, where):
    """Raises TaskError unless this machine has the files that the task needs."""
    for path, expected in task.programs:
        if not Path(path).exists():
            raise TaskError(
                f"{task.name}: {where} lacks {path}; a worker needs this checkout at the same "
                "path, with its .env and build"
            )
        if expected and digest(Path(path)) != expected:
            raise TaskError(f"{task.name}: {where} has another {path} than this machine")


def run_task(task, cores=None, where=None):
    """Runs the task's command with this number of threads, unless it was done before. Returns its
    record."""
    if record := kept(task):
        return record
    where = where or socket.gethostname()
    check_programs(task, where)
    command = [str(word) for word in task.command]
    if cores and task.threads:
        command += [task.threads, str(cores)]
    # If a worker is killed, its command must end too, and not run beside the next attempt.
    tied = ["setpriv", "--pdeathsig", "KILL"] if shutil.which("setpriv") else []
    log = task.file(".log")
    start = time.perf_counter()
    with log.open("w", encoding="utf-8") as errors:
        done = subprocess.run([*tied, *command], stdout=subprocess.PIPE, stderr=errors, text=True)
    seconds = time.perf_counter() - start
    if done.returncode != 0:
        last = log.read_text(encoding="utf-8", errors="replace").strip().splitlines()[-5:]
        raise TaskError(
            f"{task.name}: failed on {where} with status {done.returncode}: {shown(command)}\n"
            + "".join(f"    {line}\n" for line in last)
            + f"    its log: {shown([log])}"
        )
    record = {
        "key": task.key,
        "command": shown(task.command),
        "wall_seconds": seconds,
        "worker": where,
        "processor": processor(cores),
    }
    if task.prints_records:
        record["records"] = json.loads(done.stdout)
    if missing := [o for o in task.outputs if not Path(o).is_file()]:
        raise TaskError(f"{task.name}: {where} wrote no {missing[0]}: {shown(command)}")
    write_json(task.file(".json"), record)
    return record
