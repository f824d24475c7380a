"""The conditions of points on a test sphere."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from stepgauge.conditions.condition import Condition, Conditions, State
from stepgauge.conditions.resolution import step_of
from stepgauge.files.arrays import Array
from stepgauge.files.notation import rounded
from stepgauge.physics.sphere import fit_sphere

EXACT_UM = 0.01
"""No probe reads a sphere so well: points nearer to one were computed."""
TIMES, LEAST_UM = 6.0, 3.0
"""A point stands out beyond so many times the scatter of the others, and beyond so much."""
WILD_UM = 500.0
"""No error of a probe is so large: such a point is a slip."""
NOTABLE_UM = 0.5
FINE_STEP_UM = 2.0
"""Steps of a coordinate, by which the form of a sphere may be read too large by as much: remarked; and no more than
this may be beside a statement."""
LEAST_POINTS = 6
TRIED = 3
"""Points that are tried to be without, one after the other."""


def sphere_conditions(position_mm: Array, path: str) -> Conditions:
    """What was found of the tip centres ``(n, 3)`` of one stylus."""
    name = path.rsplit("/", 1)[-1]
    found = [*_twice(position_mm, name), *_steps(position_mm, name)]
    if len(position_mm) >= LEAST_POINTS:
        found += _form(position_mm, name)
    return Conditions(tuple(found))


def _twice(position_mm: Array, name: str) -> Iterator[Condition]:
    again = len(position_mm) - len(np.unique(position_mm, axis=0))
    if again:
        words = f"{name}: {again} points repeat another one to the last digit: they were copied"
        yield Condition("duplicates", "prevents", words, f"{again} points", "every point once")


def _steps(position_mm: Array, name: str) -> Iterator[Condition]:
    step = 1e3 * max(step_of(position_mm[:, i]) for i in range(3))
    if step < NOTABLE_UM:
        return
    found = f"{rounded(step, 3)} um"
    words = f"{name}: the coordinates have steps of {found}, by which the form may be too large"
    state: State = "contribution" if step <= FINE_STEP_UM else "prevents"
    yield Condition("resolution", state, words, found, f"{FINE_STEP_UM:g} um at most", step)


def _form(position_mm: Array, name: str) -> Iterator[Condition]:
    """Points that are exactly on a sphere, and those that stand out of it."""
    if fit_sphere(position_mm).form_error_um < EXACT_UM:
        words = f"{name}: all points lie on a sphere to {EXACT_UM:g} um: computed, not measured"
        yield Condition("sphere", "prevents", words, "an exact sphere", "points with the scatter of a probe")
        return
    out = outstanding(position_mm)
    if out:
        shown = ", ".join(f"point {row + 1} ({rounded(um, 3, plus=True)} um)" for row, um in out)
        largest = max(abs(um) for _, um in out)
        words = f"{name}: points that stand out of the sphere of the others: {shown}; they are in the values"
        state: State = "prevents" if largest > WILD_UM else "contribution"
        yield Condition("outliers", state, words, shown, "points without slips", largest)


def outstanding(position_mm: Array) -> list[tuple[int, float]]:
    """Points (row from 0) outside the sphere through the others by more than their scatter, and how far, um.

    The others are what is left when the points are set aside, one after the other, without which the rest is the best
    sphere: two that stand out hide each other as long as both are in the fit.
    """
    rows = list(range(len(position_mm)))
    for _ in range(min(TRIED, (len(rows) - LEAST_POINTS) // 2)):
        _, worst = min((_rest(position_mm[[row for row in rows if row != one]]), one) for one in rows)
        rows.remove(worst)
    fit = fit_sphere(position_mm[rows])
    off = 1e3 * (np.linalg.norm(position_mm - fit.centre_mm, axis=1) - fit.radius_mm)
    limit = max(TIMES * _rest(position_mm[rows]), LEAST_UM)
    return [(int(row), float(off[row])) for row in np.flatnonzero(np.abs(off) > limit)]


def _rest(position_mm: Array) -> float:
    residuals = fit_sphere(position_mm).residuals_um
    return float(np.sqrt((residuals**2).sum() / max(len(residuals) - 4, 1)))
