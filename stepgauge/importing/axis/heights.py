"""Slope distances between stations of known heights -> horizontal distances.

A distance meter measures from its own point above one station to the target's above the other. With the heights of the
stations, and of instrument and target above them where the table states these, d = sqrt(slope^2 - dh^2).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from stepgauge.axis.recording import STATIONS, AxisRecording
from stepgauge.axis.units import base_of, plain_name
from stepgauge.errors import InputError, naming, reader
from stepgauge.files.arrays import Array
from stepgauge.importing.tables.cells import any_number, read_text_cells
from stepgauge.importing.tables.questions import Decisions
from stepgauge.importing.tables.source import read_source
from stepgauge.importing.tables.vocabulary import split_name

ABOVE = (
    re.compile(r"height.*instrument|instrument.*height|^(hi|ih)\b|ger[aä]teh[oö]he|instrumentenh[oö]he", re.IGNORECASE),
    re.compile(r"height.*(target|prism|reflector)|(target|prism|reflector).*height|zielh[oö]he", re.IGNORECASE),
)
"""Names of the columns with the height of the instrument above its station, and of the target above the other."""


@reader("table of heights")
def read_heights(path: str | Path) -> dict[str, float]:
    """Height of every station, in the unit of the distances: a name, then the first number of a row.

    :class:`InputError` for a station that is there twice with different heights, and a file without any.
    """
    found: dict[str, float] = {}
    for row in read_text_cells(read_source(path), None, Decisions()).rows:
        name, height = str(row[0]).strip(), next(filter(np.isfinite, map(any_number, row[1:])), None)
        if height is None:
            continue
        if found.setdefault(name, height) != height:
            raise InputError(path, f"station {name} is there twice", found=f"{found[name]:g} and {height:g}")
    if not found:
        raise InputError(path, "no heights", expected="rows of a station and its height")
    return found


def reduced(recording: AxisRecording, height: Mapping[str, float], source: str | Path) -> AxisRecording:
    """The recording with horizontal distances; ``height``: of the stations; ``source``: the file that states them.

    :class:`InputError` for a recording of anything else, a station without a height, and heights that differ by more
    than a distance.
    """
    if recording.form != "distances":
        what = "needs distances between stations"
        raise InputError(naming("heights"), what, found=recording.form, expected="columns from and to")
    frame = recording.frame
    ends = [np.array([_of(name, height, source) for name in frame[column].astype(str)]) for column in STATIONS]
    above = [_above(recording, pattern) for pattern in ABOVE]
    rise, slope = (ends[1] + above[1]) - (ends[0] + above[0]), frame["reading"].to_numpy(float)
    if (np.abs(rise) >= slope).any():
        row = int((np.abs(rise) - slope).argmax())
        found, expected = (
            f"{rise[row]:g} over {slope[row]:g}",
            f"heights in {recording.units.position}, as the distances",
        )
        raise InputError(source, "the heights differ by more than a distance", found=found, expected=expected)
    said = {**recording.comments, "reduced": f"slope distances to horizontal ones, heights of {Path(source).name}"}
    return replace(recording, frame=frame.assign(reading=np.sqrt(slope**2 - rise**2)), comments=said)


def _of(name: str, height: Mapping[str, float], source: str | Path) -> float:
    if name not in height:
        raise InputError(source, f"station {name} has no height", found=", ".join(list(height)[:8]))
    return height[name]


def _above(recording: AxisRecording, pattern: re.Pattern[str]) -> Array:
    """Heights above the stations in the unit of the distances; nought where no column states them."""
    for name in recording.covariates:
        if pattern.search(name):
            unit = split_name(name)[1]
            factor = 1.0 if unit is None else base_of(plain_name(unit.name)) / recording.units.base_position
            return recording.frame[name].to_numpy(float) * factor
    return np.zeros(len(recording))
