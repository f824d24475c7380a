"""All random functions that a recording may show, as candidates with their priors.

One candidate contains the kernels with the same description in words: smooth with several correlation lengths, or
rough.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.covariates import (
    AXES,
    FEWEST_IN_CYCLE,
    REST,
    Covariate,
    covariates,
    is_usable,
    mask,
    runs_of,
    standard,
)
from stepgauge.diagnosis.gaussian_processes.memory import direction_differences, hysteresis, lagged, rests
from stepgauge.diagnosis.gaussian_processes.periodic import beats, sawteeth, waves
from stepgauge.diagnosis.gaussian_processes.random_function import (
    DRIFTING,
    HARMONICS,
    LAGGED,
    LENGTH,
    LEVELS,
    ROUGH,
    TREND,
    WANDERING,
    RandomFunction,
    changing,
    functions,
    volumes,
)
from stepgauge.diagnosis.laws.grids import goes_both_ways
from stepgauge.diagnosis.priors import Priors
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.effects.grids import TEMPERATURES
from stepgauge.effects.probe import LIKE_DIRECTIONS, share_beside
from stepgauge.files.arrays import Array
from stepgauge.inference.problem import AmplitudePrior, Candidate, GaussianProcess, Law

FEWEST_DIRECTIONS = 8
FEWEST_OF_A_LEVEL = 3
"""Readings of a face, on average: of two, as many unknowns would be fitted as readings are left to tell of them."""
REPEATING = ("position", "machine x", "machine y", "machine z", *WANDERING)
SAME = 1.0 - 1e-10
"""Correlation from which two covariates count as the same."""


def random_function_candidates(
    data: Residuals,
    priors: Priors,
    scale_um: float,
    laws: Collection[str] = (),
    known: int | None = None,
    finer: float = 0.0,
) -> list[Candidate]:
    """All random functions that a recording may show, each on all its possible sides.

    ``scale_um``: their sizes are in proportion to it. ``laws``: kinds of laws that are candidates, too; a function that
    is one of these is none. ``known``: the number of rows that are measured, if others may follow: the shapes have the
    numbers that they have in these rows. ``finer``: prior odds of periods that are too short to be candidates; in them
    each face has an amount of its own.
    """
    every = [one for one in _every(data, priors, known) if len(one.features) and one.sides]
    total = sum(one.share for one in every)
    sides = {side: mask(data, side) for one in every for side in one.sides}
    sizes = priors.forms.about(scale_um)
    machine = np.array([data.probings.approach(axis) for axis in AXES])
    one_way = share_beside(data.side[None], machine) < LIKE_DIRECTIONS
    found: list[Candidate] = []
    for one in every:
        odds = float(np.log(priors.forms.odds * one.share / total / len(one.sides)))
        for i, side in enumerate(one.sides):
            if any(np.array_equal(sides[side], sides[other]) for other in one.sides[i + 1 :]):
                continue  # one way is one side
            own = _own(one, side, laws, one_way)
            by_face = (one.covariate, one.shape, side) == ("face", LEVELS, "gauge")
            if len(own.features):
                own_odds = float(np.logaddexp(odds, np.log(finer))) if by_face and finer else odds
                found += _candidate(own, side, sides[side], own_odds, sizes, data)
    return found


def _candidate(
    one: RandomFunction, side: str, share: Array, odds: float, sizes: AmplitudePrior, data: Residuals
) -> Iterator[Candidate]:
    """A function on one side; none where nothing of it is seen."""
    function = replace(one, side=side, features=())
    label = f"{one.shape} {one.covariate} {one.beside} {side}"
    if isinstance(one.features, np.ndarray):
        flat = np.full(len(one.features), -np.log(len(one.features)))
        yield Law(
            one.covariate,
            label,
            False,
            odds,
            sizes,
            function,
            pattern=one.features,
            shares=share[None],
            log_weight=flat,
            refine=partial(one.refined, data, share) if one.near else None,
            discrepancy=one.unread and partial(_beside, one, share),
        )
        return
    moved = [columns * share for columns in one.features]
    features = tuple(columns[np.abs(columns).max(axis=1) > 1e-9] for columns in moved)
    if all(len(columns) for columns in features):
        rough = ROUGH in one.kernels and one.covariate not in WANDERING
        yield GaussianProcess(one.covariate, label, False, odds, sizes, function, features=features, rough=rough)


def _beside(one: RandomFunction, share: Array, atom: int) -> Array:
    """What a shape of a function may do beside its signature, ``(p, n)``."""
    assert one.unread is not None
    return one.unread(one.kernels[atom]) * share


def _own(one: RandomFunction, side: str, laws: Collection[str], one_way: bool) -> RandomFunction:
    """A function without what a law says as well: that the origin follows a temperature, or drifts.

    An origin moves along a direction of the machine; ``one_way``: that moves the gauge alike in all placements.
    """
    follows = one.covariate.endswith(TEMPERATURES) and side in (*AXES, "gauge") and "thermal_shift" in laws
    drifts = one.covariate in DRIFTING and side == "gauge" and one_way and "thermal_drift" in laws
    if follows and one.shape == LAGGED:
        return replace(one, features=(), kernels=())
    if (follows or drifts) and one.kernels[-1] == TREND:
        return replace(one, features=one.features[:-1], kernels=one.kernels[:-1])
    return one


def _every(data: Residuals, priors: Priors, known: int | None) -> Iterator[RandomFunction]:
    measured = (replace(one, known=known) for one in covariates(data))
    told = _different([one for one in measured if is_usable(one)])
    slow = next((one for one in told if one.name in WANDERING), None)
    position = next((one for one in told if one.name == "position"), None)
    axes = [one for one in told if one.name.startswith("machine ")]
    for one in told:
        yield functions(one, data, priors)
        if one.name in REPEATING:
            yield waves(one, data, priors)
            yield sawteeth(one, data, priors)
    yield from lagged(told, position, data, priors)
    if any(one.name == REST for one in told):
        yield rests(data, known)
    if position is not None and slow is not None:
        yield from changing(position, slow, priors)
        yield beats(position, slow, data, priors)
    yield from volumes(axes, data, priors)
    if position is not None and goes_both_ways(data):
        yield from direction_differences(position, data, priors)
        for one in (position, *axes):
            yield from hysteresis(one, data, priors)
    yield from _levels(data, priors)


def _different(found: Sequence[Covariate]) -> list[Covariate]:
    """Covariates without those that are linear functions of a previous one."""
    kept: list[tuple[Covariate, Array]] = []
    for one in found:
        unit = standard(one.values)
        if all(abs(float(unit @ other)) < SAME * len(unit) for _, other in kept):
            kept.append((one, unit))
    return [one for one, _ in kept]


def _levels(data: Residuals, priors: Priors) -> Iterator[RandomFunction]:
    """Separate levels of cycles, faces, placements; harmonics of the azimuth of the approach about the stylus."""
    both = ("approach", "gauge")
    run = runs_of(data)[1]
    if 1 < run.max() < len(data) / FEWEST_IN_CYCLE:
        yield RandomFunction("cycle", "", LEVELS, [_indicators(run)], (LEVELS,), both)
        if (position := data.probings.certified_mm()).std() > 0.0:
            lengths = [_indicators(run) * standard(position)]
            yield RandomFunction("cycle", "", LENGTH, lengths, (LEVELS,), ("gauge",), priors.forms.product, "position")
    met = data.group  # a target is one from both sides, where a face is met from its own
    if data.probings.setting.recording in ("linear", "rotary"):
        met = np.unique(data.probings.certified_mm(), return_inverse=True)[1].ravel()
    if (met.max() + 1) * FEWEST_OF_A_LEVEL <= len(data):
        yield RandomFunction("face", "", LEVELS, [_indicators(met)], (LEVELS,), both)
    if data.placement.max() > 0:
        yield RandomFunction("placement", "", LEVELS, [_indicators(data.placement)], (LEVELS,), ("approach",))
    c, s = data.probings.lateral_share()
    azimuth = np.arctan2(s, c)
    if len(np.unique(azimuth.round(3))) >= FEWEST_DIRECTIONS:
        orders = [np.array([np.cos(k * azimuth), np.sin(k * azimuth)]) for k in range(2, 7)]
        yield RandomFunction(
            "azimuth", "rad", HARMONICS, [*orders, np.vstack(orders) / 2.0], tuple(range(2, 8)), ("approach",)
        )


def _indicators(index: NDArray[np.intp]) -> Array:
    return (index == np.arange(index.max() + 1)[:, None]).astype(float)
