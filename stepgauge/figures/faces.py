"""Columns of a table of faces, as ``evaluation.json`` has it, for every figure of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from stepgauge.files.arrays import Array

POSITION_LABEL = "nominal position along the gauge, from face 1 (mm)"
NAMES = {"xf": "forward XF", "xb": "backward XB", "xm": "mean XM", "xr": "reversal XR"}


def column(rows: Sequence[Mapping[str, Any]], name: str) -> Array:
    """A column of a table of faces; undefined values (None) become NaN."""
    return np.array([np.nan if row[name] is None else row[name] for row in rows], float)


def deviation_um(rows: Sequence[Mapping[str, Any]], name: str) -> Array:
    """Standard deviation of an error of a single cycle, um; that of XM and XR from both ways of probing."""
    sf, sb = column(rows, "sf_um"), column(rows, "sb_um")
    both = np.hypot(sf, sb)
    return {"xf": sf, "xb": sb, "xm": both / 2.0, "xr": both}[name]
