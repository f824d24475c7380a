"""The journal of a long work on a fleet: in the store until its table has what is in it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from stepgauge.fleet.results import Results
from stepgauge.fleet.store import Fleet
from stepgauge.work.steps import Steps, open_steps


@contextmanager
def open_journal(fleet: Fleet, table: Results) -> Iterator[Steps]:
    """The journal of what fills a table; it is gone when the block is done, and goes on where that was stopped.

    One that was begun with other options is thrown away, as the table's rows are.
    """
    work = table.folder.name
    path = fleet.folder / f"{work}.journal"
    if path.exists() and not _is_of(path.read_bytes()[:100_000], table.made_with):
        path.unlink()
    journal = open_steps(fleet.folder, {"made_with": table.made_with}, path.exists(), work)
    try:
        yield journal
        path.unlink()
    finally:
        journal.close()


def _is_of(beginning: bytes, made_with: str) -> bool:
    """Whether the first line says so; one that was cut says nothing."""
    import json

    line, newline, _ = beginning.partition(b"\n")
    return not newline or json.loads(line).get("value", {}).get("made_with") == made_with
