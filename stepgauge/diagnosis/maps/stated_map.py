"""What is stated of a map: the search of :mod:`stepgauge.inference`, and the changes that it finds fitted together.

Changes of one construction do not add up exactly. What those that were found do together beside the sum of what each
does alone is subtracted, and the search repeated until that does not change.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from stepgauge.diagnosis.checks import predictive_checks, widening
from stepgauge.diagnosis.maps.candidates import ProbeChange
from stepgauge.diagnosis.maps.data import MapScatter
from stepgauge.diagnosis.maps.model import ChangeTerm, MapModel, Terms
from stepgauge.diagnosis.maps.signatures import MapRows, Point, fit_changes, make_problem
from stepgauge.diagnosis.priors import Priors
from stepgauge.diagnosis.result import Check, rms
from stepgauge.diagnosis.stating_rules import SURE_OUTLIER, StatedTerm, answer_of, sign_is_sure, stated_terms
from stepgauge.files.arrays import Array
from stepgauge.inference.hypothesis import Hypothesis
from stepgauge.inference.metric import Metric
from stepgauge.inference.noise_models import OUTLYING
from stepgauge.inference.posterior import Member, Posterior
from stepgauge.inference.problem import Candidate
from stepgauge.inference.search import Progress, Search

PASSES = 4
SETTLED = 0.1
"""Rms change of what changes do together, over the scatter of a reading, below which the search is not repeated."""
SAME_SCATTER = 1.15


@dataclass(frozen=True)
class StatedMap:
    """The hypothesis that is stated of a map: ``laws`` with the terms of ``fitted``, and ``forms``.

    ``vague``: laws whose size is not determined; ``slight``: terms that explain so little of the residuals that inexact
    statics may cause them; ``moved_by_slight``: their influence on the values of each law as a factor on uncertainties;
    ``wider``: factor on uncertainties from the predictive ``checks``; ``metric``: of the scatter, beside all terms that
    are not named.
    """

    rows: MapRows
    answer: Posterior
    state: Hypothesis
    laws: Sequence[StatedTerm]
    forms: Sequence[StatedTerm]
    vague: Sequence[StatedTerm]
    slight: Sequence[StatedTerm]
    fitted: Terms
    moved_by_slight: Array
    metric: Metric
    priors: Priors
    checks: tuple[Check, ...]
    wider: float

    @property
    def search(self) -> Search:
        """The search of the last pass."""
        return self.answer.search

    @cached_property
    def kept(self) -> NDArray[np.bool_]:
        """Rows ``(n,)`` that are not outliers."""
        outlying, stated = self.state.noise.outlying, self.priors.decision.stated
        if outlying is None or self.answer.probability_of_scatter(OUTLYING) < stated:
            return np.ones(len(self.rows.data), bool)
        return np.asarray((outlying.reshape(len(self.rows.sigma), -1) <= SURE_OUTLIER).all(axis=0))

    @property
    def grows(self) -> bool:
        """Whether it is stated that the scatter grows with the value."""
        stated = self.answer.probability_of_scatter("growth") >= self.priors.decision.stated
        return stated and self.state.noise.growth is not None

    @property
    def interaction(self) -> Array:
        """What the changes do together minus the sum of what each does alone ``(m,)``."""
        alone = (self.rows.moved((term,)) for term in self.fitted)
        return self.rows.moved(self.fitted) - sum(alone, np.zeros(len(self.rows.um)))

    def substitute_rival(self, place: int, rival: Member) -> Terms:
        """All changes fitted together, with a rival in the place of one."""
        terms = list(self.fitted)
        terms[place] = _change(rival.hypothesis, rival.candidate, rival.proposal.atom)
        return fit_changes(terms, self.rows, self.metric, self.priors, self.rows.um)


@threadpool_limits.wrap(limits=1, user_api="blas")
def stated_map(
    model: MapModel,
    candidates: Sequence[ProbeChange],
    scatter: MapScatter,
    priors: Priors,
    progress: Progress | None = None,
) -> StatedMap:
    """What is stated of a map, with what the changes do together."""
    rows = MapRows(model, scatter.sigma)
    interaction = np.zeros(len(rows.um))
    for _ in range(PASSES):
        search = Search(make_problem(rows, candidates, priors, interaction), priors.scatter, progress)
        found = _stated(rows, search, priors)
        sigma = _sigma(rows, found.state, scatter)
        change = np.array(sigma) / np.array(rows.sigma)
        if rms(found.interaction - interaction) < SETTLED and change.max() / change.min() < SAME_SCATTER:
            break
        interaction = rows.stacked(MapRows(model, sigma).parts(found.interaction))
        rows = MapRows(model, sigma)
    return found


def _sigma(rows: MapRows, state: Hypothesis, scatter: MapScatter) -> tuple[float, ...]:
    """Scatter of each quantity: that of its repeats, or that of the residuals of the hypothesis."""
    if scatter.repeats or len(rows.sigma) == 1:
        return rows.sigma
    left = np.split(state.noise.weight * state.residual_um**2, len(rows.sigma))
    least = [m.rounding for m in rows.data.measured]
    return tuple(max(s * float(np.sqrt(one.mean())), m) for s, one, m in zip(rows.sigma, left, least, strict=True))


def _stated(rows: MapRows, search: Search, priors: Priors) -> StatedMap:
    answer = answer_of(search, priors.decision)
    state, every = stated_terms(search, answer, priors.decision.stated)
    plain = _metric(search, state)
    checks = predictive_checks(search.problem, state, plain)
    wider = widening(checks, search.problem, state, plain)
    forms, laws = ([one for one in every if one.named is named] for named in (False, True))
    vague = [one for one in laws if not sign_is_sure(one, state, answer, priors.decision, wider)]
    laws = [one for one in laws if one not in vague]
    slight: list[StatedTerm] = []
    whole = plain(rows.um)
    least = priors.maps.slight * float(whole @ whole)
    while True:  # the laws together, without those that are not determined beside the others, or slight
        metric = _metric(search, state, (*forms, *vague))
        changes = [_change(state, one.lead.candidate, one.term.atom) for one in laws]
        fitted = fit_changes(changes, rows, metric, priors, rows.um)
        told = [term.significance for term in fitted]
        first, smallest = min(enumerate(told), key=lambda one: one[1], default=(0, np.inf))
        if smallest < priors.decision.determined**2:
            vague.append(laws.pop(first))
        elif smallest < least and len(laws) > 1:
            slight.append(laws.pop(first))
        else:
            break
    factor = np.ones(len(laws))
    if slight:
        beside = _metric(search, state, (*forms, *vague, *slight))
        factor = _moved(fitted, fit_changes(fitted, rows, beside, priors, rows.um))
    moved = (plain(state.contribution_um(state.index(one.term.candidate))) for one in forms)
    slight += [one for one, white in zip(forms, moved, strict=True) if white @ white < least]
    others = ([one for one in forms if one not in slight], vague, slight)
    return StatedMap(rows, answer, state, laws, *others, fitted, factor, metric, priors, checks, wider)


def _metric(search: Search, state: Hypothesis, nuisances: Sequence[StatedTerm] = ()) -> Metric:
    """That of the scatter, beside other terms."""
    beside = [one.term.nuisance for one in nuisances]
    return Metric(search.problem, state.noise, search.noise_models, state.sigma_um, beside)


def _moved(fitted: Terms, other: Terms) -> Array:
    """Factors on uncertainties for the shift of the values in another fit, one to a term."""
    shifts = (np.subtract(one.values, two.values) for one, two in zip(fitted, other, strict=True))
    variances = (np.maximum(np.diag(one.covariance), 1e-300) for one in fitted)
    return np.sqrt([1.0 + (off**2 / own).max() for off, own in zip(shifts, variances, strict=True)])


def _change(state: Hypothesis | None, candidate: Candidate, atom: int) -> ChangeTerm:
    """A law as a change of the probe, with its amplitudes in a hypothesis; of the size of its shape without one."""
    point: Point = candidate.source.points[atom]
    if state is None:
        return ChangeTerm(point.candidate, point.values(np.full(len(point.step), point.size)))
    place = state.index(candidate)
    chosen = state.terms[place]
    point = chosen.shape if isinstance(chosen.shape, Point) else candidate.source.points[chosen.atom]
    return ChangeTerm(point.candidate, point.values(state.amplitudes(place)[0][: len(point.step)]))
