"""What all forms of export share: options, the choice of rows and points, and what a form leaves out."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from stepgauge.errors import InputError, naming
from stepgauge.files.numerals import number
from stepgauge.files.text import replacing
from stepgauge.recording import APPROACH, COUNTS, OPTIONAL, POSITION, Recording

DECIMALS = {"mm": 7, "um": 4, "m": 10, "inch": 9}
"""Digits behind the point of a coordinate, by unit: 1e-7 mm or finer, as a recording has."""
STATES = OPTIONAL[2:]
"""Columns of a recording that may hold for a whole run."""


@dataclass(frozen=True)
class ExportOptions:
    """``unit``: of coordinates; ``delimiter``, ``decimal``: marks of a table as text; ``placement``: the only one to
    export (None: all); ``surface``: points compensated by the tip radius instead of tip centres; ``tip_radius_mm``:
    where the recording does not state it; ``log_form``: ``log`` or ``probeopen`` of LinuxCNC.
    """

    unit: str = "mm"
    delimiter: str = ","
    decimal: str = "."
    placement: int | None = None
    surface: bool = False
    tip_radius_mm: float | None = None
    log_form: str = "log"


@dataclass(frozen=True)
class Export:
    """The bytes of a file, and in a few lines what was left out of it."""

    content: bytes
    report: tuple[str, ...]

    def __repr__(self) -> str:
        return f"Export of {len(self.content)} bytes\n{self.summary()}"

    def summary(self) -> str:
        """What was left out, and what was taken for what."""
        return "\n".join(self.report)

    def write(self, path: str | Path) -> None:
        """Write the file; a workbook is one by its name, too."""
        workbook = self.content.startswith(b"PK")
        if workbook != str(path).lower().endswith(".xlsx"):
            expected = "NAME.xlsx" if workbook else "another suffix than .xlsx"
            raise InputError(path, "the suffix does not fit what is written", expected=expected)
        with replacing(path) as beside:
            beside.write_bytes(self.content)


def prepared(recording: Recording, options: ExportOptions) -> Recording:
    """The rows and the kind of points that are to be exported; the comments say which."""
    if options.placement is not None:
        if options.placement not in recording.placements:
            there = ", ".join(map(str, recording.placements))
            raise InputError(recording.path, f"there is no placement {options.placement}", found=there)
        recording = recording.select_placement(options.placement)
    comments = dict(recording.comments)
    radius = tip_radius_mm(recording, options)
    if radius is not None:
        comments["tip_radius_mm"] = f"{radius:g}"
    if options.surface:
        if radius is None:
            raise InputError(recording.path, "surface points need the tip radius", expected=naming("tip_radius_mm"))
        frame = recording.frame.copy()
        frame[POSITION] = recording.position_mm + radius * recording.approach
        recording = replace(recording, frame=frame)
    comments["points"] = "surface" if options.surface else "tip centres"
    return replace(recording, comments=comments)


def tip_radius_mm(recording: Recording, options: ExportOptions) -> float | None:
    """The tip radius of the person, or the one that the recording states."""
    stated = number(recording.comments.get("tip_radius_mm", ""))
    return options.tip_radius_mm or (stated if math.isfinite(stated) else None)


def one_placement(recording: Recording, form: str) -> None:
    """:class:`InputError` for a form that has no room for the number of a placement."""
    if len(recording.placements) > 1:
        raise InputError(
            recording.path,
            f"{form} has room for one placement",
            found=", ".join(map(str, recording.placements)),
            expected=naming("placement_number", words="{} N, once for each"),
        )


def tip_centres_in_mm(options: ExportOptions, form: str, words: str) -> None:
    """:class:`InputError` for a form, in words, that has neither another unit nor surface points."""
    if options.unit != "mm" or options.surface:
        raise InputError(
            naming("to", words=f"{{}} {form}"),
            f"{words} has tip centres in mm",
            expected=naming("length_unit", "points", words="no {} and no {} surface"),
        )


def run_comments(recording: Recording, columns: Sequence[str] = STATES) -> dict[str, str]:
    """One-line comments, and the columns that hold for the whole run as further ones."""
    comments = {key: value for key, value in recording.comments.items() if "\n" not in value and key != "import"}
    for name in columns:
        if name in recording.frame and recording.frame[name].nunique() == 1:
            comments[name] = repr(float(recording.frame[name].iloc[0]))
    if recording.placements != [1]:
        comments["placement"] = str(recording.placements[0])
    return comments


def left_out(recording: Recording, written: Sequence[str]) -> tuple[str, ...]:
    """Words on the columns that are neither written nor constant."""
    known = {*COUNTS, *POSITION, *APPROACH, *written}
    lost = [
        name
        for name in recording.frame.columns
        if name not in known and not (name in STATES and recording.frame[name].nunique() == 1)
    ]
    return (f"left out: columns {', '.join(lost)}",) if lost else ()
