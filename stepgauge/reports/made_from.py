"""The files that an evaluation was made from, found again from its ``evaluation.json``."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from stepgauge.errors import InputError, naming
from stepgauge.gauge.certified import read_gauge
from stepgauge.reports.reading import check_gauge, find_evaluation


def recordings_of(evaluation: dict[str, Any], path: str | Path) -> list[Path]:
    """The recordings of an evaluation: by their way from its folder, else as they were typed.

    :class:`InputError` where one is not there. That they have not changed since was checked when it was read.
    """
    near = {one.name: one for one in _near(evaluation, path)}
    found = []
    for typed in str(evaluation["recording"]).split(", "):
        place = near.get(Path(typed).name, Path(typed))
        if not typed or not place.is_file():
            what = "a recording of this evaluation is not there"
            raise InputError(
                path, what, found=typed or "not in a file", expected=naming("recording", words="it, given with {}")
            )
        found.append(place)
    return found


def gauge_of(evaluation: dict[str, Any], path: str | Path) -> Path | str:
    """The gauge file of an evaluation, or its shipped name; :class:`InputError` where it is not there."""
    names = [str(one["name"]) for one in evaluation.get("inputs", []) if "name" in one]
    candidates: list[Path | str] = [*_near(evaluation, path), *names]
    for one in candidates:
        if str(one).endswith(".toml"):
            try:
                check_gauge(evaluation, read_gauge(one))
            except InputError:
                continue
            return one
    raise InputError(
        path, "the gauge of this evaluation is not there", expected=naming("gauge", words="it, given with {}")
    )


def _near(evaluation: dict[str, Any], path: str | Path) -> Iterator[Path]:
    """Files that it was made from, which lie where they lay."""
    folder = find_evaluation(path).parent
    for one in evaluation.get("inputs", []):
        if "file" in one and (folder / str(one["file"])).is_file():
            yield folder / str(one["file"])
