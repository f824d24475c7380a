"""Forms without a law: random functions of the covariates.

A random function is a Gaussian process; its features are columns whose sum with independent amplitudes of one standard
deviation has the covariance of the process (Rasmussen and Williams, Gaussian Processes for Machine Learning, 2006, sec.
4.2). One candidate contains the kernels with the same description in words: smooth with several correlation lengths, or
rough.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.choices import LIKE_DIRECTIONS, TEMPERATURES, goes_both_ways, share_beside
from stepgauge.diagnosis.covariates import (
    AXES,
    FEWEST_IN_CYCLE,
    REST,
    TOUCHES,
    WAY,
    Covariate,
    axes_shown,
    covariates,
    lives_on,
    mask,
    runs_of,
)
from stepgauge.diagnosis.posterior.priors import Priors
from stepgauge.diagnosis.posterior.problem import Candidate, Law, Smooth
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.effects.probings import followed
from stepgauge.recording import OPTIONAL

Array = NDArray[np.float64]
Shape = Sequence[Array] | Array
"""Features of each kernel, ``(m, n)`` each, or signatures of each period, ``(atoms, d, n)``."""
TREND, SMOOTH, ROUGH, LAGGED, WAVE = "trend", "smooth", "rough", "lagged", "wave"
LENGTH, LEVELS, LOOP, HARMONICS, BEAT = "changing length", "levels", "loop", "harmonics", "beat"
SAWTOOTH = "sawtooth"
PERIODIC = (WAVE, SAWTOOTH)
DECAY = "power law"
EXPONENTS = np.geomspace(0.15, 3.0, 10)
"""Of a decay with the number of touches that is no exponential."""
ROUGH_LENGTHS = (0.015, 0.1)
VOLUME_LENGTHS = (0.25, 0.6)
"""Correlation lengths of what changes with two coordinates, over the span of each."""
KNOTS, ROUGH_KNOTS = 40, 120
OVERTONES = 5
"""Of a wave that is no sine; the k-th has the k-th part of the first's standard deviation."""
PERIODS_PER_SPAN, MOST_PERIODS = 4.0, 40.0
TEETH_PER_SPAN, MOST_TEETH, PHASES = 16.0, 10.0, 16
"""Of a sawtooth, of which the last jump must be as right as the first; its phases are no sums of two."""
FEWEST_DIRECTIONS = 8
WANDERING = ("time", "order")
DRIFTING = (*WANDERING, "cycle")
REPEATING = ("position", "machine x", "machine y", "machine z", *WANDERING)
SAME = 1.0 - 1e-10
"""Correlation from which two covariates count as the same."""


@dataclass(frozen=True)
class Form:
    """Description of a form: ``shape``, its side, its covariate and kernels.

    ``kernels``: for each of its shapes ``trend``, ``smooth`` or ``rough``, a lag in s, or a period.
    """

    covariate: str
    unit: str
    shape: str
    side: str
    kernels: tuple[object, ...]
    beside: str = ""


@dataclass(frozen=True)
class _Said:
    """A form before the choice of a side."""

    covariate: str
    unit: str
    shape: str
    features: Shape
    kernels: tuple[object, ...]
    sides: tuple[str, ...]
    share: float = 1.0
    beside: str = ""


def form_candidates(data: Residuals, priors: Priors, scale_um: float, laws: Collection[str] = ()) -> list[Candidate]:
    """All forms that a recording may show, each on all its possible sides; sizes in proportion to ``scale_um``.

    ``laws``: kinds of laws that are candidates, too; a form that is one of these is none.
    """
    said = [one for one in _said(data, priors) if len(one.features) and one.sides]
    total = sum(one.share for one in said)
    sides = {side: mask(data, side) for one in said for side in one.sides}
    sizes = priors.forms.about(scale_um)
    found: list[Candidate] = []
    one_way = _drifts_one_way(data)
    for one in said:
        odds = float(np.log(priors.forms.odds * one.share / total / len(one.sides)))
        for side in one.sides:
            own = _own(one, side, laws, one_way)
            if not len(own.features):
                continue
            form = Form(own.covariate, own.unit, own.shape, side, own.kernels, own.beside)
            label = f"{one.shape} {one.covariate} {one.beside} {side}"
            if isinstance(own.features, np.ndarray):
                flat = np.full(len(own.features), -np.log(len(own.features)))
                share = sides[side][None]
                found.append(
                    Law(
                        one.covariate,
                        label,
                        False,
                        odds,
                        sizes,
                        form,
                        pattern=own.features,
                        shares=share,
                        log_weight=flat,
                    )
                )
            else:
                features = tuple(_shown(columns * sides[side]) for columns in own.features)
                if all(len(columns) for columns in features):
                    found.append(Smooth(one.covariate, label, False, odds, sizes, form, features=features))
    return found


def _own(one: _Said, side: str, laws: Collection[str], one_way: bool) -> _Said:
    """A form without what a law says as well: that the origin follows a temperature, or drifts.

    An origin moves along a direction of the machine; ``one_way``: one moves all gauges alike.
    """
    follows = one.shape == LAGGED and one.covariate.endswith(TEMPERATURES)
    if follows and side in (*AXES, "gauge") and "thermal_shift" in laws:
        return replace(one, features=(), kernels=())
    drifts = one.covariate in DRIFTING and one.kernels[-1] == TREND and one_way
    if drifts and side == "gauge" and "thermal_drift" in laws:
        return replace(one, features=one.features[:-1], kernels=one.kernels[:-1])
    return one


def _drifts_one_way(data: Residuals) -> bool:
    """Whether a drift along one direction of the machine moves the gauge alike in all placements."""
    machine = np.array([data.probings.approach(axis) for axis in AXES])
    return share_beside(data.side[None], machine) < LIKE_DIRECTIONS


def _shown(columns: Array) -> Array:
    """Features that are not zero on all rows."""
    return columns[np.abs(columns).max(axis=1) > 1e-9]


def _said(data: Residuals, priors: Priors) -> Iterator[_Said]:
    told = _different(covariates(data))
    slow = next((one for one in told if one.name in WANDERING), None)
    position = next((one for one in told if one.name == "position"), None)
    for one in told:
        yield _of_one(one, data, priors)
        if one.name in REPEATING:
            yield _waves(one, data, priors)
            yield _sawteeth(one, data, priors)
        if one.name.startswith(TOUCHES):
            decays = (1.0 + one.values) ** -EXPONENTS[:, None, None]
            yield _Said(one.name, one.unit, DECAY, decays, tuple(EXPONENTS), ("approach", "gauge"))
    yield from _lagged(told, position, data, priors)
    if position is not None and slow is not None:
        yield from _products(position, slow, priors)
    yield from _volumes([one for one in told if one.name.startswith("machine ")], data, priors)
    if position is not None and goes_both_ways(data):
        yield from _of_ways(position, data, priors)
    yield from _levels(data, priors)


def _different(found: Sequence[Covariate]) -> list[Covariate]:
    """Covariates without those that are linear functions of a previous one."""
    kept: list[tuple[Covariate, Array]] = []
    for one in found:
        unit = standard(one.values)
        if all(abs(float(unit @ other)) < SAME * len(unit) for _, other in kept):
            kept.append((one, unit))
    return [one for one, _ in kept]


def standard(values: Array) -> Array:
    """Values minus their mean, over their standard deviation."""
    return np.asarray((values - values.mean()) / max(float(values.std()), 1e-300))


def _sides(one: Covariate, data: Residuals) -> tuple[str, ...]:
    axes = [axis for axis in axes_shown(data) if lives_on(one, axis)]
    return ("approach", "gauge", *axes)


def _of_one(one: Covariate, data: Residuals, priors: Priors) -> _Said:
    """Smooth functions of several lengths, rough ones of covariates such as time, and a trend.

    The trend is the last one: where it is a law's, the numbers of the others stay. A relaxation after a pause
    depends on ratios of its duration: its functions are smooth in the logarithm.
    """
    values = np.log1p(one.values) if one.name == REST or one.name.startswith(TOUCHES) else one.values
    smooth = [matern(values, length) for length in priors.forms.lengths]
    rough = [matern(values, length, rough=True) for length in ROUGH_LENGTHS] if one.name in WANDERING else []
    kernels = (*[SMOOTH] * len(smooth), *[ROUGH] * len(rough), TREND)
    features = [*smooth, *rough, standard(values)[None]]
    share = priors.forms.own_column if one.further and one.name not in OPTIONAL else 1.0
    return _Said(one.name, one.unit, SMOOTH, features, kernels, _sides(one, data), share)


def matern(x: Array, length: float, rough: bool = False) -> Array:
    """Features ``(m, n)`` of a random function of ``x (n,)`` with a correlation length over the span of ``x``.

    Twice differentiable (Matern 5/2), or rough as the path of a random walk (Ornstein and Uhlenbeck).
    """
    u = (x - x.min()) / np.ptp(x)
    levels, most = np.unique(u), ROUGH_KNOTS if rough else KNOTS
    knots = levels if len(levels) <= most else np.linspace(0.0, 1.0, most)
    return np.asarray((_between(u, knots) @ _root(knots.tobytes(), length, rough)).T[::-1])


@lru_cache(maxsize=64)
def _root(knots: bytes, length: float, rough: bool) -> Array:
    """Root of the covariance at knots, which recur from covariate to covariate; do not write to the array."""
    at = np.frombuffer(knots)
    r = np.abs(at[:, None] - at) / length
    root5 = np.sqrt(5.0)
    covariance = np.exp(-r) if rough else (1.0 + root5 * r + 5.0 * r**2 / 3.0) * np.exp(-root5 * r)
    value, vector = np.linalg.eigh(covariance)
    seen = value > 1e-9 * value[-1]
    found = vector[:, seen] * np.sqrt(value[seen])
    found.flags.writeable = False
    return found


def _between(u: Array, knots: Array) -> Array:
    """Matrix ``(n, m)`` that interpolates values at knots."""
    i = np.clip(np.searchsorted(knots, u, side="right") - 1, 0, len(knots) - 2)
    share = (u - knots[i]) / (knots[i + 1] - knots[i])
    weight = np.zeros((len(u), len(knots)))
    weight[np.arange(len(u)), i] = 1.0 - share
    weight[np.arange(len(u)), i + 1] += share
    return weight


def _waves(one: Covariate, data: Residuals, priors: Priors) -> _Said:
    """Periodic functions of any shape: a fundamental and its harmonics."""
    span, turns = float(np.ptp(one.values)), _turns(one, MOST_PERIODS, PERIODS_PER_SPAN)
    first = np.exp(2j * np.pi * turns[:, None] * ((one.values - one.values.min()) / span))
    overtones = [first]
    while len(overtones) < OVERTONES:  # a product is ten times as fast as another sine and cosine
        overtones.append(overtones[-1] * first)
    shrunk = np.stack(overtones, axis=1) / np.arange(1, OVERTONES + 1)[:, None]
    waves = np.concatenate([shrunk.imag, shrunk.real], axis=1)
    return _Said(one.name, one.unit, WAVE, waves, tuple(span / turns), _wave_sides(one, data), priors.forms.wave)


def _turns(one: Covariate, most: float, per_span: float) -> Array:
    """Numbers of periods over a covariate that are tried, ``(f,)``, so many to one period over its span."""
    return np.arange(2.0, min(one.steps / 4.0, most), 1.0 / per_span)


def _sawteeth(one: Covariate, data: Residuals, priors: Priors) -> _Said:
    """What creeps and is thrown back, over and over: a control with hysteresis, a table that is applied in steps."""
    span, turns = float(np.ptp(one.values)), _turns(one, MOST_TEETH, TEETH_PER_SPAN)
    phases = np.arange(PHASES) / PHASES
    passed = turns[:, None, None] * ((one.values - one.values.min()) / span) + phases[:, None]
    teeth = (passed % 1.0 - 0.5) * np.sqrt(12.0)
    shapes = tuple((span / f, phase) for f in turns.tolist() for phase in phases.tolist())
    sides = tuple(side for side in _wave_sides(one, data) if side != "approach")  # no probe does that
    return _Said(one.name, one.unit, SAWTOOTH, teeth.reshape(-1, 1, len(data)), shapes, sides, priors.forms.wave)


def _wave_sides(one: Covariate, data: Residuals) -> tuple[str, ...]:
    """A periodic function of a machine axis acts along this axis; one of time on all sides."""
    if one.name.startswith("machine "):
        own = one.name[-1]
        return (own,) if own in axes_shown(data) else ()
    return ("gauge",) if one.name == "position" else ("approach", "gauge", *axes_shown(data))


def _lagged(told: Sequence[Covariate], position: Covariate | None, data: Residuals, priors: Priors) -> Iterator[_Said]:
    """Recorded columns that act through a lag, and length errors proportional to them."""
    length = None if position is None else standard(position.values)
    for one in told:
        if one.name == "speed" and length is not None:
            grown = [(length * standard(one.values))[None]]
            yield _Said(one.name, one.unit, LENGTH, grown, (0.0,), ("gauge",), priors.forms.product, "position")
        if not one.further:
            continue
        lags = tuple(float(lag * _duration_s(data)) for lag in priors.forms.lags) if data.has_time else ()
        late = [standard(value)[None] for value in (followed(data.probings.time_s, one.values, lags) if lags else ())]
        if late:
            yield _Said(one.name, one.unit, LAGGED, late, lags, _sides(one, data), priors.forms.lag)
        if length is None:
            continue
        grown = [value * length for value in [standard(one.values)[None], *late]]
        sides = ("gauge", *axes_shown(data))
        yield _Said(one.name, one.unit, LENGTH, grown, (0.0, *lags), sides, priors.forms.product, "position")


def _duration_s(data: Residuals) -> float:
    return float(np.ptp(data.frame["time_s"].to_numpy(float)))


def _products(position: Covariate, slow: Covariate, priors: Priors) -> Iterator[_Said]:
    """Length errors and periodic errors along the gauge that change with time or order."""
    both, share = ("approach", "gauge"), priors.forms.product
    length = standard(position.values)
    changing = [matern(slow.values, at) * (length - zero) for at in priors.forms.lengths[1:3] for zero in
                (0.0, length.min(), length.max())]  # fmt: skip
    yield _Said(slow.name, slow.unit, LENGTH, changing, (SMOOTH,) * len(changing), both, share, "position")
    surface = [_product(matern(position.values, a), matern(slow.values, b)) for a, b in ((0.15, 0.08), (0.3, 0.25))]
    yield _Said(slow.name, slow.unit, SMOOTH, surface, (SMOOTH, SMOOTH), both, share, "position")
    of_x, of_y = np.arange(1.0, 6.1, 0.5), np.arange(1.0, 8.1, 0.5)
    beats = _beats(position.values, slow.values, of_x, of_y)
    spans = float(np.ptp(position.values)), float(np.ptp(slow.values))
    periods = tuple((spans[0] / f, spans[1] / g) for f in of_x.tolist() for g in of_y.tolist())
    yield _Said(slow.name, slow.unit, BEAT, beats, periods, both, share, "position")


def _volumes(places: Sequence[Covariate], data: Residuals, priors: Priors) -> Iterator[_Said]:
    """Errors of the volume: smooth functions of two coordinates together, as of a spoilt corner."""
    sides, share = ("gauge", *axes_shown(data)), priors.forms.product
    for one, other in combinations(places, 2):
        surface = [_product(matern(one.values, length), matern(other.values, length)) for length in VOLUME_LENGTHS]
        yield _Said(one.name, one.unit, SMOOTH, surface, (SMOOTH,) * len(surface), sides, share, other.name)


def _product(one: Array, other: Array, most: int = 200) -> Array:
    """Products of features, without negligible ones."""
    both = (one[:, None] * other[None]).reshape(-1, one.shape[1])
    return both[np.argsort(-(both**2).sum(axis=1))[:most]]


def _beats(x: Array, y: Array, of_x: Array, of_y: Array) -> Array:
    """Products of sines and cosines in two covariates, ``(f g, 4, n)``; ``of_x (f,)``, ``of_y (g,)``: their turns."""
    first, second = _oscillations(x, of_x), _oscillations(y, of_y)
    return np.asarray((first[:, None, :, None] * second[None, :, None]).reshape(-1, 4, len(x)))


def _oscillations(values: Array, turns: Array) -> Array:
    """Sines and cosines with so many turns over the span, ``(f, 2, n)``."""
    angle = 2.0 * np.pi * turns[:, None] * (values - values.min()) / np.ptp(values)
    return np.stack([np.sin(angle), np.cos(angle)], axis=1)


def _of_ways(position: Covariate, data: Residuals, priors: Priors) -> Iterator[_Said]:
    """Differences between the directions of travel: a constant, or a separate function along the gauge for each."""
    way = data.probings.way()
    loops = [way[None], *(way * matern(position.values, length) for length in priors.forms.lengths)]
    kernels = (TREND, *[SMOOTH] * len(priors.forms.lengths))
    yield _Said(WAY, "", LOOP, loops, kernels, ("approach", "gauge", *axes_shown(data)))


def _levels(data: Residuals, priors: Priors) -> Iterator[_Said]:
    """Separate levels of cycles, faces, placements; harmonics of the azimuth of the approach about the stylus."""
    both = ("approach", "gauge")
    run = runs_of(data)[1]
    if 1 < run.max() < len(data) / FEWEST_IN_CYCLE:
        yield _Said("cycle", "", LEVELS, [_indicators(run)], (LEVELS,), both)
        if (position := data.probings.certified_mm()).std() > 0.0:
            lengths = [_indicators(run) * standard(position)]
            yield _Said("cycle", "", LENGTH, lengths, (LEVELS,), ("gauge",), priors.forms.product, "position")
    if data.group.max() < len(data) / 2:
        yield _Said("face", "", LEVELS, [_indicators(data.group)], (LEVELS,), both)
    if data.placement.max() > 0:
        yield _Said("placement", "", LEVELS, [_indicators(data.placement)], (LEVELS,), ("approach",))
    c, s = data.probings.lateral_share()
    azimuth = np.arctan2(s, c)
    if len(np.unique(azimuth.round(3))) >= FEWEST_DIRECTIONS:
        orders = [np.array([np.cos(k * azimuth), np.sin(k * azimuth)]) for k in range(2, 7)]
        yield _Said("azimuth", "rad", HARMONICS, [*orders, np.vstack(orders) / 2.0], tuple(range(2, 8)), ("approach",))


def _indicators(index: NDArray[np.intp]) -> Array:
    return (index == np.arange(index.max() + 1)[:, None]).astype(float)
