"""The number that decides and the metric behind it, against dense covariance matrices and quadrature."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import special, stats
from scipy.integrate import trapezoid

from stepgauge.inference.amplitudes import log_inside
from stepgauge.inference.evidence import Evidence
from stepgauge.inference.hypothesis import Hypothesis
from stepgauge.inference.metric import Metric
from stepgauge.inference.noise_models import NoiseModel
from stepgauge.inference.noise_priors import NoisePriors
from stepgauge.inference.problem import AmplitudePrior, Problem, Term
from tests.inference.made import (
    NOISE_UM,
    ROWS,
    SIZES,
    coordinate,
    dense_covariance,
    law,
    noise,
    problem,
    random_function,
    term,
    turns,
    waves,
)

Array = NDArray[np.float64]
FACETS = {
    "white": {},
    "growing": {"growth": ("position", 3.0)},
    "correlated": {"correlation": 0.7},
    "growing and correlated": {"growth": ("time", 1.5), "correlation": 0.5},
    "a burst, growing": {"burst": (10, 25, 4.0), "growth": ("time", 1.5)},
    "1/f and growing": {"flicker": 0.6, "growth": ("time", 1.5)},
    "certificate": {"certificate": 4.0},
    "rounded": {"rounded": True},
    "all at once": {"growth": ("time", 6.0), "correlation": 0.9, "certificate": 2.0, "rounded": True},
}
TERMS: dict[str, tuple[Term, ...]] = {
    "nothing": (),
    "a slope": (term(law("slope", coordinate()[None, None]), sd=0.7, log_prior=-4.0),),
    "a wave and a function": (
        term(law("wave", waves(turns(), [2.0, 3.5])), atom=1, sd=0.4, log_prior=-5.5),
        term(random_function(coordinate()), atom=0, sd=0.2, log_prior=-3.0),
    ),
}


def made(facets: dict[str, object]) -> tuple[Problem, Evidence, NoiseModel]:
    um = noise() + 0.4 * np.sin(7.0 * turns()) + 0.3 * coordinate()
    latched_um = np.where(coordinate() > 0.0, 0.4, 0.2)
    one = problem(um, stated=1.0 + 4.0 * turns() ** 2 + (latched_um / NOISE_UM) ** 2, latched_um=latched_um)
    evidence = Evidence(one, NoisePriors())
    return one, evidence, evidence.noise_models.changed(evidence.noise_models.plain(), **facets)


def brute_force(one: Problem, scatter: NoiseModel, terms: Sequence[Term]) -> float:
    """Logarithm of the normal density of the residuals times the prior, over log sigma by quadrature."""
    spread = np.log(NoisePriors().sigma_factor)
    log_sigma = np.log(NOISE_UM) + np.linspace(-3.0, 3.0, 601)
    log = []
    for at in log_sigma:
        covariance = dense_covariance(one, scatter, terms, float(np.exp(at)))
        factor = np.linalg.cholesky(covariance)
        white = np.linalg.solve(factor, one.residual_um)
        log.append(-np.log(np.diag(factor)).sum() - 0.5 * white @ white - 0.5 * len(one) * np.log(2.0 * np.pi))
    log = np.array(log) + stats.norm.logpdf(log_sigma, np.log(one.scale_um), spread)
    whole = np.log(trapezoid(np.exp(log - log.max()), log_sigma)) + log.max()
    return float(whole + scatter.log_prior + sum(own.log_prior for own in terms))


@pytest.mark.parametrize("terms", TERMS.values(), ids=TERMS)
@pytest.mark.parametrize("facets", FACETS.values(), ids=FACETS)
def test_the_number_is_the_marginal_likelihood_times_the_prior(
    facets: dict[str, object], terms: tuple[Term, ...]
) -> None:
    """Up to a constant of the problem: that of the normal density, and of the prior of sigma."""
    one, evidence, scatter = made(facets)
    constant = 0.5 * ROWS * np.log(2.0 * np.pi) + np.log(np.log(NoisePriors().sigma_factor))
    found = evidence(terms, scatter).log_posterior
    assert found == pytest.approx(brute_force(one, scatter, terms) + constant, abs=0.06)


@pytest.mark.parametrize("facets", FACETS.values(), ids=FACETS)
def test_amplitudes_are_those_of_the_conditional_normal_distribution(facets: dict[str, object]) -> None:
    one, evidence, scatter = made(facets)
    terms = TERMS["a wave and a function"]
    state = evidence(terms, scatter)
    whole = dense_covariance(one, scatter, terms, state.sigma_um)
    for place, own in enumerate(terms):
        with_rows = own.sd**2 * own.columns
        mean, covariance = state.amplitudes(place)
        np.testing.assert_allclose(mean, with_rows @ np.linalg.solve(whole, one.residual_um), rtol=1e-5, atol=1e-6)
        wanted = own.sd**2 * np.eye(len(mean)) - with_rows @ np.linalg.solve(whole, with_rows.T)
        np.testing.assert_allclose(covariance, wanted, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("facets", FACETS.values(), ids=FACETS)
def test_what_is_left_is_what_the_scatter_alone_says(facets: dict[str, object]) -> None:
    """The posterior mean of the scatter of the rows: its own covariance times the inverse of the whole one."""
    one, evidence, scatter = made(facets)
    state = evidence(TERMS["a slope"], scatter)
    whole = dense_covariance(one, scatter, TERMS["a slope"], state.sigma_um)
    bare = replace(one, certified_u=np.zeros(len(one.certified)), free=one.free[:0])
    own = dense_covariance(bare, scatter, (), state.sigma_um, alike=False)
    np.testing.assert_allclose(state.residual_um, own @ np.linalg.solve(whole, one.residual_um), rtol=1e-5, atol=1e-5)


def test_expected_squares_are_those_of_a_row_for_given_others() -> None:
    """Independent scatter: what is left squared, and the variance of what the model says there."""
    one, evidence, scatter = made({})
    state = evidence(TERMS["a slope"], scatter)
    whole = dense_covariance(one, scatter, TERMS["a slope"], state.sigma_um)
    variance = state.sigma_um**2 * one.stated
    said = whole - np.diag(variance)
    spread = np.diag(said - said @ np.linalg.solve(whole, said))
    wanted = (state.residual_um**2 + spread) / variance
    np.testing.assert_allclose(evidence.squares(state), wanted, rtol=1e-4)


def test_the_order_of_terms_does_not_matter_and_each_hypothesis_is_computed_once() -> None:
    _, evidence, scatter = made({})
    terms = TERMS["a wave and a function"]
    assert evidence(terms, scatter) is evidence(terms[::-1], scatter)
    assert len(evidence.visited) == 1


def test_waves_that_are_equal_in_all_their_sums_are_two_hypotheses() -> None:
    """In an even rhythm of touches 3 and 3.25 turns have the same readings in another order."""
    one, other = waves(turns(), [3.0, 3.25])
    assert np.abs(one).sum() == pytest.approx(np.abs(other).sum(), rel=1e-14)
    wave = law("wave", one[None])
    problem_of_one = problem(3.0 * one[0] + noise())
    evidence = Evidence(problem_of_one, NoisePriors())
    scatter = evidence.noise_models.plain()
    states = [evidence((Term(wave, 0, columns, 0.5, -3.0),), scatter) for columns in (one, other)]
    assert states[0].log_posterior > states[1].log_posterior + 10.0


def test_half_normal_priors_of_either_sign_have_the_evidence_of_a_normal_one_on_average() -> None:
    """The integral over all amplitudes is that over the positive ones plus that over the negative ones."""
    _, evidence, scatter = made({})
    slope = coordinate()[None, None]
    both = evidence((term(law("slope", slope), log_prior=0.0),), scatter).log_posterior
    halves = [
        evidence((term(law(f"slope {sign}", sign * slope, positive=True), log_prior=0.0),), scatter).log_posterior
        for sign in (1.0, -1.0)
    ]
    assert special.logsumexp(halves) - np.log(2.0) == pytest.approx(both)
    assert abs(halves[0] - halves[1]) > 1.0


def test_a_law_that_cannot_be_small_is_not_there_where_its_amplitude_is() -> None:
    _, evidence, scatter = made({})
    slope = coordinate()[None, None]
    small, large = (
        evidence((term(law(f"slope of {least}", slope, least=least), log_prior=0.0),), scatter) for least in (1e-6, 2.0)
    )
    amplitude, u = small.amplitudes(0)[0][0], np.sqrt(small.amplitudes(0)[1][0, 0])
    lost = stats.norm.logsf((2.0 - abs(amplitude)) / u) - np.log(2.0) - stats.norm.logsf(2.0 / small.terms[0].sd)
    assert abs(amplitude) < 1.0
    assert large.log_posterior - small.log_posterior == pytest.approx(lost)


@pytest.mark.parametrize("positive", [False, True])
@pytest.mark.parametrize("least", [0.0, 0.3, 2.0])
def test_evidence_within_bounds_is_the_integral_over_the_cut_prior(least: float, positive: bool) -> None:
    """By quadrature, for a normal likelihood with the mean 0.5 and the standard deviation 0.4."""
    amplitude, sd = np.linspace(-12.0, 12.0, 400_001), 1.5
    prior = stats.norm.pdf(amplitude, 0.0, sd)
    product = prior * stats.norm.pdf(0.5, amplitude, 0.4)
    inside = (amplitude >= least) if positive else (np.abs(amplitude) >= least)
    cut = trapezoid(product * inside, amplitude) / trapezoid(prior * inside, amplitude)
    variance = 1.0 / (0.4**-2.0 + sd**-2.0)
    found = log_inside(0.5 * variance / 0.4**2, np.sqrt(variance), sd, least, positive)
    assert float(found) == pytest.approx(np.log(cut / trapezoid(product, amplitude)), abs=1e-3)


@pytest.mark.parametrize("beside", TERMS.values(), ids=TERMS)
@pytest.mark.parametrize("facets", FACETS.values(), ids=FACETS)
def test_products_of_mapped_columns_are_those_with_the_inverse_covariance(
    facets: dict[str, object], beside: tuple[Term, ...]
) -> None:
    one, evidence, scatter = made(facets)
    metric = Metric(one, scatter, evidence.noise_models, 0.4, [term.nuisance for term in beside])
    columns = np.random.default_rng(3).normal(size=(4, ROWS))
    inverse = np.linalg.inv(dense_covariance(one, scatter, beside, 0.4))
    wanted = columns @ inverse @ columns.T
    np.testing.assert_allclose(metric(columns) @ metric(columns).T, wanted, atol=1e-5 * np.abs(wanted).max())


def test_a_good_certificate_counts_beside_a_free_origin() -> None:
    """Faces known to 30 nm probed by a probe that repeats to 100 nm: the mean of a face is no better than its place."""
    one = problem(noise(), certified_u=np.full(12, 0.03))
    scatters = Evidence(one, NoisePriors()).noise_models
    metric = Metric(one, scatters.plain(), scatters, 0.1)
    contrast = one.certified[2] - one.certified[3]
    inverse = np.linalg.inv(dense_covariance(one, scatters.plain(), (), 0.1))
    assert metric(contrast) @ metric(contrast) == pytest.approx(contrast @ inverse @ contrast, rel=1e-2)


@pytest.mark.parametrize("facets", FACETS.values(), ids=FACETS)
def test_the_adjoint_is_the_transposed_map(facets: dict[str, object]) -> None:
    one, evidence, scatter = made(facets)
    metric = Metric(one, scatter, evidence.noise_models, 0.4, [term.nuisance for term in TERMS["a slope"]])
    random = np.random.default_rng(4)
    x, y = random.normal(size=(3, ROWS)), random.normal(size=(ROWS, 2))
    np.testing.assert_allclose(metric(x) @ y, x @ metric.adjoint(y), rtol=1e-9)


SEVERAL = AmplitudePrior(np.array([0.05, 0.3, 2.0]), np.log([0.5, 0.3, 0.2]))


@pytest.mark.parametrize("sd", SEVERAL.sd)
@pytest.mark.parametrize("facets", FACETS.values(), ids=FACETS)
def test_the_sizes_of_a_term_are_summed_whichever_it_was_proposed_with(facets: dict[str, object], sd: float) -> None:
    """The brute force gives one number for every size; their sum with the weights is what counts."""
    one, evidence, scatter = made(facets)
    (slope,) = TERMS["a slope"]
    wide = replace(slope, sd=float(sd), candidate=replace(slope.candidate, sizes=SEVERAL))
    constant = 0.5 * ROWS * np.log(2.0 * np.pi) + np.log(np.log(NoisePriors().sigma_factor))
    each = [brute_force(one, scatter, (replace(slope, sd=float(size)),)) for size in SEVERAL.sd]
    state = evidence((wide,), scatter)
    assert state.log_posterior == pytest.approx(np.logaddexp.reduce(each + SEVERAL.log_weight) + constant, abs=0.1)
    assert state.terms[0].sd == SEVERAL.sd[int(np.argmax(each + SEVERAL.log_weight))]


def test_two_laws_alike_are_as_probable_in_whatever_order_they_come() -> None:
    """Of a large disturbance every size fits while nothing is named; the number is that of the whole hypothesis."""
    values = noise() + 9.0 * coordinate() + 0.4 * np.sin(2.0 * np.pi * 3.5 * turns())
    evidence = Evidence(problem(values), NoisePriors())
    several = [
        replace(own, sd=float(sd), candidate=replace(own.candidate, sizes=SEVERAL))
        for own, sd in zip((*TERMS["a slope"], TERMS["a wave and a function"][0]), (2.0, 0.05), strict=True)
    ]
    scatter = evidence.noise_models.plain()
    both = evidence(tuple(several), scatter)
    other = [replace(one, sd=float(sd)) for one, sd in zip(several, (0.05, 2.0), strict=True)]
    assert evidence(tuple(other[::-1]), scatter) is both
    fresh = Evidence(problem(values), NoisePriors())
    assert fresh(tuple(other[::-1]), scatter).log_posterior == pytest.approx(both.log_posterior, abs=0.1)


@pytest.mark.parametrize("count", [2, 5, 8])
def test_sizes_that_are_not_reached_do_not_count_for_each_law(count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Laws that are one line, each proposed far too small: what one gains by another size, all gain only once."""
    laws = [replace(law(f"line {i}", coordinate()[None, None]), sizes=SEVERAL) for i in range(count)]
    terms = tuple(replace(term(one), candidate=one, sd=0.05) for one in laws)
    evidence = Evidence(problem(noise() + coordinate()), NoisePriors())
    whole = evidence(terms, evidence.noise_models.plain())
    monkeypatch.setattr("stepgauge.inference.evidence.RESIZED", 0)
    early = Evidence(evidence.problem, NoisePriors())(terms, evidence.noise_models.plain())
    assert early.log_posterior < whole.log_posterior + 3.0


def test_sizes_that_go_round_end_at_the_most_probable_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    """From the smallest size to the largest, to the middle one and to the largest again, whatever is most probable."""
    small, middle, large = SIZES.sd.tolist()
    following = {small: large, large: middle, middle: large}
    one = law("slope", coordinate()[None, None])
    um = noise() + 0.5 * coordinate()
    computed: list[float] = []

    def go_round(state: Hypothesis) -> Term:
        computed.append(state.terms[0].sd)
        return replace(state.terms[0], sd=following[state.terms[0].sd])

    usual = Evidence(problem(um), NoisePriors())((replace(term(one), candidate=one, sd=small),), _plain(um))
    monkeypatch.setattr("stepgauge.inference.evidence.resized", go_round)
    found = Evidence(problem(um), NoisePriors())((replace(term(one), candidate=one, sd=small),), _plain(um))
    assert computed == [small, large, middle]
    assert found.terms[0].sd == usual.terms[0].sd == middle
    assert found.log_posterior == pytest.approx(usual.log_posterior, abs=0.01)


def _plain(um: Array) -> NoiseModel:
    return Evidence(problem(um), NoisePriors()).noise_models.plain()


@pytest.mark.parametrize("positive", [False, True])
@pytest.mark.parametrize("size", [1e160, 1e200])
@pytest.mark.parametrize("pattern", [turns()[None, None], waves(turns(), [1.0]), waves(turns(), [1e-3])])
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_hypothesis_of_which_no_number_is_left_is_never_chosen(
    pattern: np.ndarray, size: float, positive: bool
) -> None:
    """Amplitudes beyond all rounding: the search goes on without it."""
    endless = replace(law("endless", pattern), sizes=AmplitudePrior(np.array([size]), np.zeros(1)), positive=positive)
    evidence = Evidence(problem(noise() + turns(), (endless,)), NoisePriors())
    state = evidence((replace(term(endless), sd=size),), evidence.noise_models.plain())
    assert state.log_posterior == -np.inf
