"""The path of the tip past the gauge: a figure in gauge coordinates, to scale, and a scene in machine coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PatchCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch, Rectangle
from numpy.typing import NDArray

from stepgauge.collision import Obstacles, make_obstacles
from stepgauge.figures.style import COLORS, CYCLE, figure_format, figure_style, new_figure, save_figure
from stepgauge.gauge import Gauge
from stepgauge.moves import Path
from stepgauge.placement import Placement

Array = NDArray[np.float64]
WIDTH_MM = 180.0
MARGIN_MM = 45.0
"""How far around the gauge the figure looks; a home position farther off is beyond its edge."""
DETAIL_BLOCKS = 3
BLOCK_COLOR, RAIL_COLOR, EDGE_COLOR = "#B8C4CE", "#E6E6E6", "#5F6B75"
BESIDE_STYLE: Any = (0, (3, 2))
TRAVEL_COLOR, MEASURE_COLOR, STOP_COLOR = CYCLE[0], CYCLE[1], CYCLE[3]


@dataclass(frozen=True)
class ProbedPoints:
    """Where searches ended: tip centres, and the face and cycle each was, by side and place."""

    tip_mm: Array
    face: NDArray[np.int64]
    cycle: NDArray[np.int64]


@dataclass(frozen=True)
class View:
    """A view along one gauge direction: which coordinate goes up the page, what it is called, which way it points."""

    vertical: int
    title: str
    label: str
    downward: bool


PLAN = View(1, "plan (from above)", "side s (mm)", True)
ELEVATION = View(2, "elevation (from the side)", "up u (mm)", False)


def draw_path(
    file: str | FilePath,
    run_path: Path,
    gauge: Gauge,
    placement: Placement,
    tip_radius_mm: float,
    stop_piece: int | None = None,
    title: str = "",
) -> FilePath:
    """Draw a path and the gauge from above and from the side, and a few blocks larger where there are many.

    Parameters
    ----------
    file : PNG, SVG or PDF, by its suffix (:class:`InputError` for another)
    run_path : pieces of the path in machine coordinates
    gauge, placement : the gauge as it lies
    tip_radius_mm : radius of the tip ball, drawn at the probed points of the detail
    stop_piece : index of the piece on which the machine stopped; what comes after it is not drawn
    title : printed above
    """
    figure_format(file)
    save_figure(path_figure(run_path, gauge, placement, tip_radius_mm, stop_piece, title), file)
    return FilePath(file)


def path_figure(
    run_path: Path,
    gauge: Gauge,
    placement: Placement,
    tip_radius_mm: float,
    stop_piece: int | None = None,
    title: str = "",
) -> Figure:
    """The figure of :func:`draw_path`, in gauge coordinates."""
    obstacles = make_obstacles(gauge, placement)
    travelled = _until(run_path, stop_piece)
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
        views[0].set_xlabel("")
        for axes, view in zip(details, (PLAN, ELEVATION), strict=False):
            _draw_view(axes, view, local, obstacles, stopped)
            _draw_balls(axes, view, local, tip_radius_mm)
            _limit(axes, view, low, high)
            axes.set_title(f"detail, {view.title.split()[0]}; tip ball to scale", loc="left")
        figure.suptitle(title, parse_math=False, x=0.01, ha="left", fontsize=9, fontweight="bold")
        _add_legend(figure, stopped)
    return figure


def _until(path: Path, stop_piece: int | None) -> Path:
    """The pieces up to and with the one on which the machine stopped."""
    if stop_piece is None:
        return path
    kept = slice(0, stop_piece + 1)
    return Path(path.start_mm[kept], path.end_mm[kept], path.measuring[kept], path.move[kept])


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
    aside = ~local.measuring & _beside(local, obstacles, view)
    for kind, where, color, width, style in (
        ("travel", ~local.measuring & ~aside, TRAVEL_COLOR, 0.6, "solid"),
        ("travel beside", aside, TRAVEL_COLOR, 0.6, BESIDE_STYLE),
        ("measuring", local.measuring, MEASURE_COLOR, 1.4, "solid"),
    ):
        lines = LineCollection(list(pieces[where]), colors=color, linewidths=width, linestyles=[style], zorder=3)
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


def _beside(local: Path, obstacles: Obstacles, view: View) -> NDArray[np.bool_]:
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
        Line2D([], [], color=MEASURE_COLOR, linewidth=0, marker="o", markersize=3, label="probed (tip centre)"),
    ]
    if stopped:
        entries.append(Line2D([], [], color=STOP_COLOR, marker="X", markersize=6, linewidth=2, label="stopped here"))
    figure.legend(handles=entries, loc="outside lower center", ncols=len(entries), frameon=False)


def probed_points(run_path: Path, gauge: Gauge, placement: Placement, tip_radius_mm: float) -> ProbedPoints:
    """Ends of the searches in machine coordinates, each with the face it points at and the how-manieth visit it is."""
    tip = run_path.end_mm[run_path.measuring]
    along = (tip - run_path.start_mm[run_path.measuring]) @ placement.axis
    contact = placement.to_gauge(gauge, tip)[:, 0] + np.sign(along) * tip_radius_mm
    nearest = [np.abs(contact[:, None] - gauge.position_mm[side::2]).argmin(axis=1) for side in (0, 1)]
    face = np.where(along > 0, 2 * nearest[0] + 1, 2 * nearest[1] + 2)
    cycle = np.array([(face[: i + 1] == one).sum() for i, one in enumerate(face)], dtype=np.int64)
    return ProbedPoints(tip, face, cycle)


def write_path_html(
    file: str | FilePath,
    run_path: Path,
    gauge: Gauge,
    placement: Placement,
    tip_radius_mm: float,
    travel_mm: Array | None = None,
    stop_piece: int | None = None,
    title: str = "",
) -> FilePath:
    """Write a scene to turn in a browser: gauge, path and probed points in machine coordinates, mm.

    One HTML file that needs no network. ``travel_mm`` of shape ``(3, 2)`` adds the box of the machine's travel; the
    other parameters are those of :func:`draw_path`.
    """
    from stepgauge.errors import InputError
    from stepgauge.files import write_text

    if FilePath(file).suffix.lower() != ".html":
        raise InputError(file, "not a page for a browser", found=repr(FilePath(file).suffix), expected=".html")
    scene = path_scene(run_path, gauge, placement, tip_radius_mm, travel_mm, stop_piece, title)
    write_text(file, scene.to_html(include_plotlyjs=True, full_html=True, div_id="path"))
    return FilePath(file)


def path_scene(
    run_path: Path,
    gauge: Gauge,
    placement: Placement,
    tip_radius_mm: float,
    travel_mm: Array | None = None,
    stop_piece: int | None = None,
    title: str = "",
) -> Any:
    """The plotly figure of :func:`write_path_html`."""
    import html

    import plotly.graph_objects as go

    obstacles = make_obstacles(gauge, placement)
    travelled = _until(run_path, stop_piece)
    stopped = stop_piece is not None
    traces = [
        _boxes(obstacles, slice(0, -1), "blocks", BLOCK_COLOR),
        _boxes(obstacles, slice(-1, None), "rail", RAIL_COLOR),
        _lines(travelled, ~travelled.measuring, "travel", TRAVEL_COLOR, 2),
        _lines(travelled, travelled.measuring, "measuring", MEASURE_COLOR, 5),
        _probed(travelled, gauge, placement, tip_radius_mm, stopped),
    ]
    traces += [] if travel_mm is None else [_travel_volume(np.asarray(travel_mm, float))]
    traces += [_stop(travelled)] if stopped else []
    axes = {f"{axis}axis": {"title": {"text": f"{axis} (mm)"}} for axis in "xyz"}
    return go.Figure(
        traces,
        {
            "title": {"text": html.escape(title)},
            "scene": {"aspectmode": "manual", "aspectratio": _aspect(traces), **axes},
            "margin": {"l": 0, "r": 0, "b": 0, "t": 40 if title else 0},
            "legend": {"itemsizing": "constant"},
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


_CORNERS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
_SIDES = ([0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3])
_TRIANGLES = np.array([half for a, b, c, d in _SIDES for half in ([a, b, c], [a, c, d])])
_EDGES = [(a, b) for a in range(8) for b in range(a + 1, 8) if np.abs(_CORNERS[a] - _CORNERS[b]).sum() == 1]


def _boxes(obstacles: Obstacles, rows: slice, name: str, color: str) -> Any:
    """Boxes as one mesh: eight corners and twelve triangles each, in machine coordinates."""
    import plotly.graph_objects as go

    low, high = obstacles.low_mm[rows, None], obstacles.high_mm[rows, None]
    corners = obstacles.placement.to_machine(obstacles.gauge, (low + (high - low) * _CORNERS).reshape(-1, 3))
    triangles = (_TRIANGLES + 8 * np.arange(len(low))[:, None, None]).reshape(-1, 3)
    x, y, z = corners.T
    i, j, k = triangles.T
    return go.Mesh3d(
        x=x, y=y, z=z, i=i, j=j, k=k, name=name, color=color, flatshading=True, showlegend=True, hoverinfo="name"
    )


def _lines(path: Path, where: NDArray[np.bool_], name: str, color: str, width: int) -> Any:
    gap = np.full((int(where.sum()), 3), np.nan)
    return _line_trace(np.stack([path.start_mm[where], path.end_mm[where], gap], axis=1), name, color, width)


def _line_trace(pieces: Array, name: str, color: str, width: int) -> Any:
    """Pieces ``(n, 3 places, 3)``, the last place of each NaN, as one trace with gaps."""
    import plotly.graph_objects as go

    x, y, z = (_without_nan(column) for column in pieces.reshape(-1, 3).T)
    line = {"color": color, "width": width}
    return go.Scatter3d(x=x, y=y, z=z, mode="lines", name=name, line=line, hoverinfo="skip")


def _without_nan(values: Array) -> list[float | None]:
    return [None if np.isnan(value) else float(value) for value in values]


def _probed(path: Path, gauge: Gauge, placement: Placement, tip_radius_mm: float, stopped: bool) -> Any:
    import plotly.graph_objects as go

    points = probed_points(path, gauge, placement, tip_radius_mm)
    count = len(points.face) - int(stopped and bool(path.measuring[-1]))  # the search that stopped it found nothing
    text = [
        f"face {face}, cycle {cycle}<br>({x:.4f}, {y:.4f}, {z:.4f}) mm"
        for face, cycle, (x, y, z) in zip(points.face, points.cycle, points.tip_mm, strict=True)
    ]
    x, y, z = points.tip_mm[:count].T
    marker = {"size": 3, "color": MEASURE_COLOR}
    return go.Scatter3d(
        x=x, y=y, z=z, mode="markers", name="probed (tip centre)", text=text[:count], hoverinfo="text", marker=marker
    )


def _travel_volume(travel_mm: Array) -> Any:
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
