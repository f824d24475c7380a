"""The 16 points of a placement, from a table of any make or from the log of a teach program."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stepgauge.alignment import is_point_table, read_points
from stepgauge.errors import InputError, naming
from stepgauge.importing.formats import TABLES
from stepgauge.importing.logs import read_log, recognise_log
from stepgauge.importing.tables.source import Given, read_source

NUMBERS = np.arange(1, 17)
WANTED = "a table with the columns point, x_mm, y_mm, z_mm, or the log of the program of stepgauge plan --teach"


def read_sixteen(given: Given, surface: bool = False) -> NDArray[np.float64]:
    """16 tip centres, or with ``surface`` points on the surface, shape ``(16, 3)`` mm.

    A table ``point,x_mm,y_mm,z_mm``, one of another make with a column of the numbers 1 to 16, or rows in order, as the
    log of the program of ``stepgauge plan --teach`` has them. :class:`InputError` for what has not just these.
    """
    path = given if isinstance(given, str | Path) else read_source(given).name
    try:
        source = recognise_log(given)
    except InputError:
        source = TABLES[0]  # the reader of points says what is wrong with it
    if source == TABLES[0] and isinstance(given, str | Path) and is_point_table(given):
        return read_points(given)
    try:
        log = read_log(given, source)
    except InputError as error:  # what it advises are options of import
        raise InputError(error.where, error.what, found=error.found, expected=WANTED) from None
    columns = [log.number, *log.columns.values()]
    counts = [one for one in columns if one is not None and np.array_equal(np.sort(one), NUMBERS)]
    if log.surface is True and not surface:
        centres = naming("surface", words="tip centres, or {} stated to locate")
        raise InputError(path, "the points are compensated by the tip radius", expected=centres)
    wrong = len(log) != 16 or (log.success is not None and not log.success.all())
    if wrong or (log.number is not None and not np.array_equal(log.number, NUMBERS)):
        found = f"{len(log)} points"
        expected = "16 points, by number or in order, as in a table or the log of stepgauge plan --teach"
        raise InputError(path, "these are not the 16 points of a placement", found=found, expected=expected)
    return log.position_mm[np.argsort(counts[0])] if counts else log.position_mm
