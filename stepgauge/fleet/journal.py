"""The journal of a long work on a fleet: in the store until its table has what is in it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from stepgauge.executors.journal import Steps, open_steps
from stepgauge.files.lines import read_lines
from stepgauge.fleet.results import Results
from stepgauge.fleet.store import Fleet


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
