"""The covariates on which residuals may depend, and the directions in which readings may be displaced."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.laws.library import SEEN_SHARE, reached_axes
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.effects.grids import pauses_s
from stepgauge.files.arrays import Array
from stepgauge.recording import COUNTS, OPTIONAL, REQUIRED
from stepgauge.recording.columns import STYLUS

ROUNDING = 1e-9
SAME_PLACE = 1e-6
"""Share of the gauge's length below which two coordinates are the same."""
FEWEST_IN_CYCLE = 6
"""Least number of rows of a cycle that distinguishes it from other cycles and from the order of the rows."""
COLUMN = "column "
FIXED = ("position", "machine x", "machine y", "machine z", "cycle", "time", "order", "side", "placement", "azimuth")
TOUCHES = "touches since a pause"
TURNING = "way since turning round"
REST = "rest before the touch"
WAY = "direction of travel"
NAMES = {
    "position": "position_mm",
    "machine x": "x_mm",
    "machine y": "y_mm",
    "machine z": "z_mm",
    "time": "time_s",
    "order": "row",
    TURNING: "turning_mm",
    "speed": "speed_mm_s",
    REST: "rest_s",
}
"""Name of a covariate in a formula, if it differs."""
SIDES = ("approach", "gauge", "front", "back")
"""Along every approach; along the gauge axis; on front faces only; on back faces only."""
AXES = ("x", "y", "z")
"""Further sides: along a machine axis, independent of the gauge."""


@dataclass(frozen=True)
class Covariate:
    """A covariate of the residuals: a name, a unit and a value per row.

    ``further``: a column of the recording beyond those that every recording has; ``known``: the number of rows that
    are measured, if others may follow; what shapes depend on is theirs.
    """

    name: str
    unit: str
    values: Array
    further: bool = False
    known: int | None = None

    @property
    def measured(self) -> Array:
        """The values of the rows that are measured."""
        return self.values[: self.known]

    @property
    def span(self) -> float:
        """The range of the measured values."""
        return float(np.ptp(self.measured))

    @property
    def standard(self) -> Array:
        """Values minus the mean of the measured ones, over their standard deviation."""
        return standard(self.values, self.known)


def standard(values: Array, known: int | None = None) -> Array:
    """Values ``(..., n)`` minus their mean, over their standard deviation, both of the first ``known`` rows."""
    some = values[..., :known]
    spread = np.maximum(some.std(axis=-1, keepdims=True), 1e-300)
    return np.asarray((values - some.mean(axis=-1, keepdims=True)) / spread)


def everywhere(data: Residuals) -> list[Covariate]:
    """Where, when and how fast a face was probed, as far as it varies: what the scatter may grow with."""
    found = [*_places(data), *_times(data)]
    if "speed_mm_s" in data.frame:
        found.append(Covariate("speed", "", data.frame["speed_mm_s"].to_numpy(float)))
    return [c for c in found if is_usable(c)]


def covariates(data: Residuals) -> list[Covariate]:
    """All covariates of a recording that vary.

    A coordinate along which no gauge reaches tells placements apart, and their faces by how the gauge happens to lie:
    the scatter may depend on it, a displacement is the origin's.
    """
    frame = data.frame
    order = np.empty(len(data))
    order[data.order] = np.arange(len(data))
    found = _places(data, reached_axes(data))
    runs = len(frame[["placement", "cycle"]].drop_duplicates())
    found += [Covariate("cycle", "", frame["cycle"].to_numpy(float))] if runs * FEWEST_IN_CYCLE <= len(data) else []
    found += _times(data)
    found += [Covariate("order", "", order)] if data.ordered and not data.has_time else []
    found += [Covariate(TURNING, "mm", data.probings.since_turning_mm())] if data.is_ordered else []
    found += list(_touches(data)) if data.has_time else []
    found += [Covariate(REST, "s", data.probings.rest_s())] if data.has_time else []
    for name in frame.columns:
        if name.startswith("share_") or name == STYLUS:
            continue  # the truth of a simulation is no covariate; a stylus has its radius and its laws
        if name in ("speed_mm_s", *OPTIONAL[3:]) or name not in (*REQUIRED, *OPTIONAL, *COUNTS):
            taken = name in FIXED or name in {one.name for one in found}
            plain = "speed" if name == "speed_mm_s" else COLUMN + name if taken else name
            found.append(Covariate(plain, "", frame[name].to_numpy(float), name != "speed_mm_s"))
    return [c for c in found if is_usable(c)]


def _places(data: Residuals, axes: Iterable[str] = AXES) -> list[Covariate]:
    machine = [Covariate(f"machine {axis}", "mm", _place_mm(data, axis)) for axis in axes]
    return [Covariate("position", "mm", data.probings.certified_mm()), *machine]


def _times(data: Residuals) -> list[Covariate]:
    return [Covariate("time", "s", data.frame["time_s"].to_numpy(float))] if data.has_time else []


def is_usable(covariate: Covariate) -> bool:
    """Whether all are known, and those that are measured differ by more than rounding: a time may count from 1970."""
    least = ROUNDING * max(float(np.abs(covariate.measured).max()), 1e-9)
    return bool(np.isfinite(covariate.values).all()) and covariate.span > least


def _place_mm(data: Residuals, axis: str) -> Array:
    """A machine coordinate, to a millionth of the gauge's length.

    Along an axis in which a placement does not move, the variation of a coordinate is its rounding and a trace of the
    residual itself, since the gauge is never exactly perpendicular to the axis.
    """
    mm = data.probings.coordinate_mm(axis)
    step = SAME_PLACE * max(float(np.ptp(data.probings.certified_mm())), 1.0)
    return mm.min() + step * np.rint((mm - mm.min()) / step)


def _touches(data: Residuals) -> Iterator[Covariate]:
    """Touches since a pause, for every duration of a pause in this recording; without pauses their number."""
    told: list[Array] = []
    for pause_s in (round(pause) for pause in pauses_s(data.probings)):
        touches = data.probings.touches_since_pause(pause_s)
        paused = bool((np.diff(touches[data.order]) <= 0.0).any())
        if paused and not any(np.array_equal(touches, other) for other in told):
            told.append(touches)
            yield Covariate(f"{TOUCHES} of {pause_s} s", "", touches)


def pause_of(covariate: str) -> int:
    """The duration of a pause, s, from the name of the covariate."""
    return int(covariate.removeprefix(TOUCHES).split()[1])


def axes_shown(data: Residuals) -> list[str]:
    """Machine axes along which a motion differs from one along the gauge: those oblique to a placement."""
    shares = np.abs(np.array(list(data.probings.setting.axis.values())))
    return [axis for i, axis in enumerate("xyz") if np.ptp(shares[:, i]) > SEEN_SHARE]


def lives_on(covariate: Covariate, side: str) -> bool:
    """Whether a covariate may displace the readings along a machine axis, if the side is one."""
    return side in SIDES or covariate.name.startswith("machine ") or covariate.further


def mask(data: Residuals, side: str) -> Array:
    """Share of a form in every row by its side."""
    if side in AXES:
        return data.probings.approach(side)
    return {
        "approach": np.ones(len(data)),
        "gauge": data.side,
        "front": (data.side > 0).astype(float),
        "back": (data.side < 0).astype(float),
    }[side]


def length_mm(side: str, data: Residuals) -> Array:
    """The coordinate to which a length error on a side is proportional, from its middle, mm."""
    values = data.probings.coordinate_mm(side) if side in AXES else data.probings.certified_mm()
    return values - float(values.mean())


def runs_of(data: Residuals) -> tuple[NDArray[np.int64], NDArray[np.intp]]:
    """Placement and cycle of every run along the gauge, ``(r, 2)``, and the run of every row."""
    numbers, run = np.unique(data.frame[["placement", "cycle"]].to_numpy(), axis=0, return_inverse=True)
    return numbers, run.ravel()
