"""Forms that depend on what went before: lags, rests, directions of travel, hysteresis."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from stepgauge.diagnosis.covariates import NAMES, REST, WAY, Covariate, axes_shown, standard
from stepgauge.diagnosis.gaussian_processes.periodic import FINER, wave_sides
from stepgauge.diagnosis.gaussian_processes.random_function import (
    HYSTERESIS,
    LAGGED,
    LENGTH,
    LOOP,
    RESTS,
    SMOOTH,
    TREND,
    RandomFunction,
    sides_of,
)
from stepgauge.diagnosis.laws.grids import FEWEST_BACK
from stepgauge.diagnosis.priors import Priors
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.diagnosis.unobserved_inputs import principal, shifts
from stepgauge.effects.probings import followed
from stepgauge.files.arrays import Array
from stepgauge.inference.kernels import matern

HELD = np.geomspace(0.03, 0.6, 7)
"""Ways on which friction holds back what moves, over the span of the travel."""
PLACES, FEWER = (0.15, 0.5), 2
"""Correlation lengths of friction that differs along the travel, over its span; every second way is enough."""
KEPT = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 13.0, 16.0, 20.0)
"""Touches over which a rest is forgotten."""


def lagged(
    told: Sequence[Covariate], position: Covariate | None, data: Residuals, priors: Priors
) -> Iterator[RandomFunction]:
    """Recorded columns that act through a lag, and length errors proportional to them."""
    length = None if position is None else position.standard
    for one in told:
        if one.name == "speed" and length is not None:
            grown = [(length * one.standard)[None]]
            yield RandomFunction(
                one.name, one.unit, LENGTH, grown, (0.0,), ("gauge",), priors.forms.product, "position"
            )
        if not one.further:
            continue
        duration_s = float(np.ptp(data.probings.time_s[: one.known])) if data.has_time else 0.0
        lags = tuple(lag * duration_s for lag in priors.forms.lags) if data.has_time else ()
        if lags:
            yield _following(one, lags, sides_of(one, data), data, priors)
        if length is not None:
            yield _following(one, (0.0, *lags), ("gauge", *axes_shown(data)), data, priors, length)


def _following(
    one: Covariate,
    lags: tuple[float, ...],
    sides: tuple[str, ...],
    data: Residuals,
    priors: Priors,
    length: Array | None = None,
) -> RandomFunction:
    """What follows a column after one of some lags, or one between them; a length error where ``length`` is given."""
    times = np.ones(len(data)) if length is None else length

    def of(lags_s: Sequence[float]) -> Array:
        late = (followed(data.probings.time_s, one.values, (lag_s,))[0] if lag_s else one.values for lag_s in lags_s)
        return np.array([standard(each, one.known)[None] * times for each in late])

    def unread(lag_s: float) -> Array:
        return _unread(one, lag_s, data) * times

    def near(lag_s: float, part: float) -> list[float]:
        step = lags[-1] / lags[-2] if len(lags) > 2 else 1.0
        return (lag_s * step ** (part * np.linspace(-1.0, 1.0, FINER))).tolist()

    shape, odds, beside = LAGGED, priors.forms.lag, ""
    if length is not None:
        shape, odds, beside = LENGTH, priors.forms.product, "position"
    nearer = (partial(near, part=1.0), partial(near, part=2.0 / FINER))
    return RandomFunction(one.name, one.unit, shape, of(lags), lags, sides, odds, beside, of, nearer, unread)


def _unread(one: Covariate, lag_s: float, data: Residuals) -> Array:
    """What the column may have done beside this while nobody read it, ``(p, n)``."""
    if not lag_s:
        return np.zeros((0, len(data)))
    time_s = data.probings.time_s
    spread = max(float(followed(time_s, one.values, (lag_s,))[0][: one.known].std()), 1e-300)
    return principal(shifts(time_s, one.values, lag_s, one.known) / spread, one.known)


def rests(data: Residuals, known: int | None) -> RandomFunction:
    """What friction or a seat keeps of the rests before the last touches, as roots of their times.

    Contacts at rest strengthen with time, but less than in proportion (Rabinowicz, Proc. Phys. Soc. 71, 1958: 668;
    Dieterich, Pure Appl. Geophys. 116, 1978: 790), and a touch wipes out part of that. The root stands for such laws.
    """
    kept = standard(np.array([data.probings.rested(touches)[None] for touches in KEPT]), known)
    return RandomFunction(REST, "s", RESTS, kept, KEPT, ("approach", "gauge"))


def hysteresis(one: Covariate, data: Residuals, priors: Priors) -> Iterator[RandomFunction]:
    """Loops with inner loops: what friction holds back follows once it has been drawn far enough.

    A spring with a slider holds by the way since the last turn, at most by its own way (stop operator); with several
    such ways at once hysteresis of nearly any form results (Prandtl, Z. angew. Math. Mech. 8, 1928: 85; Ishlinskii).
    Where friction is not the same all along, as on a guideway that is worn in its middle, the loops are wider in some
    places (Preisach, Z. Phys. 94, 1935: 277, has them differ from place to place).
    """
    held_um = tuple(max(round(1e3 * way * one.span), 1) for way in HELD.tolist())
    loops = np.array([data.probings.held_mm(NAMES[one.name], um * 1e-3) / (um * 1e-3) for um in held_um])
    sides, alike = wave_sides(one, data), [loops / np.sqrt(len(loops)), *(loop[None] for loop in loops)]
    yield RandomFunction(one.name, one.unit, HYSTERESIS, alike, (held_um, *((um,) for um in held_um)), sides)
    places = [matern(one.values, length) for length in PLACES]
    some, few = loops[::FEWER] / np.sqrt(len(loops[::FEWER])), held_um[::FEWER]
    differing = [(some[:, None] * place).reshape(-1, len(one.values)) for place in places]
    kernels, share = (few,) * len(places), priors.forms.product
    yield RandomFunction(one.name, one.unit, HYSTERESIS, differing, kernels, sides, share, one.name)


def direction_differences(position: Covariate, data: Residuals, priors: Priors) -> Iterator[RandomFunction]:
    """Differences between the directions of travel: a constant, or a separate function along the gauge for each.

    None where the approach is in the direction of travel, as along an axis: functions on its sides are these.
    """
    way = data.probings.way()
    if abs(float((way * data.side).mean())) > 1.0 - 2.0 * FEWEST_BACK:
        return
    loops = [way[None], *(way * matern(position.values, length) for length in priors.forms.lengths)]
    kernels = (TREND, *[SMOOTH] * len(priors.forms.lengths))
    yield RandomFunction(WAY, "", LOOP, loops, kernels, ("approach", "gauge", *axes_shown(data)))
