"""A planned path to play back in a browser: the scene, the tool to scale, and where the tip is at what time."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.figures.path_scene import DECIMALS, path_scene
from stepgauge.figures.style import COLORS, STOP_COLOR
from stepgauge.files.arrays import Array
from stepgauge.files.json_types import defined
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.motion.collision import Tool, ToolPart
from stepgauge.motion.moves import Path, Program, trace

CORNERS = 16
"""Of the circles that the tool is made of."""
BODY_SHOWN_MM = 60.0
"""Height of the tool above the shank that is drawn: the rest is far from everything and would make the gauge small."""


def path_player(
    program: Program, gauge: Gauge, placement: Placement, tool: Tool, travel_mm: Array, conflicts: Sequence[int] = ()
) -> dict[str, Any]:
    """Content of the page's player, JSON types.

    Parameters
    ----------
    program : the moves
    gauge, placement : the gauge in its placement
    tool : ball, shank and body of the probe
    travel_mm : box of the machine's travel, shape ``(3, 2)``
    conflicts : pieces of the path that are refused, drawn in red

    Returns
    -------
    ``figure``; ``tool``: number of its trace, and its corners relative to the tip centre, mm; ``steps``: place of the
    tip in mm and time in s at the ends of all pieces, and what each piece is.
    """
    path = trace(program)
    figure = json.loads(path_scene(path, gauge, placement, tool.tip_radius_mm, travel_mm).to_json())
    if conflicts:
        figure["data"].append(_pieces(path, sorted(set(conflicts))))
    corners, triangles = tool_mesh(tool)
    mesh = _mesh(corners + path.start_mm[0], triangles)
    figure["data"].append(mesh)
    figure["layout"] |= {"uirevision": "path", "legend": {"orientation": "h", "y": 0.0, "itemsizing": "constant"}}
    moved = {axis: column.round(DECIMALS).tolist() for axis, column in zip("xyz", corners.T, strict=True)}
    return {"figure": figure, "tool": {"trace": len(figure["data"]) - 1, **moved}, "steps": _steps(program, path)}


def _steps(program: Program, path: Path) -> dict[str, Any]:
    places = np.vstack([path.start_mm[:1], path.end_mm]).round(DECIMALS)
    settings = program.settings
    speed = np.where(path.measuring, settings.measuring_speed_mm_s, settings.travel_speed_mm_s)
    time_s = np.concatenate([[0.0], np.cumsum(path.length_mm / speed)]).round(3)
    named = [program.names[move] for move in path.move]
    return {
        **{axis: column.tolist() for axis, column in zip("xyz", places.T, strict=True)},
        "time_s": time_s.tolist(),
        "name": named,
        "measuring": path.measuring.tolist(),
    }


def _pieces(path: Path, pieces: Sequence[int]) -> dict[str, Any]:
    """Pieces as one trace with gaps, those that repeat in every cycle once."""
    ends = np.unique(np.stack([path.start_mm[pieces], path.end_mm[pieces]], axis=1).round(DECIMALS), axis=0)
    places = np.concatenate([ends, np.full((len(ends), 1, 3), np.nan)], axis=1).reshape(-1, 3)
    x, y, z = ([defined(one) for one in column] for column in places.T)
    line = {"color": STOP_COLOR, "width": 12}
    return {"type": "scatter3d", "x": x, "y": y, "z": z, "mode": "lines", "name": "refused", "line": line}


def _mesh(corners: Array, triangles: NDArray[np.int64]) -> dict[str, Any]:
    x, y, z = (column.round(DECIMALS).tolist() for column in corners.T)
    i, j, k = triangles.T.tolist()
    look = {"color": COLORS["grey"], "opacity": 0.75, "flatshading": False, "hoverinfo": "skip", "showlegend": True}
    return {"type": "mesh3d", "x": x, "y": y, "z": z, "i": i, "j": j, "k": k, "name": "probe", **look}


def tool_mesh(tool: Tool) -> tuple[Array, NDArray[np.int64]]:
    """Corners ``(n, 3)`` relative to the tip centre, mm, and triangles ``(m, 3)`` of ball, shank and body."""
    meshes = [_ball(tool.tip_radius_mm)]
    meshes += [_cylinder(part) for part in tool.parts[1:]]
    first = np.cumsum([0, *(len(corners) for corners, _ in meshes[:-1])])
    triangles = np.concatenate([some + at for (_, some), at in zip(meshes, first, strict=True)])
    return np.concatenate([corners for corners, _ in meshes]) @ _frame(tool.upward), triangles


def _frame(upward: Array) -> Array:
    """Rows: two unit vectors across ``upward``, and itself."""
    least = np.eye(3)[int(np.abs(upward).argmin())]
    across = np.cross(upward, least)
    across /= np.linalg.norm(across)
    return np.stack([across, np.cross(upward, across), upward])


def _rings(radius: Array, height: Array) -> tuple[Array, NDArray[np.int64]]:
    """A surface of revolution about z through circles of these radii and heights."""
    angle = np.linspace(0.0, 2.0 * np.pi, CORNERS, endpoint=False)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    corners = np.concatenate(
        [np.column_stack([r * circle, np.full(CORNERS, h)]) for r, h in zip(radius, height, strict=True)]
    )
    at = np.arange(CORNERS)
    beside = (at + 1) % CORNERS
    triangles = [
        np.concatenate(
            [
                np.stack([low + at, low + beside, low + CORNERS + at], 1),
                np.stack([low + beside, low + CORNERS + beside, low + CORNERS + at], 1),
            ]
        )
        for low in range(0, CORNERS * (len(radius) - 1), CORNERS)
    ]
    return corners, np.concatenate(triangles)


def _ball(radius_mm: float) -> tuple[Array, NDArray[np.int64]]:
    polar = np.linspace(0.0, np.pi, CORNERS // 2 + 1)
    return _rings(radius_mm * np.sin(polar), radius_mm * np.cos(polar))


def _cylinder(part: ToolPart) -> tuple[Array, NDArray[np.int64]]:
    """A part of the tool with its ends closed, as far as it is drawn."""
    far = min(part.far_mm, part.near_mm + BODY_SHOWN_MM)
    height = np.array([part.near_mm, part.near_mm, far, far])
    return _rings(part.radius_mm * np.array([0.0, 1.0, 1.0, 0.0]), height)
