"""Do many tasks on an engine: again after a failure, in the order asked for, each on the disk as it is done."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from dataclasses import dataclass
from itertools import islice
from typing import Any

from stepgauge.executors.journal import Steps
from stepgauge.executors.task import Engine, Function, Reply

AHEAD = 4
"""Tasks that are taken up for each worker beyond the one it is at: none waits for the next one to be sent."""
Progress = Callable[[int], None]


@dataclass(frozen=True)
class TaskOutcome:
    """What became of a task, by its key: its value, or ``error``, one line; ``tries``: how often it was begun.

    ``failed``: the error is none of the input, so that it may be well another day; no journal has it.
    """

    key: str
    value: Any = None
    error: str = ""
    tries: int = 1
    failed: bool = False


def run(
    function: Function,
    tasks: Iterable[tuple[str, Any]],
    engine: Engine,
    *,
    retries: int = 2,
    journal: Steps | None = None,
    progress: Progress | None = None,
) -> Iterator[TaskOutcome]:
    """The outcomes of all tasks, in the order of the tasks, whoever does them.

    Parameters
    ----------
    function : of the item of a task; it must be known by name in every process, and depend on nothing else
    tasks : key and item of each; taken up as workers become free, so that few are in memory
    engine : who does them
    retries : how often a task is begun again that failed, or whose worker died; wrong input is not tried again
    journal : has what is done (JSON types); what it has already is not done again
    progress : told how many outcomes there are, after each
    """
    with closing(engine):
        yield from _Running(engine, engine.open(function), iter(tasks), retries, journal, progress).outcomes()


@dataclass
class _Pending:
    """A task that has no outcome yet."""

    key: str
    item: Any
    tries: int = 1


class _Running:
    """The tasks that are being done, and the outcomes that wait for those before them."""

    def __init__(
        self,
        engine: Engine,
        workers: int,
        tasks: Iterator[tuple[str, Any]],
        retries: int,
        journal: Steps | None,
        progress: Progress | None,
    ) -> None:
        self.engine, self.most, self.retries = engine, workers * (1 + AHEAD), retries
        self.tasks, self.journal, self.progress = enumerate(tasks), journal, progress
        self.waiting: dict[int, _Pending] = {}
        self.ready: dict[int, TaskOutcome] = {}
        self.next = self.done = 0

    def outcomes(self) -> Iterator[TaskOutcome]:
        """All, in order."""
        while True:
            self._take_up()
            while self.next in self.ready:
                yield self.ready.pop(self.next)
                self.next += 1
            if self.waiting:
                self._collect()
            elif not self._take_up():
                return

    def _take_up(self) -> int:
        """Give the engine as many as it can be at; returns how many tasks were left."""
        room = self.most - len(self.waiting) - len(self.ready)
        count = 0
        for number, (key, item) in islice(self.tasks, max(room, 0)):
            count += 1
            if self.journal is not None and key in self.journal.done:
                self._end(number, TaskOutcome(key, **self.journal.done[key]))
            else:
                self.waiting[number] = _Pending(key, item)
                self.engine.submit(number, item)
        return count

    def _collect(self) -> None:
        number, reply = self.engine.reply()
        task = self.waiting[number]
        if reply.kind == "failed" and task.tries <= self.retries:
            task.tries += 1
            self.engine.submit(number, task.item)
            return
        del self.waiting[number]
        failed = reply.kind == "failed"
        outcome = TaskOutcome(task.key, reply.value, _error(reply, task.tries), task.tries, failed)
        if self.journal is not None and not failed:
            self.journal.once(task.key, lambda: {"value": outcome.value, "error": outcome.error})
        self._end(number, outcome)

    def _end(self, number: int, outcome: TaskOutcome) -> None:
        self.ready[number] = outcome
        self.done += 1
        if self.progress is not None:
            self.progress(self.done)


def _error(reply: Reply, tries: int) -> str:
    return "" if reply.kind == "done" else reply.why if reply.kind == "refused" else f"{reply.why} ({tries} times)"
