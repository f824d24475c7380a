"""One pass over a map: named changes, what they leave, and whether they only imitate a form without a name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnose.maps.candidates import Candidate
from stepgauge.diagnose.maps.chance import log_p_value
from stepgauge.diagnose.maps.empirical import empirical
from stepgauge.diagnose.maps.fit import Fitted, Fitter
from stepgauge.diagnose.maps.locate import DIRECTION, IRREGULAR, Found, Locator, Shape, lack_of_fit
from stepgauge.diagnose.maps.model import MapModel, Term, Terms
from stepgauge.diagnose.maps.noise import CLEARLY, MapNoise
from stepgauge.diagnose.maps.select import SMALLEST_SHARE, MapSelector, Selection, Step

Array = NDArray[np.float64]
IDLE_LOG_P = float(np.log(1e-3))
"""Logarithm of the chance from which on a named term is not needed beside forms."""
NEXT_TO_NOTHING = 0.05
"""Share of what a form without a name takes below which a name only mends the form."""
IRREGULAR_P = 0.003
"""Chance that directions seem to differ by more than the repeats scatter where they do not."""


@dataclass(frozen=True)
class Explained:
    """What a map says: named changes in ``selection``, forms without a name beside them in ``unknown``.

    ``described``: the fit with both; ``slight``: forms that stand out and take less than a thousandth of the
    disagreement; ``before``: what stands out before anything is named; ``nothing``: the fit without any change.
    """

    fitter: Fitter
    selection: Selection
    nothing: Fitted
    before: tuple[Found, ...]
    unknown: tuple[Found, ...]
    slight: tuple[Found, ...]
    described: Fitted
    locator: Locator


@dataclass(frozen=True)
class _Description:
    """Named terms with the forms that they leave, and the length of both: information criterion and looks."""

    named: Fitted
    unknown: tuple[Found, ...]
    slight: tuple[Found, ...]
    whole: Fitted
    length: float


def explain(model: MapModel, noise: MapNoise, candidates: Sequence[Candidate]) -> Explained:
    """Name what can be named, describe the rest, and prefer the form where names only imitate it."""
    selector, selection = _selected(model, noise, candidates)
    fitter = selector.fitter
    locator = Locator(model.data)
    best = _describe(fitter, locator, selection.fitted)
    shorter, dropped = _without_imitations(fitter, locator, best)
    if dropped:
        trail = (*selection.trail, *(_imitation(label, shorter) for label in dropped))
        selection = replace(selector.settled(shorter.named), trail=trail)
        best = _describe(fitter, locator, selection.fitted)
    nothing = fitter.at((), best.whole.rest)
    before = tuple(locator.standing_out(nothing))
    unknown = best.unknown or _irregular(fitter, best)
    return Explained(fitter, selection, nothing, before, unknown, best.slight, best.whole, locator)


def _selected(model: MapModel, noise: MapNoise, candidates: Sequence[Candidate]) -> tuple[MapSelector, Selection]:
    """With the law of the scatter that the repeats have, or else the likelier one."""
    fitter = Fitter(model, noise)
    selector = MapSelector(fitter, candidates)
    selection = selector.select()
    if noise.repeats:
        return selector, selection
    terms = selection.fitted.terms
    other = Fitter(model, replace(noise, scatter="proportional"))
    if other.fit([term.candidate for term in terms], terms).bic > selection.fitted.bic - CLEARLY:
        return selector, selection
    selector = MapSelector(other, candidates)
    return selector, selector.select()


def _describe(fitter: Fitter, locator: Locator, named: Fitted) -> _Description:
    """The forms beside named terms, fitted together with them."""
    size = [float(np.median(s)) for s in named.sigma]
    nothing = fitter.at((), named.rest).whitened.reshape(len(named.sigma), -1)
    total = (nothing**2).sum(axis=1)
    found = locator.standing_out(named)
    large = tuple(one for one in found if one.gain >= SMALLEST_SHARE * total[one.quantity])
    slight = tuple(one for one in found if one not in large)
    laws = [empirical(one, fitter.model.data.measured[one.quantity], size[one.quantity]) for one in large]
    whole = fitter.fit([*(term.candidate for term in named.terms), *laws], named.terms) if laws else named
    large = tuple(replace(one, gain=_gain(fitter, whole, law)) for one, law in zip(large, laws, strict=True))
    return _Description(named, large, slight, whole, whole.bic + 2.0 * float(sum(np.log(f.looks) for f in large)))


def _gain(fitter: Fitter, whole: Fitted, law: Candidate) -> float:
    """What a law takes off chi-square in the end."""
    without = tuple(term for term in whole.terms if term.candidate != law)
    return fitter.left(without, whole.rest) - whole.rss


def _without_imitations(fitter: Fitter, locator: Locator, best: _Description) -> tuple[_Description, tuple[str, ...]]:
    """Leave out named terms where forms alone are the clearly shorter description, and which those were.

    So are names that take next to nothing beside the forms. Otherwise only where the names leave structure, or
    where the forms need fewer numbers: a law that leaves nothing is believed before a form of as many coefficients.
    """
    dropped: tuple[str, ...] = ()
    while best.named.terms:
        idle = _idle(fitter, best)
        if idle:
            best = _describe(fitter, locator, _fit_of(fitter, _but(best.named.terms, idle)))
            dropped += (idle.candidate.label,)
            continue
        others = [_describe(fitter, locator, _fit_of(fitter, terms)) for terms in _fewer(best.named.terms)]
        others = [each for each in others if each.unknown and (best.unknown or each.whole.size < best.whole.size)]
        shortest = min(others, key=lambda each: each.length, default=None)
        if shortest is None or shortest.length > best.length - CLEARLY:
            break
        kept = {term.candidate for term in shortest.named.terms}
        dropped += tuple(t.candidate.label for t in best.named.terms if t.candidate not in kept)
        best = shortest
    return best, dropped


def _idle(fitter: Fitter, best: _Description) -> Term | None:
    """The named term that takes least beside the forms, if that is chance or next to nothing against what they take."""
    if not best.unknown:
        return None
    variance, dof = best.whole.variance
    gains = []
    for term in best.named.terms:
        without = fitter.fit([t.candidate for t in best.whole.terms if t.candidate != term.candidate], best.whole.terms)
        gains.append((fitter.left(without.terms, best.whole.rest) - best.whole.rss, term))
    gain, weakest = min(gains, key=lambda pair: pair[0])
    d = len(weakest.values)
    chance = log_p_value(gain / variance, d, dof + d, 1.0) > IDLE_LOG_P
    return weakest if chance or gain < NEXT_TO_NOTHING * max(one.gain for one in best.unknown) else None


def _but(terms: Terms, left_out: Term) -> Terms:
    return tuple(term for term in terms if term.candidate != left_out.candidate)


def _fewer(terms: Terms) -> list[Terms]:
    """The terms without each one of them, and none at all."""
    single = [terms[:place] + terms[place + 1 :] for place in range(len(terms))]
    return single if len(terms) < 2 else [*single, ()]


def _fit_of(fitter: Fitter, terms: Terms) -> Fitted:
    return fitter.fit([term.candidate for term in terms], terms)


def _imitation(label: str, best: _Description) -> Step:
    why = f"imitates a form: {best.unknown[0].shape.words}"
    return Step("dropped", label, 0.0, 0.0, best.whole.bic, why)


def _irregular(fitter: Fitter, best: _Description) -> tuple[Found, ...]:
    """What differs from direction to direction by more than the repeats scatter, in no form."""
    data = fitter.model.data
    gain, log_p = lack_of_fit(data, fitter.noise, best.whole.whitened, best.whole.size)
    total = fitter.at((), best.whole.rest).rss
    if log_p > np.log(IRREGULAR_P) or gain < SMALLEST_SHARE * total:
        return ()
    parts = best.whole.whitened.reshape(len(data.measured), len(data))
    worst = int((parts**2).sum(axis=1).argmax())
    shape = Shape("differs from direction to direction by more than the repeats scatter, in no regular form", ())
    return (Found(worst, DIRECTION, IRREGULAR, shape, gain, log_p, 1),)
