"""The gauge as it lies in the travel of the machine, with the 16 points, as a scene to turn in a browser."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from stepgauge.figures.path_scene import DECIMALS, boxes, scene_of, seen_from, travel_volume
from stepgauge.figures.style import BLOCK_COLOR, MEASURE_COLOR, RAIL_COLOR, STOP_COLOR
from stepgauge.files.arrays import Array
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.motion.collision import make_obstacles

EYE = {"x": 1.15, "y": 1.15, "z": 0.95}
"""Far enough to have the whole machine in view."""


def placement_scene(
    gauge: Gauge,
    placement: Placement | None,
    points: Array | None = None,
    suspects: Sequence[int] = (),
    travel_mm: Array | None = None,
) -> Any:
    """A plotly figure in machine coordinates, mm.

    Parameters
    ----------
    gauge, placement : drawn as blocks and rail; without a placement only the points are
    points : tip centres of the 16 points, shape ``(16, 3)``
    suspects : the points, from 1, that disagree
    travel_mm : box of the machine's travel, shape ``(3, 2)``
    """
    traces: list[Any] = []
    if placement is not None:
        obstacles = make_obstacles(gauge, placement)
        traces += [boxes(obstacles, slice(0, -1), "blocks", BLOCK_COLOR)]
        traces += [boxes(obstacles, slice(-1, None), "rail", RAIL_COLOR)]
    if points is not None:
        others = [number for number in range(1, 17) if number not in suspects]
        traces += [_points(points, others, "points (centre of the tip)", MEASURE_COLOR)]
        traces += [_points(points, list(suspects), "disagrees", STOP_COLOR)] if suspects else []
    if travel_mm is not None:
        traces += [travel_volume(np.asarray(travel_mm, float)).update(visible=True)]
    found = scene_of(traces)
    eye = EYE if placement is None else seen_from(EYE, placement.axis)
    found.update_layout(scene_camera={"eye": eye}, legend={"orientation": "h", "y": 1.0, "x": 0.0})
    return found


def _points(points: Array, numbers: list[int], name: str, color: str) -> Any:
    import plotly.graph_objects as go

    x, y, z = points[np.array(numbers) - 1].round(DECIMALS).T.tolist()
    hover = "%{text}<br>(%{x:.4f}, %{y:.4f}, %{z:.4f}) mm<extra></extra>"
    return go.Scatter3d(
        x=x,
        y=y,
        z=z,
        text=[str(number) for number in numbers],
        mode="markers+text" if len(numbers) < 3 else "markers",
        name=name,
        hovertemplate=hover,
        marker={"size": 5 if len(numbers) > 2 else 9, "color": color},
    )
