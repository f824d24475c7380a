"""Error tables of machine axes, ready for controllers: from what was measured to a controller's file."""

from __future__ import annotations

from stepgauge.compensation.faces import TipRadius, axis_faces
from stepgauge.compensation.formats import FORMATS, render_table, table_to_dict, write_table
from stepgauge.compensation.readings import AxisReadings
from stepgauge.compensation.recorded import iso230_readings, recorded_readings
from stepgauge.compensation.table import CompensationTable, TableOptions, make_table

__all__ = [
    "FORMATS",
    "AxisReadings",
    "CompensationTable",
    "TableOptions",
    "TipRadius",
    "axis_faces",
    "iso230_readings",
    "make_table",
    "recorded_readings",
    "render_table",
    "table_to_dict",
    "write_table",
]
