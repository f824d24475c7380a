"""A grid of shapes is as fine as it must be, and a value between its points is found as it is."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from matplotlib.figure import Figure

import stepgauge as sg
from stepgauge.inference.grids import KEPT, kept

X = np.linspace(0.0, 450.0, 150)
X[1:-1] += np.random.default_rng(0).uniform(-1.0, 1.0, 148)  # at even steps other periods would be the same
SIZE = sg.inference.amplitude_prior(0.3, 10.0)


def wave(period: float) -> list[np.ndarray]:
    return [np.sin(2.0 * np.pi * X / period), np.cos(2.0 * np.pi * X / period)]


def test_a_grid_of_one_per_cent_that_would_miss_a_period_is_refused() -> None:
    """90 periods in the readings: one per cent is nearly a whole one, and 0.99994 of the truth was stated for sure."""
    periods = np.geomspace(2.0, 100.0, 400)
    with pytest.raises(ValueError, match=r"grid of pitch is too coarse.*expected 0.9 or more; give the function"):
        sg.inference.make_law("pitch", [wave(one) for one in periods], SIZE, values=periods)
    for wrong in (None, [5.0], [5.0, 9.0, 7.0]):
        with pytest.raises(ValueError, match="expected two or more in order, the range of the function"):
            sg.inference.make_law("pitch", wave, SIZE, values=wrong)


def test_the_rule_is_a_quarter_of_a_wave_over_all_readings() -> None:
    """Closed form: two waves that part by d cycles over the readings have sin(pi d) / (pi d) in common."""
    turn = 2.0 * np.pi * np.linspace(0.0, 1.0, 2000)
    for cycles in (0.1, 0.25, 0.5, 0.9):
        one, other = (np.array([np.sin(n * turn), np.cos(n * turn)]) for n in (60.0, 60.0 + cycles))
        assert kept(one, other) == pytest.approx(np.sinc(cycles), abs=0.01)
    assert np.sinc(0.25) == pytest.approx(KEPT, abs=0.001)


@pytest.mark.parametrize(("period", "seed"), [(5.0, 1), (7.123, 2), (31.4, 3)])
@pytest.mark.parametrize("by", ["function", "array"])
def test_a_period_between_the_points_of_the_grid_is_found_with_its_amplitude(period: float, seed: int, by: str) -> None:
    """Within what a period can be told (Cramer-Rao: u = sqrt(6 / n) sigma p^2 / (pi a L)); table and legend agree."""
    amplitude, sigma = 1.5, 0.25
    um = amplitude * np.sin(2.0 * np.pi * X / period + 0.7) + 0.015 * X
    um += np.random.default_rng(seed).normal(0.0, sigma, len(X))
    scale = sg.inference.make_law("scale", X / 225.0 - 1.0, SIZE)
    grid = 1.0 / np.arange(1.0 / 60.0, 1.0 / 4.0, 1.0 / 3000.0)
    law = (
        sg.inference.make_law("pitch", wave, SIZE, values=[60.0, 4.0])
        if by == "function"
        else sg.inference.make_law("pitch", [wave(one) for one in grid], SIZE, values=grid)
    )
    smooth = sg.inference.make_gaussian_process("smooth", X, [50.0, 150.0], SIZE)
    found = sg.inference.infer(sg.inference.make_problem(um, sigma, [scale, law, smooth]))
    table = found.to_frame().set_index("label")
    assert found.best.labels == {"scale", "pitch"}
    shape, u = found.shape("pitch")
    u_best = np.sqrt(6.0 / len(X)) * sigma * period**2 / (np.pi * amplitude * np.ptp(X))
    assert u == pytest.approx(u_best, rel=0.3)
    assert abs(shape - period) < 3.5 * u
    assert abs(table.loc["pitch", "amplitude"] - amplitude) < 3.5 * table.loc["pitch", "u_amplitude"]
    assert abs(table.loc["scale", "amplitude"] - 0.015 * 225.0) < 3.5 * table.loc["scale", "u_amplitude"]
    assert table.loc["pitch", "shape"] == shape
    legend = found.plot(Figure().subplots(), X).get_legend()
    assert f"pitch ({shape:.4g})" in legend.get_texts()[1].get_text()


@pytest.mark.parametrize("onset", [11, 20, 37])
def test_what_jumps_at_a_reading_has_nothing_between_and_is_found_at_any(onset: int) -> None:
    day = np.arange(40.0)
    law = sg.inference.make_law("step", lambda at: 1.0 * (day >= at), SIZE, values=[0.5, 38.5])
    for one, other in pairwise(law.pattern):
        assert kept(one, other) >= KEPT or np.abs(one - other).sum() == 1.0
    um = 3.0 * (day >= onset) + np.random.default_rng(onset).normal(0.0, 0.25, 40)
    best = sg.inference.infer(sg.inference.make_problem(um, 0.25, [law])).best
    assert np.array_equal(best.terms[0].columns[0], 1.0 * (day >= onset))


def test_between_two_stated_values_a_shape_is_as_likely_as_between_any_others() -> None:
    law = sg.inference.make_law("wave", wave, SIZE, values=[10.0, 20.0, 60.0])
    assert np.exp(law.log_weight).sum() == pytest.approx(1.0)
    below = np.exp(law.log_weight)[law.values < 20.0].sum()  # type: ignore[operator]
    assert below == pytest.approx(0.5, abs=0.05)
