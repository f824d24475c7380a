"""Bounded least squares against closed forms, and laws whose signature depends on their size."""

import numpy as np
import pytest

from stepgauge.inference import NoisePriors, amplitude_prior, make_law, make_problem
from stepgauge.inference.nonlinear import WIDEST, Parameters, fit_nonlinear
from stepgauge.inference.problem import Law, Refined
from stepgauge.inference.search import Search

X = np.linspace(0.0, 1.0, 60)


def known(count, low=-10.0, high=10.0):
    return Parameters(np.zeros(count), np.full(count, low), np.full(count, high), np.ones(count))


def test_a_linear_model_has_the_values_and_covariance_of_least_squares():
    random = np.random.default_rng(1)
    columns = np.array([np.ones(60), X, X**2])
    values = np.array([1.0, -2.0, 0.5]) @ columns + random.normal(0.0, 0.3, 60)
    found = fit_nonlinear(lambda x: x @ columns, values, np.zeros(3), known(3), lambda um: um / 0.3)
    precision = columns @ columns.T / 0.3**2 + np.eye(3) / WIDEST**2
    assert found.values == pytest.approx(np.linalg.solve(precision, columns @ values / 0.3**2), rel=1e-5)
    assert found.covariance == pytest.approx(np.linalg.inv(precision), rel=1e-5)


def test_a_bound_holds_and_what_is_impossible_is_not_entered():
    def root(x):
        return np.where(x[0] < 0.0, np.nan, np.sqrt(np.abs(x[0]))) * X

    inside = fit_nonlinear(root, 1.5 * X, np.array([0.2]), known(1, -10.0, 10.0), lambda um: um)
    assert inside.values[0] == pytest.approx(2.25, rel=1e-3)
    bounded = fit_nonlinear(root, 1.5 * X, np.array([0.2]), known(1, 0.0, 1.0), lambda um: um)
    assert bounded.values[0] == pytest.approx(1.0, abs=1e-6)


def sag(size):
    """What something of a size does: not in proportion to it."""
    return 3.0 * np.tanh(size * X)


def by_size(atoms):
    """A law with signatures at some sizes on its grid, and at any other."""
    sizes = amplitude_prior(0.1, 10.0)
    pattern = np.array([[sag(size) / size] for size in atoms])

    weight = np.full(len(atoms), -np.log(len(atoms)))

    def of_size(atom, residual, metric):
        found = fit_nonlinear(lambda x: sag(x[0]), residual, np.array([atoms[atom]]), known(1, 0.01, 20.0), metric)
        size = float(found.values[0])
        return Refined((sag(size) / size)[None], size)

    return Law(
        "sag",
        "sag",
        True,
        float(np.log(0.1)),
        sizes,
        pattern=pattern,
        shares=np.ones((1, 60)),
        log_weight=weight,
        of_size=of_size,
    )


@pytest.mark.parametrize("size", [0.8, 4.0])
def test_a_law_that_is_not_linear_in_its_size_is_as_probable_as_with_the_signature_of_its_size(size):
    """The size is summed as an amplitude; it is no shape of the grid that must be paid for."""
    values = sag(size) + np.random.default_rng(3).normal(0.0, 0.2, 60)
    search = Search(make_problem(values, 0.2, [by_size([1.0, 10.0])]), NoisePriors())
    found = search.run()
    (term,) = found.terms
    assert term.shape == pytest.approx(size, rel=0.25)
    assert found.amplitudes(0)[0][0] == pytest.approx(term.shape, rel=0.05)
    only = make_law("sag", sag(term.shape) / term.shape, amplitude_prior(0.1, 10.0))
    alone = Search(make_problem(values, 0.2, [only]), NoisePriors()).run()
    assert found.log_posterior == pytest.approx(alone.log_posterior, abs=0.02)


def test_the_size_is_the_one_that_it_has_beside_another_cause():
    """A trend looks much like it: alone, the law would have to be far larger."""
    values = sag(2.0) + 3.0 * X + np.random.default_rng(4).normal(0.0, 0.05, 60)
    trend = make_law("trend", X, amplitude_prior(0.1, 10.0))
    problem = make_problem(values, 0.05, [by_size([1.0, 10.0]), trend])
    found = Search(problem, NoisePriors()).run()
    assert found.labels == {"sag", "trend"}
    place = next(i for i, term in enumerate(found.terms) if term.candidate.label == "sag")
    assert found.terms[place].shape == pytest.approx(2.0, rel=0.1)
    assert found.amplitudes(place)[0][0] == pytest.approx(found.terms[place].shape, rel=0.05)
