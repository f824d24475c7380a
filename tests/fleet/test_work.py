"""The engines: the same outcomes in the same order, whoever dies."""

from __future__ import annotations

import contextlib
import os
import signal
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stepgauge.errors import InputError
from stepgauge.executors.dask import Dask
from stepgauge.executors.journal import open_steps
from stepgauge.executors.processes import InProcess, Processes
from stepgauge.executors.run import TaskOutcome, run
from stepgauge.executors.task import Engine

TASKS = [(f"t{number}", number) for number in range(40)]


def solved(number: int) -> list[float]:
    """Something whose last digits depend on how it is summed."""
    random = np.random.default_rng(number)
    matrix = random.normal(size=(200, 40))
    return [float(v) for v in np.linalg.lstsq(matrix, random.normal(size=200), rcond=None)[0][:3]]


def awkward(item: tuple[str, Any]) -> Any:
    """Whatever a task can do to its worker."""
    what, value = item
    if what == "refuse":
        raise InputError("x.csv", "wrong", found=value)
    if what == "once" and not Path(value).exists():
        Path(value).touch()
        raise RuntimeError("by chance")
    if what == "die once" and not Path(value).exists():
        Path(value).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    if what == "die":
        os.kill(os.getpid(), signal.SIGKILL)
    if what == "grow":
        return len(np.ones(int(value)))
    return what


def values(engine: Engine, **more: Any) -> list[TaskOutcome]:
    return list(run(solved, TASKS, engine, **more))


def test_processes_give_what_this_process_gives_to_the_last_digit() -> None:
    told: list[int] = []
    here = values(InProcess(), progress=told.append)
    assert [one.key for one in here] == [key for key, _ in TASKS]
    assert told == list(range(1, 41))
    assert values(Processes(2)) == here


def test_a_worker_that_dies_costs_only_its_own_task_a_try(tmp_path: Path) -> None:
    items = [("fine", 0), ("die once", tmp_path / "a"), ("refuse", 7), ("once", tmp_path / "b"), ("die", 0), ("end", 0)]
    found = list(run(awkward, [(str(i), item) for i, item in enumerate(items)], Processes(2)))
    assert [one.value for one in found] == ["fine", "die once", None, "once", None, "end"]
    assert [one.tries for one in found] == [1, 2, 1, 2, 3, 1]
    assert found[2].error == "x.csv: wrong; found 7"
    assert found[4].error == "its process died (exit code -9) (3 times)"


def test_workers_killed_at_any_moment_change_no_result() -> None:
    engine, random = Processes(2), np.random.default_rng(5)
    found = []
    for one in run(solved, TASKS, engine, retries=20):
        found.append((one.key, one.value))
        if random.random() < 0.3:
            with contextlib.suppress(ProcessLookupError):  # dead already, and not replaced yet
                os.kill(engine.pids()[int(random.integers(2))], signal.SIGKILL)
    assert found == [(one.key, one.value) for one in values(InProcess())]


def test_a_task_that_needs_too_much_memory_is_refused_and_the_next_one_is_done() -> None:
    found = list(run(awkward, [("a", ("grow", 1e9)), ("b", ("grow", 1e3))], Processes(1, memory_MB=1500)))
    assert found[0].error == "it needs more memory than the worker may have"
    assert found[1].value == 1000


def test_what_the_journal_has_is_not_done_again(tmp_path: Path) -> None:
    journal = open_steps(tmp_path, {"work": "x"}, False, "diagnoses")
    some = run(solved, TASKS, InProcess(), journal=journal)
    first = [next(some) for _ in range(10)]
    some.close()  # type: ignore[attr-defined]
    journal.close()
    journal = open_steps(tmp_path, {"work": "x"}, True, "diagnoses")
    began = time.perf_counter()
    again = list(run(awkward, TASKS[:10], InProcess(), journal=journal))
    assert again == first
    assert time.perf_counter() - began < 1.0
    journal.close()


def test_no_scheduler_is_told_in_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("stepgauge.executors.dask.CONNECT_S", 0.5)
    with pytest.raises(InputError, match="no Dask"):
        list(run(solved, TASKS, Dask("tcp://127.0.0.1:9")))
    with pytest.raises(InputError, match="no address"):
        list(run(solved, TASKS, Dask("127.0.0.1")))
