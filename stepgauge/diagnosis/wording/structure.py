"""Structure without a law in words: what it depends on, and how."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np

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
from stepgauge.diagnosis.wording.catalogue import words as declared
from stepgauge.diagnosis.wording.phrases import Phrase, number
from stepgauge.effects.words import Wording, filled
from stepgauge.files.arrays import Array
from stepgauge.inference.problem import Candidate

CORRELATED, GROWING, DISTURBED = "correlated scatter", "growing scatter", "disturbed scatter"
UNDETERMINED = "undetermined"
SCATTER = (CORRELATED, GROWING, DISTURBED)
"""Forms of the scatter, which no formula of the mean describes."""
CHANGED = 3.0
"""Standard deviations from which a form counts as changed."""
SAY = {TREND: "trend", LEVELS: "levels", LOOP: "loop", HARMONICS: "harmonics", WAVE: "wave", SAWTOOTH: "sawtooth"}
SAY |= {LAGGED: "lagged", LENGTH: "length", BEAT: "beat", RESTS: "rests", HYSTERESIS: "hysteresis"}
"""The phrase of each form; of any other that it is smooth."""
QUIET = 0.3
"""Share of the record without any change from which the rest is stated as the part in which the form acts."""


def located(candidate: Candidate, atom: int, probability: float, share: float = 1.0, fitted: Any = None) -> Located:
    """A form with one of its shapes, or with numbers that were ``fitted``, in words for a technician."""
    form: RandomFunction = candidate.source
    shape = form.kernels[atom] if fitted is None else fitted
    name = TREND if shape == TREND and form.shape != LOOP else form.shape
    phrases = [_phrase(form, name, shape), _moved(form.side)]
    side = "both" if form.side in ("approach", "gauge") else form.side
    numbers = shape if isinstance(shape, float | tuple) else None
    return Located(form.covariate, side, name, phrases, round(share, 4), probability, form.beside, numbers)


def _moved(side: str) -> Phrase:
    return {"say": side} if side in ("gauge", "approach") else {"say": "machine", "axis": side}


def _phrase(form: RandomFunction, name: str, shape: Any) -> Phrase:
    """How a form depends on its covariate."""
    say: dict[str, Any] = {"say": SAY.get(name, "smooth"), "covariate": form.covariate}
    numbers = shape if isinstance(shape, tuple) else (shape,)
    if name in (WAVE, SAWTOOTH):
        return {**say, "period": number(numbers[0], form.unit)}
    if name in (LAGGED, LENGTH):
        return {**say, "lag": number(shape if isinstance(shape, float) else 0.0, "s")}
    if name == BEAT:
        return {**say, "along": number(numbers[0], "mm"), "period": number(numbers[1], form.unit)}
    if name == RESTS:
        return {**say, "count": number(shape)}
    if name == HYSTERESIS:
        back = numbers[0] * 1e-3 if isinstance(shape, tuple) and len(shape) == 1 else 0.0
        return {**say, "back": number(back, form.unit), "beside": form.beside}
    return {**say, "beside": form.beside} if say["say"] == "smooth" else say


def regime(x: Array, columns: Array, mean: Array, covariance: Array, unit: str) -> list[Phrase]:
    """The part of a covariate in which a form differs from the rest, as a phrase; none if there is no such part.

    ``x (n,)``: the covariate; ``columns (d, n)``: the form's features; ``mean (d,)``, ``covariance (d, d)``: posterior
    of their amplitudes. Differences within the form are compared, since a constant may be the origin.
    """
    order = np.argsort(x, kind="stable")
    x, columns = x[order], columns[:, order]
    flat, back = (_flat_share(some, mean, covariance) for some in (columns, columns[:, ::-1]))
    if not QUIET <= max(flat, back) < 1.0:
        return []
    if flat >= back:
        return [{"say": "above", "edge": number(x[int(flat * len(x)) - 1], unit)}]
    return [{"say": "below", "edge": number(x[len(x) - int(back * len(x))], unit)}]


def _flat_share(columns: Array, mean: Array, covariance: Array) -> float:
    """Share of the rows, from the beginning, over which a form does not change from its value in the first tenth."""
    first = max(columns.shape[1] // 10, 3)
    apart = columns - columns[:, :first].mean(axis=1, keepdims=True)
    spread = np.sqrt(np.maximum(np.einsum("dn,dn->n", apart, covariance @ apart), 0.0))
    off = np.abs(mean @ apart) > CHANGED * spread
    return float(np.argmax(off)) / len(off) if off.any() else 1.0


def remedy_of_structure(
    forms: Collection[str], covariate: str, called: str, language: str = "en", warms: bool = False
) -> Wording:
    """What to check for structure without a known law, with one or several ``forms`` over a covariate.

    By its form, or by the covariate where the forms do not tell; ``called``: the covariate in the language;
    ``warms``: whether driving warms what measures, in whose course it came.
    """
    known = declared("structure")
    found = {known.get(form, known.get(covariate)) for form in forms}
    own = (found.pop() if len(found) == 1 else None) or known.get(covariate, known["any"])
    words = own.said_in(language)
    values: dict[str, dict[str, Any]] = {"covariate": {"value": called}, "warms": {"value": warms}}
    return Wording(check=filled(words.check, values), repair=words.repair)
