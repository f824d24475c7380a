"""A probe's values over the directions of the surface as a body to turn in a browser, and as curves round the stylus.

Charts are plain JSON of plotly; colours as in :mod:`stepgauge.figures.error_chart`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.figures.error_chart import LINES, numbers
from stepgauge.figures.probe import QUANTITIES
from stepgauge.files.arrays import Array
from stepgauge.physics.directions import unit_vectors
from stepgauge.probes.directions_map import DirectionMap

TITLES = dict(QUANTITIES)
DASHES = ("solid", "dash", "dot", "dashdot", "longdash")
MOST_CURVES = 5
FEWEST_AROUND = 3
"""Azimuths that enclose a body."""


def probe_body(found: DirectionMap, quantity: str = "pretravel_um") -> dict[str, Any]:
    """The body of a map: in each direction of the normal the value is the distance from the centre, and the colour.

    ``quantity``: ``pretravel_um``, ``deflection_um`` or ``trigger_force_N``. Directions without a value are left out.
    """
    polar, azimuth, *_ = found.columns()
    value = np.asarray(getattr(found, quantity), float)
    place = value[..., None] * unit_vectors(np.radians(azimuth), np.radians(90.0 - polar))
    triangles = _triangles(found.azimuth_deg, value)
    used = np.unique(triangles)
    number = np.zeros(value.size, int)
    number[used] = np.arange(len(used))
    x, y, z = (numbers(column, 5) for column in place.reshape(-1, 3)[used].T)
    i, j, k = number[triangles].T.tolist()
    flat = [column.ravel()[used] for column in (polar, azimuth, value)]
    unit = TITLES[quantity].rpartition("(")[2].rstrip(")")
    mesh = {
        "type": "mesh3d",
        **dict(zip("xyzijk", (x, y, z, i, j, k), strict=True)),
        "intensity": numbers(flat[2], 5),
        "colorscale": "Cividis",
        "colorbar": {"title": {"text": TITLES[quantity]}, "thickness": 14, "len": 0.8, "orientation": "h", "y": -0.12},
        "lighting": {"ambient": 0.75, "diffuse": 0.45, "specular": 0.05},
        "text": [f"polar {p:g}°, azimuth {a:g}°: {v:.4g} {unit}" for p, a, v in zip(*flat, strict=True)],
        "hovertemplate": "%{text}<extra></extra>",
    }
    axes = {f"{axis}axis": {"title": {"text": f"{axis} ({unit})"}} for axis in "xyz"}
    scene = {"aspectmode": "data", "camera": {"eye": {"x": -1.5, "y": -1.9, "z": 1.2}}, **axes}
    return {"data": [mesh], "layout": {"scene": scene, "margin": {"l": 0, "r": 0, "t": 0, "b": 0}}}


def _triangles(azimuth_deg: Array, value: Array) -> NDArray[np.int64]:
    """Of the grid of directions, shape ``(n, 3)``, closed round the stylus where the azimuths go round."""
    rows, columns = value.shape
    number = np.arange(value.size).reshape(rows, columns)
    step = np.diff(azimuth_deg)
    gap = azimuth_deg[0] + 360.0 - azimuth_deg[-1]
    if columns >= FEWEST_AROUND and 0.0 < gap <= 1.5 * step.max():
        number = np.column_stack([number, number[:, :1]])
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, :-1], number[1:, 1:]
    every = np.concatenate([np.stack([a, c, b], -1).reshape(-1, 3), np.stack([b, c, d], -1).reshape(-1, 3)])
    known = np.isfinite(value).ravel()
    return np.asarray(every[known[every].all(axis=1)], dtype=np.int64)


def probe_curves(found: DirectionMap, quantity: str = "pretravel_um") -> dict[str, Any]:
    """The same over the azimuth, for a few polar angles, walls first."""
    chosen = np.unique(np.linspace(0, len(found.polar_deg) - 1, MOST_CURVES).round().astype(int))[::-1]
    value = np.where(np.isfinite(getattr(found, quantity)), getattr(found, quantity), np.nan)
    data = [
        {
            "type": "scatter",
            "x": numbers(found.azimuth_deg),
            "y": numbers(value[row], 5),
            "mode": "lines",
            "name": f"{found.polar_deg[row]:g}°",
            "line": {"color": LINES[place % len(LINES)], "dash": DASHES[place % len(DASHES)], "width": 2},
            "hovertemplate": "azimuth %{x:g}°: %{y:.4g}<extra>polar " + f"{found.polar_deg[row]:g}°</extra>",
        }
        for place, row in enumerate(chosen.tolist())
    ]
    return {
        "data": data,
        "layout": {
            "xaxis": {"title": {"text": "azimuth of the surface normal (°)"}, "dtick": 60},
            "yaxis": {"title": {"text": TITLES[quantity]}, "rangemode": "tozero"},
            "legend": {"title": {"text": "polar angle "}, "orientation": "h", "y": 1.02, "yanchor": "bottom"},
            "margin": {"l": 60, "r": 10, "t": 10, "b": 45},
        },
    }
