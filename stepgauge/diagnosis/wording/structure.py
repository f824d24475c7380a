"""Structure without a law in words: what it depends on, and how."""

from __future__ import annotations

from typing import Any

import numpy as np

from stepgauge.diagnosis.covariates import AXES
from stepgauge.diagnosis.gaussian_processes.random_function import (
    BEAT,
    HARMONICS,
    HYSTERESIS,
    LAGGED,
    LENGTH,
    LEVELS,
    LOOP,
    RESTS,
    SAWTOOTH,
    TREND,
    WAVE,
    RandomFunction,
)
from stepgauge.diagnosis.result import Located
from stepgauge.files.arrays import Array
from stepgauge.files.notation import rounded
from stepgauge.inference.problem import Candidate

CORRELATED, GROWING, DISTURBED = "correlated scatter", "growing scatter", "disturbed scatter"
UNDETERMINED = "undetermined"
SCATTER = (CORRELATED, GROWING, DISTURBED)
"""Forms of the scatter, which no formula of the mean describes."""
CHANGED = 3.0
"""Standard deviations from which a form counts as changed."""
QUIET = 0.3
"""Share of the record without any change from which the rest is stated as the part in which the form acts."""

WORDS = {
    TREND: "proportional to {name}",
    LEVELS: "all readings of a {name} are off together, each {name} by an amount of its own",
    LOOP: "a separate curve along the gauge for each direction of travel",
    HARMONICS: "depends on the direction of approach about the stylus",
}
"""Forms without a number."""


def located(candidate: Candidate, atom: int, probability: float, share: float = 1.0, fitted: Any = None) -> Located:
    """A form with one of its shapes, or with numbers that were ``fitted``, in words for a technician."""
    form: RandomFunction = candidate.source
    number = form.kernels[atom] if fitted is None else fitted
    shape = TREND if number == TREND and form.shape != LOOP else form.shape
    words = _words(form, shape, number) + _moved(form.side)
    side = "both" if form.side in ("approach", "gauge") else form.side
    told = number if isinstance(number, float | tuple) else None
    return Located(form.covariate, side, shape, words, round(share, 4), probability, form.beside, told)


def _moved(side: str) -> str:
    if side == "gauge":
        return ", with the same sign on front and back faces (along the gauge)"
    return f", along machine {side}" if side in AXES else ", along the approach"


def _words(form: RandomFunction, shape: str, number: Any) -> str:
    name, unit = form.covariate, f" {form.unit}".rstrip()
    if shape in WORDS:
        return WORDS[shape].format(name=name)
    if shape == WAVE:
        return f"a periodic function of {name}, period {rounded(number, 4)}{unit}"
    if shape == SAWTOOTH and isinstance(number, tuple):
        return f"creeps with {name} and is thrown back, a sawtooth of period {rounded(number[0], 4)}{unit}"
    if shape == LAGGED:
        return f"proportional to {name} after a first-order lag, time constant about {rounded(number, 2)} s"
    if shape == LENGTH:
        late = f", time constant about {rounded(number, 2)} s" if isinstance(number, float) and number > 0.0 else ""
        return f"a length error that changes with {name}{late}"
    if shape == BEAT and isinstance(number, tuple):
        along, beside = (rounded(one, 4) for one in number)
        return f"periodic along the gauge, period {along} mm, and in {name}, period {beside}{unit}"
    if shape == RESTS:
        return f"follows the rests before the last {rounded(number, 2)} probings, as the roots of their times"
    if shape == HYSTERESIS and isinstance(number, tuple):
        way = f", held back for {number[0] * 1e-3:.3g}{unit} after a turn" if len(number) == 1 else ""
        differs = ", more in some places than in others" if form.beside else ""
        return f"hysteresis of {name}: depends on where its travel turned before{way}{differs}"
    other = f" and {form.beside}" if form.beside else ""
    return f"a smooth function of {name}{other}"


def regime(x: Array, columns: Array, mean: Array, covariance: Array, unit: str) -> str:
    """The part of a covariate in which a form differs from the rest, in words; empty if there is no such part.

    ``x (n,)``: the covariate; ``columns (d, n)``: the form's features; ``mean (d,)``, ``covariance (d, d)``: posterior
    of their amplitudes. Differences within the form are compared, since a constant may be the origin.
    """
    order = np.argsort(x, kind="stable")
    x, columns = x[order], columns[:, order]
    flat, back = (_flat_share(some, mean, covariance) for some in (columns, columns[:, ::-1]))
    if not QUIET <= max(flat, back) < 1.0:
        return ""
    if flat >= back:
        return f"only above {rounded(x[int(flat * len(x)) - 1], 4)}{unit}"
    return f"only below {rounded(x[len(x) - int(back * len(x))], 4)}{unit}"


def _flat_share(columns: Array, mean: Array, covariance: Array) -> float:
    """Share of the rows, from the beginning, over which a form does not change from its value in the first tenth."""
    first = max(columns.shape[1] // 10, 3)
    apart = columns - columns[:, :first].mean(axis=1, keepdims=True)
    spread = np.sqrt(np.maximum(np.einsum("dn,dn->n", apart, covariance @ apart), 0.0))
    off = np.abs(mean @ apart) > CHANGED * spread
    return float(np.argmax(off)) / len(off) if off.any() else 1.0
