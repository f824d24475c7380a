"""The error table of an axis: both directions of travel with their uncertainty, and the reversal below."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from stepgauge.compensation.result import Compensation
from stepgauge.compensation.table import CompensationTable
from stepgauge.figures.legends import add_legend, axes_entries
from stepgauge.figures.style import COLORS, CYCLE, figure_style, new_figure, save_figure

WIDTH_MM, HEIGHT_MM, ALONE_MM = 170.0, 100.0, 75.0
GREY = COLORS["grey"]


class Curve(NamedTuple):
    """One line of the upper panel; ``measured`` marks the rows that this direction of travel was measured around."""

    label: str
    color: str
    marker: str
    value_um: NDArray[np.float64]
    u_um: NDArray[np.float64]
    measured: NDArray[np.bool_]


def draw_compensation(path: str | Path, table: CompensationTable, simulated: bool = False) -> None:
    """Draw a table into a file (png, svg or pdf); ``simulated``: it is from the recording of no machine."""
    save_figure(compensation_figure(table), path, simulated)


def compensation_figure(table: CompensationTable) -> Figure:
    """Error by coordinate and direction of travel with two standard uncertainties; below, positive minus negative."""
    with figure_style():
        both = table.travel == "both"
        figure = new_figure(WIDTH_MM, HEIGHT_MM if both else ALONE_MM)
        errors = figure.subplots(
            2 if both else 1, 1, sharex=True, squeeze=False, height_ratios=[3, 1] if both else [1]
        )[0, 0]
        _draw_errors(errors, table)
        if both:
            _draw_reversal(figure.axes[1], table)
        _label(figure.axes, table)
        _add_legend(figure, _curves(table))
    return figure


def draw_table(axes: Axes, compensation: Compensation) -> None:
    """Draw the errors of a table by coordinate and direction of travel, with two standard uncertainties, on axes."""
    _draw_errors(axes, compensation.table)
    _label([axes], compensation.table)


def _draw_errors(axes: Axes, table: CompensationTable) -> None:
    axes.axhline(0.0, color=GREY, linewidth=0.7)
    for curve in _curves(table):
        _draw(axes, table.position_mm, curve)
    _mark_zero(axes, table.zero_at_mm)


def _marks(curves: Sequence[Curve]) -> tuple[tuple[Line2D, ...], tuple[Patch, ...]]:
    """The open marks and the bands of all curves, as they are drawn."""
    look: dict[str, Any] = {"markerfacecolor": "white", "linestyle": "none"}
    inferred = tuple(Line2D([], [], color=one.color, marker=one.marker, **look) for one in curves)
    return inferred, tuple(Patch(color=one.color, alpha=0.3, linewidth=0) for one in curves)


def _add_legend(figure: Figure, curves: Sequence[Curve]) -> None:
    inferred, bands = _marks(curves)
    add_legend(figure, {**axes_entries(figure.axes[0]), "inferred": inferred, "± 2 u": bands})


def _curves(table: CompensationTable) -> list[Curve]:
    positive = Curve("positive travel", CYCLE[0], ">", table.positive_um, table.u_positive_um, table.from_positive)
    negative = Curve("negative travel", CYCLE[1], "<", table.negative_um, table.u_negative_um, table.from_negative)
    mean = Curve(
        "mean of both directions",
        COLORS["model"],
        "o",
        table.mean_um,
        table.u_positive_um,
        table.from_positive & table.from_negative,
    )
    return {"both": [positive, negative], "mean": [mean], "positive": [positive], "negative": [negative]}[table.travel]


def _draw(axes: Axes, x: NDArray[np.float64], curve: Curve) -> None:
    low, high = curve.value_um - 2 * curve.u_um, curve.value_um + 2 * curve.u_um
    axes.fill_between(x, low, high, color=curve.color, alpha=0.18, linewidth=0)
    axes.plot(x, curve.value_um, color=curve.color, linewidth=0.9, marker=curve.marker, label=curve.label)
    inferred = ~curve.measured
    axes.plot(
        x[inferred],
        curve.value_um[inferred],
        linestyle="none",
        marker=curve.marker,
        color=curve.color,
        markerfacecolor="white",
        label="_inferred",
    )


def _mark_zero(axes: Axes, x: float) -> None:
    axes.axvline(x, color=GREY, linewidth=0.7, linestyle=(0, (2, 2)))
    axes.text(x, 0.98, " zero", transform=axes.get_xaxis_transform(), va="top", fontsize=7, color=GREY)


def _draw_reversal(axes: Axes, table: CompensationTable) -> None:
    axes.axhline(0.0, color=GREY, linewidth=0.7)
    axes.plot(table.position_mm, table.reversal_um, color=COLORS["measured"], marker="D", markersize=2.5)
    axes.set_ylabel("reversal (µm)")
    low, high = axes.get_ylim()
    if high - low < 1.0:
        axes.set_ylim((low + high - 1.0) / 2.0, (low + high + 1.0) / 2.0)


def _label(panels: Sequence[Axes], table: CompensationTable) -> None:
    errors = panels[0]
    errors.set_ylabel("indicated − true (µm)")
    panels[-1].set_xlabel(f"machine coordinate {table.axis} (mm)")
    errors.set_title(f"Error table of axis {table.axis}: {len(table)} rows", loc="left", fontweight="bold")
    for axes in panels:
        axes.spines[["top", "right"]].set_visible(False)
