"""Least sums of squares against scipy's, and a diagnosis without causes that loads no optimiser."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import optimize

from stepgauge.inference.nonlinear import least_squares

Array = NDArray[np.float64]
TURNS = np.linspace(0.0, 4.0, 80)


def valley(x: Array) -> Array:
    """Rosenbrock's valley (1960), whose least value is zero at (1, 1)."""
    return np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]])


def valley_slopes(x: Array) -> Array:
    return np.array([[-20.0 * x[0], 10.0], [-1.0, 0.0]])


def wave_in_noise(random: np.random.Generator) -> tuple[Callable[[Array], Array], Callable[[Array], Array]]:
    """Residuals of amplitude, frequency and phase from a noisy sine, and their slopes."""
    seen = 3.0 * np.sin(2.1 * TURNS + 0.4) + random.normal(0.0, 0.3, len(TURNS))

    def left(x: Array) -> Array:
        return seen - x[0] * np.sin(x[1] * TURNS + x[2])

    def slopes(x: Array) -> Array:
        inside = x[1] * TURNS + x[2]
        return -np.column_stack([np.sin(inside), x[0] * TURNS * np.cos(inside), x[0] * np.cos(inside)])

    return left, slopes


def test_the_end_of_a_curved_valley_is_found() -> None:
    np.testing.assert_allclose(least_squares(valley, valley_slopes, np.array([-1.2, 1.0]), 1e-12, 500), 1.0, rtol=1e-6)


@pytest.mark.parametrize("seed", range(6))
def test_a_wave_in_noise_is_fitted_as_by_minpack(seed: int) -> None:
    random = np.random.default_rng(seed)
    left, slopes = wave_in_noise(random)
    start = np.array([1.0, 1.9, 0.0])
    expected = optimize.least_squares(left, start, slopes, method="lm", ftol=1e-12).x
    np.testing.assert_allclose(least_squares(left, slopes, start, 1e-12, 200), expected, rtol=1e-4)


def test_parameters_that_do_nothing_stay_where_they_are() -> None:
    found = least_squares(lambda x: x[:1] - 2.0, lambda _x: np.array([[1.0, 0.0]]), np.array([0.0, 7.0]), 1e-9, 50)
    np.testing.assert_allclose(found, [2.0, 7.0], rtol=1e-3)


def test_what_is_no_number_at_the_start_is_refused_and_later_no_step_leads_there() -> None:
    with pytest.raises(ValueError, match="no numbers"):
        least_squares(lambda x: x * np.nan, lambda _x: np.eye(1), np.ones(1), 1e-9, 50)

    def root(x: Array) -> Array:
        return np.sqrt(x) - 1.5 if x[0] > 0.0 else np.array([np.nan])

    found = least_squares(root, lambda x: np.array([[0.5 / np.sqrt(x[0])]]), np.array([60.0]), 1e-12, 90)
    assert found[0] == pytest.approx(2.25, rel=1e-4)


def test_the_diagnosis_loads_neither_an_optimiser_nor_the_dialects_of_programs() -> None:
    code = "import sys, stepgauge.diagnosis.engine; print({'scipy.optimize', 'stepgauge.programs'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


def test_a_bound_is_kept_and_the_other_parameters_go_on_along_it() -> None:
    high = np.array([0.5, 2.0])
    found = least_squares(valley, valley_slopes, np.array([-1.2, 1.0]), 1e-12, 500, (np.full(2, -2.0), high))
    np.testing.assert_allclose(found, [0.5, 0.25], rtol=1e-6)
    expected = optimize.least_squares(valley, [-1.2, 1.0], valley_slopes, bounds=([-2.0, -2.0], high)).x
    np.testing.assert_allclose(found, expected, rtol=1e-4)


def test_a_step_that_a_bound_cuts_short_may_lead_farther_than_its_slopes_say() -> None:
    random = np.random.default_rng(327)
    left, slopes = wave_in_noise(random)
    start = np.array([random.uniform(-3.0, 3.0), random.uniform(0.5, 6.0), random.uniform(-3.0, 3.0)])
    half = random.uniform(0.0, 0.3, 3)
    found = least_squares(left, slopes, start, 1e-12, 200, (start - half, start + half))
    assert (np.abs(found - start) <= half + 1e-12).all()
    assert left(found) @ left(found) < left(start) @ left(start)
