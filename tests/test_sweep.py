"""Distances of moving balls and shanks from boxes, against brute force and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepgauge.motion.collision import distance_to_box, first_contact, segment_distance, shank_distance

coordinate = st.floats(-20.0, 20.0)
point = st.tuples(coordinate, coordinate, coordinate).map(np.array)
LOW, HIGH = np.array([-5.0, -3.0, -2.0]), np.array([5.0, 3.0, 2.0])


def rows(*vectors: np.ndarray) -> list[np.ndarray]:
    return [np.asarray(v, float)[None] for v in vectors]


def sampled(start: np.ndarray, step: np.ndarray, count: int = 4001) -> np.ndarray:
    """Distance from the box at many places of a piece, with numpy.clip as the independent way to the nearest point."""
    place = start + np.linspace(0, 1, count)[:, None] * step
    return np.linalg.norm(place - np.clip(place, LOW, HIGH), axis=1)


@given(point, point)
def test_the_smallest_distance_of_a_piece_is_what_sampling_finds(start, step) -> None:
    found = segment_distance(*rows(start, step, LOW, HIGH))[0]
    brute = sampled(start, step)
    assert found <= brute.min() + 1e-12
    assert found >= brute.min() - np.linalg.norm(step) / 4000


@given(point, point, st.floats(0.1, 5.0))
def test_first_contact_is_where_the_ball_begins_to_touch(start, step, radius) -> None:
    t = first_contact(*rows(start, step), radius, *rows(LOW, HIGH))[0]
    brute = sampled(start, step)
    slack = np.linalg.norm(step) / 4000
    if np.isnan(t):
        assert brute.min() > radius - slack
        return
    at = distance_to_box(start + t * step, LOW, HIGH)
    assert at <= radius + 1e-9
    if t > 0:
        assert at == pytest.approx(radius, abs=1e-9)
        before = sampled(start, step * t)
        assert before[:-1].min() >= radius - 1e-9


@given(point, point, point)
def test_a_shank_is_as_near_as_the_nearest_of_its_points(start, step, shank) -> None:
    found = shank_distance(*rows(start, step), np.zeros(3), shank, *rows(LOW, HIGH))[0]
    along = np.linspace(0, 1, 201)
    brute = min(sampled(start + h * shank, step, 201).min() for h in along)
    slack = (np.linalg.norm(step) + np.linalg.norm(shank)) / 200
    assert brute - slack <= found <= brute + 1e-9


def test_closed_forms() -> None:
    """Straight at a face, past an edge, along a face, at rest inside."""
    towards = first_contact(*rows([-20, 0, 0], [20, 0, 0]), 2.0, *rows(LOW, HIGH))
    assert towards[0] == pytest.approx(13.0 / 20.0, abs=1e-15)
    past_edge = segment_distance(*rows([-20, 6, 6], [40, 0, 0], LOW, HIGH))
    assert past_edge[0] == pytest.approx(5.0)
    onto_edge = first_contact(*rows([0, 6, 10], [0, 0, -10]), 5.0, *rows(LOW, HIGH))
    assert onto_edge[0] == pytest.approx(0.4, abs=1e-12)  # 3 beside the edge, so 4 above it: z = 6
    along_face = segment_distance(*rows([-20, 0, 3.5], [40, 0, 0], LOW, HIGH))
    assert along_face[0] == pytest.approx(1.5)
    assert segment_distance(*rows([0, 0, 0], [0, 0, 0], LOW, HIGH))[0] == 0.0
    assert first_contact(*rows([0, 0, 0], [1, 0, 0]), 1.0, *rows(LOW, HIGH))[0] == 0.0
