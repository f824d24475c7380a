"""The judge of compensations: exact cases first, so that its verdicts on real probes can be trusted."""

import numpy as np
import pytest

from stepgauge.physics import directions, error_reduction
from stepgauge.physics.wozniak import LobeModel

MODEL = LobeModel("kinematic", 0.3)
GRID, FIVE = directions.nine_degree_points(1), directions.five_points(0.1)
BOTH = pytest.mark.parametrize(
    "judge", [error_reduction.errors_of_the_paper, error_reduction.errors_on_a_machine], ids=["paper", "machine"]
)


@BOTH
def test_a_probe_that_obeys_the_model_is_left_without_error(judge):
    errors = judge(lambda n: MODEL.pretravel_um(n, 6.0), GRID, FIVE, MODEL)
    np.testing.assert_allclose(errors.after_um, 0.0, atol=1e-6)
    assert np.ptp(errors.before_um) > 5.0
    assert errors.range_ratio == np.inf


@BOTH
def test_errors_grow_with_the_probe(judge):
    def truth(n):
        return MODEL.pretravel_um(n, 6.0) + 0.8 * n[..., 2] ** 2

    small, large = judge(truth, GRID, FIVE, MODEL), judge(lambda n: 10.0 * truth(n), GRID, FIVE, MODEL)
    np.testing.assert_allclose(large.after_um, 10.0 * small.after_um, atol=0.02)
    assert large.range_ratio == pytest.approx(small.range_ratio, rel=0.01)


@BOTH
def test_a_probe_without_lobes_gains_nothing_from_lobes(judge):
    """The same pre-travel everywhere is best served by its mean; the model then makes errors of its own."""
    errors = judge(lambda n: np.full(len(n), 5.0), GRID, FIVE, MODEL)
    np.testing.assert_allclose(errors.before_um, 0.0, atol=1e-6)
    assert errors.range_ratio < 1e-6


def test_a_machine_does_not_see_an_error_that_is_a_shift():
    """Pre-travel along the axis, w ~ sin(gamma), moves the fitted centre; about a known centre it is an error."""

    def tilt(n):
        return 2.0 * n[..., 2]

    machine = error_reduction.errors_on_a_machine(tilt, GRID, directions.iso_10360_5_points(), MODEL)
    paper = error_reduction.errors_of_the_paper(tilt, GRID, directions.iso_10360_5_points(), MODEL)
    np.testing.assert_allclose(machine.before_um, 0.0, atol=1e-3)
    assert np.ptp(paper.before_um) == pytest.approx(2.0 * np.ptp(GRID[:, 2]))


def test_ratios_are_what_they_say():
    errors = error_reduction.Errors(np.array([-3.0, 1.0, 5.0]), np.array([-1.0, 0.0, 1.0]))
    assert errors.range_ratio == pytest.approx(4.0)
    assert errors.largest_ratio == pytest.approx(5.0)
    assert errors.rms_ratio == pytest.approx(np.sqrt(35.0 / 2.0))


def test_where_there_is_no_error_nothing_is_gained():
    still = error_reduction.Errors(np.full(3, 1e-9), np.full(3, -1e-9))
    assert (still.range_ratio, still.rms_ratio, still.largest_ratio) == (1.0, 1.0, 1.0)
