"""The recording of one axis, of one spot or of distances between stations: a target and a reading per row.

A CSV file like that of a gauge: ``# key: value`` lines, a header, numbers. ``recording`` says which of :data:`FORMS` it
is, ``unit`` and ``deviation_unit`` in which units it is told, ``sensor`` what read it. Columns end in the unit.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import takewhile
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from stepgauge.axis.sensors import SENSORS
from stepgauge.axis.units import AxisUnits
from stepgauge.errors import FRAME, InputError, at_row, no_such_file, reader
from stepgauge.files.arrays import Array
from stepgauge.files.display import Plotted, join_lines
from stepgauge.files.text import read_text, write_text
from stepgauge.files.units import column_name
from stepgauge.recording import PROBINGS, comment_lines
from stepgauge.recording.lines import is_beside, lines_beside, row_lines

if TYPE_CHECKING:
    import pandas as pd

FORMS = ("axis", "spot", "distances")
FORM = "recording"
"""Comment that says which form a recording has; that of a gauge has none."""
STATIONS = ["from_station", "to_station"]
OWN = ("placement", "cycle", "way", "target", "reading", "u_target", "time_s")
LONGEST_COMMENT = 100_000
SAME_PLACE = 1e-3
"""Share of the span within which targets that differ are one place.

Between the closest targets of a test, a hundredth of the span, and the scatter of an axis that comes to a place again,
at worst a ten thousandth of its travel (10 um in 100 mm): in proportion as far from the one as from the other. It is
not taken from the gaps between targets: the faces of a step gauge lie in pairs, too.
"""
APART = 5.0
"""How many times longer the shortest distance between places is than the longest within one, at least."""
DIGITS = 12
"""Significant digits of a number: 0.1 um over 100 km."""


@dataclass(frozen=True, repr=False)
class AxisRecording(Plotted):
    """Readings of one axis, of one spot over time, or of distances between stations.

    ``frame``: ``placement`` (which setting up), ``cycle``, ``way`` (+1 or -1, the sense of travel), ``target`` (of an
    axis) or the two ``STATIONS``, ``reading``, ``u_target`` (standard uncertainty of the target, where it is known),
    ``time_s``, and numbers that were recorded besides; ``target`` and ``reading`` in ``units.position``, ``u_target``
    in ``units.deviation``.
    """

    drawn_by: ClassVar[str] = "axis.draw_recording"
    frame: pd.DataFrame
    form: str
    units: AxisUnits
    sensor: str
    comments: Mapping[str, str]
    path: str = ""

    def __len__(self) -> int:
        return len(self.frame)

    def summary(self) -> str:
        """How much was measured, by what, and what the recording says of itself."""
        frame, words = self.frame, SENSORS[self.sensor].words
        targets = (
            f" at {len(np.unique(places_of(frame['target'].to_numpy(float))))} targets" if "target" in frame else ""
        )
        first = f"{self.form} by {words}: {len(self)} readings{targets}, {frame['cycle'].nunique()} cycles"
        units = f"in {self.units.position}, deviations in {self.units.deviation}"
        return join_lines(f"{first}, {units}", *(f"{key}: {value}" for key, value in self.comments.items()))

    def to_frame(self) -> pd.DataFrame:
        """One row per reading, with its deviation and with the units in the names of the columns."""
        told = self.frame.rename(columns=_names(self.units))
        return (
            told if self.form == "distances" else told.assign(**{f"deviation_{self.units.deviation}": self.deviation})
        )

    def write(self, path: str | Path) -> None:
        """Write the recording as CSV, numbers to 12 significant digits."""
        write_axis_recording(path, self)

    def _stated(self) -> str:
        return axis_recording_text(self)

    @property
    def both_ways(self) -> bool:
        """Whether the axis came from both sides."""
        return self.frame["way"].nunique() > 1

    @property
    def covariates(self) -> list[str]:
        """Columns that were recorded besides."""
        return [name for name in self.frame.columns if name not in (*OWN, *STATIONS)]

    @property
    def deviation(self) -> Array:
        """Reading minus target, in ``units.deviation``, ``(n,)``; of a spot, minus the first reading."""
        reading = self.frame["reading"].to_numpy(float)
        target = self.frame["target"].to_numpy(float) if "target" in self.frame else reading[0]
        return np.asarray((reading - target) * self.units.deviations_per_position)


def places_of(target: Array) -> NDArray[np.intp]:
    """Which place each target is, counted along the axis, ``(n,)``.

    Targets that a reference instrument read are never twice the same. They are one place within the repeatability that
    shows: the distances between neighbours are of two kinds, those within a place, below :data:`SAME_PLACE` of the
    span, and those between places, at least :data:`APART` times as long; and that makes repeats of targets that have
    none. A dense scan, whose distances are of one kind, has as many places as positions.
    """
    import pandas as pd

    codes, found = pd.factorize(target)
    values = np.sort(found)
    place = np.searchsorted(values, found)[codes]
    if 2 * len(values) <= len(target) or len(values) < 3:
        return place.ravel()
    steps = np.diff(values)
    sizes = np.sort(steps)
    within = sizes[:-1] < SAME_PLACE * float(np.ptp(values))
    if not within.any():
        return place.ravel()
    growth = np.where(within, sizes[1:] / sizes[:-1], 0.0)
    cut = int(growth.argmax())
    joined = np.concatenate([[0], np.cumsum(steps > sizes[cut])])
    alike = growth[cut] >= APART and 2 * (joined[-1] + 1) <= len(target)
    return joined[place.ravel()] if alike else place.ravel()


def is_axis_recording(path: str | Path) -> bool:
    """Whether a file is a recording of one of these forms, by its comments; a pipe, which is read once, is none.

    :class:`InputError` where there is nothing of this name: whatever else is missing is asked for afterwards.
    """
    if not Path(path).exists():
        raise no_such_file(path)
    if not Path(path).is_file():
        return False
    try:
        with Path(path).open(encoding="utf-8-sig") as file:
            lines = iter(lambda: file.readline(LONGEST_COMMENT), "")
            return any(_form_in(line) for line in takewhile(is_beside, lines))
    except (OSError, UnicodeDecodeError):
        return False


def _form_in(line: str) -> bool:
    key, _, value = line[1:].partition(":")
    return key.strip() == FORM and value.strip() in FORMS


@reader("recording of an axis")
def read_axis_recording(path: str | Path) -> AxisRecording:
    """Read and check a recording as :func:`write_axis_recording` writes it; errors name the line or column."""
    lines = read_text(path).splitlines()
    first = next((n for n, line in enumerate(lines) if not is_beside(line)), len(lines))
    beside = lines_beside(path, first + 1)
    frame = _table(path, [*range(first), *(line - 1 for line in beside)])
    return _checked(frame, comment_lines(lines[:first]), str(path), row_lines(len(frame), first + 1, beside))


def axis_recording_of_frame(frame: pd.DataFrame) -> AxisRecording:
    """A table with the columns of such a file, checked as this; its comments stand in ``frame.attrs``: at least
    ``recording``, ``unit`` and ``sensor``. Rows count from 0."""
    comments = {str(key): str(value) for key, value in frame.attrs.items()}
    return _checked(frame.reset_index(drop=True), comments, FRAME, range(len(frame)))


def _checked(frame: pd.DataFrame, comments: dict[str, str], path: str, lines: Sequence[int]) -> AxisRecording:
    form = comments.pop(FORM, "")
    if form not in FORMS:
        raise InputError(path, "not a recording of an axis", found=repr(form), expected=", ".join(FORMS))
    units = AxisUnits.of(comments.pop("unit", ""), comments.pop("deviation_unit", None))
    sensor = comments.pop("sensor", "")
    if sensor not in SENSORS:
        raise InputError(path, "the sensor is not known", found=repr(sensor), expected=", ".join(SENSORS))
    frame = _plain_columns(frame, units)
    _check(frame, form, path, lines, comments.pop(PROBINGS, None))
    return AxisRecording(frame, form, units, sensor, comments, path)


def write_axis_recording(path: str | Path, recording: AxisRecording) -> None:
    """Write a recording as CSV, comments first; numbers to :data:`DIGITS` significant digits."""
    write_text(path, axis_recording_text(recording))


def axis_recording_text(recording: AxisRecording) -> str:
    """The text of its file."""
    units = recording.units
    said = {FORM: recording.form, "unit": units.position, "deviation_unit": units.deviation, "sensor": recording.sensor}
    head = [f"# {key}: {line}" for key, value in {**said, **recording.comments}.items() for line in value.split("\n")]
    frame = recording.frame.rename(columns=_names(units))
    body = frame.to_csv(index=False, lineterminator="\n", float_format=f"%.{DIGITS}g")
    return "\n".join([*head, f"# {PROBINGS}: {len(recording)}", body])


def join_axis_recordings(recordings: Sequence[AxisRecording]) -> AxisRecording:
    """Several settings up of one axis as one recording, in the units of the first; placements are numbered on.

    :class:`InputError` for recordings of another kind, and for one that is there twice: it is no second measurement.
    """
    import pandas as pd

    first, frames, taken = recordings[0], list[pd.DataFrame](), 0
    for one in recordings:
        if (one.form, one.units, one.sensor) != (first.form, first.units, first.sensor):
            found = f"{one.form} by {one.sensor} in {one.units.position}"
            expected = f"{first.form} by {first.sensor} in {first.units.position}, as {first.path}"
            raise InputError(one.path, "not a recording of the same kind", found=found, expected=expected)
        frames.append(one.frame.assign(placement=one.frame["placement"] + taken))
        taken = int(frames[-1]["placement"].max())
    shared = [name for name in first.frame.columns if all(name in frame for frame in frames)]
    path = ", ".join(one.path for one in recordings if one.path)
    whole = replace(first, frame=pd.concat([f[shared] for f in frames], ignore_index=True), path=path)
    _check_copies(whole)
    return whole


def _check_copies(recording: AxisRecording) -> None:
    seen: dict[bytes, int] = {}
    for number, rows in recording.frame.groupby("placement"):
        again = int(str(number))
        first = seen.setdefault(rows[[n for n in ("target", "reading") if n in rows]].to_numpy(float).tobytes(), again)
        if first != again and len(rows) > 1:
            what = f"setting up {again} repeats the readings of setting up {first}"
            expected = "a recording of its own for every setting up"
            raise InputError(recording.path, what, found="the same readings to the last digit", expected=expected)


def ways_doubt(frame: pd.DataFrame) -> str | None:
    """What to say where the order of the targets contradicts the stated sense of travel in every run.

    Tables often list the way back with rising targets, so one direction alone tells nothing: it is doubtful only where
    the targets rise on all ways down and fall on all ways up.
    """
    if "target" not in frame or frame["way"].nunique() < 2:
        return None
    for _, rows in frame.groupby(["placement", "cycle", "way"], sort=False):
        steps = np.diff(rows["target"].to_numpy(float))
        if len(steps) == 0 or not (steps * rows["way"].to_numpy(float)[1:] < 0.0).all():
            return None
    return "targets rise where the direction is stated as down and fall where it is up, as if they were exchanged"


def _names(units: AxisUnits) -> dict[str, str]:
    return {
        **{name: f"{name}_{units.position}" for name in ("target", "reading")},
        "u_target": f"u_target_{units.deviation}",
    }


def _table(path: str | Path, over: Sequence[int]) -> pd.DataFrame:
    import pandas as pd

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", pd.errors.ParserWarning)  # pandas would drop what has no column
            return pd.read_csv(path, skiprows=over, dtype=dict.fromkeys(STATIONS, str), index_col=False)
    except (pd.errors.ParserError, pd.errors.ParserWarning, pd.errors.EmptyDataError) as error:
        raise InputError(path, "the rows are not as the header says", found=str(error)) from None


def _plain_columns(frame: pd.DataFrame, units: AxisUnits) -> pd.DataFrame:
    frame = frame.rename(columns={long: short for short, long in _names(units).items()})
    frame = frame.rename(columns={one: column_name(str(one)) for one in frame.columns if one not in (*OWN, *STATIONS)})
    for name, value in (("placement", 1), ("cycle", 1), ("way", 1)):
        if name not in frame:
            frame.insert(0, name, value)
    return frame


def _check(frame: pd.DataFrame, form: str, path: str | Path, lines: Sequence[int], stated: str | None) -> None:
    """The columns of the form, numbers without gaps, and all rows that the file says it has."""
    import pandas as pd

    needed = {"axis": ["target", "reading"], "spot": ["reading"], "distances": [*STATIONS, "reading"]}[form]
    missing = [name for name in needed if name not in frame]
    if missing or frame.empty:
        what = f"column {missing[0]} is missing" if missing else "the recording has no rows"
        raise InputError(path, what, found=",".join(frame.columns), expected=f"{', '.join(needed)} with their unit")
    if stated is not None and stated != str(len(frame)):
        raise InputError(path, "the recording is cut, or rows were added", found=f"{len(frame)} rows", expected=stated)
    for name in frame.columns.difference(STATIONS):
        values = pd.to_numeric(frame[name], errors="coerce").to_numpy(float)
        wrong = ~np.isfinite(values)
        if wrong.any():
            row = int(wrong.argmax())
            where = at_row(path, lines[row])
            raise InputError(where, f"column {name} is not a number", found=repr(str(frame[name].iloc[row])))
    if not np.isin(frame["way"], (-1, 1)).all():
        raise InputError(path, "column way is no sense of travel", expected="1 or -1 in every row")
