"""Inclusion probabilities and log posteriors against sums over all sets of terms (``benchmarks/enumeration.py``)."""

from __future__ import annotations

from itertools import combinations, product

import numpy as np
import pytest
from scipy import special

from benchmarks import enumeration
from stepgauge.inference.noise_priors import NoisePriors

FEW = NoisePriors(
    outliers=1e-12, heavy=1e-12, burst=1e-12, growth_rates=[1.5], correlations=[0.5, 0.8], flicker_shares=[0.6],
    certificate_factors=[4.0],
)  # fmt: skip


@pytest.mark.parametrize("seed", [2, 6, 17])
def test_averages_over_the_neighbourhood_are_those_over_all_sets(seed: int) -> None:
    """Six candidates, sets of up to three. Of what the search visited, inclusion was off by up to 0.12 (seed 2, 6)."""
    found = enumeration.compared(enumeration.random_problem(seed, 6), 3, FEW)
    assert found.inclusion <= 0.02
    assert found.log_posterior <= 0.1
    assert found.loss < 0.05


def test_noise_that_stands_for_a_term_counts_with_all_its_models() -> None:
    """Fourteen candidates, sets of up to two: with one model of such noise inclusion was off by 0.027."""
    found = enumeration.compared(enumeration.random_problem(101, 14), 2, FEW)
    assert found.inclusion <= 0.02
    assert found.log_posterior <= 0.1


def test_shapes_that_are_probable_beside_other_shapes_only_count() -> None:
    """Fourteen candidates, sets of up to three: of three terms with three shapes each 0.36 nats were missing."""
    assert enumeration.compared(enumeration.random_problem(103, 14), 3, FEW).log_posterior <= 0.1


def test_the_sums_by_elimination_are_those_by_covariance_matrices() -> None:
    """One model of the noise, two sets: every shape and size written out as a covariance matrix of the rows."""
    one = enumeration.random_problem(3, 4)
    plain = NoisePriors(
        outliers=1e-12, heavy=1e-12, burst=1e-12, growth=1e-12, correlation=1e-12, flicker=1e-12, certificate=1e-12,
        growth_rates=[1.0], correlations=[0.5], flicker_shares=[0.5], certificate_factors=[2.0],
    )  # fmt: skip
    exact = enumeration.enumerated(one, 2, plain)
    by_set = dict(zip(exact.labels, exact.log_posterior, strict=True))
    noise = next(iter(enumeration._noise_models(one, plain)))

    def log_density(terms: tuple[enumeration.Candidate, ...]) -> float:
        every = []
        shapes = [[(c, atom, i) for atom in range(c.atoms) for i in range(len(c.sizes.sd))] for c in terms]
        for chosen, log_sigma in product(product(*shapes), enumeration.LOG_SIGMA):
            covariance = enumeration._covariance(one, noise, enumeration.NOISE_UM * float(np.exp(log_sigma)))
            weight = -0.5 * (log_sigma / np.log(plain.sigma_factor)) ** 2
            for c, atom, i in chosen:
                columns = c.columns(atom)
                covariance = covariance + c.sizes.sd[i] ** 2 * columns.T @ columns
                weight += c.sizes.log_weight[i] - np.log(c.atoms)
            quad = one.residual_um @ np.linalg.solve(covariance, one.residual_um)
            every.append(weight - 0.5 * np.linalg.slogdet(covariance)[1] - 0.5 * quad)
        return float(special.logsumexp(every)) + sum(c.log_odds for c in terms)

    nothing = log_density(())
    for terms in [(c,) for c in one.candidates] + list(combinations(one.candidates, 2))[:2]:
        labels = frozenset(c.label for c in terms)
        assert by_set[labels] - by_set[frozenset()] == pytest.approx(log_density(terms) - nothing, abs=1e-6)
