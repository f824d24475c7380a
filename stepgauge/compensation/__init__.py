"""Error tables of machine axes, ready for controllers: from ``evaluation.json`` to a controller's file."""

from __future__ import annotations

from stepgauge.compensation.faces import AxisFaces, TipRadius, axis_faces
from stepgauge.compensation.formats import FORMATS, render_table, table_to_dict, write_table
from stepgauge.compensation.table import CompensationTable, TableOptions, make_table

__all__ = [
    "FORMATS",
    "AxisFaces",
    "CompensationTable",
    "TableOptions",
    "TipRadius",
    "axis_faces",
    "make_table",
    "render_table",
    "table_to_dict",
    "write_table",
]
