"""The path of the tip past the gauge: a figure in gauge coordinates, to scale."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PatchCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch, Rectangle
from numpy.typing import NDArray

from stepgauge.figures.legends import add_legend
from stepgauge.figures.style import (
    BLOCK_COLOR,
    EDGE_COLOR,
    MEASURE_COLOR,
    RAIL_COLOR,
    STOP_COLOR,
    TRAVEL_COLOR,
    figure_style,
    new_figure,
)
from stepgauge.files.arrays import Array
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.motion.collision import Obstacles, make_obstacles
from stepgauge.motion.moves import Path

WIDTH_MM = 180.0
MARGIN_MM = 45.0
"""Margin of the figure around the gauge; a home position farther away is outside."""
DETAIL_BLOCKS = 3
SAME_MM = 0.01
"""Heights nearer to each other are drawn as one line."""
BESIDE_STYLE: Any = (0, (3, 2))


@dataclass(frozen=True)
class View:
    """A view along one gauge direction: which coordinate goes up the page, what it is called, which way it points."""

    vertical: int
    title: str
    label: str
    downward: bool


PLAN = View(1, "plan (from above)", "side s (mm)", True)
ELEVATION = View(2, "elevation (from the side)", "up u (mm)", False)


def path_figure(
    run_path: Path,
    gauge: Gauge,
    placement: Placement,
    tip_radius_mm: float,
    stop_piece: int | None = None,
    title: str = "",
) -> Figure:
    """A path and the gauge from above and from the side, and a few blocks larger where there are many.

    Parameters
    ----------
    run_path : pieces of the path in machine coordinates; drawn in those of the gauge
    gauge, placement : the gauge in its placement
    tip_radius_mm : radius of the tip ball, drawn at the probed points of the detail
    stop_piece : index of the piece on which the machine stopped; what comes after it is not drawn
    title : printed above
    """
    obstacles = make_obstacles(gauge, placement)
    travelled = run_path.until(stop_piece)
    local = Path(
        placement.to_gauge(gauge, travelled.start_mm),
        placement.to_gauge(gauge, travelled.end_mm),
        travelled.measuring,
        travelled.move,
    )
    stopped = stop_piece is not None
    low, high = _window(local, obstacles)
    with figure_style():
        figure, views, details = _lay_out(low, high, gauge.n_blocks > DETAIL_BLOCKS + 1)
        for axes, view in zip(views, (PLAN, ELEVATION), strict=True):
            _draw_view(axes, view, local, obstacles, stopped)
            _limit(axes, view, low, high)
        low, high = _detail_window(local, obstacles, stopped)
        for axes in views if len(details) else views[:1]:  # below stands the same label
            axes.set_xlabel("")
        for axes, view in zip(details, (PLAN, ELEVATION), strict=False):
            _draw_view(axes, view, local, obstacles, stopped)
            _draw_balls(axes, view, local, tip_radius_mm)
            _limit(axes, view, low, high)
            axes.set_title(f"detail, {view.title.split()[0]}; tip ball to scale", loc="left")
        figure.suptitle(title, parse_math=False, x=0.01, ha="left", fontsize=9, fontweight="bold")
        _add_legend(figure, stopped)
    return figure


def _window(local: Path, obstacles: Obstacles) -> tuple[Array, Array]:
    """Corners of what is shown: the gauge and what the path does near it."""
    low, high = obstacles.low_mm.min(axis=0), obstacles.high_mm.max(axis=0)
    points = np.vstack([local.start_mm, local.end_mm])
    near = points[((points > low - MARGIN_MM) & (points < high + MARGIN_MM)).all(axis=1)]
    corners = np.vstack([near, low, high])
    return corners.min(axis=0) - 4.0, corners.max(axis=0) + 4.0


def _detail_window(local: Path, obstacles: Obstacles, stopped: bool) -> tuple[Array, Array]:
    """A few blocks: where the machine stopped, else where the path first measures."""
    blocks = obstacles.low_mm[:-1, 0]
    searches = local.end_mm[local.measuring]
    middle = local.end_mm[-1] if stopped else (searches[0] if len(searches) else local.end_mm[0])
    first = int(np.clip(np.searchsorted(blocks, middle[0]) - 1, 0, max(len(blocks) - DETAIL_BLOCKS, 0)))
    last = min(first + DETAIL_BLOCKS, len(blocks)) - 1
    pitch = float(np.diff(blocks[:2])[0])
    start, end = blocks[first] - 0.8 * pitch, obstacles.high_mm[last, 0] + 0.8 * pitch
    across = max(0.36 * (end - start), 1.2 * float(np.abs(searches[:, 1:]).max(initial=0.0)))  # the same in both views
    return np.array([start, -across, -across]), np.array([end, across, across])


def _lay_out(low: Array, high: Array, with_detail: bool) -> tuple[Figure, list[Axes], list[Axes]]:
    """Axes whose sizes suit the window, so that a millimetre is as long in every direction of a panel."""
    size = high - low
    scale = (WIDTH_MM - 18.0) / size[0]
    heights = [max(size[1] * scale, 12.0), max(size[2] * scale, 14.0)]
    detail_mm = 58.0 if with_detail else 0.0
    rows = [*heights, detail_mm] if with_detail else heights
    figure = new_figure(WIDTH_MM, sum(rows) + 16.0 + 11.0 * len(rows))
    grid = figure.add_gridspec(len(rows), 2, height_ratios=rows)
    views = [figure.add_subplot(grid[row, :]) for row in (0, 1)]
    details = [figure.add_subplot(grid[2, column]) for column in (0, 1)] if with_detail else []
    return figure, views, details


def _draw_view(axes: Axes, view: View, local: Path, obstacles: Obstacles, stopped: bool) -> None:
    _draw_gauge(axes, view, obstacles)
    start, end = local.start_mm[:, [0, view.vertical]], local.end_mm[:, [0, view.vertical]]
    pieces = np.stack([start, end], axis=1)
    aside = ~local.measuring & _passes_blocks(local, obstacles, view)
    for kind, where, color, width, style in (
        ("travel", ~local.measuring & ~aside, TRAVEL_COLOR, 0.6, "solid"),
        ("travel beside", aside, TRAVEL_COLOR, 0.6, BESIDE_STYLE),
        ("measuring", local.measuring, MEASURE_COLOR, 1.4, "solid"),
    ):
        drawn = _once(pieces[where]) if kind == "travel beside" else pieces[where]
        lines = LineCollection(list(drawn), colors=color, linewidths=width, linestyles=[style], zorder=3)
        lines.set_gid(kind)
        axes.add_collection(lines)
    probed = end[local.measuring][: -1 if stopped and local.measuring[-1] else None]
    axes.plot(*probed.T, linestyle="none", marker="o", markersize=1.8, color=MEASURE_COLOR, zorder=4, gid="probed")
    if stopped:
        axes.plot(*pieces[-1].T, color=STOP_COLOR, linewidth=2.0, zorder=5)
        axes.plot(*end[-1], marker="X", markersize=6, color=STOP_COLOR, markeredgecolor="black", zorder=6, gid="stop")
    axes.set_title(view.title, loc="left")
    axes.set_xlabel("along the gauge a, from face 1 (mm)")
    axes.set_ylabel(view.label)


def _once(pieces: Array) -> Array:
    """Pieces ``(n, 2 ends, 2)`` without what is drawn already: dashes over dashes would make a solid line.

    Those along the gauge at one height are joined to as few as cover them.
    """
    level = np.abs(pieces[:, 0, 1] - pieces[:, 1, 1]) < SAME_MM
    joined = list[Array]()
    for one in sorted(pieces[level], key=lambda piece: (round(float(piece[0, 1]) / SAME_MM), piece[:, 0].min())):
        left, right = np.sort(one[:, 0])
        if joined and abs(joined[-1][0, 1] - one[0, 1]) < SAME_MM and left <= joined[-1][1, 0] + SAME_MM:
            joined[-1][1, 0] = max(joined[-1][1, 0], right)
        else:
            joined.append(np.array([[left, one[0, 1]], [right, one[0, 1]]]))
    others = pieces[~level].round(3)
    back = (others[:, 0, 0] > others[:, 1, 0]) | (
        (others[:, 0, 0] == others[:, 1, 0]) & (others[:, 0, 1] > others[:, 1, 1])
    )
    others[back] = others[back][:, ::-1]
    return np.array([*joined, *np.unique(others, axis=0)]).reshape(-1, 2, 2)


def _passes_blocks(local: Path, obstacles: Obstacles, view: View) -> NDArray[np.bool_]:
    """Pieces that pass the blocks on the near or the far side of what a view shows: drawn across them, not through."""
    depth = 3 - view.vertical  # side where up is drawn, up where the side is
    low, high = obstacles.low_mm[:-1, depth].min(), obstacles.high_mm[:-1, depth].max()
    start, end = local.start_mm[:, depth], local.end_mm[:, depth]
    return np.asarray((np.minimum(start, end) > high) | (np.maximum(start, end) < low))


def _draw_gauge(axes: Axes, view: View, obstacles: Obstacles) -> None:
    low, high = obstacles.low_mm[:, [0, view.vertical]], obstacles.high_mm[:, [0, view.vertical]]
    boxes = [Rectangle(tuple(a), *(b - a)) for a, b in zip(low, high, strict=True)]
    rail = PatchCollection(boxes[-1:], facecolor=RAIL_COLOR, edgecolor=EDGE_COLOR, linewidth=0.4, zorder=1)
    blocks = PatchCollection(boxes[:-1], facecolor=BLOCK_COLOR, edgecolor=EDGE_COLOR, linewidth=0.4, zorder=2)
    blocks.set_gid("blocks")
    axes.add_collection(rail)
    axes.add_collection(blocks)


def _draw_balls(axes: Axes, view: View, local: Path, radius_mm: float) -> None:
    centres = local.end_mm[local.measuring][:, [0, view.vertical]]
    balls = [Circle(tuple(centre), radius_mm) for centre in np.unique(centres.round(2), axis=0)]
    axes.add_collection(
        PatchCollection(balls, facecolor="none", edgecolor=MEASURE_COLOR, linewidth=0.7, zorder=4, gid="tip balls")
    )


def _limit(axes: Axes, view: View, low: Array, high: Array) -> None:
    axes.set_xlim(low[0], high[0])
    limits = (low[view.vertical], high[view.vertical])
    axes.set_ylim(limits[::-1] if view.downward else limits)
    axes.set_aspect("equal")
    axes.spines[["top", "right"]].set_visible(False)


def _add_legend(figure: Figure, stopped: bool) -> None:
    entries: list[Any] = [
        Patch(facecolor=BLOCK_COLOR, edgecolor=EDGE_COLOR, linewidth=0.4, label="block"),
        Patch(facecolor=RAIL_COLOR, edgecolor=EDGE_COLOR, linewidth=0.4, label="rail"),
        Line2D([], [], color=TRAVEL_COLOR, linewidth=0.8, label="travel"),
        Line2D([], [], color=TRAVEL_COLOR, linewidth=0.8, linestyle=BESIDE_STYLE, label="beside or above the blocks"),
        Line2D([], [], color=MEASURE_COLOR, linewidth=1.4, label="measuring"),
        Line2D([], [], color=MEASURE_COLOR, linewidth=0, marker="o", markersize=3, label="probed (centre of the tip)"),
    ]
    if stopped:
        entries.append(Line2D([], [], color=STOP_COLOR, marker="X", markersize=6, linewidth=2, label="stopped here"))
    add_legend(figure, {str(one.get_label()): one for one in entries}, "lower center")
