"""The journal of an investigation: every step is a line of JSON, on the disk before the next one is begun.

A step that is done is never done again: an investigation that was broken off goes through the same steps, and those
that the journal has are read from it. The points of a run have a journal of their own (:mod:`stepgauge.live.journal`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from stepgauge.errors import InputError, naming
from stepgauge.live.journal import Lines, Row, held, sync_folder, whole_lines

FORMAT = "stepgauge investigation journal 1"
NAME = "investigation.journal"


@dataclass
class Steps(Lines):
    """An open journal; ``done`` are the steps on the disk, by their names."""

    done: dict[str, Any] = field(default_factory=dict)

    def once(self, name: str, make: Callable[[], Any]) -> Any:
        """What a step gave: from the journal where it is done, else made now and put on the disk."""
        if name not in self.done:
            value = make()
            self.write({"step": name, "value": value})
            self.done[name] = value
        return self.done[name]


def open_steps(folder: Path, head: Row, again: bool) -> Steps:
    """The journal in a folder: a new one, or (``again``) that of the same investigation, to go on with.

    ``head``: what is investigated, and with which choices. :class:`InputError` where there is none to go on with, where
    one is that would be overwritten, or where it is that of another investigation.
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / NAME
    if not again and path.exists() and path.stat().st_size:
        expected = naming("resume", words="{} to go on with it, or another folder")
        raise InputError(path, "an investigation is here", expected=expected)
    if again and not path.is_file():
        raise InputError(path, "there is no journal to resume", expected="an investigation that was begun")
    with held(path) as file:
        steps, whole = _read(path)
        if whole:
            _check_same(steps.path, steps.done.pop("head"), head)
        file.truncate(whole)
    steps._file = file
    if not whole:
        steps.write({"step": "head", "value": {"format": FORMAT, **head}})
        sync_folder(folder)
    return steps


def _read(path: Path) -> tuple[Steps, int]:
    """The steps in a file, and how many of its bytes are whole lines."""
    steps, whole = Steps(path), 0
    for number, (raw, line) in enumerate(whole_lines(path), 1):
        if set(line) != {"step", "value"} or line["step"] in steps.done or (number == 1) != (line["step"] == "head"):
            raise InputError(f"{path}:{number}", "the journal is damaged", found=repr(raw[:40]))
        steps.done[line["step"]] = line["value"]
        whole += len(raw) + 1
    return steps, whole


def _check_same(path: Path, found: Row, head: Row) -> None:
    if not isinstance(found, dict) or found.get("format") != FORMAT:
        raise InputError(path, "this is no journal of an investigation", expected=FORMAT)
    for key, value in head.items():
        if found.get(key) != value:
            what = f"this is the journal of an investigation with another {key.replace('_', ' ')}"
            raise InputError(path, what, found=str(found.get(key))[:60], expected=str(value)[:60])
