"""What a run may still show: against closed forms, and in the directions that the first run was blind to."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from stepgauge.investigation.decision import Unseen


def overlap(s: float) -> float:
    return float(np.exp(-0.5 * np.log1p(s / 2.0) + 0.25 * np.log1p(s)))


def test_the_overlap_is_that_of_two_normal_distributions() -> None:
    """The Bhattacharyya coefficient of variances 1 and 1 + s, by numerical integration."""
    x = np.linspace(-60.0, 60.0, 200_001)
    for s in (0.1, 2.0, 50.0):
        product = np.sqrt(stats.norm.pdf(x) * stats.norm.pdf(x, scale=np.sqrt(1.0 + s)))
        assert overlap(s) == pytest.approx(float(product.sum() * (x[1] - x[0])), rel=1e-6)


def test_a_run_that_is_blind_to_everything_tells_nothing() -> None:
    blind = Unseen(("a", "b"), np.array([0.3, 0.1]), np.ones(2))
    assert blind.chance == 0.0
    assert blind.nats == pytest.approx(0.0, abs=1e-12)


def test_a_run_that_shows_everything_tells_whether_there_is_something() -> None:
    odds = np.array([0.3, 0.2])
    p = np.array([1.0 / 1.5, 0.5 / 1.5])
    shows = Unseen(("a", "a"), odds, np.zeros(2))
    assert shows.chance == pytest.approx(p[1])
    assert shows.nats == pytest.approx(float(-(p * np.log(p)).sum()))
    assert shows.most(3) == ["a"]
