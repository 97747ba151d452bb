# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs tasks: on this machine, one after the other, or on the workers of a Dask scheduler.

Both ways accept new tasks while others run, and return each task with its record."""

import heapq
import itertools
import logging
import sys
import time
import uuid
from collections import defaultdict

import demo_tasks
from demo_tasks import TaskError, run_task

#: The Dask resource that each worker offers once, so that it runs one task at a time.
RESOURCE = "render"
#: Seconds: to wait for a scheduler's answer; between two checks of the workers.
ANSWER_TIMEOUT, CHECK_INTERVAL = 10, 10


class LocalRunner:
    """Runs tasks on this machine, one after the other, each with all cores."""

    workers = 1

    def __init__(self):
        self.queue = []

    def add(self, tasks):
        for task in tasks:
            heapq.heappush(self.queue, (task.order, task.name, task))

    def __iter__(self):
        while self.queue:
            task = heapq.heappop(self.queue)[-1]
            yield task, run_task(task)


def run_on_worker(task):
    """Runs on a worker, with the number of cores that it offers."""
    from distributed import get_worker

    worker = get_worker()
    cores = worker.state.total_resources.get("cores")
    return run_task(task, cores and int(cores), worker.address)


class Farm:
    """Runs tasks on the workers that offer RESOURCE. If a worker is lost, Dask runs its task again
    elsewhere, and gives up at the fourth loss."""

    def __init__(self, address, say):
        import cloudpickle
        from distributed import Client

        # Workers don't have these files, so their code is sent along.
        for module in (demo_tasks, sys.modules[__name__]):
            cloudpickle.register_pickle_by_value(module)
        # If the scheduler is lost, one line below reports it instead of Dask's messages.
        logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
        self.address, self.say, self.alone = address, say, False
        self.count = itertools.count()
        try:
            self.client = Client(address, timeout=ANSWER_TIMEOUT)
        except (OSError, TimeoutError, ValueError) as error:
            raise TaskError(
                f"no scheduler answers at {address} ({error}); `script/farm scheduler` starts one"
            ) from error
        self.running = {}
        self.check_workers()

    def check_workers(self):
        """Counts the workers that take tasks, and prints a message if there are none."""
        known = self.client.scheduler_info(n_workers=-1)["workers"].values()
        self.workers = sum(w["resources"].get(RESOURCE, 0) >= 1 for w in known)
        if not self.workers and not self.alone:
            others = f", {len(known)} that take no renders" if known else ""
            start = f"script/farm worker {self.address}"
            self.say(f"waiting for workers (there are none{others}): `{start}` starts one")
        self.alone = not self.workers

    def gone(self):
        return TaskError(
            f"the scheduler at {self.address} is gone; what is done is kept, and the same command "
            "goes on from there with another one"
        )

    def add(self, tasks):
        for task in tasks:
            future = self.client.submit(
                # Dask sends code along for functions that can't be imported by name, such as a
                # lambda.
                lambda task=task: run_on_worker(task),
                key=f"{task.name}-{uuid.uuid4().hex}",
                pure=False,
                resources={RESOURCE: 1},
                # By scene in their order; within a scene, tasks that were added first come first.
                priority=-(task.order[0] * 10**6 + next(self.count)),
            )
            self.running[future] = task

    def __iter__(self):
        from concurrent.futures import CancelledError

        from distributed import KilledWorker, wait

        while self.running:
            try:
                done, _ = wait(
                    list(self.running), timeout=CHECK_INTERVAL, return_when="FIRST_COMPLETED"
                )
            except TimeoutError:
                self.check_workers()
                continue
            except CancelledError as error:
                raise self.gone() from error
            self.check_workers()
            for future in done:
                task = self.running.pop(future)
                try:
                    record = future.result()
                except KilledWorker as error:
                    raise TaskError(
                        f"{task.name}: given up, its workers were lost or killed again and again: "
                        f"{demo_tasks.shown(task.command)}"
                    ) from error
                except CancelledError as error:
                    raise self.gone() from error
                yield task, record


class Progress:
    """Prints a line per task with the estimated time left, from tasks of the same kind so far and
    their work."""

    def __init__(self, say):
        self.say, self.total, self.done = say, 0, 0
        self.left = defaultdict(float)  #: work by kind
        self.spent = defaultdict(lambda: [0.0, 0.0])  #: seconds and work by kind

    def expect(self, kind, count, work):
        self.total += count
        self.left[kind] += count * work

    def finish(self, task, record, workers):
        self.done += 1
        self.left[task.kind] -= task.work
        spent = self.spent[task.kind]
        spent[0] += record["wall_seconds"]
        spent[1] += task.work
        where = f" on {record['worker']}" if workers > 1 else ""
        self.say(
            f"[{self.done}/{self.total}] {task.name}: {record['wall_seconds']:.1f} s{where}"
            f"{self.time_left(workers)}"
        )

    def time_left(self, workers):
        if self.done >= self.total or not workers:
            return ""
        seconds = 0.0
        for kind, work in self.left.items():
            if work > 1e-9:
                if kind not in self.spent:
                    return ""  # nothing is known of these yet
                seconds += work * self.spent[kind][0] / self.spent[kind][1]
        left = time.strftime("%H:%M:%S", time.gmtime(seconds / workers))
        return f"; about {left} left"
