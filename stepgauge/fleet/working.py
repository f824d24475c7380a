"""What has no result yet is worked on, on any engine, and the results go into a table of the store.

Quick work is done in batches, whose results are on the disk in portions; long work recording by recording, each result
being in a journal as it is made, until its portion is in the table.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import islice
from typing import Any, TypeVar

from stepgauge.executors.journal import Steps, open_steps
from stepgauge.executors.run import run
from stepgauge.executors.task import Engine, Function
from stepgauge.files.lines import read_lines
from stepgauge.fleet.batches import Batch, StoredBatch, batches, named
from stepgauge.fleet.results import Results
from stepgauge.fleet.schema import StoredColumn, arrow_library, arrow_schema
from stepgauge.fleet.store import Fleet

BATCH = 100
"""Recordings of a task: many enough that to send them costs little, few enough that the last ones do not wait."""
PORTION = 500
"""Recordings whose results become one file: few files, and little to do again after a kill."""
Progress = Callable[[int, int], None]
RowsOf = Callable[[str, Any, str], Sequence[Mapping[str, Any]]]
T = TypeVar("T")


def work_in_batches(table: Results, engine: Engine, function: Function, progress: Progress | None = None) -> list[str]:
    """Fill a table with what ``function`` makes of batches; returns why some recordings cannot be done, a line each.

    ``function`` gives rows with an ``error`` where one cannot, as an Arrow table. ``progress`` is told how many of how
    many recordings are done. What is done stays done where this is stopped.
    """
    fleet, keys, errors = table.fleet, _left_over(table), list[str]()
    told = None if progress is None else (lambda done: progress(min(done * BATCH, len(keys)), len(keys)))
    outcomes = run(function, _tasks(fleet, engine, keys, BATCH), engine, progress=told)
    for some in _portions(outcomes, PORTION // BATCH):
        done = [one.value for one in some if not one.error]
        if done:
            table.put(arrow_library().concat_tables(done, promote_options="permissive"))
        errors += [text for rows in done for text in rows["error"].to_pylist() if text]
        errors += [f"{BATCH} recordings from {one.key} on: {one.error}" for one in some if one.error]
    return errors


def work_one_by_one(
    table: Results,
    engine: Engine,
    function: Function,
    rows_of: RowsOf,
    columns: tuple[StoredColumn, ...],
    progress: Progress | None = None,
) -> list[str]:
    """The same with ``function`` of batches of one recording, whose value (JSON types) is in the journal at once.

    ``rows_of`` makes the rows of a recording of its key, the value (None where there is none) and the error.
    """
    keys, errors = _left_over(table), list[str]()
    for number, some in enumerate(_portions(table.fleet.order_keys(keys), PORTION)):
        told = None if progress is None else _counting(progress, number * PORTION, len(keys))
        with open_journal(table.fleet, table) as journal:
            tasks = _tasks(table.fleet, engine, some, 1)
            done = list(run(function, tasks, engine, journal=journal, progress=told))
            rows = [row for one in done if not one.failed for row in rows_of(one.key, one.value, one.error)]
            if rows:
                table.put(arrow_library().Table.from_pylist(rows, arrow_schema(columns)))
        errors += [one.error for one in done if one.error]
    return errors


def _counting(progress: Progress, before: int, total: int) -> Callable[[int], None]:
    return lambda done: progress(before + done, total)


def _portions(items: Iterable[T], size: int) -> Iterator[list[T]]:
    """Lists of so many; the last one is shorter."""
    left = iter(items)
    while some := list(islice(left, size)):
        yield some


def _tasks(fleet: Fleet, engine: Engine, keys: Collection[str], size: int) -> Iterator[tuple[str, Batch | StoredBatch]]:
    return named(fleet, keys, size) if engine.near else batches(fleet, keys, size)


def _left_over(table: Results) -> list[str]:
    """The keys of the recordings that have no row in a table of results."""
    done = table.done()
    return [key for key in table.fleet.index()["recording"].to_pylist() if key not in done]


@contextmanager
def open_journal(fleet: Fleet, table: Results) -> Iterator[Steps]:
    """The journal of what fills a table; it is gone when the block is done, and goes on where that was stopped.

    One that was begun with other options is thrown away, as the table's rows are.
    """
    work = table.folder.name
    path = fleet.folder / f"{work}.journal"
    begun = read_lines(path).lines if path.exists() else []
    if begun and begun[0].get("value", {}).get("made_with") != table.made_with:
        path.unlink()
    journal = open_steps(fleet.folder, {"made_with": table.made_with}, path.exists(), work)
    try:
        yield journal
        path.unlink()
    finally:
        journal.close()
