"""The 16 points of a placement, from a table written by hand or from the log of a teach program."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stepgauge.alignment import read_points
from stepgauge.errors import InputError
from stepgauge.importing import TABLES, read_log, recognise_log


def read_sixteen(path: str | Path) -> NDArray[np.float64]:
    """16 tip centres, shape ``(16, 3)`` mm.

    A table ``point,x_mm,y_mm,z_mm``, or the log of the program of ``stepgauge plan --teach``, whose points are in
    order. :class:`InputError` for a log that has not just these.
    """
    try:
        source = recognise_log(path)
    except InputError:
        source = TABLES[0]  # the reader of points says what is wrong with it
    if source in TABLES:
        return read_points(path)
    log = read_log(path, source)
    wrong = log.surface is True or len(log) != 16 or (log.success is not None and not log.success.all())
    if wrong or (log.number is not None and log.number.tolist() != list(range(1, 17))):
        found = f"{len(log)} points{' that are compensated by the tip radius' if log.surface else ''}"
        expected = "the 16 tip centres of the program of stepgauge plan --teach, in order"
        raise InputError(path, "this is not the log of a teach program", found=found, expected=expected)
    return log.position_mm
