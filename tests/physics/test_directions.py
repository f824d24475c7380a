"""Probe frames, angles and probing patterns."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepgauge.physics import directions

angle = st.floats(-3.0, 3.0)


@given(azimuth=angle, elevation=st.floats(-1.5, 1.5))
def test_angles_and_vectors_are_inverse(azimuth, elevation):
    found = directions.angles_rad(7.0 * directions.unit_vectors(azimuth, elevation))
    assert found[0] == pytest.approx(azimuth, abs=1e-12)
    assert found[1] == pytest.approx(elevation, abs=1e-12)


@given(axis=st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda a: np.linalg.norm(a) > 1e-3))
def test_probe_frame_is_right_handed_with_the_axis_as_z(axis):
    frame = directions.probe_frame(axis)
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(frame) == pytest.approx(1.0)
    np.testing.assert_allclose(frame @ (np.asarray(axis) / np.linalg.norm(axis)), [0, 0, 1], atol=1e-12)


def test_the_frame_of_a_hanging_probe_is_the_machine():
    np.testing.assert_allclose(directions.probe_frame(), np.eye(3))
    with pytest.raises(ValueError, match="no length"):
        directions.probe_frame((0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("pattern", "count"),
    [
        (directions.five_points(0.3), 5),
        (directions.iso_10360_5_points(0.3), 25),
        (directions.nine_degree_points(), 2000),
        (directions.evenly_spread_points(100), 100),
    ],
)
def test_patterns_are_unit_vectors_on_the_upper_half(pattern, count):
    assert pattern.shape == (count, 3)
    np.testing.assert_allclose(np.linalg.norm(pattern, axis=1), 1.0)
    assert np.all(pattern[:, 2] >= -1e-15)


def test_iso_pattern_has_its_rings():
    _, elevation = directions.angles_rad(directions.iso_10360_5_points())
    rings, counts = np.unique(np.round(90.0 - np.degrees(elevation), 6), return_counts=True)
    np.testing.assert_allclose(rings, [0.0, 22.5, 45.0, 67.5, 90.0])
    np.testing.assert_array_equal(counts, [1, 4, 8, 4, 8])


def test_even_pattern_has_even_moments():
    """Over a half sphere the mean height is 1/2 and the mean of x^2, y^2, z^2 is 1/3 each."""
    points = directions.evenly_spread_points(500)
    np.testing.assert_allclose(points.mean(axis=0), [0.0, 0.0, 0.5], atol=5e-3)
    np.testing.assert_allclose((points**2).mean(axis=0), 1.0 / 3.0, atol=5e-3)
