"""Errors against position with 2s bands, and the reversal below (the figure of Pahk & Kim's Fig 6).

Drawn from one placement of ``evaluation.json``, so that the verb that evaluates and the report show the same figure.
Measured points are solid, points interpolated from the neighbouring faces hollow; where nothing is defined the lines
have a gap. Readings that were left out are crosses, at the mean of their face plus their distance from its repeats; one
that is beyond the panel is a cross at its edge, with the distance.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from stepgauge.evaluation.evaluate import Evaluation
from stepgauge.evaluation.files import face_rows, mean_error_extent
from stepgauge.figures.faces import POSITION_LABEL, column
from stepgauge.figures.legends import add_legend
from stepgauge.figures.style import COLORS, CYCLE, draw_dimension, figure_style, new_figure
from stepgauge.files.arrays import Array
from stepgauge.files.notation import counted
from stepgauge.standards.mpe import Mpe

WIDTH_MM, HEIGHT_MM = 170.0, 106.0
LARGEST_MARKER_PT, SMALLEST_MARKER_PT = 4.6, 2.2


class DirectionStyle(NamedTuple):
    """Style of one direction of probing: its column in the table is ``x<key>_um``, its deviation ``s<key>_um``."""

    key: str
    label: str
    color: str
    marker: str
    odd: bool


FORWARD = DirectionStyle("f", "forward XF", CYCLE[0], ">", True)
BACKWARD = DirectionStyle("b", "backward XB", CYCLE[1], "<", False)
LIMIT_COLOR = CYCLE[3]
LEFT_OUT = "left out"
_DOTTED: dict[str, Any] = {"linestyle": (0, (1, 1.2)), "zorder": 2}
MEAN_COLOR, REVERSAL_COLOR, GREY = COLORS["model"], COLORS["measured"], COLORS["grey"]


def evaluation_figure(placement: Mapping[str, Any], mpe: Mpe | None = None) -> Figure:
    """The figure of one entry of ``placements`` in an ``evaluation.json`` (see :mod:`stepgauge.evaluation.files`)."""
    rows = placement["faces"]
    with figure_style():
        figure = new_figure(WIDTH_MM, HEIGHT_MM)
        errors, reversal = figure.subplots(2, 1, sharex=True, height_ratios=[3.2, 1.0])
        _draw_errors(errors, rows)
        _mark_band(errors, rows)
        if mpe is not None:
            draw_mpe(errors, column(rows, "nominal_mm"), _reference_mm(rows), mpe)
        _mark_worst(errors, rows, placement["worst_two_sigma_um"])
        _mark_left_out(errors, rows, placement.get("left_out", ()))
        _draw_reversal(reversal, rows)
        _label(errors, reversal, placement)
        _add_legend(figure, rows)
    return figure


def draw_placement(
    axes: Axes, evaluation: Evaluation, placement: int | None = None, before: Evaluation | None = None
) -> None:
    """The errors of a placement (the first) on axes of somebody else, with a legend; ``before``: over earlier ones."""
    if before is not None:
        from stepgauge.figures.overlay import draw_over

        draw_over(axes, before, evaluation, placement)
        return
    result = evaluation.select_placement(placement)
    rows = face_rows(result)
    _draw_errors(axes, rows)
    axes.set(xlabel=POSITION_LABEL, ylabel="error (µm)")
    axes.set_title(f"Placement {result.placement}, 2s bands", loc="left")
    shown = [line for line in axes.get_lines() if "measured" in str(line.get_label()) or line.get_label() == "mean XM"]
    axes.legend(handles=shown, frameon=False)


def draw_mpe(axes: Axes, nominal_mm: Array, reference_mm: float, mpe: Mpe) -> None:
    """Lines at plus and minus the limit of the length from the reference face."""
    x = np.linspace(nominal_mm[0], nominal_mm[-1], 201)
    for sign in (1, -1):
        label = f"± MPE = {mpe.to_text()}" if sign > 0 else "_mpe"
        axes.plot(x, sign * mpe.at_um(x - reference_mm), color=LIMIT_COLOR, linewidth=1.1, label=label, **_DOTTED)


def _reference_mm(rows: Sequence[Mapping[str, Any]]) -> float:
    """Nominal position of the first front that was measured: errors of length are counted from there."""
    return next(float(row["nominal_mm"]) for row in rows if row["face"] % 2 and row["count"])


def describe(placement: Mapping[str, Any]) -> str:
    """Content of the figure in a sentence: its caption and alternative text."""
    rows, worst = placement["faces"], placement["worst_two_sigma_um"]
    said = [f"range of the mean error {_um(placement['band_um'])} over {mean_error_extent(rows)[1]:.1f} mm"]
    if worst is None:
        said.append("2s undefined (no face was probed twice)")
    else:
        said.append(f"largest 2s {_um(worst)} at face {rows[_worst_row(rows)]['face']}")
    if out := placement.get("left_out"):
        said.append(f"{counted(len(out), 'reading')} left out")
    return "; ".join(said)


def _um(value: float | None) -> str:
    return "undefined" if value is None else f"{value:.2f} µm"


def _draw_errors(axes: Axes, rows: Sequence[Mapping[str, Any]]) -> None:
    nominal = column(rows, "nominal_mm")
    axes.axhline(0.0, color=GREY, linewidth=0.7, zorder=1)
    for direction in (FORWARD, BACKWARD):
        error, sigma = column(rows, f"x{direction.key}_um"), column(rows, f"s{direction.key}_um")
        if np.isfinite(sigma).any():
            band = axes.fill_between(
                nominal, error - 2 * sigma, error + 2 * sigma, color=direction.color, alpha=0.18, linewidth=0, zorder=2
            )
            band.set_gid(f"two-sigma {direction.label}")
        _draw_points(axes, rows, error, direction)
    mean = column(rows, "xm_um")
    axes.plot(nominal, mean, color=MEAN_COLOR, linewidth=1.3, marker=".", markersize=2.5, zorder=5, label="mean XM")


def _draw_points(axes: Axes, rows: Sequence[Mapping[str, Any]], error: Array, direction: DirectionStyle) -> None:
    """The line through all points, solid markers where the face was probed this way, hollow ones between."""
    nominal, measured = column(rows, "nominal_mm"), (column(rows, "face") % 2 == 1) == direction.odd
    axes.plot(nominal, error, color=direction.color, linewidth=0.8, zorder=3)
    for part, where, fill in (("measured", measured, direction.color), ("interpolated", ~measured, "white")):
        axes.plot(
            nominal[where],
            error[where],
            linestyle="none",
            marker=direction.marker,
            markersize=_marker_pt(len(rows)),
            color=direction.color,
            markerfacecolor=fill,
            markeredgewidth=0.6,
            zorder=4,
            label=f"{direction.label} {part}",
        )


def _marker_pt(count: int) -> float:
    """Size of markers, so that those of neighbouring faces do not overlap on a long gauge."""
    return float(np.clip(180.0 / count, SMALLEST_MARKER_PT, LARGEST_MARKER_PT))


def _mark_band(axes: Axes, rows: Sequence[Mapping[str, Any]]) -> None:
    """Dashed lines at the largest and the smallest mean error, with a bracket at the end of the gauge."""
    nominal, mean = column(rows, "nominal_mm"), column(rows, "xm_um")
    if not np.isfinite(mean).any():
        return
    low, high = float(np.nanmin(mean)), float(np.nanmax(mean))
    axes.hlines([low, high], nominal[0], nominal[-1], color=MEAN_COLOR, linewidth=0.6, linestyle=(0, (5, 3)), zorder=2)
    beyond = nominal[-1] + 0.02 * np.ptp(nominal)
    draw_dimension(axes, float(beyond), low, high, f"range {high - low:.2f} µm", MEAN_COLOR)


def _mark_worst(axes: Axes, rows: Sequence[Mapping[str, Any]], worst_um: float | None) -> None:
    """A bar of plus and minus two sigma at the measured face where it is largest."""
    if worst_um is None:
        return
    row = rows[_worst_row(rows)]
    direction = FORWARD if row["face"] % 2 else BACKWARD
    error = row[f"x{direction.key}_um"]
    if error is None:
        return
    bar = axes.errorbar(
        row["nominal_mm"], error, worst_um, color=direction.color, capsize=3.0, elinewidth=1.4, capthick=1.4, zorder=6
    )
    bar.set_label("largest 2s")
    axes.set_title(f"largest 2s: ±{worst_um:.2f} µm (face {row['face']})", loc="right")


def _mark_left_out(axes: Axes, rows: Sequence[Mapping[str, Any]], left_out: Sequence[Mapping[str, Any]]) -> None:
    """Crosses for the readings that are not used; the panel grows for those within its own height beyond it."""
    if not left_out:
        return
    x, error = _left_out_places(rows, left_out)
    low, high = axes.get_ylim()
    height, room = high - low, 0.08 * (high - low)
    near = error[(error > low - height) & (error < high + height)]
    bottom = min([low, *(near - room)]) - 2.0 * room * bool((error < low - height).any())
    top = max([high, *(near + room)]) + 2.0 * room * bool((error > high + height).any())
    drawn = np.clip(error, bottom + room, top - room)
    axes.set_ylim(bottom, top)
    look: dict[str, Any] = {"marker": "x", "color": COLORS["accent"], "markersize": 5.0, "markeredgewidth": 1.5}
    axes.plot(x, drawn, linestyle="none", zorder=7, label=LEFT_OUT, **look)
    beyond = drawn != error
    for at, shown, one in zip(x[beyond], drawn[beyond], column(left_out, "off_um")[beyond], strict=True):
        axes.annotate(f"{one:+.4g} µm", (at, shown), (5, 0), textcoords="offset points", va="center")


def _left_out_places(rows: Sequence[Mapping[str, Any]], left_out: Sequence[Mapping[str, Any]]) -> tuple[Array, Array]:
    """Nominal position (mm) and error (um) of every reading that is not used."""
    of_face = {row["face"]: row for row in rows}
    faces = [of_face[one["face"]] for one in left_out]
    mean = [row["xf_um" if row["face"] % 2 else "xb_um"] or 0.0 for row in faces]
    return column(faces, "nominal_mm"), np.array(mean) + column(left_out, "off_um")


def _worst_row(rows: Sequence[Mapping[str, Any]]) -> int:
    """Row of the measured face with the largest standard deviation."""
    measured = np.where(column(rows, "face") % 2 == 1, column(rows, "sf_um"), column(rows, "sb_um"))
    return int(np.nanargmax(measured))


def _draw_reversal(axes: Axes, rows: Sequence[Mapping[str, Any]]) -> None:
    axes.axhline(0.0, color=GREY, linewidth=0.7, zorder=1)
    axes.plot(
        column(rows, "nominal_mm"),
        column(rows, "xr_um"),
        color=REVERSAL_COLOR,
        linewidth=1.0,
        marker="D",
        markersize=0.6 * _marker_pt(len(rows)),
        label="reversal XR",
    )


def _label(errors: Axes, reversal: Axes, placement: Mapping[str, Any]) -> None:
    rows, (fewest, most) = placement["faces"], placement["cycles"]
    nominal = column(rows, "nominal_mm")
    errors.set_xlim(nominal[0] - 0.02 * np.ptp(nominal), nominal[-1] + 0.06 * np.ptp(nominal))
    for axes in (errors, reversal):
        axes.spines[["top", "right"]].set_visible(False)
    errors.set_ylabel("error (µm)")
    reversal.set_ylabel("reversal XR (µm)")
    reversal.set_xlabel(POSITION_LABEL)
    _no_smaller_than(reversal, 1.0)
    cycles = counted(most, "cycle") if fewest == most else f"{fewest} to {most} cycles"
    errors.set_title(
        f"Placement {placement['placement']}, blocks {rows[0]['block']} to {rows[-1]['block']}, {cycles}",
        loc="left",
        fontweight="bold",
    )


def _no_smaller_than(axes: Axes, height_um: float) -> None:
    """Least range of an axis, so that rounding errors do not fill the panel."""
    low, high = axes.get_ylim()
    if high - low < height_um:
        axes.set_ylim((low + high - height_um) / 2.0, (low + high + height_um) / 2.0)


def _entries(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """What every figure of errors shows, by label."""
    entries: dict[str, Any] = {
        d.label: Line2D([], [], color=d.color, marker=d.marker, markersize=4.5, linewidth=0.8)
        for d in (FORWARD, BACKWARD)
    }
    entries["mean XM"] = Line2D([], [], color=MEAN_COLOR, linewidth=1.3, marker=".", markersize=2.5)
    entries["interpolated"] = tuple(
        Line2D([], [], color=d.color, marker=d.marker, markerfacecolor="white", markersize=4.5, linewidth=0)
        for d in (FORWARD, BACKWARD)
    )
    if any(row["sf_um"] is not None or row["sb_um"] is not None for row in rows):
        entries["± 2s"] = tuple(Patch(color=d.color, alpha=0.3, linewidth=0) for d in (FORWARD, BACKWARD))
    return entries


def _add_legend(figure: Figure, rows: Sequence[Mapping[str, Any]]) -> None:
    errors = figure.axes[0]
    entries = _entries(rows)
    more: list[Any] = [line for line in errors.get_lines() if "MPE" in str(line.get_label())]
    more += [line for line in errors.get_lines() if line.get_label() == LEFT_OUT]
    more += [bar for bar in errors.containers if bar.get_label() and not str(bar.get_label()).startswith("_")]
    entries |= {str(one.get_label()): one for one in more}
    add_legend(figure, entries)
