"""Where a reading lies on the line of its search: a machine that searches along a straight line triggers on it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stepgauge.importing.expected import Expected

Array = NDArray[np.float64]
Rows = NDArray[np.int64]
SEARCH_END_MM = 1e-5
"""A search that ends this close to its programmed end has met nothing; the logs print 1e-6 mm or finer."""


def from_target(position_mm: Array, expected: Expected, point: Rows) -> tuple[Array, Array]:
    """Distance beyond the nominal tip centre along the approach, and beside that line, mm; each ``(n,)``."""
    off = position_mm - expected.target_mm[point]
    approach = expected.approach[point]
    along = (off * approach).sum(axis=1)
    return along, np.linalg.norm(off - along[:, None] * approach, axis=1)
