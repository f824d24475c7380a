"""Where a law that was found is not quite the law: its size changes with something, or its shape is another.

A search among all forms must expect structure anywhere. What a law is easily mistaken for is looked for here in a few
places, and is seen long before: overtones of an oscillation, a second time constant, a size that changes with time.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnose.forms import Covariate, covariates
from stepgauge.diagnose.library import Family
from stepgauge.diagnose.search import PERIODS, Library, Look
from stepgauge.diagnose.select import Selector, Term
from stepgauge.diagnose.solve import Solved

Array = NDArray[np.float64]
FALSE_ALARM = 0.005
"""Chance that a law that is there is taken for departing from itself in its size, and as much for its shape."""
SIZE, SHAPE = "form:size", "form:shape"
SMALLEST_SHARE = 0.15
"""Share of what a law and its departure explain below which the law is there, in a shape a little off its ideal."""
SMALLEST_OVERTONE = 0.09
"""The same for an overtone: three tenths of an oscillation's amplitude are another shape of wave."""
OVERTONES = (2.0, 3.0, 5.0)
"""Orders looked for by themselves; waves with corners, that have them all, are looked for in the place of a law."""
TIMES = {"time_constant_h": "time constant", "touches": "decay", "width_mm": "width"}
"""Parameters that give a law its shape, and what a second value of them means."""
FACTOR = 4.0
"""By how much another time constant, width or number of touches must differ to be another one."""


@dataclass(frozen=True)
class Departure:
    """The term that departs, how (in words), and the look that shows it."""

    place: int
    words: str
    look: Look


def departure(selector: Selector, terms: tuple[Term, ...]) -> Departure | None:
    """The clearest departure of any term from its law, if it is neither chance nor a small part of it."""
    families = [
        (place, family)
        for place, solved in enumerate(selector.fit(terms).solved)
        for family in _families(solved, selector)
    ]
    if not families:
        return None
    left, basis = selector.residual(terms)
    library = Library([family for _, family in families], selector.whitening)
    among = Counter(family.kind for _, family in families)
    for look in library.looks(left, basis, selector.dof - basis.shape[1]):
        place = next(place for place, family in families if family is look.family)
        extra = max(look.gain - look.dimension, 0.0)
        own = selector.look_at(terms[place].index, terms[:place] + terms[place + 1 :]).gain
        bar = np.log(FALSE_ALARM / among[look.family.kind])
        if look.log_p <= bar and extra >= look.family.details["least"] * (own + extra):
            return Departure(place, look.family.label, look)
    return None


def _families(solved: Solved, selector: Selector) -> Iterator[Family]:
    """Departures of one law as families of one signature each."""
    data = selector.residuals
    share = solved.displacement_um(data)
    label = solved.family.label
    sides = [Covariate("side", "", data.side)] if np.ptp(data.side) > 0.0 else []
    for covariate in [*covariates(data), *sides]:
        u = covariate.values - covariate.values.mean()
        column = share * u / np.abs(u).max()
        words = f"the size of {label} changes with {covariate.name}"
        yield _family(SIZE, words, covariate.name, column[None, None], SMALLEST_SHARE)
    for words, columns, least in _shapes(solved, selector):
        yield _family(SHAPE, f"{label} has {words}", solved.family.covariate, columns, least)


def _family(kind: str, words: str, covariate: str, columns: Array, least: float) -> Family:
    """Signatures ``(atoms, d, n)``, and the share of the structure that they must make up."""
    atoms = [{"atom": i} for i in range(len(columns))]
    return Family(kind, words, {}, atoms, columns, None, covariate, details={"least": least})


def _shapes(solved: Solved, selector: Selector) -> Iterator[tuple[str, Array, float]]:
    """The same law with other values of what gives it its shape: words, signatures, the share they must make up."""
    data = selector.residuals
    for name in solved.family.atoms[0]:
        value = getattr(solved.effect, name)
        if name in PERIODS:
            for order in OVERTONES:
                quicker = value * order if name == "frequency_hz" else value / order
                phases = [solved.displacement_um(data, **{name: quicker, "phase_deg": phase}) for phase in (0.0, 90.0)]
                yield f"an overtone of order {order:.0f}", np.array([phases]), SMALLEST_OVERTONE
        elif isinstance(value, float) and value > 0.0 and name in TIMES:
            for factor in (1.0 / FACTOR, FACTOR):
                second = solved.displacement_um(data, **{name: value * factor})
                yield f"a second {TIMES[name]}", second[None, None], SMALLEST_SHARE
