"""Where a reading lies on the line of its search: a machine that searches along a straight line triggers on it.

One rule for the rows of a finished log (:mod:`.pairing`) and for the answers of a machine as they
come (:mod:`stepgauge.live.judging`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from stepgauge.correspondence.expected_points import ExpectedPoints, coordinates
from stepgauge.files.arrays import Array, Rows

SEARCH_END_MM = 1e-5
"""A search that ends this close to its programmed end has met nothing; the logs print 1e-6 mm or finer."""


class OffSearchLine(NamedTuple):
    """The first row, counted from 0, that is no reading of its point, in words; ``missed``: the search met nothing."""

    row: int
    missed: bool
    found: str
    expected: str


def line_distances(position_mm: Array, target_mm: Array, approach: Array) -> tuple[Array, Array]:
    """Distance beyond the nominal tip centre along the approach, and beside that line, mm; each ``(n,)``."""
    off = position_mm - target_mm
    along = (off * approach).sum(axis=1)
    return along, np.linalg.norm(off - along[:, None] * approach, axis=1)


def point_distances(position_mm: Array, expected: ExpectedPoints, point: Rows) -> tuple[Array, Array]:
    """The same of readings whose points are known."""
    return line_distances(position_mm, expected.target_mm[point], expected.approach[point])


def off_search_line(
    position_mm: Array, target_mm: Array, approach: Array, search_mm: float, lateral_mm: float
) -> OffSearchLine | None:
    """The first reading that no search for its target can have made; None where all can be.

    Parameters
    ----------
    position_mm, target_mm, approach : readings, tip centres at nominal contact, unit approaches, each ``(n, 3)``
    search_mm : how far before and beyond the target a search triggers
    lateral_mm : how far the machine strays from its line
    """
    with np.errstate(invalid="ignore"):  # what is no number is on no line
        along, beside = line_distances(position_mm, target_mm, approach)
    missed = (np.abs(along - search_mm) <= SEARCH_END_MM) & (beside < lateral_mm)
    wrong = np.flatnonzero(missed | ~((np.abs(along) <= search_mm) & (beside <= lateral_mm)))
    if not wrong.size:
        return None
    row = int(wrong[0])
    if missed[row]:
        found, expected = f"{along[row]:.6f} mm beyond the nominal contact", f"a trigger before {search_mm:g} mm"
        return OffSearchLine(row, True, found, expected)
    found = (
        f"{coordinates(position_mm[row])}, {along[row]:+.3f} mm along the approach and {beside[row]:.3f} mm beside it"
    )
    return OffSearchLine(row, False, found, f"within {search_mm:g} mm along and {lateral_mm:g} mm beside")
