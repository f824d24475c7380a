"""Errors along the gauge, and evaluations laid over each other, as charts to click in a browser.

Charts are plain JSON of plotly; a colour ``--line-1`` is a variable of the page's style sheet, ``--line-1/33`` the same
with an opacity in hexadecimal digits, so that light and dark pages have their own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.figures.faces import NAMES, POSITION_LABEL, column, deviation_um
from stepgauge.files.arrays import Array
from stepgauge.standards.difference import Difference

LINES = ("--line-1", "--line-2", "--line-3", "--line-4")
SYMBOLS = ("circle", "square", "triangle-up", "diamond", "x")


def numbers(values: Any, digits: int = 6) -> list[float | None]:
    """Numbers for JSON, None where undefined."""
    return [float(f"{one:.{digits}g}") if np.isfinite(one) else None for one in np.asarray(values, float)]


def error_chart(
    placement: Mapping[str, Any], expanded_um: Array | None = None, limit_um: Array | None = None
) -> dict[str, Any]:
    """XF, XB and XM with bands of 2s above, XR below; the points carry the number of their face.

    ``placement``: of ``evaluation.json``; by face, ``expanded_um``: expanded uncertainty of XM, drawn as bars;
    ``limit_um``: maximum permissible error, drawn as two lines.
    """
    rows = placement["faces"]
    data: list[dict[str, Any]] = []
    for name, color, odd in (("xf", LINES[0], 1), ("xb", LINES[1], 0)):
        data += _line(rows, name, color, NAMES[name], own=odd)
    mean = _line(rows, "xm", "--ink", NAMES["xm"], band=False)
    if expanded_um is not None:
        mean[-1]["error_y"] = {"array": numbers(expanded_um), "color": "--ink", "thickness": 1, "width": 3}
        mean[-1]["name"] += " ± U"
    reversal = _line(rows, "xr", LINES[2], NAMES["xr"], band=False)
    limits = [] if limit_um is None else _limits(column(rows, "nominal_mm"), limit_um)
    return {
        "data": [*data, *mean, *limits, *({**one, "yaxis": "y2"} for one in reversal)],
        "layout": _layout("error (µm)", "XR"),
    }


def overlay_chart(
    placements: Sequence[Mapping[str, Any]], found: Sequence[Difference | None], names: Sequence[str], error: str
) -> dict[str, Any]:
    """One error of several evaluations with bands of 2s above; below, the first minus each other one with its U.

    Parameters
    ----------
    placements : the same placement in each ``evaluation.json``, the latest first
    found : differences of the first from each of the others, the first one None
    names : of the evaluations
    error : xf, xb, xm or xr
    """
    data: list[dict[str, Any]] = []
    for number, (placement, name) in enumerate(zip(placements, names, strict=True)):
        color = LINES[number % len(LINES)]
        data += _line(placement["faces"], error, color, name, symbol=SYMBOLS[number % len(SYMBOLS)])
    for number, one in enumerate(found):
        if one is not None:
            data += _difference(one, error, LINES[number % len(LINES)], f"{names[0]} − {names[number]}")
    return {"data": data, "layout": _layout(f"{NAMES[error]} (µm)", f"Δ{error.upper()}")}


def _line(
    rows: Sequence[Mapping[str, Any]],
    name: str,
    color: str,
    label: str,
    *,
    own: int | None = None,
    band: bool = True,
    symbol: str = "circle",
) -> list[dict[str, Any]]:
    """An error along the gauge with its band of 2s; hollow where ``own`` says that it comes from the neighbours."""
    x, y, s = column(rows, "nominal_mm"), column(rows, f"{name}_um"), deviation_um(rows, name)
    face = [int(row["face"]) for row in rows]
    hollow = [own is not None and one % 2 != own for one in face]
    marker = {"size": 6, "color": ["--ground" if one else color for one in hollow], "symbol": symbol}
    line = {
        "type": "scatter",
        "x": numbers(x),
        "y": numbers(y),
        "customdata": face,
        "mode": "lines+markers",
        "name": label,
        "legendgroup": label,
        "line": {"color": color, "width": 1.5},
        "marker": {**marker, "line": {"color": color, "width": 1.5}},
        "hovertemplate": "face %{customdata}, %{x:.1f} mm: %{y:.2f} µm<extra>" + label + "</extra>",
    }
    return [*(_band(x, y, 2.0 * s, color, label) if band else []), line]


def _limits(x: Array, limit_um: Array) -> list[dict[str, Any]]:
    """Plus and minus the maximum permissible error where it is known."""
    known = np.isfinite(limit_um)
    look = {"mode": "lines", "line": {"color": "--red", "width": 1.5, "dash": "dash"}, "legendgroup": "MPE"}
    return [
        {
            "type": "scatter",
            "x": numbers(x[known]),
            "y": numbers(sign * limit_um[known]),
            "name": "MPE",
            "showlegend": sign > 0.0,
            "hovertemplate": "%{y:.2f} µm<extra>MPE</extra>",
            **look,
        }
        for sign in (1.0, -1.0)
    ]


def _band(x: Array, y: Array, half: Array, color: str, group: str) -> list[dict[str, Any]]:
    kept = np.isfinite(y + half)
    if not kept.any():
        return []
    edge = np.concatenate([(y + half)[kept], (y - half)[kept][::-1]])
    along = np.concatenate([x[kept], x[kept][::-1]])
    look = {"fill": "toself", "fillcolor": f"{color}/2a", "line": {"width": 0}, "mode": "lines", "hoverinfo": "skip"}
    return [
        {"type": "scatter", "x": numbers(along), "y": numbers(edge), "showlegend": False, "legendgroup": group, **look}
    ]


def _difference(one: Difference, error: str, color: str, label: str) -> list[dict[str, Any]]:
    x, d = one.nominal_mm, one.of(error)
    line = {
        "type": "scatter",
        "x": numbers(x),
        "y": numbers(d),
        "customdata": one.face.tolist(),
        "mode": "lines+markers",
        "name": f"{label}, ± U",
        "line": {"color": color, "width": 1.5, "dash": "dot"},
        "marker": {"size": 5, "color": color},
        "hovertemplate": "face %{customdata}, %{x:.1f} mm: %{y:.2f} µm<extra>" + label + "</extra>",
    }
    return [{**trace, "yaxis": "y2"} for trace in (*_band(x, d, one.expanded_um[error], color, label), line)]


def _layout(above: str, below: str) -> dict[str, Any]:
    return {
        "xaxis": {"title": {"text": POSITION_LABEL}, "anchor": "y2", "showgrid": True, "zeroline": False},
        "yaxis": {"title": {"text": above}, "domain": [0.34, 1.0], "zeroline": True},
        "yaxis2": {"title": {"text": f"{below} (µm)"}, "domain": [0.0, 0.27], "zeroline": True},
        "margin": {"l": 60, "r": 10, "t": 10, "b": 50},
        "legend": {"orientation": "h", "y": 1.02, "yanchor": "bottom"},
        "hovermode": "closest",
        "clickmode": "event",
    }


def probings_chart(cycle: Array, error_um: Array, used: NDArray[np.bool_], label: str) -> dict[str, Any]:
    """The single probings of a face over the cycles, those that were left out as crosses."""
    kinds = ((used, "circle", "--line-1", label), (~used, "x", "--red", "left out"))
    data = [
        {
            "type": "scatter",
            "x": cycle[which].astype(int).tolist(),
            "y": numbers(error_um[which]),
            "mode": "markers",
            "name": name,
            "marker": {"symbol": symbol, "color": color, "size": 7},
            "hovertemplate": "cycle %{x}: %{y:.2f} µm<extra></extra>",
        }
        for which, symbol, color, name in kinds
        if which.any()
    ]
    mean = float(error_um[used].mean()) if used.any() else None
    line = {"type": "line", "xref": "paper", "x0": 0, "x1": 1, "y0": mean, "y1": mean, "line": {"color": "--line-1"}}
    return {
        "data": data,
        "layout": {
            "xaxis": {"title": {"text": "cycle"}, "tickformat": "d"},
            "yaxis": {"title": {"text": "error (µm)"}},
            "shapes": [] if mean is None else [line],
            "margin": {"l": 60, "r": 10, "t": 10, "b": 45},
            "showlegend": bool((~used).any()),
        },
    }
