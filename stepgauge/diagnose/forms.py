"""Forms without a law: what any structure looks like that depends on one covariate.

They serve twice: they say where a disagreement lives, and they catch what no named effect explains.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnose.library import SEEN_SHARE, Family, pauses_s
from stepgauge.diagnose.residuals import Residuals
from stepgauge.recording import COUNTS, OPTIONAL, REQUIRED

Array = NDArray[np.float64]
BINS = 8
HARMONICS = 6
ROUNDING = 1e-9
SAME_PLACE = 1e-6
"""Share of the gauge's length below which two coordinates are the same."""
COLUMN = "column "
FIXED = ("position", "machine x", "machine y", "machine z", "cycle", "time", "order", "side", "placement", "azimuth")
"""Covariates that a column of the same name is told from."""
TOUCHES = "touches since a pause"
TURNING = "way since turning round"
REST = "rest before the touch"
WAY = "direction of travel"
FEWEST_BACK = 0.2
"""Share of the touches each way from which a difference between the ways can be told from single touches."""
WANDERING = ("time", "order")
POWERS = np.geomspace(0.15, 3.0, 14)
"""Exponents of a decay with the number of touches that is no exponential."""
GROWING_LENGTH = "growing length"
"""The form of a length that grows in proportion to a covariate."""
CHANGING_LENGTHS = ("changing scale", GROWING_LENGTH)
MEMORY = "memory"
"""The form of what rests leave and touches wear off."""
FADING = np.array([1, 2, 3, 4, 6, 8, 12, 16])
"""Numbers of touches over which it fades to 1/e."""
GROWING, ISOLATED = "growing scatter", "isolated rows"
"""Forms of the scatter, which no formula of the mean describes."""
REPEATING = ("position", "machine x", "machine y", "machine z", *WANDERING)
"""Covariates in which things repeat; in others a period is but one more shape that fits by chance."""
MOST_PERIODS = 400
FEWEST_IN_CYCLE = 8
"""Rows of a cycle from which it can be told from the others."""
PRIOR_SIZE = 3.0
"""Standard deviation of what is expected of a form's coefficients, over that of the residuals."""
SIDES = ("approach", "gauge", "front", "back")
"""Along every approach; along the gauge axis; on front faces only; on back faces only."""
AXES = ("x", "y", "z")
"""Sides, too: along a machine axis, whatever the gauge."""


@dataclass(frozen=True)
class Covariate:
    """Something the disagreement may depend on: a name, a unit and a value per row.

    ``further``: a column of the recording beyond those that every recording has.
    """

    name: str
    unit: str
    values: Array
    further: bool = False

    @property
    def steps(self) -> int:
        return len(np.unique(self.values))


def covariates(data: Residuals) -> list[Covariate]:
    """All covariates of a recording that vary."""
    frame = data.frame
    order = np.empty(len(data))
    order[data.order] = np.arange(len(data))
    found = [Covariate("position", "mm", data.probings.certified_mm())]
    found += [Covariate(f"machine {axis}", "mm", _place_mm(data, axis)) for axis in "xyz"]
    found += [Covariate("cycle", "", frame["cycle"].to_numpy(float))]
    found += [Covariate("time", "s", frame["time_s"].to_numpy(float))] if data.has_time else []
    found += [Covariate("order", "", order)] if not data.has_time else []
    found += [Covariate(TURNING, "mm", data.probings.since_turning_mm())]
    found += list(_touches(data)) if data.has_time else []
    found += [Covariate(REST, "s", data.probings.rest_s())] if data.has_time else []
    for name in frame.columns:
        if name.startswith("share_"):
            continue  # the truth of a simulation is no covariate
        if name in ("speed_mm_s", *OPTIONAL[3:]) or name not in (*REQUIRED, *OPTIONAL, *COUNTS):
            found.append(Covariate(_plain_name(name, found), "", frame[name].to_numpy(float), name != "speed_mm_s"))
    return [c for c in found if np.isfinite(c.values).all() and _varies(c.values)]


def _place_mm(data: Residuals, axis: str) -> Array:
    """A machine coordinate, to a millionth of the gauge's length.

    Along an axis in which a placement does not move, what is left of a coordinate is its rounding and a trace of the
    very residual that is to be explained: the gauge is never quite at right angles to it.
    """
    mm = data.probings.coordinate_mm(axis)
    step = SAME_PLACE * float(np.ptp(data.probings.certified_mm()))
    return mm.min() + step * np.rint((mm - mm.min()) / step)


def _touches(data: Residuals) -> Iterator[Covariate]:
    """Touches since a pause, for every length that may count as one in this recording; without any they only count."""
    told: list[Array] = []
    for pause_s in (round(pause) for pause in pauses_s(data)):
        touches = data.probings.touches_since_pause(pause_s)
        paused = bool((np.diff(touches[data.order]) <= 0.0).any())
        if paused and not any(np.array_equal(touches, other) for other in told):
            told.append(touches)
            yield Covariate(f"{TOUCHES} of {pause_s} s", "", touches)


def pause_of(covariate: str) -> int:
    """The length of a pause, s, in the name of the touches since one."""
    return int(covariate.removeprefix(TOUCHES).split()[1])


def _plain_name(name: str, others: Sequence[Covariate]) -> str:
    """A column's name, told from covariates that every recording has."""
    if name == "speed_mm_s":
        return "speed"
    return COLUMN + name if name in FIXED or name in {one.name for one in others} else name


def _varies(values: Array) -> bool:
    """Whether values differ by more than their rounding: a time may count from 1970."""
    return float(np.ptp(values)) > ROUNDING * max(float(np.abs(values).max()), 1e-9)


def form_families(data: Residuals) -> Iterator[Family]:
    """Trend, bow, steps and free shapes in every covariate, on every side; periods; the approach's azimuth."""
    shapes = [(covariate, list(_shapes(covariate))) for covariate in covariates(data)]
    for side in (*SIDES, *axes_shown(data)):
        sided = mask(data, side)[None]
        if side in ("approach", "front"):
            yield make_form("offset", "side", side, sided[None], data)
        for covariate, forms in shapes:
            if not lives_on(covariate, side):
                continue
            for form, columns, values in forms:
                family = make_form(form, covariate.name, side, columns, data)
                details = {**family.details, "atoms": values, "unit": covariate.unit}
                yield replace(family, details=details, shares=sided)
    yield from _length_forms(data)
    yield from _memory_forms(data)
    yield from _way_forms(data)
    yield from _side_forms(data)
    yield from _cycle_forms(data)
    yield from _placement_forms(data)
    yield from _azimuth_forms(data)


def axes_shown(data: Residuals) -> list[str]:
    """Machine axes along which a motion differs from one along the gauge: those that placements lie along in part."""
    shares = np.abs(np.array(list(data.probings.setting.axis.values())))
    return [axis for i, axis in enumerate("xyz") if np.ptp(shares[:, i]) > SEEN_SHARE]


def lives_on(covariate: Covariate, side: str) -> bool:
    """Whether a covariate is one that may move the readings along a machine axis, if the side is one."""
    return side in SIDES or covariate.name.startswith("machine ") or covariate.further


def mask(data: Residuals, side: str) -> Array:
    """Share of a form in every row by the side on which it lives."""
    if side in AXES:
        return data.probings.approach(side)
    return {
        "approach": np.ones(len(data)),
        "gauge": data.side,
        "front": (data.side > 0).astype(float),
        "back": (data.side < 0).astype(float),
    }[side]


def length_mm(side: str, data: Residuals) -> Array:
    """The coordinate along which a length on a side grows in proportion, from its middle, mm."""
    values = along_mm(side, data)
    return values - float(values.mean())


def along_mm(side: str, data: Residuals) -> Array:
    """The coordinate along a side: a machine axis, or the gauge, mm."""
    return data.probings.coordinate_mm(side) if side in AXES else data.probings.certified_mm()


def make_form(form: str, covariate: str, side: str, columns: Array, data: Residuals) -> Family:
    """A form on one side as a family without a law, from its signatures ``(atoms, d, n)``."""
    atoms = [{"atom": i} for i in range(len(columns))]
    details = {"form": form, "side": side}
    label = f"{form} in {covariate}, {side}"
    # a form describes residuals: one that is all but an origin shift must not grow beyond them to show
    prior = PRIOR_SIZE * max(float(data.um.std()), 1e-9)
    return Family(f"form:{form}", label, {}, atoms, columns, None, covariate, details=details, prior=prior)


def _shapes(covariate: Covariate) -> Iterator[tuple[str, Array, Array | None]]:
    """Named forms as ``(atoms, d, n)``, and what each atom stands for (the place of a step, a period)."""
    x = covariate.values
    u = (x - x.mean()) / np.ptp(x) * 2.0
    yield "trend", u[None, None], None
    if covariate.steps > 2:
        yield "bow", np.stack([u, u**2 - (u**2).mean()])[None], None
    if covariate.steps > 3:
        yield "free shape", _bins(x)[None], None
    if covariate.name.startswith(TOUCHES):
        decays = (1.0 + x) ** -POWERS[:, None, None]
        yield "decay", decays, POWERS
        yield "decay to a level", np.concatenate([decays, np.ones_like(decays)], axis=1), POWERS
    if covariate.name == REST:
        yield "power", np.maximum(x, 0.1) ** POWERS[:, None, None] / x.max() ** POWERS[:, None, None], POWERS
    if covariate.steps > 12:
        places = _places(x)
        yield "step", (x >= places[:, None]).astype(float)[:, None], places
        if covariate.name in REPEATING:
            yield "period", *sines(x)


def _bins(x: Array) -> Array:
    """Indicator functions of intervals with about as many rows each, less their mean."""
    levels = np.unique(x)
    count = min(BINS, len(levels))
    edges = np.quantile(levels, np.linspace(0, 1, count + 1)[1:-1])
    index = np.searchsorted(edges, x, side="right")
    columns = (index == np.arange(count)[:, None]).astype(float)
    return (columns - columns.mean(axis=1, keepdims=True))[:-1]


def _places(x: Array) -> Array:
    """Places for a step, between the values that occur."""
    levels = np.unique(x)
    between = (levels[1:] + levels[:-1]) / 2.0
    return between[np.unique(np.linspace(0, len(between) - 1, min(len(between), 120)).astype(int))]


def sines(x: Array) -> tuple[Array, Array]:
    """Sine and cosine of every period that a covariate may show, ``(periods, 2, n)``, and the periods."""
    span = float(np.ptp(x))
    frequency = np.arange(1.0, min(len(np.unique(x)) / 2.0, MOST_PERIODS / 3.0), 1.0 / 3.0) / span
    angle = 2.0 * np.pi * frequency[:, None] * (x - x.min())
    return np.stack([np.sin(angle), np.cos(angle)], axis=1), 1.0 / frequency


def goes_both_ways(data: Residuals) -> bool:
    """Whether enough touches were made each way to tell the ways apart."""
    way = data.probings.way()
    return bool(min((way > 0).sum(), (way < 0).sum()) >= FEWEST_BACK * len(data))


def _length_forms(data: Residuals) -> Iterator[Family]:
    """Lengths along the gauge, or along machine axes, that grow with a speed, a temperature, any further column."""
    for covariate in covariates(data):
        if covariate.name != "speed" and not covariate.further:
            continue
        u = (covariate.values - covariate.values.mean()) / np.ptp(covariate.values)
        for side in ("gauge", *axes_shown(data)):
            length = length_mm(side, data)
            columns = u * length / np.ptp(length) * mask(data, side)
            yield make_form(GROWING_LENGTH, covariate.name, side, columns[None, None], data)


def _memory_forms(data: Residuals) -> Iterator[Family]:
    """What every rest adds and every touch wears off a part of, to a level that is a constant along the approach."""
    if not data.has_time:
        return
    rested = np.array([data.probings.rested(touches) for touches in FADING])[:, None]
    for side, columns in (("approach", np.concatenate([rested, np.ones_like(rested)], axis=1)), ("gauge", rested)):
        form = make_form(MEMORY, REST, side, columns * mask(data, side), data)
        yield replace(form, details=form.details | {"atoms": FADING, "unit": "touches"})


def _way_forms(data: Residuals) -> Iterator[Family]:
    """What differs between the ways there and back: by a constant, or by another shape along the gauge each way."""
    if not goes_both_ways(data):
        return
    way = data.probings.way()
    shape = _bins(data.probings.certified_mm())
    for side in ("approach", "gauge"):
        sided = mask(data, side)
        yield make_form("offset", WAY, side, (way * sided)[None, None], data)
        yield make_form("loop", WAY, side, (np.vstack([shape, way, way * shape]) * sided)[None], data)


def _side_forms(data: Residuals) -> Iterator[Family]:
    """Fronts and backs each with a curve of their own along the gauge."""
    x = data.probings.certified_mm()
    u = (x - x.mean()) / max(float(np.ptp(x)), 1e-9) * 2.0
    curve = np.array([u, u**2, u**3])
    columns = np.vstack([curve * (data.side > 0), curve * (data.side < 0), data.side > 0])
    yield make_form("two curves", "position", "approach", columns[None].astype(float), data)


def runs_of(data: Residuals) -> tuple[NDArray[np.int64], NDArray[np.intp]]:
    """Placement and cycle of every run along the gauge, ``(r, 2)``, and the run of every row."""
    numbers, run = np.unique(data.frame[["placement", "cycle"]].to_numpy(), axis=0, return_inverse=True)
    return numbers, run.ravel()


def _cycle_forms(data: Residuals) -> Iterator[Family]:
    """A level of its own for every cycle of every placement; one cycle with a level or a length of its own."""
    numbers, run = runs_of(data)
    count = len(numbers)
    if not 2 < count < len(data) / FEWEST_IN_CYCLE:
        return
    columns = (run == np.arange(count)[:, None]).astype(float)
    position = data.probings.certified_mm()
    length = (position - position.mean()) / np.ptp(position)
    places = {"atoms": np.arange(count), "names": [f"{cycle} of placement {placing}" for placing, cycle in numbers]}
    for side in ("approach", "gauge"):
        if data.placement.max() > 0:
            free = columns[:-1] if side == "gauge" else columns  # origins of the placements lie along the gauge
            yield make_form("levels", "cycle", side, (free * mask(data, side))[None], data)
        odd = make_form("odd cycle", "cycle", side, (columns * mask(data, side))[:, None], data)
        yield replace(odd, details=odd.details | places)
    odd = make_form("odd length", "cycle", "gauge", (columns * length * data.side)[:, None], data)
    yield replace(odd, details=odd.details | places)


def _placement_forms(data: Residuals) -> Iterator[Family]:
    """Differences between placements that are no matter of their origins: in the mean along the approach."""
    count = int(data.placement.max()) + 1
    if count > 1:
        columns = (data.placement == np.arange(count)[:, None]).astype(float)
        yield make_form("level", "placement", "approach", columns[None], data)


def _azimuth_forms(data: Residuals) -> Iterator[Family]:
    """Harmonics of the approach's azimuth about the stylus."""
    c, s = data.probings.lateral_share()
    azimuth = np.arctan2(s, c)
    directions = len(np.unique(np.round(azimuth, 3)))
    if directions > 2:
        orders = np.arange(1, min(HARMONICS, directions // 2) + 1)[:, None]
        columns = np.concatenate([np.cos(orders * azimuth), np.sin(orders * azimuth)])
        yield make_form("harmonics", "azimuth", "approach", columns[None], data)
