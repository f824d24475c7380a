"""Errors of several placements in the travel of the machine: arrows at the faces, magnified, across the gauge.

A step gauge measures errors along its axis. Arrows along the gauge would overlap; so every arrow is drawn across it: up
where the machine indicates too long a distance from face 1 of the used section, down where too short.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from stepgauge.errors import InputError, naming
from stepgauge.evaluation.evaluate import PlacementResult
from stepgauge.figures.style import COLORS, CYCLE, figure_style, new_figure
from stepgauge.files.arrays import Array

WIDTH_MM, HEIGHT_MM = 140.0, 130.0
LONG, SHORT, GREY = CYCLE[0], CYCLE[1], COLORS["grey"]
LARGEST_SHARE = 0.16
"""Length of the largest arrow over the diagonal of the box."""


def arrows_figure(results: Sequence[PlacementResult], travel_mm: Array | None = None, machine: str = "") -> Figure:
    """Mean errors XM of all placements in a view of the machine.

    ``travel_mm``: lowest and highest x, y, z, shape ``(3, 2)``; without it the box encloses the placements.
    :class:`InputError` where a placement is outside of it.
    """
    box = _box(results) if travel_mm is None else np.asarray(travel_mm, float)
    _check_inside(results, box)
    largest_um = max((float(np.nanmax(np.abs(r.xm_um))) for r in results if np.isfinite(r.xm_um).any()), default=1.0)
    magnification = _round_down(
        LARGEST_SHARE * float(np.linalg.norm(np.ptp(box, axis=1))) * 1e3 / max(largest_um, 1e-3)
    )
    with figure_style():
        figure = new_figure(WIDTH_MM, HEIGHT_MM)
        figure.set_layout_engine("none")  # it would shrink the box to its widest label
        axes = figure.add_axes((0.0, 0.16, 1.0, 0.80), projection="3d", computed_zorder=False)
        _draw_box(axes, box)
        for result in results:
            _draw_placement(axes, result, magnification, box)
        _label(axes, box)
        where = "places of the gauge" if travel_mm is None else "travel"
        title = f"{machine + ': ' if machine else ''}Mean errors XM in the {where}, {_grouped(magnification)} times"
        figure.text(0.02, 0.965, title, fontsize=8.5, fontweight="bold")
        figure.text(0.02, 0.028, _caption(magnification, largest_um), fontsize=7.5)
        figure.legend(handles=_legend(), loc="lower center", bbox_to_anchor=(0.5, 0.072), ncols=3, frameon=False)
    return figure


def _check_inside(results: Sequence[PlacementResult], box: Array) -> None:
    """A recording of another machine would lie outside the box."""
    for result in results:
        ends = _ends(result)
        outside = ((ends < box[:, 0]) | (ends > box[:, 1])).any(axis=0)
        if outside.any():
            axis = int(outside.argmax())
            raise InputError(
                naming("machine"),
                f"placement {result.placement} is outside the travel of {'xyz'[axis]}",
                found=f"{ends[:, axis].min():.1f} to {ends[:, axis].max():.1f} mm",
                expected=f"{box[axis, 0]:g} to {box[axis, 1]:g} mm",
            )


def _ends(result: PlacementResult) -> Array:
    return np.asarray(result.origin_mm + np.outer([0.0, result.span_mm], result.axis))


def _box(results: Sequence[PlacementResult]) -> Array:
    """A box around all faces with a margin."""
    ends = np.concatenate([_ends(result) for result in results])
    margin = 0.2 * float(np.ptp(ends, axis=0).max())
    return np.column_stack([ends.min(axis=0) - margin, ends.max(axis=0) + margin])


def _round_down(value: float) -> float:
    """The next of 1, 2, 5 times a power of ten below."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * max(step for step in (1.0, 2.0, 5.0) if step * power <= value * (1 + 1e-9)))


def _draw_box(axes: Any, box: Array) -> None:
    corners = np.array(list(product(*box)))
    for one, other in product(corners, corners):
        if (one != other).sum() == 1 and (one <= other).all():
            axes.plot(*np.column_stack([one, other]), color="#B0B0B0", linewidth=0.7, zorder=1)


def _draw_placement(axes: Any, result: PlacementResult, magnification: float, box: Array) -> None:
    along = result.position_mm - result.position_mm[np.flatnonzero(result.count)[0]]
    foot = result.origin_mm + np.outer(along, result.axis)
    tip = foot + np.outer(np.nan_to_num(result.xm_um) * 1e-3 * magnification, across(result.axis))
    line = np.array([foot[0], foot[-1]]).T
    axes.plot(*line, color=COLORS["model"], linewidth=2.2, solid_capstyle="butt", zorder=3)
    known = np.isfinite(result.xm_um)
    for start, end, error in zip(foot[known], tip[known], result.xm_um[known], strict=True):
        axes.plot(*np.column_stack([start, end]), color=LONG if error >= 0 else SHORT, linewidth=1.0, zorder=4)
    for sign, color, marker in ((1, LONG, "^"), (-1, SHORT, "v")):
        heads = tip[known & (np.sign(np.nan_to_num(result.xm_um)) == sign)]
        axes.plot(*heads.T, linestyle="none", marker=marker, markersize=3.0, color=color, zorder=5)
    axes.plot(*tip[known].T, color=GREY, linewidth=0.6, zorder=4)
    axes.text(
        *(foot[0] - 0.02 * np.linalg.norm(np.ptp(box, axis=1)) * result.axis), str(result.placement), fontweight="bold",
        ha="center", va="center", zorder=6,
    )  # fmt: skip


def across(axis: Array) -> Array:
    """Machine +z made perpendicular to the gauge; for a gauge on end, machine +x."""
    up = np.array([0.0, 0.0, 1.0]) if abs(axis[2]) < 0.95 else np.array([1.0, 0.0, 0.0])
    direction = up - axis * (up @ axis)
    return np.asarray(direction / np.linalg.norm(direction))


def _label(axes: Any, box: Array) -> None:
    for letter, (low, high) in zip("xyz", box, strict=True):
        getattr(axes, f"set_{letter}lim")(low, high)
        getattr(axes, f"set_{letter}label")(f"{letter} (mm)")
        ticks = max(2, round(8 * (high - low) / float(np.ptp(box, axis=1).max())))
        axes.locator_params(axis=letter, nbins=ticks)
    axes.set_box_aspect(np.ptp(box, axis=1), zoom=1.12)
    axes.view_init(elev=25, azim=-68)
    axes.xaxis.pane.fill = axes.yaxis.pane.fill = axes.zaxis.pane.fill = False


def _grouped(value: float) -> str:
    return f"magnified {value:,.0f}".replace(",", " ")


def _caption(magnification: float, largest_um: float) -> str:
    return (
        f"1 µm is drawn as {magnification * 1e-3:g} mm of the machine; largest |XM| {largest_um:.2f} µm.\n"
        "Errors are along the gauge and drawn across it."
    )


def _legend() -> list[Line2D]:
    return [
        Line2D([], [], color=COLORS["model"], linewidth=2.2, label="gauge, from its number on"),
        Line2D([], [], color=LONG, marker="^", label="reads long"),
        Line2D([], [], color=SHORT, marker="v", label="reads short"),
    ]
