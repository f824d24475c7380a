"""Outlying rows and heavy tails: the variational bound against the sums and integrals that it stands for."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import special, stats
from scipy.integrate import trapezoid

from stepgauge.inference.evidence import Evidence
from stepgauge.inference.hypothesis import Hypothesis
from stepgauge.inference.noise_models import NoiseModel, NoiseModels
from stepgauge.inference.noise_priors import NoisePriors
from stepgauge.inference.problem import Problem
from tests.inference.made import NOISE_UM

Array = NDArray[np.float64]
FEW = 30
LOG_SIGMA = np.log(NOISE_UM) + np.linspace(-2.0, 2.5, 181)
ROUNDS = 30


def few(um: Array) -> Problem:
    """Rows without anything that they share: a nuisance of a millionth of their scatter."""
    n = len(um)
    return Problem(
        residual_um=um,
        scale_um=NOISE_UM,
        certified=np.ones((1, n)),
        certified_u=np.array([1e-6]),
        free=np.zeros((0, n)),
        order=np.arange(n),
        gap=np.ones(n - 1),
        growing={},
        step_um=0.0,
        group=np.arange(n),
        candidates=(),
    )


def bounded(um: Array, weigh: Callable[[NoiseModels, NoiseModel, Array], NoiseModel]) -> Hypothesis:
    """The hypothesis of rows that are weighed by what they leave, until they settle."""
    evidence = Evidence(few(um), NoisePriors())
    plain = evidence.noise_models.plain()
    state = evidence((), plain)
    square = um**2 / NOISE_UM**2
    for _ in range(ROUNDS):
        state = evidence((), weigh(evidence.noise_models, plain, square))
        square = evidence.squares(state)
    return state


def integrated(log_likelihood: Array) -> float:
    """Over log sigma with its prior, in the units of the number that decides; ``log_likelihood`` at ``LOG_SIGMA``."""
    spread = np.log(NoisePriors().sigma_factor)
    log = log_likelihood + stats.norm.logpdf(LOG_SIGMA, np.log(NOISE_UM), spread)
    whole = np.log(trapezoid(np.exp(log - log.max()), LOG_SIGMA)) + log.max()
    return float(whole + 0.5 * FEW * np.log(2.0 * np.pi) + np.log(spread))


def mixture(um: Array) -> float:
    """The exact number: over the share of outliers by quadrature, over which rows they are by a product of sums."""
    prior = NoisePriors()
    share = np.linspace(0.0, 1.0, 4001)[1:-1]
    log_share = stats.beta.logpdf(share, 1.0, 1.0 / prior.outlier_share)
    log = []
    for sigma in np.exp(LOG_SIGMA):
        good = stats.norm.logpdf(um, 0.0, sigma)
        bad = special.logsumexp([stats.norm.logpdf(um, 0.0, sigma * wide) for wide in prior.outlier_sizes], axis=0)
        bad = bad - np.log(len(prior.outlier_sizes))
        rows = np.logaddexp(np.log1p(-share)[:, None] + good, np.log(share)[:, None] + bad).sum(axis=1)
        whole = log_share + rows
        log.append(np.log(trapezoid(np.exp(whole - whole.max()), share)) + whole.max())
    return integrated(np.array(log)) + float(np.log(prior.outliers))


def student(um: Array, freedom: float) -> float:
    prior = NoisePriors()
    log = np.array([stats.t.logpdf(um, freedom, 0.0, sigma).sum() for sigma in np.exp(LOG_SIGMA)])
    return integrated(log) + float(np.log(prior.heavy / len(prior.heavy_freedoms)))


@pytest.mark.parametrize("bad", [(), (2.0,), (2.0, -5.0)])
def test_the_bound_of_outlying_rows_is_below_the_exact_number_and_near_it(bad: tuple[float, ...]) -> None:
    um = np.random.default_rng(5).normal(0.0, NOISE_UM, FEW)
    um[: len(bad)] = bad
    found = bounded(um, lambda all_, plain, square: all_.outlying(plain, square))
    wanted = mixture(um)
    assert wanted - 1.2 < found.log_posterior < wanted + 0.1
    assert found.noise.outlying is not None
    np.testing.assert_array_equal(found.noise.outlying > 0.5, np.arange(FEW) < len(bad))


@pytest.mark.parametrize("freedom", [3.0, 7.0])
def test_the_bound_of_heavy_tails_is_below_the_exact_number_and_near_it(freedom: float) -> None:
    um = NOISE_UM * np.random.default_rng(6).standard_t(freedom, FEW)
    found = bounded(um, lambda all_, plain, square: all_.heavy(plain, freedom, square))
    wanted = student(um, freedom)
    assert wanted - 1.5 < found.log_posterior < wanted + 0.1


def test_even_scatter_is_likelier_than_outliers_and_heavy_tails_and_one_bad_row_is_not() -> None:
    um = np.random.default_rng(7).normal(0.0, NOISE_UM, FEW)
    for bad, wanted in ((0.0, False), (14.0 * NOISE_UM, True)):
        values = np.where(np.arange(FEW) == 11, um + bad, um)
        even = Evidence(few(values), NoisePriors())
        normal = even((), even.noise_models.plain()).log_posterior
        odd = bounded(values, lambda all_, plain, square: all_.outlying(plain, square)).log_posterior
        assert (odd > normal) is wanted


def test_each_facet_has_its_price_and_no_other() -> None:
    one, prior = few(np.zeros(FEW)), NoisePriors()
    scatters = NoiseModels(one, NoisePriors())
    plain = scatters.plain()
    assert plain.log_prior == 0.0
    assert scatters.changed(plain, correlation=0.5).log_prior == pytest.approx(
        np.log(prior.correlation / len(prior.correlations))
    )
    assert scatters.changed(plain, flicker=1.0).log_prior == pytest.approx(
        np.log(prior.flicker / len(prior.flicker_shares))
    )
    assert scatters.changed(plain, certificate=2.0).log_prior == pytest.approx(
        np.log(prior.certificate / len(prior.certificate_factors))
    )
    assert scatters.changed(plain, rounded=True).log_prior == pytest.approx(np.log(prior.rounded))
    heavy = scatters.heavy(scatters.changed(plain, correlation=0.5), 3.0, np.ones(FEW))
    assert scatters.without_tails(heavy).key == scatters.changed(plain, correlation=0.5).key
