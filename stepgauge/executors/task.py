"""One task as a worker does it: with one thread of linear algebra, and with an answer whatever happens.

Sums whose order depends on the number of threads differ in the last digit; so each engine gives the same numbers.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal, Protocol

from threadpoolctl import ThreadpoolController

from stepgauge.errors import InputError, naming

Kind = Literal["done", "refused", "failed"]
Function = Callable[[Any], Any]
_one_at_a_time = threading.Lock()


@dataclass(frozen=True)
class Reply:
    """What became of a task: its value; or why its input is wrong (``refused``); or how it ``failed``, perhaps by
    chance."""

    kind: Kind
    value: Any = None
    why: str = ""


class Engine(Protocol):
    """Who does tasks. Opened for one function, it takes numbered tasks and gives each an answer, in any order.

    ``near``: all workers are on this computer, and have its files.
    """

    near: bool

    def open(self, function: Function) -> int:
        """Make ready; returns how many tasks are done at the same time."""

    def submit(self, number: int, item: Any) -> None:
        """Take a task."""

    def reply(self) -> tuple[int, Reply]:
        """Wait for the next answer; a task whose worker died has failed."""

    def close(self) -> None:
        """Let the workers go, whatever they are at."""


def perform(function: Function, item: Any) -> Reply:
    """Do a task in this process: one at a time, for files and caches of the package belong to a process."""
    with _one_at_a_time, _controller().limit(limits=1):
        try:
            return Reply("done", function(item))
        except InputError as error:
            return Reply("refused", why=error.cli_text())
        except MemoryError:
            return Reply("refused", why="it needs more memory than the worker may have")
        except Exception as error:
            return Reply("failed", why=f"{type(error).__name__}: {error}")


@cache
def _controller() -> ThreadpoolController:
    """The libraries of linear algebra that are loaded; looking for them takes as long as a small task."""
    import scipy.linalg  # noqa: F401

    return ThreadpoolController()


def engine_of(jobs: int | None = None, scheduler: str | None = None, memory_MB: float | None = None) -> Engine:
    """A Dask cluster where its scheduler is stated; else this process for one job without a limit; else processes.

    ``jobs``: processes, None: as many as there are processors; ``scheduler``: as
    :class:`~stepgauge.executors.dask.Dask` takes it; ``memory_MB``: what each process may allocate.
    """
    from stepgauge.executors.dask import Dask
    from stepgauge.executors.processes import InProcess, Processes

    if scheduler is not None:
        if memory_MB is not None or (jobs or 1) > 1:
            what = naming("jobs", "memory_MB", words="{} and {} are of processes: a cluster has its own")
            raise InputError(scheduler, what)
        return Dask(scheduler)
    return InProcess() if jobs == 1 and memory_MB is None else Processes(jobs, memory_MB)
