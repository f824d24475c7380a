"""The search of a map: hypotheses by additive signatures, then the named changes together by the statics of the probe.

Changes of one construction do not add up exactly, and a signature is exact for one size only. So the joint influence of
the changes found minus the sum of their single ones is subtracted, signatures of their exact sizes are added, and the
search is repeated until nothing changes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from stepgauge.diagnosis.checks import predictive_checks, widening
from stepgauge.diagnosis.credible import StatedTerm, answer_of, sign_is_sure, stated_terms
from stepgauge.diagnosis.maps.candidates import ProbeChange
from stepgauge.diagnosis.maps.fit import FittedChanges, fit
from stepgauge.diagnosis.maps.forms import DirectionForm
from stepgauge.diagnosis.maps.model import ChangeTerm, MapModel
from stepgauge.diagnosis.maps.problem import LOBES, MapRows, Point, make_problem, signature
from stepgauge.diagnosis.maps.scatter import MapScatter
from stepgauge.diagnosis.priors import Priors
from stepgauge.diagnosis.result import Check, rms
from stepgauge.files.arrays import Array
from stepgauge.inference.hypothesis import Hypothesis
from stepgauge.inference.metric import Metric
from stepgauge.inference.posterior import Member, Posterior
from stepgauge.inference.priors import NoisePriors
from stepgauge.inference.problem import Law, Problem
from stepgauge.inference.problem import Term as Chosen
from stepgauge.inference.proposal import Proposal
from stepgauge.inference.search import Search

PASSES = 4
SETTLED = 0.1
"""Rms difference of signatures and statics, over the scatter of a reading, below which they count as equal."""
SAME_SCATTER = 1.15
ALIKE = 0.98
"""Cosine between the signatures of two changes from which each is fitted in the place of the other."""
ROUNDS, SAME_SIZE = 8, 0.01
"""Rounds in which the size of a signature is set to its amplitude, and the relative agreement of the two."""


@dataclass(frozen=True)
class SearchedMap:
    """The hypothesis that is stated for a map.

    ``laws`` with the terms of ``fitted``; ``forms``; ``vague``: laws whose size is not determined; ``slight``: terms
    that explain so little of the residuals that inexact statics may cause them; ``moved_by_slight``: their influence on
    the values of each law as a factor on uncertainties; ``wider``: factor on uncertainties from the predictive
    ``checks``; ``metric``: of the scatter alone, ``beside``: with all terms that are not named.
    """

    rows: MapRows
    search: Search
    answer: Posterior
    state: Hypothesis
    laws: tuple[StatedTerm, ...]
    forms: tuple[StatedTerm, ...]
    vague: tuple[StatedTerm, ...]
    slight: tuple[StatedTerm, ...]
    fitted: FittedChanges
    moved_by_slight: Array
    metric: Metric
    beside: Metric
    priors: Priors
    checks: tuple[Check, ...]
    wider: float

    def term_of(self, rival: Member) -> ChangeTerm:
        """A rival of a law as a change, with its values from the search."""
        if rival.hypothesis is None:
            point = _point(rival.proposal.term())
            return ChangeTerm(point.candidate, point.values(np.full(len(point.step), point.size)))
        place = rival.hypothesis.index(rival.candidate)
        return _term(rival.hypothesis, rival.hypothesis.terms[place])

    def replacements(self, place: int, rival: Member) -> FittedChanges:
        """All changes, fitted with a rival in the place of one."""
        terms = (*self.fitted.terms[:place], self.term_of(rival), *self.fitted.terms[place + 1 :])
        return fit(terms, self.rows, self.beside, self.priors)


class SizedSearch(Search):
    """A search that also begins with the result of an earlier one, and computes every law at its actual size."""

    def __init__(self, problem: Problem, priors: NoisePriors, rows: MapRows, seed: Sequence[str] = ()) -> None:
        super().__init__(problem, priors)
        self.rows, self.seed = rows, seed

    def run(self) -> Hypothesis:
        """The more probable of two hypotheses: from a search from nothing, and from one that began with ``seed``."""
        best, seeded = super().run(), self.start
        for label in self.seed:
            for look in self.screen(seeded):
                if look.candidate.label == label:
                    seeded = self.added(seeded, _exact(look))
        seeded = self.polished(self.reshaped(seeded))
        return best if seeded.log_posterior <= best.log_posterior else self.climbed(self._better(best, seeded))

    def _shaped(self, state: Hypothesis, look: Proposal) -> Hypothesis:
        """The hypothesis with one more term; intermediate sizes are not kept among the computed hypotheses."""
        visited = self.evidence.visited
        known = set(visited)
        found = self._grown_to_size(super()._shaped(state, look), look)
        for other in [one for one in visited if one not in known and visited[one] is not found]:
            del visited[other]
        return found

    def _grown_to_size(self, found: Hypothesis, look: Proposal) -> Hypothesis:
        law = look.candidate
        if not isinstance(law, Law) or look.by_atom is None or len(law.sizes.sd) < 2:
            return found
        for _ in range(ROUNDS):
            sized = self._sized(found, self._of_its_size(found, law), look)
            if sized is found:
                break
            found = sized
        return found

    def _of_its_size(self, found: Hypothesis, law: Law) -> Chosen:
        """The term of a law with the signature at the size of its amplitude."""
        place = found.index(law)
        term = found.terms[place]
        if not law.named or (point := _point(term)).candidate.shape not in ("line", "plane"):
            return term
        size = float(f"{found.amplitudes(place)[0][0]:.3g}")
        sized = replace(point, size=size)
        if size == 0.0 or _of_one_size(sized, point):
            return term
        for exact, columns in signature(self.rows, sized):
            return replace(term, columns=columns, shape=exact)
        return term

    def _sized(self, found: Hypothesis, term: Chosen, look: Proposal) -> Hypothesis:
        """The hypothesis with another term of the same law; the shapes of a line are its sizes, which are summed."""
        law = look.candidate
        line = law.named and _point(term).candidate.shape == "line"
        sized = replace(term, log_prior=law.log_odds + (0.0 if line else look.volume))
        others = tuple(one for one in found.terms if one.candidate is not law)
        return self.evidence((*others, sized), found.noise, found.sigma_um)


def _exact(look: Proposal) -> Proposal:
    """The look of a law at the size that was fitted before: the last one of its shapes."""
    law = look.candidate
    if not isinstance(law, Law) or not law.named or law.source[-1].candidate.shape not in ("plane", "lobes"):
        return look
    return replace(look, atom=law.atoms - 1, volume=look.volume_of(law.atoms - 1))


@threadpool_limits.wrap(limits=1, user_api="blas")
def searched(model: MapModel, candidates: Sequence[ProbeChange], scatter: MapScatter, priors: Priors) -> SearchedMap:
    """The result of the search of a map, with signatures that agree with the statics of the probe."""
    rows = MapRows(model, scatter.sigma)
    remainder, before = np.zeros(len(rows.um)), np.full(len(rows.um), np.inf)
    fitted: dict[str, list[Point]] = {}
    seed: tuple[str, ...] = ()
    for _ in range(PASSES):
        problem = make_problem(rows, candidates, priors, remainder, fitted)
        found = _search(rows, SizedSearch(problem, priors.scatter, rows, seed), priors)
        exact = rows.moved(found.fitted.terms)
        settled = min(rms(exact - before), rms(_signatures(found) + remainder - exact)) < SETTLED
        points = _exactly(found)
        if settled and _same(rows, found, scatter) and _are_tried(points, fitted):
            break
        remainder = exact - sum((rows.moved((term,)) for term in found.fitted.terms), np.zeros(len(exact)))
        before, fitted = exact, points
        seed = tuple(one.lead.candidate.label for one in (*found.laws, *found.forms))
        rows = MapRows(model, _sigma(rows, found, scatter))
    return found


def _search(rows: MapRows, search: Search, priors: Priors) -> SearchedMap:
    answer = answer_of(search, priors.decision)
    state, said = stated_terms(search, answer, priors.decision.stated)
    forms, slight = [one for one in said if not one.named], list[StatedTerm]()
    scatter = (search.problem, state.noise, search.noise_models, state.sigma_um)
    metric = Metric(*scatter)
    checks = predictive_checks(search.problem, state, metric)
    wider = widening(checks, search.problem, state, metric)
    sure = [one for one in said if one.named and sign_is_sure(one, state, answer, priors.decision, wider)]
    vague = [one for one in said if one.named and one not in sure]
    while True:
        beside = Metric(*scatter, [one.term.nuisance for one in (*forms, *vague)])
        fitted = fit([_term(state, one.term) for one in sure], rows, beside, priors)
        if (least := _least_determined(fitted, priors.decision.determined)) is not None:
            vague.append(sure.pop(least))
        elif (least := _slightest(fitted, rows, beside, priors)) is not None:
            slight.append(sure.pop(least))
        else:
            break
    moved = np.ones(len(fitted.terms))
    if slight:
        without = Metric(*scatter, [one.term.nuisance for one in (*forms, *vague, *slight)])
        moved = _moved_by(fitted, rows, without, priors)
    slight += [one for one in forms if _share_of(one, state, metric, rows) < priors.maps.slight]
    forms = [one for one in forms if one not in slight]
    told_of = (tuple(sure), tuple(forms), tuple(vague), tuple(slight))
    return SearchedMap(rows, search, answer, state, *told_of, fitted, moved, metric, beside, priors, checks, wider)


def _least_determined(fitted: FittedChanges, least: float) -> int | None:
    """The change of the smallest size in standard uncertainties, if it is not determined beside the others."""
    sizes = []
    for place, term in enumerate(fitted.terms):
        off = np.array(term.values) - np.array(term.candidate.none)
        sizes.append(float(off @ np.linalg.pinv(fitted.covariance_of(place)) @ off))
    return int(np.argmin(sizes)) if sizes and min(sizes) < least**2 else None


def _slightest(fitted: FittedChanges, rows: MapRows, metric: Metric, priors: Priors) -> int | None:
    """The change that explains least of the residuals, if this is within the inexactness of the statics."""
    if len(fitted.terms) < 2:
        return None
    total, left = _square(metric(rows.um)), _square(metric(rows.um - rows.moved(fitted.terms)))
    shares = []
    for place in range(len(fitted.terms)):
        others = fit((*fitted.terms[:place], *fitted.terms[place + 1 :]), rows, metric, priors)
        shares.append((_square(metric(rows.um - rows.moved(others.terms))) - left) / total)
    return int(np.argmin(shares)) if min(shares) < priors.maps.slight else None


def _moved_by(fitted: FittedChanges, rows: MapRows, beside: Metric, priors: Priors) -> Array:
    """Factors on uncertainties for the shift of the values if slight terms are included, one to a term."""
    other = fit(fitted.terms, rows, beside, priors)
    found = []
    for place, (one, two) in enumerate(zip(fitted.terms, other.terms, strict=True)):
        variance = np.maximum(np.diag(fitted.covariance_of(place)), 1e-300)
        found.append(float(np.sqrt(1.0 + (np.subtract(one.values, two.values) ** 2 / variance).max())))
    return np.array(found)


def _share_of(form: StatedTerm, state: Hypothesis, metric: Metric, rows: MapRows) -> float:
    """Share of the squared residuals that a form explains."""
    place = next(i for i, term in enumerate(state.terms) if term is form.term)
    return _square(metric(state.amplitudes(place)[0] @ form.term.columns)) / _square(metric(rows.um))


def _square(values: Array) -> float:
    return float(values @ values)


def _point(chosen: Chosen) -> Point:
    point: Point = chosen.shape if isinstance(chosen.shape, Point) else chosen.candidate.source[chosen.atom]
    return point


def _term(state: Hypothesis, chosen: Chosen) -> ChangeTerm:
    """A law of a hypothesis as a change of the probe, with its amplitudes in the hypothesis."""
    point = _point(chosen)
    place = next(i for i, t in enumerate(state.terms) if t is chosen)
    return ChangeTerm(point.candidate, point.values(state.amplitudes(place)[0][: len(point.step)]))


def _signatures(found: SearchedMap) -> Array:
    """Sum of the signatures of the laws, ``(m,)``."""
    moved = np.zeros(len(found.rows.um))
    for said in found.laws:
        place = next(i for i, t in enumerate(found.state.terms) if t is said.term)
        moved += found.state.amplitudes(place)[0] @ said.term.columns
    return moved


def _exactly(found: SearchedMap) -> dict[str, list[Point]]:
    """The fitted sizes of the laws and of similar ones, to be tried exactly."""
    points: dict[str, list[Point]] = {}
    alike = [fitted.terms[place] for place in range(len(found.laws)) for fitted in _alike(found, place)]
    for term in (*alike, *found.fitted.terms):
        candidate = term.candidate
        point = _point_of(term)
        if point.size and candidate.shape != "linear":
            points.setdefault(candidate.prior or candidate.kind, []).append(point)
    return points


def _are_tried(points: dict[str, list[Point]], tried: dict[str, list[Point]]) -> bool:
    """Whether every change that may stand for a stated one was a hypothesis at its own size."""
    return all(
        any(one.candidate.label == point.candidate.label and _of_one_size(one, point) for one in tried.get(name, ()))
        for name, several in points.items()
        for point in several
    )


def _of_one_size(one: Point, other: Point) -> bool:
    return abs(one.size / other.size - 1.0) < SAME_SIZE


def _point_of(term: ChangeTerm) -> Point:
    candidate, moved = term.candidate, np.array(term.values) - np.array(term.candidate.none)
    if candidate.shape == "lobes":
        return Point(candidate, (0.0, term.values[1], 0.0), LOBES)
    size = float(np.linalg.norm(moved)) * (1.0 if len(moved) > 1 else float(np.sign(moved[0])))
    return Point(candidate, candidate.none, (tuple(map(float, moved / (size or 1.0))),), size)


def _alike(found: SearchedMap, place: int) -> Iterator[FittedChanges]:
    """Fits with another change of one knob in the place of one, if their signatures are similar."""
    terms = found.fitted.terms
    moved = _unit(found.metric(found.rows.moved((terms[place],))))
    there = {said.lead.candidate.label for said in found.laws}
    for law in found.search.problem.candidates:
        if not isinstance(law, Law) or not law.named or law.dimension > 1 or law.label in there:
            continue
        near = [abs(float(_unit(found.metric(law.columns(i)[0])) @ moved)) for i in range(law.atoms)]
        point = law.source[int(np.argmax(near))]
        if max(near) > ALIKE and point.candidate.shape == "line":
            other = ChangeTerm(point.candidate, point.values(np.array([point.size])))
            yield fit((*terms[:place], other, *terms[place + 1 :]), found.rows, found.beside, found.priors)


def _unit(values: Array) -> Array:
    return values / max(float(np.linalg.norm(values)), 1e-300)


def _sigma(rows: MapRows, found: SearchedMap, scatter: MapScatter) -> tuple[float, ...]:
    """Scatter of each quantity: that of its repeats, or that of the residuals of the hypothesis."""
    if scatter.repeats or len(rows.sigma) == 1:
        return rows.sigma
    weight = found.state.noise.weight
    left = np.split(weight * found.state.residual_um**2, len(rows.sigma))
    least = [m.rounding for m in rows.data.measured]
    return tuple(max(s * float(np.sqrt(one.mean())), m) for s, one, m in zip(rows.sigma, left, least, strict=True))


def _same(rows: MapRows, found: SearchedMap, scatter: MapScatter) -> bool:
    """Whether the ratio of the scatters of the quantities agrees with the one used."""
    change = np.array(_sigma(rows, found, scatter)) / np.array(rows.sigma)
    return float(change.max() / change.min()) < SAME_SCATTER


def form_of(said: StatedTerm) -> tuple[DirectionForm, int]:
    """The form that is stated, and the index of its shape."""
    form: DirectionForm = said.source
    return form, said.term.atom
