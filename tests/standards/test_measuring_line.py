"""The seven positions and the travel along them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepgauge.standards.measuring_line import ORIENTATIONS, line_length_mm, orientation_of

TRAVEL = np.array([[0.0, 700.0], [0.0, 1200.0], [0.0, 600.0]])
SHARE = st.floats(0.01, 0.99)


def test_four_body_diagonals_and_three_axes() -> None:
    """Closed form: every diagonal of a box 700 x 1200 x 600 is sqrt(700^2 + 1200^2 + 600^2) long."""
    lengths = [np.linalg.norm(end - start) for start, end in (one.ends_mm(TRAVEL) for one in ORIENTATIONS)]
    assert lengths == pytest.approx([np.sqrt(700.0**2 + 1200.0**2 + 600.0**2)] * 4 + [700.0, 1200.0, 600.0])
    directions = np.array([one.direction(TRAVEL) for one in ORIENTATIONS[:4]])
    cosines = np.abs(directions @ directions.T)[~np.eye(4, dtype=bool)]
    assert cosines.max() < 0.9, "the four are four different lines"


@pytest.mark.parametrize("one", ORIENTATIONS, ids=lambda one: one.name)
def test_the_travel_along_a_position_is_its_whole_line(one) -> None:
    start, end = one.ends_mm(TRAVEL)
    found = line_length_mm((start + end) / 2.0, one.direction(TRAVEL), TRAVEL)
    assert found == pytest.approx(np.linalg.norm(end - start))


@given(x=SHARE, y=SHARE, z=SHARE, i=st.floats(-1, 1), j=st.floats(-1, 1), k=st.floats(0.1, 1))
def test_walking_both_ways_from_a_point_inside_covers_the_line(x, y, z, i, j, k) -> None:
    """Independent: march to the nearest wall in both directions."""
    point = TRAVEL[:, 0] + np.array([x, y, z]) * np.ptp(TRAVEL, axis=1)
    along = np.array([i, j, k]) / np.linalg.norm([i, j, k])

    def to_wall(way: np.ndarray) -> float:
        walls = np.where(way > 0, TRAVEL[:, 1], TRAVEL[:, 0])
        return min(float((w - p) / d) for w, p, d in zip(walls, point, way, strict=True) if abs(d) > 1e-12)

    assert line_length_mm(point, along, TRAVEL) == pytest.approx(to_wall(along) + to_wall(-along), rel=1e-6)


def test_a_line_beside_the_travel_has_none() -> None:
    assert line_length_mm([350.0, 600.0, 700.0], [1.0, 0.0, 0.0], TRAVEL) == 0.0
    assert line_length_mm([-500.0, 0.0, 0.0], [0.0, 1.0, 0.0], TRAVEL) == 0.0


@given(index=st.integers(0, 6), back=st.booleans())
def test_a_gauge_either_way_round_is_at_its_position(index: int, back: bool) -> None:
    direction = ORIENTATIONS[index].direction(TRAVEL) * (-1.0 if back else 1.0)
    found, off_deg = orientation_of(direction, TRAVEL)
    assert found.number == index + 1
    assert off_deg < 1e-5
