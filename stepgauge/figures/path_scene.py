"""The path of the tip past the gauge as a scene to turn in a browser: one file that needs no network.

Moves that a program repeats in every cycle are drawn once.
"""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError
from stepgauge.figures.plotly_library import embedded_json, packed_library
from stepgauge.figures.style import BLOCK_COLOR, COLORS, MEASURE_COLOR, RAIL_COLOR, STOP_COLOR, TRAVEL_COLOR
from stepgauge.files.arrays import Array
from stepgauge.files.json_types import defined
from stepgauge.files.text import write_text
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.motion.collision import Obstacles, make_obstacles
from stepgauge.motion.moves import Path

DECIMALS = 4
"""Decimals of coordinates in mm: more are not visible."""
EYE = {"x": 0.85, "y": 0.85, "z": 0.7}
"""Where the scene is seen from at first, in lengths of its longest side."""
END_ON = 0.85
"""Cosine of the gauge to the line of sight, seen from above, beyond which it is looked at end on."""
PAGE = """<!DOCTYPE html>
<html lang="en">
<head><meta charset="utf-8"><title>{title}</title></head>
<body style="margin:0">
<div id="path" style="width:100vw;height:100vh"></div>
<script type="application/json" id="scene">{scene}</script>
<script type="text/plain" id="library">{library}</script>
<script>
const scene = JSON.parse(document.getElementById("scene").textContent);
async function draw() {{
  const packed = Uint8Array.from(atob(document.getElementById("library").textContent), c => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  const script = document.createElement("script");
  script.textContent = await new Response(stream).text();
  document.head.append(script);
  await Plotly.newPlot("path", scene.data, scene.layout, {{responsive: true}});
}}
draw().catch(error => {{
  document.getElementById("path").textContent = "Cannot draw this (" + error + "). It needs a browser of 2023.";
}});
</script>
</body>
</html>
"""


@dataclass(frozen=True)
class SearchEnds:
    """Where searches ended: tip centres, and the face and cycle each was, by side and place."""

    tip_mm: Array
    face: NDArray[np.int64]
    cycle: NDArray[np.int64]


def probed_points(run_path: Path, gauge: Gauge, placement: Placement, tip_radius_mm: float) -> SearchEnds:
    """Ends of the searches in machine coordinates, each with its face and the number of the probing of this face."""
    tip = run_path.end_mm[run_path.measuring]
    along = (tip - run_path.start_mm[run_path.measuring]) @ placement.axis
    contact = placement.to_gauge(gauge, tip)[:, 0] + np.sign(along) * tip_radius_mm
    nearest = [np.abs(contact[:, None] - gauge.position_mm[side::2]).argmin(axis=1) for side in (0, 1)]
    face = np.where(along > 0, 2 * nearest[0] + 1, 2 * nearest[1] + 2)
    cycle = np.array([(face[: i + 1] == one).sum() for i, one in enumerate(face)], dtype=np.int64)
    return SearchEnds(tip, face, cycle)


def write_path_html(file: str | FilePath, scene: Any) -> FilePath:
    """Write what :func:`path_scene` made as one HTML file that needs no network.

    Raises :class:`InputError` for a suffix other than ``.html``.
    """
    if FilePath(file).suffix.lower() != ".html":
        raise InputError(file, "not a page for a browser", found=repr(FilePath(file).suffix), expected=".html")
    write_text(file, _page(scene))
    return FilePath(file)


def _page(scene: Any) -> str:
    title = scene.layout.title.text or "path of the tip"
    return PAGE.format(title=title, scene=embedded_json(scene.to_json()), library=packed_library())


def path_scene(
    run_path: Path,
    gauge: Gauge,
    placement: Placement,
    tip_radius_mm: float,
    travel_mm: Array | None = None,
    stop_piece: int | None = None,
    title: str = "",
) -> Any:
    """A scene to turn in a browser, a plotly figure: gauge, path and probed points in machine coordinates, mm.

    ``travel_mm`` of shape ``(3, 2)`` adds the box of the machine's travel; the other parameters are those of
    :func:`~stepgauge.figures.path.path_figure`.
    """
    obstacles = make_obstacles(gauge, placement)
    travelled = run_path.until(stop_piece)
    stopped = stop_piece is not None
    traces = [
        boxes(obstacles, slice(0, -1), "blocks", BLOCK_COLOR),
        boxes(obstacles, slice(-1, None), "rail", RAIL_COLOR),
        _lines(travelled, ~travelled.measuring, "travel", TRAVEL_COLOR, 2),
        _lines(travelled, travelled.measuring, "measuring", MEASURE_COLOR, 5),
        _probed(travelled, gauge, placement, tip_radius_mm, stopped),
    ]
    traces += [] if travel_mm is None else [travel_volume(np.asarray(travel_mm, float))]
    traces += [_stop(travelled)] if stopped else []
    return scene_of(traces, title).update_layout(scene_camera={"eye": seen_from(EYE, placement.axis)})


def seen_from(eye: Mapping[str, float], axis: Array) -> dict[str, float]:
    """The place from which a scene is seen: another corner of the travel where the gauge would be looked at end on.

    Along a diagonal of x and y it would stand upright in the picture.
    """
    end_on = abs(eye["x"] * axis[0] + eye["y"] * axis[1]) > END_ON * np.hypot(eye["x"], eye["y"])
    return {**eye, "y": -eye["y"] if end_on else eye["y"]}


def scene_of(traces: Sequence[Any], title: str = "") -> Any:
    """Traces in machine coordinates, mm, as a plotly figure to scale."""
    import plotly.graph_objects as go

    aspect = _aspect(traces)
    axes = {f"{axis}axis": {"title": {"text": axis}, "nticks": _ticks(aspect[axis])} for axis in "xyz"}
    unit = {"text": "x, y, z: mm", "xref": "paper", "yref": "paper", "x": 0.0, "y": 0.0, "showarrow": False}
    return go.Figure(
        traces,
        {
            "title": {"text": html.escape(title)},
            "scene": {"aspectmode": "manual", "aspectratio": aspect, "camera": {"eye": EYE}, **axes},
            "margin": {"l": 0, "r": 0, "b": 0, "t": 40 if title else 0},
            "legend": {"itemsizing": "constant"},
            "annotations": [unit],  # once: beside each axis they ran into each other
        },
    )


def _aspect(traces: Sequence[Any]) -> dict[str, float]:
    """To scale, the longest side of what is shown at first as 1: so the start view holds all of it."""
    shown = [one for one in traces if one.visible != "legendonly"]
    size = {}
    for axis in "xyz":
        values = np.concatenate([np.array(one[axis], float) for one in shown])
        size[axis] = float(np.nanmax(values) - np.nanmin(values))
    longest = max(size.values())
    return {axis: max(one / longest, 0.05) for axis, one in size.items()}


def _ticks(share: float) -> int:
    """As many numbers as can be read along an axis of that share of the longest one."""
    return max(2, round(8 * share))


_CORNERS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
_SIDES = ([0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3])
_TRIANGLES = np.array([half for a, b, c, d in _SIDES for half in ([a, b, c], [a, c, d])])
_EDGES = [(a, b) for a in range(8) for b in range(a + 1, 8) if np.abs(_CORNERS[a] - _CORNERS[b]).sum() == 1]


def boxes(obstacles: Obstacles, rows: slice, name: str, color: str) -> Any:
    """Boxes as one mesh: eight corners and twelve triangles each, in machine coordinates."""
    import plotly.graph_objects as go

    low, high = obstacles.low_mm[rows, None], obstacles.high_mm[rows, None]
    corners = obstacles.placement.to_machine(obstacles.gauge, (low + (high - low) * _CORNERS).reshape(-1, 3))
    triangles = (_TRIANGLES + 8 * np.arange(len(low))[:, None, None]).reshape(-1, 3)
    x, y, z = corners.round(DECIMALS).T.tolist()
    i, j, k = triangles.T.tolist()
    return go.Mesh3d(
        x=x, y=y, z=z, i=i, j=j, k=k, name=name, color=color, flatshading=True, showlegend=True, hoverinfo="name"
    )


def _lines(path: Path, where: NDArray[np.bool_], name: str, color: str, width: int) -> Any:
    pieces = np.stack([path.start_mm[where], path.end_mm[where]], axis=1).round(DECIMALS)
    once = np.unique(pieces, axis=0)
    gap = np.full((len(once), 1, 3), np.nan)
    return _line_trace(np.concatenate([once, gap], axis=1), name, color, width)


def _line_trace(pieces: Array, name: str, color: str, width: int) -> Any:
    """Pieces ``(n, 3 places, 3)``, the last place of each NaN, as one trace with gaps."""
    import plotly.graph_objects as go

    x, y, z = ([defined(one) for one in column] for column in pieces.reshape(-1, 3).T)
    line = {"color": color, "width": width}
    return go.Scatter3d(x=x, y=y, z=z, mode="lines", name=name, line=line, hoverinfo="skip")


def _probed(path: Path, gauge: Gauge, placement: Placement, tip_radius_mm: float, stopped: bool) -> Any:
    import plotly.graph_objects as go

    points = probed_points(path, gauge, placement, tip_radius_mm)
    count = len(points.face) - int(stopped and bool(path.measuring[-1]))  # the search that stopped it found nothing
    x, y, z = points.tip_mm[:count].round(DECIMALS).T.tolist()
    visits = np.column_stack([points.face, points.cycle])[:count].tolist()
    hover = "face %{customdata[0]}, cycle %{customdata[1]}<br>(%{x:.4f}, %{y:.4f}, %{z:.4f}) mm<extra></extra>"
    marker = {"size": 3, "color": MEASURE_COLOR}
    name = "probed (centre of the tip)"
    return go.Scatter3d(x=x, y=y, z=z, mode="markers", name=name, customdata=visits, hovertemplate=hover, marker=marker)


def travel_volume(travel_mm: Array) -> Any:
    """The edges of the travel ``(3, 2)``, low and high of each axis, mm, as a trace that a click on its name shows."""
    corners = travel_mm[:, 0] + (travel_mm[:, 1] - travel_mm[:, 0]) * _CORNERS
    gap = np.full(3, np.nan)
    pieces = np.array([[corners[a], corners[b], gap] for a, b in _EDGES])
    box = _line_trace(pieces, "travel of the machine", COLORS["grey"], 1)
    # shown at a click on its name: with it the scene would open on the whole machine, and the gauge be tiny
    return box.update(visible="legendonly")


def _stop(path: Path) -> Any:
    import plotly.graph_objects as go

    x, y, z = path.end_mm[-1:].T
    marker = {"size": 7, "color": STOP_COLOR, "symbol": "x"}
    return go.Scatter3d(x=x, y=y, z=z, mode="markers", name="stopped here", marker=marker)
