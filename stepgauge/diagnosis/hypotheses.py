"""What may be the case after a diagnosis, with its probability, and what each of it predicts for further readings."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy import special
from scipy.linalg import cho_factor, cho_solve

from stepgauge.diagnosis.fits.solve import solve
from stepgauge.diagnosis.further_runs import ExtendedRecording, independent_metric
from stepgauge.diagnosis.gaussian_processes.candidates import random_function_candidates
from stepgauge.diagnosis.laws.candidates import usual_signature
from stepgauge.diagnosis.priors import Priors
from stepgauge.diagnosis.problem import bare_problem
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.diagnosis.stated_model import Model
from stepgauge.effects import Effect, along_approach_um
from stepgauge.files.arrays import Array
from stepgauge.inference.design import Prediction
from stepgauge.inference.metric import Metric, nuisances
from stepgauge.inference.posterior import Posterior
from stepgauge.inference.problem import Candidate, Law
from stepgauge.inference.search import Search

LEAST = 3e-3
"""Hypotheses that are less probable than this are not looked at."""
MOST = 16


@dataclass(frozen=True)
class Searched:
    """A search with its answer, and its residuals; ``reached``: log posterior of the best hypothesis that it led to."""

    data: Residuals
    search: Search
    answer: Posterior
    model: Model
    reached: float


@dataclass(frozen=True)
class HypothesisTerm:
    """One law or form of a hypothesis: its candidate, the number of its shape, the prior sd of its amplitudes.

    ``shape``: that of a form between the shapes that have numbers.
    """

    candidate: Candidate
    atom: int
    sd: float
    shape: Any = None


@dataclass(frozen=True)
class RivalHypothesis:
    """Laws and forms that may be there together, and the posterior probability that it is these."""

    parts: tuple[HypothesisTerm, ...]
    probability: float

    @property
    def is_of_laws(self) -> bool:
        """Whether it has no structure without a law."""
        return all(part.candidate.named for part in self.parts)

    @property
    def laws(self) -> frozenset[str]:
        """The labels of its laws; one law in several parts of the record has one."""
        return frozenset(str(one.candidate.source.label) for one in self.parts if one.candidate.named)

    @property
    def words(self) -> str:
        """The hypothesis by the names of its parts."""
        return " and ".join(sorted(_name(one.candidate) for one in self.parts)) or "nothing"


def _name(candidate: Candidate) -> str:
    if candidate.named:
        return str(candidate.source.label)
    return f"something unknown over {candidate.source.covariate}"


def every_hypothesis(found: Searched) -> list[RivalHypothesis]:
    """All hypotheses of a search, the most probable first, their probabilities summing to one.

    Those that were computed and, for every term of the best one, the rivals that were only rated.
    """
    worth = _computed(found) | _rated(found)
    ranked = sorted(worth.values(), key=lambda one: -one[1])
    share = special.softmax([value for _, value in ranked])
    return [RivalHypothesis(parts, float(p)) for (parts, _), p in zip(ranked, share, strict=True)]


def hypotheses(found: Searched) -> list[RivalHypothesis]:
    """The most probable hypotheses of a search, the most probable first, their probabilities summing to one."""
    kept = [one for one in every_hypothesis(found) if one.probability >= LEAST][:MOST]
    total = sum(one.probability for one in kept)
    return [replace(one, probability=one.probability / total) for one in kept]


Worth = dict[frozenset[str], tuple[tuple[HypothesisTerm, ...], float]]


def _computed(found: Searched) -> Worth:
    """For each set of labels the most probable hypothesis that was computed, and its log posterior."""
    worth: Worth = {}
    for state in found.search.evidence.current:
        if state.labels not in worth or worth[state.labels][1] < state.log_posterior:
            parts = tuple(HypothesisTerm(term.candidate, term.atom, term.sd, term.shape) for term in state.terms)
            worth[state.labels] = (parts, state.log_posterior)
    return worth


def _rated(found: Searched) -> Worth:
    """Rivals of terms of the best hypothesis that were rated and not computed."""
    best, worth = found.answer.best, Worth()
    for place in found.answer.sets:
        others = tuple(
            HypothesisTerm(t.candidate, t.atom, t.sd, t.shape) for i, t in enumerate(best.terms) if i != place.term
        )
        for rival in place.members:
            if rival.hypothesis is None and rival.probability > 0.0:
                parts = (*others, HypothesisTerm(rival.candidate, rival.proposal.atom, rival.proposal.sd))
                value = best.log_posterior + float(np.log(rival.probability / place.members[0].probability))
                worth[frozenset(one.candidate.label for one in parts)] = (parts, value)
    return worth


class Predicting:
    """What hypotheses predict, fitted to the recording so far; computed once for all runs that may follow."""

    def __init__(self, found: Searched, possible: Sequence[RivalHypothesis], priors: Priors) -> None:
        self.found, self.possible, self.priors = found, possible, priors

    @cached_property
    def _metric(self) -> Metric:
        state = self.found.model.state
        return Metric(self.found.search.problem, state.noise, self.found.search.noise_models, state.sigma_um)

    @cached_property
    def _fits(self) -> list[tuple[Effect, ...]]:
        """The effects of each hypothesis with their fitted values."""
        return [self._fit(one) for one in self.possible]

    def _fit(self, one: RivalHypothesis) -> tuple[Effect, ...]:
        laws = [part for part in one.parts if not _is_summed(part)]
        families = [part.candidate.source for part in laws]
        solved = solve(families, [part.atom for part in laws], self.found.data, self._metric).solved
        return tuple(each.effect for each in solved)

    def __call__(self, more: ExtendedRecording) -> list[Prediction]:
        """One prediction for each hypothesis, over all rows of a lengthened recording.

        :class:`InputError` where a law cannot be computed there.
        """
        forms, told = self._forms(more.data), self._nuisances(more)
        return [self._of(one, fit, more, forms, told) for one, fit in zip(self.possible, self._fits, strict=True)]

    def _forms(self, data: Residuals) -> dict[str, Candidate]:
        """The forms of the hypotheses, with the features that they have in a lengthened recording."""
        if all(part.candidate.named for one in self.possible for part in one.parts):
            return {}
        known, scale_um = len(self.found.data), self.found.search.problem.scale_um
        return {one.label: one for one in random_function_candidates(data, self.priors, scale_um, known=known)}

    def _of(
        self,
        one: RivalHypothesis,
        effects: Sequence[Effect],
        more: ExtendedRecording,
        forms: dict[str, Candidate],
        nuisances: Callable[[Array], Array],
    ) -> Prediction:
        mean = np.zeros(len(more.data))
        for effect in effects:
            mean = mean + along_approach_um(effect, more.data.probings)
        columns, sd = [np.zeros((0, len(mean)))], [np.zeros(0)]
        for part in one.parts:
            own = _columns(part, more.data, forms)
            if _is_summed(part) and len(own):
                mean = mean + self._formed(own, part.sd, mean)
            columns.append(own)
            sd.append(np.full(len(own), part.sd))
        return Prediction(mean + nuisances(mean), np.vstack(columns), np.concatenate(sd) ** -2.0)

    def _nuisances(self, more: ExtendedRecording) -> Callable[[Array], Array]:
        """What origins and faces add to a mean, as the recording so far tells them."""
        count = len(self.found.data)
        columns, sd = nuisances(bare_problem(more.data), self.found.search.noise_models.plain())
        rows, sigma_um = independent_metric(self.found.data, more.metric.sigma_um).rows, more.metric.sigma_um
        design = rows(columns[:, :count]) * (sd / sigma_um)[:, None]
        factor = cho_factor(design @ design.T + np.eye(len(sd)))

        def told(mean: Array) -> Array:
            left = rows((self.found.data.um - mean[:count]) / sigma_um)
            return np.asarray(cho_solve(factor, design @ left) * sd @ columns)

        return told

    def _formed(self, columns: Array, sd: float, mean: Array) -> Array:
        """What a form adds: its amplitudes fitted to what is left in the recording so far."""
        count = len(self.found.data)
        design = self._metric(columns[:, :count]) * sd
        left = self._metric(self.found.data.um - mean[:count])
        amplitudes = np.linalg.solve(design @ design.T + np.eye(len(design)), design @ left)
        return np.asarray(amplitudes * sd @ columns)


def _is_summed(part: HypothesisTerm) -> bool:
    """Whether a part is a sum of many functions with amplitudes, and no law with a fit of its own."""
    return not part.candidate.named or part.candidate.combined


def _columns(part: HypothesisTerm, data: Residuals, forms: dict[str, Candidate]) -> Array:
    """How the rows of a lengthened recording change with the amplitudes of a part, ``(d, n)``."""
    source: Any = part.candidate.source
    if part.candidate.combined:
        return np.asarray(source.columns(data))
    if part.candidate.named:
        return usual_signature(source, source.atoms[part.atom], data)
    form = forms.get(part.candidate.label)
    if form is None or part.atom >= form.atoms:
        return np.zeros((0, len(data)))
    if part.shape is None or not isinstance(form, Law):
        return form.columns(part.atom)
    return np.concatenate([form.source.of([part.shape])[0] * share for share in form.shares])
