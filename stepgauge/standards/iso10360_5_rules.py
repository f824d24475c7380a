"""What ISO 10360-5:2020 asks of the probing test, checked one by one."""

from __future__ import annotations

import numpy as np

from stepgauge.physics.directions import evenly_spread_points, probe_frame
from stepgauge.standards.iso10360_5 import POINTS, STANDARD, STYLI, ProbingTest, StylusPoints
from stepgauge.standards.rules import Rule

SPHERE_MM = (10.0, 51.0)
LARGEST_GAP_DEG = 35.0
"""No place of the hemisphere may be farther than this from the nearest point. The standard asks for points
approximately evenly distributed over at least a hemisphere; this limit is ours. Its recommended pattern leaves 23
deg."""
APART_DEG = 60.0
"""Styli nearer to each other than this are one way of probing."""


def rules_of(test: ProbingTest) -> tuple[Rule, ...]:
    """Every rule, in the order in which a tester goes through them."""
    low, high = SPHERE_MM
    size = test.sphere.diameter_mm
    return (
        *((_styli(test),) if test.multiple else ()),
        _points(test),
        _spread(test),
        Rule(
            f"{STANDARD}, measuring equipment (unconfirmed)",
            f"a test sphere of {low:g} mm to {high:g} mm",
            f"{size:g} mm",
            low <= size <= high,
        ),
        Rule(
            f"{STANDARD}, measuring equipment",
            "a test sphere that the probe was not qualified on",
            "not recorded" if test.sphere.another is None else "stated",
            test.sphere.another,
        ),
    )


def _styli(test: ProbingTest) -> Rule:
    ways = np.array([one.from_sphere for one in test.styli])
    angles = np.degrees(np.arccos(np.clip(ways @ ways.T, -1.0, 1.0)))[np.triu_indices(len(ways), 1)]
    found = f"{len(ways)}, at least {angles.min():.0f}° apart"
    met = len(ways) == STYLI and bool(angles.min() >= APART_DEG)
    return Rule(
        f"{STANDARD}, multi-stylus test", f"{STYLI} styli or ways of one stylus, square to each other", found, met
    )


def _points(test: ProbingTest) -> Rule:
    counts = [len(one.surface_mm) for one in test.styli]
    found = ", ".join(str(count) for count in counts)
    return Rule(f"{STANDARD}, measuring procedure", f"{POINTS} points", found, all(count == POINTS for count in counts))


def _spread(test: ProbingTest) -> Rule:
    gaps = [largest_gap_deg(one) for one in test.styli]
    asks = f"points spread over at least a hemisphere (here: no place farther than {LARGEST_GAP_DEG:g}° from a point)"
    found = f"farthest place {max(gaps):.0f}°"
    return Rule(f"{STANDARD}, measuring procedure", asks, found, max(gaps) <= LARGEST_GAP_DEG)


def largest_gap_deg(stylus: StylusPoints) -> float:
    """Largest angle from a place of the hemisphere about the stylus to the nearest point."""
    places = evenly_spread_points(400) @ probe_frame(tuple(stylus.from_sphere))
    normals = stylus.surface_mm - stylus.fit.centre_mm
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    nearest = (places @ normals.T).max(axis=1)
    return float(np.degrees(np.arccos(np.clip(nearest.min(), -1.0, 1.0))))
