"""Expected information: against closed forms, against a numerical integral, and what parameters take away."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from stepgauge.inference.design import Prediction, distances, entropy, expected_information_gain

NONE = np.zeros((0, 4))
NEW = np.array([False, False, True, True])


def plain(columns: NDArray[np.float64]) -> NDArray[np.float64]:
    return columns


def predict(mean: list[float], columns: NDArray[np.float64] = NONE, precision: float = 0.0) -> Prediction:
    return Prediction(np.array(mean), columns, np.full(len(columns), precision))


def test_rivals_that_predict_the_same_give_nothing() -> None:
    assert expected_information_gain(np.array([0.7, 0.3]), np.zeros((2, 2))) == 0.0


def test_rivals_far_apart_give_all_that_is_not_known() -> None:
    p = np.array([0.5, 0.3, 0.2])
    far = 1e4 * (1.0 - np.eye(3))
    assert expected_information_gain(p, far) == pytest.approx(entropy(p), rel=1e-12)
    assert expected_information_gain(np.full(2, 0.5), far[:2, :2]) == pytest.approx(np.log(2.0))


def test_two_even_rivals_follow_the_closed_form() -> None:
    for d in (0.1, 1.0, 10.0):
        expected = -np.log((1.0 + np.exp(-d / 8.0)) / 2.0)
        assert expected_information_gain(np.full(2, 0.5), np.array([[0.0, d], [d, 0.0]])) == pytest.approx(expected)


@pytest.mark.parametrize(("d", "p"), [(1.0, 0.5), (4.0, 0.5), (16.0, 0.9), (30.0, 0.2)])
def test_it_is_a_lower_bound_and_not_a_loose_one(d: float, p: float) -> None:
    """The mutual information of a choice and a normal variable, by numerical integration."""
    x, step = np.linspace(-12.0, 12.0 + np.sqrt(d), 20001, retstep=True)
    weights = np.array([p, 1.0 - p])
    density = np.exp(-0.5 * (x - np.array([[0.0], [np.sqrt(d)]])) ** 2) / np.sqrt(2.0 * np.pi)
    mixture = weights @ density
    exact = float((weights[:, None] * density * np.log(np.maximum(density, 1e-300) / mixture)).sum() * step)
    bound = expected_information_gain(weights, np.array([[0.0, d], [d, 0.0]]))
    assert 0.4 * exact < bound <= exact


def test_a_difference_without_parameters_counts_in_new_rows_only() -> None:
    found = distances([predict([5.0, 5.0, 0.0, 0.0]), predict([0.0, 0.0, 3.0, 4.0])], NEW, plain)
    assert found == pytest.approx(np.array([[0.0, 25.0], [25.0, 0.0]]))


def test_a_parameter_that_the_old_rows_leave_free_takes_the_difference_over() -> None:
    free = np.array([[0.0, 0.0, 3.0, 4.0]])
    found = distances([predict([0.0] * 4), predict([0.0, 0.0, 3.0, 4.0], free)], NEW, plain)
    assert found[0, 1] == pytest.approx(0.0, abs=1e-9)


def test_a_parameter_that_the_old_rows_determine_takes_its_part() -> None:
    """One reading of variance one determines a constant; the predicted difference has variance 1 + 1."""
    constant = np.array([[1.0, 0.0, 1.0, 0.0]])
    found = distances([predict([0.0] * 4), predict([2.0, 0.0, 2.0, 0.0], constant)], NEW, plain)
    assert found[0, 1] == pytest.approx(2.0**2 / (1.0 + 1.0))


def test_prior_knowledge_of_a_parameter_counts_as_a_reading() -> None:
    constant = np.array([[0.0, 0.0, 1.0, 0.0]])
    found = distances([predict([0.0] * 4), predict([0.0, 0.0, 2.0, 0.0], constant, 1.0 / 9.0)], NEW, plain)
    assert found[0, 1] == pytest.approx(2.0**2 / (1.0 + 9.0))
