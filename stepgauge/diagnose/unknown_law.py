"""Structure without a known law as ``empirical`` effects: the form that was described, with fitted coefficients.

The formula is what is fitted: every term is evaluated by the effect that will stand in the machine file, so that the
simulation repeats exactly what was fitted here.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from stepgauge.diagnose.corners import SHAPES, Corners, formula
from stepgauge.diagnose.forms import (
    AXES,
    BINS,
    CHANGING_LENGTHS,
    COLUMN,
    GROWING,
    GROWING_LENGTH,
    HARMONICS,
    ISOLATED,
    MEMORY,
    TOUCHES,
    TURNING,
    WAY,
    along_mm,
    axes_shown,
    covariates,
    form_families,
    lives_on,
    make_form,
    mask,
    pause_of,
    runs_of,
    sines,
)
from stepgauge.diagnose.residuals import Residuals
from stepgauge.diagnose.result import Diagnosis, Located
from stepgauge.diagnose.solve import Estimate
from stepgauge.diagnose.whitening import Whitening, make_whitening
from stepgauge.effects import along_approach_um
from stepgauge.effects.empirical import RESTED, Empirical, formula_name
from stepgauge.recording import APPROACH

Array = NDArray[np.float64]
NAMES = {
    "position": "position_mm",
    "machine x": "x_mm",
    "machine y": "y_mm",
    "machine z": "z_mm",
    "time": "time_s",
    "order": "row",
    TURNING: "turning_mm",
    "speed": "speed_mm_s",
    "direction of travel": "way",
    "rest before the touch": "rest_s",
}
"""Name of a covariate in a formula, where it differs."""
PLACED = ("power", "decay", "decay to a level", "step", MEMORY)
"""Forms that stand at a place, or have a power."""
MASK = {"approach": "", "gauge": "side * ", "front": "step(side) * ", "back": "step(-side) * "}
MASK |= {axis: f"{column} * " for axis, column in zip(AXES, APPROACH, strict=True)}
TERMS_PER_FORMULA = 6
"""Longer sums become several effects: a formula is meant to be read."""
SECOND_FORM_P = 1e-4
"""A further form enters only where chance gains as much less often than this."""
KNOTS = (8, 16, 32)
"""Bends of a wandering to try."""
UNSEEN = 1e-6
"""Share of a term that must be left once the origins of the placements are fitted."""
FINER = 20
"""Points to each side of the best period at which it is looked for again, within one step of the grid."""


@dataclass(frozen=True)
class UnknownLaw:
    """A described form and the effects that imitate it.

    ``estimates``: coefficients by name with their standard uncertainties, um or um per unit of the term they stand
    before; ``share_um (n,)``: along the approach; ``period`` in the covariate's unit, where it repeats.
    """

    located: Located
    side: str
    effects: tuple[Empirical, ...]
    estimates: dict[str, Estimate]
    share_um: Array
    period: float | None = None


def model_unknown(diagnosis: Diagnosis) -> list[UnknownLaw]:
    """Laws for what a diagnosis could not name, the clearest form first, further ones where they add something.

    They are fitted to what the named laws leave. Empty where nothing is unexplained, or where its covariate cannot be
    named in a formula.
    """
    if not diagnosis.unexplained:
        return []
    whitening = make_whitening(diagnosis.data, diagnosis.noise.by_row_um)
    return _laws(diagnosis, whitening, diagnosis.after_um)


def rest_um(diagnosis: Diagnosis, laws: Sequence[UnknownLaw]) -> Array:
    """Residuals when all that is modelled is taken out, and with it the mean origin of every placement, um."""
    data = diagnosis.data
    if not laws:
        return diagnosis.after_um
    return data.without_origins(diagnosis.after_um - np.sum([law.share_um for law in laws], axis=0))


def rest_rms_um(diagnosis: Diagnosis, laws: Sequence[UnknownLaw]) -> float:
    """Their rms over all rows with weight, um."""
    rest = rest_um(diagnosis, laws)[np.isfinite(diagnosis.noise.by_row_um)]
    return float(np.sqrt((rest**2).mean()))


def _laws(diagnosis: Diagnosis, whitening: Whitening, left: Array) -> list[UnknownLaw]:
    laws: list[UnknownLaw] = []
    for located in diagnosis.unexplained:
        law, gain = _best_law(located, diagnosis.data, whitening, left)
        if law is not None and (not laws or stats.chi2.sf(gain, len(law.estimates)) < SECOND_FORM_P):
            laws.append(law)
            left = left - law.share_um
    return laws


def _best_law(
    located: Located, data: Residuals, whitening: Whitening, left_um: Array
) -> tuple[UnknownLaw | None, float]:
    """The law on the side that explains most, and what it takes off chi-square."""
    best, best_gain, worth = None, -1.0, -np.inf
    price = np.log(max(whitening.dof, 2))
    for side in _sides(located, data):
        for terms, period in _candidates(located, side, data, whitening, left_um):
            fitted = _fit(terms, data, whitening, left_um)
            if fitted.terms and fitted.gain - price * len(fitted.terms) > worth:
                worth = fitted.gain - price * len(fitted.terms)
                best, best_gain = _law(located, side, fitted, period), fitted.gain
    return best, best_gain


@dataclass(frozen=True)
class _Fitted:
    terms: tuple[str, ...]
    coefficients: Array
    u: Array
    gain: float
    share_um: Array


def _fit(terms: Sequence[str], data: Residuals, whitening: Whitening, left_um: Array) -> _Fitted:
    """Least squares of the whitened residual on whitened terms; those that only move an origin are left out."""
    columns = np.array([_column(term, data) for term in terms])
    white, target = whitening(columns).T, whitening(left_um)
    seen = np.linalg.norm(white, axis=0) > UNSEEN * np.linalg.norm(columns * whitening.inverse_sigma, axis=1)
    terms, columns, white = [t for t, keep in zip(terms, seen, strict=True) if keep], columns[seen], white[:, seen]
    coefficients = np.asarray(np.linalg.lstsq(white, target, rcond=1e-9)[0], float)
    u = np.asarray(np.sqrt(np.maximum(np.diag(np.linalg.pinv(white.T @ white)), 0.0)), float)
    rest = target - white @ coefficients
    share = np.asarray(coefficients @ columns, float)
    return _Fitted(tuple(terms), coefficients, u, float(target @ target - rest @ rest), share)


def _column(term: str, data: Residuals) -> Array:
    um = along_approach_um(Empirical(formula=term), data.probings)
    return np.broadcast_to(um, (len(data),)).astype(float)


def _law(located: Located, side: str, fitted: _Fitted, period: float | None) -> UnknownLaw:
    named = [
        (f"c{i}", term, float(c)) for i, (term, c) in enumerate(zip(fitted.terms, fitted.coefficients, strict=True), 1)
    ]
    effects = []
    for first in range(0, len(named), TERMS_PER_FORMULA):
        part = named[first : first + TERMS_PER_FORMULA]
        formula = " + ".join(f"{name} * {term}" for name, term, _ in part)
        effects.append(Empirical(formula=formula, coefficients={name: float(f"{c:.12g}") for name, _, c in part}))
    estimates = {name: Estimate(c, float(u), "um") for (name, _, c), u in zip(named, fitted.u, strict=True)}
    return UnknownLaw(located, side, tuple(effects), estimates, fitted.share_um, period)


def _sides(located: Located, data: Residuals) -> list[str]:
    """Where a form may move the readings, as far as it was told."""
    if located.side != "both":
        return [located.side]
    if located.form in CHANGING_LENGTHS:
        return ["gauge", *axes_shown(data)]
    if located.form in SHAPES:  # what swings in time may move one axis alone
        return ["approach", "gauge", *axes_shown(data)]
    found = [one for one in covariates(data) if one.name == located.covariate]
    return ["approach", "gauge", *(axis for axis in axes_shown(data) if any(lives_on(one, axis) for one in found))]


def _candidates(
    located: Located, side: str, data: Residuals, whitening: Whitening, left_um: Array
) -> Iterator[tuple[list[str], float | None]]:
    """Terms to try for a form on one side, with the period where it has one."""
    mask = MASK[side]
    if located.form in (GROWING, ISOLATED):
        return
    if located.covariate == WAY:
        position = data.probings.certified_mm()
        loop = [*_stairs("position_mm", position), *(f"way * {term}" for term in _stairs("position_mm", position))]
        yield [mask + term for term in (loop if located.form == "loop" else ["way"])], None
    elif located.form == "two curves":
        yield _two_curves(data), None
    elif located.form == "levels":
        yield [mask + term for term in _levels(data)], None
    elif located.form in ("odd cycle", "odd length"):
        place = _place(located, side, data, whitening, left_um)
        if np.isfinite(place):
            own = f"{mask}{_levels(data)[int(place)]}"
            yield [own if located.form == "odd cycle" else f"{own} * {_length(side, data)}"], None
    elif located.form == "offset":
        yield [f"{mask}1"], None
    elif located.form == "harmonics":
        yield [mask + term for term in _harmonics(data)], None
    elif located.form == "level":
        numbers = np.unique(data.frame["placement"].to_numpy())
        yield [f"{mask}(abs(placement - {n:g}) < 0.5)" for n in numbers], None
    else:
        yield from _of_covariate(located, side, data, whitening, left_um)


def _of_covariate(
    located: Located, side: str, data: Residuals, whitening: Whitening, left_um: Array
) -> Iterator[tuple[list[str], float | None]]:
    name = _column_name(located.covariate)
    x = next((c.values for c in covariates(data) if c.name == located.covariate), None)
    if x is None or name is None:
        return
    mask, middle = MASK[side], float(x.mean())
    centred = f"{mask}({name} - {middle:.12g})"
    place = _place(located, side, data, whitening, left_um)
    one_term = {
        "trend": centred,
        GROWING_LENGTH: f"{centred} * {_length(side, data)}",
        "power": f"{mask}max({name}, 0.1)**{place:.12g}",
        "decay": f"{mask}(1 + {name})**(-{place:.12g})",
        "step": f"{mask}step({name} - {place:.12g})",
    }
    if np.isnan(place) and located.form in PLACED:
        return
    if located.form in one_term:
        yield [one_term[located.form]], None
    elif located.form == "decay to a level":
        yield [one_term["decay"], f"{mask}1"], None
    elif located.form == MEMORY:
        yield [f"{mask}{RESTED}_{place:.0f}", f"{mask}1"], None
    elif located.form == "bow":
        yield [centred, f"{centred}**2"], None
    elif located.form in ("wander", "changing scale"):
        times = f"{mask}{_length(side, data)} * " if located.form == "changing scale" else mask
        yield from (([times + ramp for ramp in _ramps(name, x, knots)], None) for knots in KNOTS)
    elif located.form in ("period", *SHAPES):
        yield from _repeating(located, side, name, x, data, whitening, left_um)
    else:
        yield [mask + term for term in _stairs(name, x)], None


def _column_name(covariate: str) -> str | None:
    """Name of a covariate in a formula, None where a formula cannot name it."""
    if covariate.startswith(TOUCHES):
        return f"touches_{pause_of(covariate)}"
    return NAMES.get(covariate) or formula_name(covariate.removeprefix(COLUMN))


def _place(located: Located, side: str, data: Residuals, whitening: Whitening, left_um: Array) -> float:
    """Where a step is, or the power, as far as the grid of the forms knows; NaN for a form without one."""
    target = whitening(left_um)
    for family in form_families(data):
        atoms = family.details.get("atoms")
        same = family.covariate == located.covariate and family.details["form"] == located.form
        if same and family.details["side"] == side and atoms is not None:
            gains = [_gain(whitening(columns), target) for columns in family.columns]
            return float(atoms[int(np.argmax(gains))])
    return float("nan")


def _gain(white: Array, target: Array) -> float:
    rest = target - white.T @ np.linalg.lstsq(white.T, target, rcond=1e-9)[0]
    return float(target @ target - rest @ rest)


def _repeating(
    located: Located, side: str, name: str, x: Array, data: Residuals, whitening: Whitening, left_um: Array
) -> Iterator[tuple[list[str], float]]:
    """Terms for what repeats in a covariate ``x (n,)``, which has a ``name`` in formulas, and the period."""
    share, target = mask(data, side), whitening(left_um)
    if located.period is not None:
        family = make_form(located.form, located.covariate, side, share[None, None], data)
        waves = Corners([family], family, x, share)
        for period, ahead in waves.about(located.form, located.period, target, whitening):
            yield [MASK[side] + formula(located.form, name, period, ahead)], period
        return
    columns, periods = sines(x)
    strongest = float(periods[np.argmax([_gain(whitening(pair * share), target) for pair in columns])])
    for period in _finer(strongest, x):
        angle = f"(2 * pi * {name} / {period:.12g})"
        yield [f"{MASK[side]}sin{angle}", f"{MASK[side]}cos{angle}"], period


def _finer(period: float, x: Array) -> Array:
    """Periods about the best of the grid, which is one third of a cycle over the span wide."""
    step = 1.0 / (3.0 * float(np.ptp(x)))
    frequency = 1.0 / period + np.linspace(-step, step, 2 * FINER + 1)
    return 1.0 / frequency[frequency > 0.1 * step]


def _length(side: str, data: Residuals) -> str:
    """The same in a formula."""
    name = f"{side}_mm" if side in AXES else "position_mm"
    return f"({name} - {float(along_mm(side, data).mean()):.12g})"


def _ramps(name: str, x: Array, knots: int) -> list[str]:
    """A line that may bend at evenly spaced places."""
    at = np.linspace(x.min(), x.max(), knots)[:-1]
    return ["1", *(f"max({name} - {place:.12g}, 0)" for place in at)]


def _two_curves(data: Residuals) -> list[str]:
    u = f"(position_mm - {float(data.probings.certified_mm().mean()):.12g})"
    powers = [u, f"{u}**2", f"{u}**3"]
    return ["step(side)", *(f"step({sign}side) * {power}" for sign in ("", "-") for power in powers)]


def _levels(data: Residuals) -> list[str]:
    """One for each cycle of each placement."""
    return [f"(abs(placement - {p:g}) < 0.5) * (abs(cycle - {c:g}) < 0.5)" for p, c in runs_of(data)[0]]


def _stairs(name: str, x: Array) -> list[str]:
    """A free shape as a level and steps between intervals with about as many places each."""
    levels = np.unique(x)
    edges = np.unique(np.quantile(levels, np.linspace(0, 1, min(BINS, len(levels)) + 1)[1:-1]))
    return ["1", *(f"step({name} - {edge:.12g})" for edge in edges)]


def _harmonics(data: Residuals) -> list[str]:
    c, s = data.probings.lateral_share()
    directions = len(np.unique(np.round(np.arctan2(s, c), 3)))
    orders = range(1, max(min(HARMONICS, directions // 2), 1) + 1)
    return [f"{wave}({order} * azimuth_rad)" for order in orders for wave in ("cos", "sin")]
