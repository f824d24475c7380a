"""Engines on this computer: the process itself, or processes that it starts."""

from __future__ import annotations

import contextlib
import gc
import os
import signal
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing import get_all_start_methods, get_context
from multiprocessing.connection import Connection, wait
from typing import Any

from stepgauge.executors.task import Function, Reply, perform
from stepgauge.files.children import safe_children


class InProcess:
    """This process, one task after the other."""

    near = True

    def open(self, function: Function) -> int:
        """Nothing to start."""
        self._function = function
        self._tasks: deque[tuple[int, Any]] = deque()
        return 1

    def submit(self, number: int, item: Any) -> None:
        """Take a task."""
        self._tasks.append((number, item))

    def reply(self) -> tuple[int, Reply]:
        """Do the next task."""
        number, item = self._tasks.popleft()
        return number, perform(self._function, item)

    def close(self) -> None:
        """Nothing to stop."""


PREPARING: list[Callable[[], object]] = []
"""What every process does before its first task: it imports what the command line named."""


@dataclass
class _Worker:
    process: Any
    pipe: Connection
    task: int | None = None


class Processes:
    """A pool of processes that survives the death of any of them.

    Each has one task at a time; a task whose process died has failed, and another process takes its place.

    Parameters
    ----------
    count : processes; None: as many as there are processors
    memory_MB : what each may allocate; None: no limit. Systems without such limits ignore it
    """

    near = True

    def __init__(self, count: int | None = None, memory_MB: float | None = None) -> None:
        self.count, self.memory_MB = count or len(os.sched_getaffinity(0)), memory_MB
        self._workers: list[_Worker] = []

    def open(self, function: Function) -> int:
        """Start the processes."""
        self._function = function
        self._tasks: deque[tuple[int, Any]] = deque()
        self._context = _context(getattr(function, "func", function).__module__)
        self._workers = [self._start() for _ in range(self.count)]
        return self.count

    def submit(self, number: int, item: Any) -> None:
        """Take a task."""
        self._tasks.append((number, item))
        self._give()

    def reply(self) -> tuple[int, Reply]:
        """Wait for the next answer."""
        ready = wait([one.pipe for one in self._workers if one.task is not None])
        worker = next(one for one in self._workers if one.pipe in ready)
        number, worker.task = worker.task, None
        assert number is not None
        try:
            reply: Reply = worker.pipe.recv()
        except (EOFError, OSError):
            reply = self._replace(worker)
        self._give()
        return number, reply

    def pids(self) -> list[int]:
        """Of the processes, by which somebody else may look at them."""
        return [one.process.pid for one in self._workers]

    def close(self) -> None:
        """Stop the processes at once."""
        for worker in self._workers:
            worker.pipe.close()
            worker.process.terminate()
        for worker in self._workers:
            worker.process.join()
            worker.process.close()
        self._workers = []

    def _start(self) -> _Worker:
        here, there = self._context.Pipe()
        given = (there, self._function, self.memory_MB, tuple(PREPARING))
        process = self._context.Process(target=_serve, args=given, daemon=True)
        with safe_children():
            process.start()
        there.close()
        return _Worker(process, here)

    def _give(self) -> None:
        """A task to each that has none."""
        for worker in self._workers:
            if self._tasks and worker.task is None:
                worker.task, item = self._tasks.popleft()
                with contextlib.suppress(OSError):  # a dead one is found by reply()
                    worker.pipe.send(item)

    def _replace(self, worker: _Worker) -> Reply:
        """Another process in the place of one that died."""
        worker.pipe.close()
        worker.process.join()
        code = worker.process.exitcode
        self._workers[self._workers.index(worker)] = self._start()
        return Reply("failed", why=f"its process died (exit code {code})")


def _context(module: str) -> Any:
    """A fork server imports once and has no threads; on other systems every process imports anew.

    ``module``: what it imports before the first process, unless it runs already.
    """
    if "forkserver" not in get_all_start_methods():
        return get_context("spawn")
    context = get_context("forkserver")
    context.set_forkserver_preload([__name__, *([] if module == "__main__" else [module])])
    return context


def _serve(
    pipe: Connection, function: Function, memory_MB: float | None, preparing: tuple[Callable[[], object], ...]
) -> None:
    """Do tasks until nobody sends any: the other end closes with the process that it belongs to."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the one that gives the tasks
    _limit(memory_MB)
    for prepare in preparing:
        prepare()
    with contextlib.suppress(EOFError, OSError):
        pipe.send(perform(function, pipe.recv()))
        gc.freeze()  # what the first task loaded stays, and need not be searched for garbage after every other
        while True:
            pipe.send(perform(function, pipe.recv()))


def _limit(memory_MB: float | None) -> None:
    if memory_MB is None:
        return
    try:
        import resource

        most = int(memory_MB * 1e6)
        resource.setrlimit(resource.RLIMIT_DATA, (most, most))
    except (ImportError, ValueError, OSError):
        return
