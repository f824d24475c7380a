"""A look at a candidate beside a hypothesis, against the sum of the exact numbers of all its shapes and sizes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import special, stats

from stepgauge.inference.evidence import Evidence
from stepgauge.inference.hypothesis import Hypothesis
from stepgauge.inference.kernels import matern
from stepgauge.inference.noise_priors import NoisePriors
from stepgauge.inference.problem import AmplitudePrior, Candidate, GaussianProcess, Law, Term
from stepgauge.inference.proposal import UNSEEN, Proposal
from stepgauge.inference.screening import Screening
from stepgauge.inference.tables import _explained, _unseen
from tests.inference.made import (
    FACES,
    REPEATS,
    ROWS,
    coordinate,
    law,
    noise,
    problem,
    random_function,
    term,
    turns,
    waves,
)

SHARES = np.array([np.arange(ROWS) % 3 > 0, 1.0 - 0.3 * coordinate()], float)
CANDIDATES: dict[str, Candidate] = {
    "one amplitude": law("slope", np.stack([coordinate(), turns()])[:, None]),
    "two": law("wave", waves(turns(), [1.0, 1.4, 1.8])),
    "three": law("ripple", np.concatenate([waves(turns(), [1.3, 2.6]), np.ones((2, 1, ROWS))], axis=1)),
    "four": law("moving wave", waves(turns(), [1.5, 2.5]), SHARES),
    "five, of one shape": law("bell", np.concatenate([*waves(turns(), [1.2, 2.3]), np.ones((1, ROWS))])[None]),
    "a random function": random_function(coordinate()),
}
TRUTH = {"scatter": 0.0, "something": 0.25, "much": 1.0}


def looked(
    candidate: Candidate, um: float, terms: tuple[Term, ...], **facets: object
) -> tuple[Proposal, Evidence, Hypothesis]:
    values = noise() + um * np.sin(9.0 * turns()) * (1.0 + coordinate())
    others = tuple(one for one in CANDIDATES.values() if one is not candidate)
    one = problem(values, (candidate, *others))
    evidence = Evidence(one, NoisePriors())
    state = evidence(terms, evidence.noise_models.changed(evidence.noise_models.plain(), **facets))
    (look,) = (look for look in Screening(one)(state, evidence.noise_models) if look.candidate is candidate)
    return look, evidence, state


def exact(candidate: Candidate, evidence: Evidence, state: Hypothesis) -> float:
    """Log posterior of the candidate being there, in any shape and size, against it not being there."""
    weight = candidate.log_weight if isinstance(candidate, Law) else np.full(candidate.atoms, -np.log(candidate.atoms))
    total = []
    for atom in range(candidate.atoms):
        for sd, share in zip(candidate.sizes.sd, candidate.sizes.log_weight, strict=True):
            own = Term(candidate, atom, candidate.columns(atom), float(sd), candidate.log_odds + weight[atom] + share)
            total.append(evidence((*state.terms, own), state.noise, state.sigma_um).log_posterior)
    return float(special.logsumexp(total)) - state.log_posterior


@pytest.mark.parametrize("beside", [False, True], ids=["alone", "beside a term"])
@pytest.mark.parametrize("um", TRUTH.values(), ids=TRUTH)
@pytest.mark.parametrize("candidate", CANDIDATES.values(), ids=CANDIDATES)
def test_a_look_is_the_sum_over_shapes_and_sizes(candidate: Candidate, um: float, beside: bool) -> None:
    bend = law("bend", (coordinate() ** 2)[None, None])
    look, evidence, state = looked(candidate, um, (term(bend),) if beside else ())
    wanted = exact(candidate, evidence, state)
    # of much more than the scatter sizes are priced by the scatter before the candidate, which is larger than after it
    assert look.gain == pytest.approx(wanted, abs=0.3, rel=0.2 if um > 0.5 else 0.0)


@pytest.mark.parametrize("facets", [{"correlation": 0.7}, {"growth": ("position", 3.0)}, {"certificate": 4.0}])
def test_a_look_knows_the_scatter_of_its_hypothesis(facets: dict[str, object]) -> None:
    """To a nat: nuisances keep their ratio to the scatter while that is integrated."""
    candidate = CANDIDATES["four"]
    look, evidence, state = looked(candidate, 0.25, (), **facets)
    assert look.gain == pytest.approx(exact(candidate, evidence, state), abs=1.2)


def test_the_term_of_a_look_has_the_volume_of_all_shapes_and_sizes_in_its_prior() -> None:
    """The hypothesis with that term is as likely as all shapes and sizes together."""
    candidate = CANDIDATES["two"]
    look, evidence, state = looked(candidate, 1.0, ())
    added = evidence((look.term(),), state.noise, state.sigma_um)
    wanted = exact(candidate, evidence, state)
    assert added.log_posterior - state.log_posterior == pytest.approx(wanted, abs=1.5, rel=0.0)


@pytest.mark.parametrize("bound", [{"positive": True}, {"least": 0.05}], ids=["positive", "not small"])
def test_a_law_within_bounds_is_looked_at_with_a_part_of_a_normal_prior(bound: dict[str, Any]) -> None:
    """The evidence without bounds, times the share of the posterior within them over that of the prior."""
    slope = law("slope", coordinate()[None, None], **bound)
    least, positive = bound.get("least", 0.0), bound.get("positive", False)
    both = law("slope of any sign", coordinate()[None, None])
    for sign in (1.0, -1.0):
        one = problem(noise() + sign * 0.1 * coordinate(), (slope, both))
        evidence = Evidence(one, NoisePriors())
        state = evidence((), evidence.noise_models.plain())
        gains = {look.candidate.label: look.gain for look in Screening(one)(state, evidence.noise_models)}
        total = []
        for sd, weight in zip(both.sizes.sd, both.sizes.log_weight, strict=True):
            own = Term(both, 0, both.columns(0), float(sd), both.log_odds + weight)
            added = evidence((own,), state.noise)
            mean, covariance = added.amplitudes(0)
            share = [
                one.sf(least) + (0.0 if positive else one.cdf(-least))
                for one in (stats.norm(mean[0], np.sqrt(covariance[0, 0])), stats.norm(0.0, sd))
            ]
            total.append(added.log_posterior - state.log_posterior + np.log(share[0] / share[1]))
        assert gains["slope"] == pytest.approx(float(special.logsumexp(total)), abs=0.3)


@pytest.mark.parametrize("size", [1.0, 3e5])
@pytest.mark.parametrize("facets", [{}, {"correlation": 0.7}], ids=["white", "correlated"])
def test_what_terms_leave_is_the_conditional_distribution(facets: dict[str, object], size: float) -> None:
    """By least squares with the amplitudes' priors as rows; two terms are nearly alike and may be very large."""
    like = law("like the wave", waves(turns(), [1.01]))
    terms = (term(CANDIDATES["two"], sd=size), term(like, sd=size), term(CANDIDATES["a random function"], sd=0.2))
    one = problem(noise() + size * np.sin(2.0 * np.pi * 1.01 * turns()), tuple(CANDIDATES.values()))
    evidence = Evidence(one, NoisePriors())
    state = evidence(terms, evidence.noise_models.changed(evidence.noise_models.plain(), **facets))
    looker = Screening(one).metric_screening(state, evidence.noise_models)
    vectors = looker.vectors_of(state)
    turned = looker.beside(vectors).turn.T @ np.vstack([each.mapped for each in vectors])
    left, lost, white = turned[0], turned[1:], vectors[0].mapped[0]
    wide = looker.metric(np.vstack([each.columns for each in state.terms]))
    wide *= np.concatenate([each.sds for each in state.terms])[:, None]
    stacked, known = np.vstack([wide.T, np.eye(len(wide))]), np.vstack([np.eye(ROWS), np.zeros((len(wide), ROWS))])
    wanted = np.eye(ROWS) - wide.T @ np.linalg.lstsq(stacked, known, rcond=None)[0]
    assert_allclose(np.eye(ROWS) - lost.T @ lost, wanted, atol=0.02)  # directions with less are left out
    assert_allclose(left, wanted @ white, atol=0.01 * np.abs(white).max() / size**0.5)


@pytest.mark.parametrize("share", [(1.0, -100.0), (1.0, -100.0, 30.0)])
def test_rounding_makes_no_evidence_of_amplitudes_that_are_one(share: tuple[float, ...]) -> None:
    """Signatures in proportion explain what one of them explains, though rounding makes their determinant negative."""
    one = np.array(share) / np.linalg.norm(share)
    exact = np.outer(one, one)
    unseen = 1e-3 * np.diag(exact)
    rounded = exact + np.diag(unseen)
    rounded[0, 1:] *= 1.002
    rounded[1:, 0] *= 1.002
    assert np.linalg.det(rounded) < 0.0
    explained, log_det = _explained(rounded[None], unseen[None], np.array([[1e-14]]), 3.0 * one[None])
    assert explained.item() == pytest.approx(9.0, rel=0.05)
    assert log_det.item() >= np.log(unseen / 1e-14).sum()


@pytest.mark.parametrize("first", [0.90, 0.93, 0.94, 0.96])
@pytest.mark.parametrize("apart", [1e-3, 1e-4])
def test_rounding_makes_no_evidence_where_shares_cancel_each_other(apart: float, first: float) -> None:
    """Directions that differ in the first half of a record, and in the second by less than single precision shows."""
    one = np.linspace(first, 0.98, ROWS)
    other = np.where(turns() < 0.5, -one, (1.0 - apart) * one + 1e-7 * coordinate())
    steps = np.stack([(turns() > edge).astype(float) for edge in (0.6, 0.7, 0.8)])[:, None]
    wide = AmplitudePrior(np.array([0.5, 1e3]), np.log([0.9, 0.1]))
    both = replace(law("both", steps, np.stack([one - other, one + 1e-6 * coordinate()])), sizes=wide)
    known = problem(noise() + turns(), (law("one", steps, one[None]), law("other", steps, other[None]), both))
    evidence = Evidence(known, NoisePriors())
    state = evidence((), evidence.noise_models.plain())
    (look,) = (look for look in Screening(known)(state, evidence.noise_models) if look.candidate is both)
    assert look.gain <= exact(both, evidence, state) + 0.3


@pytest.mark.parametrize("seed", range(5))
def test_rounding_makes_no_evidence_of_many_amplitudes_that_are_two(seed: int) -> None:
    """Every element of the matrix of ten signatures is off by what rounding may make of it."""
    random = np.random.default_rng(seed)
    mix = random.normal(size=(10, 2))
    exact = mix @ mix.T
    length = np.sqrt(np.diag(exact))
    off = UNSEEN * random.uniform(-1.0, 1.0, (10, 10)) * np.outer(length, length)
    unseen = _unseen(length[None, None], np.ones((1, 1)))
    rounded = exact + np.tril(off) + np.tril(off, -1).T + np.diag(unseen[0])
    dot = mix @ np.array([3.0, 4.0])
    explained, _ = _explained(rounded[None], unseen, np.array([[1e-14]]), dot[None])
    assert explained.item() == pytest.approx(25.0, rel=1e-3)


def test_pairs_have_all_their_sizes_beside_a_law_that_cannot_be_large() -> None:
    """Two laws whose sum tells little of each: they are tried as large as they are, whatever a third one may be."""
    slope, near = coordinate(), coordinate() + 0.01 * np.sin(7.0 * turns())
    small = replace(law("small", turns()[None, None]), sizes=AmplitudePrior(np.array([0.01, 0.02]), np.log([0.5, 0.5])))
    wide = AmplitudePrior(np.array([0.1, 1.0, 10.0, 100.0]), np.log(np.full(4, 0.25)))
    pair = [replace(law(label, um[None, None]), sizes=wide) for label, um in (("one", slope), ("other", near))]
    one = problem(noise() + 80.0 * (near - slope), (small, *pair))
    evidence = Evidence(one, NoisePriors())
    state = evidence((), evidence.noise_models.plain())
    (first, second), *_ = Screening(one).pairs(state, evidence.noise_models, 3, frozenset())
    assert {first.candidate.label, second.candidate.label} == {"one", "other"}
    assert first.sd == second.sd == 100.0


@pytest.mark.parametrize("seed", range(4))
def test_a_rough_function_far_above_the_scatter_is_rated_by_what_it_leaves(seed: int) -> None:
    """By the scatter before it, or without its finest features, a random walk was 400 nats too improbable."""
    walk = np.cumsum(np.random.default_rng(seed).normal(0.0, 2.0, FACES))
    sizes = AmplitudePrior(np.array([1.0, 3.0, 10.0]), np.log([0.3, 0.4, 0.3]))
    candidate = GaussianProcess(
        "walk",
        "walk",
        False,
        float(np.log(0.03)),
        sizes,
        None,
        features=(matern(coordinate(), 1.0, rough=True),),
        rough=True,
    )
    one = problem(noise(seed) + np.tile(walk, REPEATS), (candidate,))
    evidence = Evidence(one, NoisePriors())
    state = evidence((), evidence.noise_models.plain())
    (look,) = Screening(one)(state, evidence.noise_models)
    assert look.gain == pytest.approx(exact(candidate, evidence, state), rel=0.16)
