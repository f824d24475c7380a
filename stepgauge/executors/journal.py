"""The journal of a long work: every step is a line of JSON, on the disk before the next one is begun.

A step that is done is never done again: a work that was broken off goes through the same steps, and those that the
journal has are read from it. The points of a measurement have a journal of their own (:mod:`stepgauge.live.journal`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from stepgauge.errors import InputError, naming
from stepgauge.files.lines import DurableLines, Row, held, read_lines, sync_folder


@dataclass
class Steps(DurableLines):
    """An open journal; ``done`` are the steps on the disk, by their names."""

    done: dict[str, Any] = field(default_factory=dict)

    def once(self, name: str, make: Callable[[], Any]) -> Any:
        """What a step gave: from the journal where it is done, else made now and put on the disk."""
        if name not in self.done:
            value = make()
            self.write({"step": name, "value": value})
            self.done[name] = value
        return self.done[name]


def open_steps(folder: Path, head: Row, again: bool, work: str = "investigation") -> Steps:
    """The journal of a ``work`` in a folder: a new one, or (``again``) that of the same work, to go on with.

    ``head``: on what it works, and with which choices. :class:`InputError` where there is none to go on with, where one
    is that would be overwritten, or where it is that of another work.
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{work}.journal"
    article = "an" if work[0] in "aeiou" else "a"
    if not again and path.exists() and path.stat().st_size:
        expected = naming("resume", words="{} to go on with it, or another folder")
        raise InputError(path, f"{article} {work} is here", expected=expected)
    if again and not path.is_file():
        raise InputError(path, "there is no journal to resume", expected=f"{article} {work} that was begun")
    head = {"format": f"stepgauge {work} journal 1", **head}
    with held(path) as file:
        steps, whole = _read(path)
        if whole:
            _check_same(steps.path, steps.done.pop("head"), head, f"{article} {work}")
        steps.go_on(file, whole)
    if not whole:
        steps.write({"step": "head", "value": head})
        sync_folder(folder)
    return steps


def _read(path: Path) -> tuple[Steps, int]:
    """The steps in a file, and how many of its bytes are whole lines."""
    read = read_lines(path)
    steps = Steps(path, last=read.last)
    for number, line in enumerate(read.lines, 1):
        if set(line) != {"step", "value"} or line["step"] in steps.done or (number == 1) != (line["step"] == "head"):
            raise read.damaged(number)
        steps.done[line["step"]] = line["value"]
    return steps, read.size


def _check_same(path: Path, found: Row, head: Row, work: str) -> None:
    if not isinstance(found, dict) or found.get("format") != head["format"]:
        raise InputError(path, f"this is no journal of {work}", expected=head["format"])
    for key, value in head.items():
        if found.get(key) != value:
            what = f"this is the journal of {work} with another {key.replace('_', ' ')}"
            raise InputError(path, what, found=str(found.get(key))[:60], expected=str(value)[:60])
