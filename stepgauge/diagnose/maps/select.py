"""Which changes of the construction a map asks for: added one by one, exchanged, dropped.

A term enters when three judges agree: the chance that scatter looks like it, after all looks; the information
criterion; and the prediction of whole rings and whole spokes that the fit has not seen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnose.maps.candidates import Candidate
from stepgauge.diagnose.maps.chance import log_p_value
from stepgauge.diagnose.maps.fit import Fitted, Fitter
from stepgauge.diagnose.maps.holdout import Holdout, held_out
from stepgauge.diagnose.maps.model import Terms

Array = NDArray[np.float64]
FALSE_ALARM = 0.005
"""Chance that any change is named where there is none."""
SMALLEST_SHARE = 1e-3
"""What explains less of the disagreement of every quantity is a slight departure of the laws, not a change to name."""
MOST_TERMS = 5
UNDECIDED = float(np.log(20.0))
"""Candidates whose likelihoods differ by less than this factor are not told apart."""


@dataclass(frozen=True)
class Step:
    """One decision on the way, for the evidence trail; ``gain`` in units of the scatter's variance."""

    action: str
    label: str
    gain: float
    log_p: float
    bic: float
    why: str = ""


@dataclass(frozen=True)
class Tried:
    """A candidate beside others: its fit, what it gains and how surprising that is, all looks but those at others."""

    candidate: Candidate
    fitted: Fitted
    gain: float
    log_p: float
    share: float

    @property
    def values(self) -> tuple[float, ...]:
        """Of the candidate's own knobs."""
        return next(term.values for term in self.fitted.terms if term.candidate == self.candidate)


@dataclass(frozen=True)
class Rivals:
    """What could stand in one place of the model, likeliest first, with posterior weights."""

    tried: tuple[Tried, ...]
    weights: tuple[float, ...]


@dataclass(frozen=True)
class Selection:
    """The model chosen; ``minor``: significant but too small to name; ``rivals``: one entry per term."""

    fitted: Fitted
    minor: tuple[Tried, ...]
    rivals: tuple[Rivals, ...]
    trail: tuple[Step, ...]


class MapSelector:
    """Searches the candidates for the terms of a map."""

    def __init__(self, fitter: Fitter, candidates: Sequence[Candidate]) -> None:
        self.fitter, self.candidates = fitter, tuple(candidates)
        self.bar = float(np.log(FALSE_ALARM / max(len(self.candidates), 1)))
        self.nothing = fitter.fit(())
        self.trail: list[Step] = []
        self._known: dict[tuple[Candidate, Terms], Tried] = {}

    def select(self) -> Selection:
        """Add, exchange and drop until nothing changes."""
        current = self.nothing
        minor: tuple[Tried, ...] = ()
        while len(current.terms) < MOST_TERMS:
            accepted, minor = self._next(current)
            if accepted is None:
                break
            current = accepted.fitted
        current, rivals = self._exchanged(self._dropped(current))
        slimmer = self._dropped(current)
        if slimmer is not current:
            current, rivals = self._exchanged(slimmer)
        return Selection(current, tuple(minor), tuple(rivals), tuple(self.trail))

    def settled(self, fitted: Fitted) -> Selection:
        """A model that was decided on elsewhere, with the rivals of its terms."""
        rivals = tuple(self.rivals(fitted, place) for place in range(len(fitted.terms)))
        return Selection(fitted, (), rivals, tuple(self.trail))

    def tried(self, candidate: Candidate, beside: Fitted) -> Tried:
        """A candidate fitted together with the terms there are."""
        key = (candidate, beside.terms)
        if key not in self._known:
            self._known[key] = self._try(candidate, beside)
        return self._known[key]

    def _try(self, candidate: Candidate, beside: Fitted) -> Tried:
        fitted = self.fitter.fit([*(t.candidate for t in beside.terms), candidate], beside.terms)
        variance, dof = fitted.variance
        gain = (self.fitter.left(beside.terms, fitted.rest) - fitted.rss) / variance
        log_p = log_p_value(gain, len(candidate.knobs), dof + len(candidate.knobs), 1.0)
        log_p = min(log_p + float(np.log(len(candidate.starts))), 0.0)
        return Tried(candidate, fitted, gain, log_p, self._share(beside.terms, fitted.terms))

    def _share(self, without: Terms, terms: Terms) -> float:
        """How much of the squared disagreement the added term takes, in the quantity in which it takes most."""
        model = self.fitter.model
        before, old, new = (model.residuals(each) for each in (self.nothing.terms, without, terms))
        squares = [[float(np.sum(each**2)) for each in part] for part in zip(before, old, new, strict=True)]
        return max((o - n) / max(b, 1e-300) for b, o, n in squares)

    def _next(self, current: Fitted) -> tuple[Tried | None, tuple[Tried, ...]]:
        """The best candidate that all judges accept, and those that are significant but too small."""
        tried = [self.tried(c, current) for c in self._beside(current.terms)]
        tried.sort(key=lambda each: (each.log_p, -each.gain))
        minor = []
        for each in tried:
            why = self._objection(each, current)
            self._log("added" if not why else "not added", each, why)
            if not why:
                return each, ()
            if why.startswith("too small"):
                minor.append(each)
        return None, tuple(minor)

    def _objection(self, tried: Tried, current: Fitted) -> str:
        """Which judge is against it; empty if none is."""
        if tried.log_p > self.bar:
            return "may be chance"
        if tried.fitted.bic >= current.bic:
            return "information criterion"
        if tried.share < SMALLEST_SHARE:
            return f"too small: {tried.share:.1e} of the disagreement"
        if self._in_the_digits(tried):
            return "too small: no larger than the rounding of the printed digits"
        worse = [h.by for h in self.compare(current, tried.fitted) if h.score_after >= h.score_before]
        return f"does not predict held-out {' and '.join(worse)}" if worse else ""

    def _in_the_digits(self, tried: Tried) -> bool:
        data = self.fitter.model.data
        rounded = [m.is_rounded(sigma) for m, sigma in zip(data.measured, tried.fitted.sigma, strict=True)]
        return all(rounded) and tried.gain < len(data)

    def compare(self, without: Fitted, fitted: Fitted) -> list[Holdout]:
        """Held-out prediction without and with."""
        return held_out(self.fitter, without, fitted)

    def _dropped(self, current: Fitted) -> Fitted:
        """Take out what is no longer needed beside the rest."""
        if len(current.terms) < 2:
            return current
        for place, term in enumerate(current.terms):
            others = self.fitter.fit(
                [t.candidate for t in _without(current.terms, place)], _without(current.terms, place)
            )
            again = self.tried(term.candidate, others)
            if again.log_p > self.bar or again.fitted.bic >= others.bic:
                self._log("dropped", again, "the other terms explain it")
                return self._dropped(others)
        return current

    def _exchanged(self, current: Fitted) -> tuple[Fitted, list[Rivals]]:
        """Every place taken by its likeliest rival."""
        for _ in range(MOST_TERMS):
            rivals = [self.rivals(current, place) for place in range(len(current.terms))]
            better = [
                r.tried[0] for r, t in zip(rivals, current.terms, strict=True) if r.tried[0].candidate != t.candidate
            ]
            if not better:
                return current, rivals
            self._log("exchanged for", better[0], "likelier in its place")
            current = better[0].fitted
        return current, [self.rivals(current, place) for place in range(len(current.terms))]

    def rivals(self, current: Fitted, place: int) -> Rivals:
        """All candidates that explain nearly as much in one place, the others refitted."""
        rest = _without(current.terms, place)
        others = self.fitter.fit([t.candidate for t in rest], rest)
        tried = [self.tried(c, others) for c in self._beside(rest)]
        best = min(each.fitted.deviance for each in tried)
        own = current.terms[place].candidate
        near = [each for each in tried if each.candidate == own or self._as_good(each, best)]
        log_weight = np.array([-each.fitted.bic / 2.0 - each.candidate.surprise(each.values) for each in near])
        order = np.argsort(-log_weight)
        weight = np.exp(log_weight[order] - log_weight.max())
        return Rivals(tuple(near[i] for i in order), tuple(map(float, weight / weight.sum())))

    def _beside(self, terms: Terms) -> list[Candidate]:
        """Candidates that may stand beside terms."""
        there = {term.candidate for term in terms}
        taken = {candidate.place for candidate in there} - {""}
        return [c for c in self.candidates if c not in there and c.place not in taken]

    def _as_good(self, tried: Tried, best: float) -> bool:
        return (tried.fitted.deviance - best) / 2.0 <= UNDECIDED and tried.log_p <= self.bar

    def _log(self, action: str, tried: Tried, why: str = "") -> None:
        self.trail.append(Step(action, tried.candidate.label, tried.gain, tried.log_p, tried.fitted.bic, why))


def _without(terms: Terms, place: int) -> Terms:
    return terms[:place] + terms[place + 1 :]
