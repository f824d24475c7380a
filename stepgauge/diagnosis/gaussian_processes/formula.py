"""Structure without a law as ``empirical`` effects: what is stated, with fitted coefficients.

The formula itself is fitted: every term is evaluated by the effect that is written to the machine file, so that the
simulation repeats the fit exactly. The number of bends is chosen by Schwarz' criterion: the formula is for reading and
simulation and has no influence on the verdict.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.covariates import (
    AXES,
    COLUMN,
    NAMES,
    TOUCHES,
    WAY,
    Covariate,
    along_mm,
    covariates,
    pause_of,
    runs_of,
)
from stepgauge.diagnosis.fits.solve import Estimate
from stepgauge.diagnosis.gaussian_processes.periodic import FINER, OVERTONES, PERIODS_PER_SPAN, PHASES, TEETH_PER_SPAN
from stepgauge.diagnosis.gaussian_processes.random_function import (
    BEAT,
    HARMONICS,
    LAGGED,
    LENGTH,
    LEVELS,
    MEMORIES,
    PERIODIC,
    RESTS,
    SAWTOOTH,
    TREND,
    WAVE,
)
from stepgauge.diagnosis.priors import shipped_priors
from stepgauge.diagnosis.problem import bare_problem
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.diagnosis.result import GaugeDiagnosis, Located
from stepgauge.diagnosis.wording.structure import SCATTER, UNDETERMINED
from stepgauge.effects import along_approach_um
from stepgauge.effects.empirical import RESTED, Empirical, formula_name
from stepgauge.files.arrays import Array
from stepgauge.inference.metric import Metric
from stepgauge.inference.noise_models import NoiseModels
from stepgauge.recording import APPROACH

MASK = {"approach": "", "gauge": "side * "}
MASK |= {axis: f"{column} * " for axis, column in zip(AXES, APPROACH, strict=True)}
TERMS_PER_FORMULA = 6
"""Longer sums are divided into several effects, so that formulas stay readable."""
KNOTS = (3, 5, 9, 17)
"""Numbers of bends of a function that are tried."""
FEW_KNOTS = 4
FEWEST_KNOTS = (2, 3, 5)
"""Numbers of bends of a curve beside a hysteresis."""
SLIGHT = 0.02
"""Weight of a displacement as a whole, over that beside the origins of the placements."""
UNSEEN = 1e-6
"""Share of a term that must remain beside the origins of the placements."""


@dataclass(frozen=True)
class EmpiricalLaw:
    """Structure in its description, and the effects that approximate it.

    ``estimates``: coefficients by name with their standard uncertainties, um or um per unit of their
    term; ``share_um (n,)``: along the approach; ``period`` in the unit of the covariate, if it is periodic.
    """

    located: Located
    side: str
    effects: tuple[Empirical, ...]
    estimates: dict[str, Estimate]
    share_um: Array
    period: float | None = None


def model_unknown(diagnosis: GaugeDiagnosis) -> list[EmpiricalLaw]:
    """Empirical laws of the structure of a diagnosis, the clearest one first, further ones if they improve the fit.

    They are fitted to the residuals of the named laws. Empty if there is none, or if its covariate has no name in a
    formula.
    """
    stated = [one for one in diagnosis.unexplained if one.form not in (*SCATTER, UNDETERMINED)]
    if not stated:
        return []
    data, problem = diagnosis.data, bare_problem(diagnosis.data)
    sigma_um = diagnosis.noise.sigma_um / problem.typical
    scatters = NoiseModels(problem, shipped_priors().scatter)
    metric, left, laws = Metric(problem, scatters.plain(), scatters, sigma_um), diagnosis.after_um, []
    used = np.isfinite(diagnosis.noise.by_row_um)
    for one in stated:
        law = _best_law(one, data, metric, left, used)
        if law is not None:
            laws.append(law)
            left = left - law.share_um
    return laws


def rest_um(diagnosis: GaugeDiagnosis, laws: Sequence[EmpiricalLaw]) -> Array:
    """Residuals minus all modelled effects and the mean origin of every placement, um."""
    data = diagnosis.data
    if not laws:
        return diagnosis.after_um
    return data.without_origins(diagnosis.after_um - np.sum([law.share_um for law in laws], axis=0))


def rest_rms_um(diagnosis: GaugeDiagnosis, laws: Sequence[EmpiricalLaw]) -> float:
    """Rms of these over all rows with weight, um."""
    rest = rest_um(diagnosis, laws)[np.isfinite(diagnosis.noise.by_row_um)]
    return float(np.sqrt((rest**2).mean()))


def _best_law(
    located: Located, data: Residuals, metric: Metric, left_um: Array, used: NDArray[np.bool_]
) -> EmpiricalLaw | None:
    """The best law by Schwarz' criterion; None if none is better than no law."""
    best, worth = None, 0.0
    price = float(np.log(max(int(used.sum()), 2)))
    for side in [located.side] if located.side in AXES else ["approach", "gauge"]:
        for near in _about(located, data):
            for terms in _terms(near, side, data):
                fitted = _fit(terms, data, metric, left_um, used)
                if fitted.terms and fitted.gain - price * len(fitted.terms) > worth:
                    worth = fitted.gain - price * len(fitted.terms)
                    best = _law(near, side, fitted)
    return best


def _about(located: Located, data: Residuals) -> Iterator[Located]:
    """What is stated with periods, and phases of a sawtooth, within a step of its grid; other shapes unchanged."""
    one = next((c for c in covariates(data) if c.name == located.covariate), None)
    if located.form not in PERIODIC or one is None:
        yield located
        return
    span, steps = float(np.ptp(one.values)), np.linspace(-1.0, 1.0, FINER)
    period, *phase = np.atleast_1d(located.numbers).tolist()
    periods = (span / (span / period + steps / (TEETH_PER_SPAN if phase else PERIODS_PER_SPAN))).tolist()
    finer = product(periods, (phase[0] + steps / PHASES).tolist()) if phase else periods
    yield from (replace(located, numbers=numbers) for numbers in finer)


@dataclass(frozen=True)
class _Fitted:
    terms: tuple[str, ...]
    coefficients: Array
    u: Array
    gain: float
    share_um: Array


def _fit(terms: Sequence[str], data: Residuals, metric: Metric, left_um: Array, used: NDArray[np.bool_]) -> _Fitted:
    """Least-squares fit of the residuals by the terms, without those that only shift an origin.

    What the origins of the placements take up is determined by nothing: there the smallest displacement is taken.
    """
    columns = np.array([_column(term, data) for term in terms])
    white, target = metric(columns * used).T, metric(left_um * used)
    seen = np.linalg.norm(white, axis=0) > UNSEEN * np.linalg.norm(columns / metric.sigma_um, axis=1)
    terms, columns, white = [t for t, keep in zip(terms, seen, strict=True) if keep], columns[seen], white[:, seen]
    least = np.vstack([white, SLIGHT * columns.T / metric.sigma_um])
    coefficients = np.asarray(np.linalg.lstsq(least, np.r_[target, np.zeros(len(data))], rcond=1e-9)[0], float)
    u = np.asarray(np.sqrt(np.maximum(np.diag(np.linalg.pinv(least.T @ least)), 0.0)), float)
    rest = target - white @ coefficients
    share = np.asarray(coefficients @ columns, float)
    return _Fitted(tuple(terms), coefficients, u, float(target @ target - rest @ rest), share)


def _column(term: str, data: Residuals) -> Array:
    um = along_approach_um(Empirical(formula=term), data.probings)
    return np.broadcast_to(um, (len(data),)).astype(float)


def _law(located: Located, side: str, fitted: _Fitted) -> EmpiricalLaw:
    named = [
        (f"c{i}", term, float(c)) for i, (term, c) in enumerate(zip(fitted.terms, fitted.coefficients, strict=True), 1)
    ]
    effects = []
    for first in range(0, len(named), TERMS_PER_FORMULA):
        part = named[first : first + TERMS_PER_FORMULA]
        formula = " + ".join(f"{name} * {term}" for name, term, _ in part)
        effects.append(Empirical(formula=formula, coefficients={name: float(f"{c:.12g}") for name, _, c in part}))
    estimates = {name: Estimate(c, float(u), "um") for (name, _, c), u in zip(named, fitted.u, strict=True)}
    period = float(np.atleast_1d(located.numbers)[0]) if located.form in PERIODIC else None
    return EmpiricalLaw(located, side, tuple(effects), estimates, fitted.share_um, period)


def _terms(located: Located, side: str, data: Residuals) -> Iterator[list[str]]:
    """Sums that are tried for structure on one side."""
    mask = MASK[side]
    for terms in _shapes(located, side, data):
        yield [mask + term for term in terms]


def _shapes(located: Located, side: str, data: Residuals) -> Iterator[list[str]]:
    if located.form == LEVELS:
        yield _levels(located.covariate, data)
    elif located.form == HARMONICS:
        yield [f"{wave}({order} * azimuth_rad)" for order in range(1, 7) for wave in ("cos", "sin")]
    elif located.covariate == WAY:
        position = data.probings.certified_mm()
        yield from (["way", *(f"way * {t}" for t in _ramps("position_mm", position, k)[1:])] for k in KNOTS)
    else:
        one = next((c for c in covariates(data) if c.name == located.covariate), None)
        name = None if one is None else _column_name(one.name)
        if one is not None and name is not None:
            yield from _covariate_terms(located, side, one, name, data)


def _covariate_terms(located: Located, side: str, one: Covariate, name: str, data: Residuals) -> Iterator[list[str]]:
    x, middle = one.values, float(one.values.mean())
    if located.form == TREND:
        yield [f"({name} - {middle:.12g})"]
    elif located.form in MEMORIES:
        yield from _remembered(located, one, name, data)
    elif located.form == WAVE:
        angle = f"2 * pi * {name} / {float(located.numbers):.12g}"
        yield [f"{wave}({order} * {angle})" for order in range(1, OVERTONES + 1) for wave in ("sin", "cos")]
    elif located.form == SAWTOOTH:
        period, phase = located.numbers
        begin = (float(x.min() + x.max()) / 2.0 - phase * period) % period
        yield [f"(({name} - {begin:.12g}) % {period:.12g} - {0.5 * period:.12g})"]
    elif located.form == BEAT:
        first, second = located.numbers
        angles = [f"(2 * pi * position_mm / {first:.12g})", f"(2 * pi * {name} / {second:.12g})"]
        yield [f"{a}{angles[0]} * {b}{angles[1]}" for a in ("sin", "cos") for b in ("sin", "cos")]
    elif located.form == LENGTH and one.name == "cycle":
        yield [f"{level} * {_length(side, data)}" for level in _levels("cycle", data)]
    elif located.form == LENGTH:
        late = _late(name, located.numbers)
        length = _length(side, data)
        yield [f"({late} - {middle:.12g}) * {length}"]
        yield from ([_times(ramp, length) for ramp in _ramps(name, x, k)] for k in KNOTS)
    elif located.beside:
        other = next(c for c in covariates(data) if c.name == located.beside)
        place = _ramps(NAMES[other.name], other.values, FEW_KNOTS)
        yield [_times(a, b) for a in place for b in _ramps(name, x, FEW_KNOTS)]
    else:
        yield from (_ramps(name, x, k) for k in KNOTS)


def _remembered(located: Located, one: Covariate, name: str, data: Residuals) -> Iterator[list[str]]:
    """What depends on what went before.

    Of a hysteresis one way, or all that were tried, the same all along or not, beside a curve: a law over its
    coordinate is not named (rule 3).
    """
    if located.form == LAGGED:
        yield [f"({_late(name, located.numbers)} - {float(one.values.mean()):.12g})"]
    elif located.form == RESTS:
        kept = round(located.numbers)
        yield [f"({RESTED}_{kept} - {float(data.probings.rested(kept).mean()):.12g})"]
    else:
        held = [f"{name}_held_{um}" for um in located.numbers]
        tried = [held, *([way] for way in held)]
        if located.beside:
            place = _ramps(name, one.values, FEW_KNOTS)
            tried += [[_times(way, ramp) for way in ways for ramp in place] for ways in tried]
        for ways in tried:
            yield from ([*ways, *curve] for curve in ([], *(_ramps(name, one.values, k)[1:] for k in FEWEST_KNOTS)))


def _times(one: str, other: str) -> str:
    """A product in a formula, without factors of one."""
    return " * ".join([factor for factor in (one, other) if factor != "1"]) or "1"


def _late(name: str, lag_s: object) -> str:
    """A column after a first-order lag, in a formula."""
    return f"{name}_lag_{round(lag_s)}" if isinstance(lag_s, float) and lag_s >= 1.0 else name


def _column_name(covariate: str) -> str | None:
    """Name of a covariate in a formula, None if a formula cannot name it."""
    if covariate.startswith(TOUCHES):
        return f"touches_{pause_of(covariate)}"
    return NAMES.get(covariate) or formula_name(covariate.removeprefix(COLUMN))


def _length(side: str, data: Residuals) -> str:
    name = f"{side}_mm" if side in AXES else "position_mm"
    return f"({name} - {float(along_mm(side, data).mean()):.12g})"


def _ramps(name: str, x: Array, knots: int) -> list[str]:
    """A polyline with equidistant bends."""
    at = np.linspace(x.min(), x.max(), knots)[:-1]
    return ["1", *(f"max({name} - {place:.12g}, 0)" for place in at)]


def _levels(covariate: str, data: Residuals) -> list[str]:
    """A level for each cycle of each placement, each placement, or each face of each placement."""
    if covariate == "cycle":
        return [f"(abs(placement - {p:g}) < 0.5) * (abs(cycle - {c:g}) < 0.5)" for p, c in runs_of(data)[0]]
    numbers = np.unique(data.frame[covariate].to_numpy())
    return [f"(abs({covariate} - {n:g}) < 0.5)" for n in numbers]
