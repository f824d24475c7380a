"""Evaluations of one gauge laid over each other: every error of each, and the differences with their uncertainty."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from stepgauge.evaluation.evaluate import Evaluation
from stepgauge.evaluation.files import evaluation_to_dict
from stepgauge.figures.faces import NAMES, POSITION_LABEL, column, deviation_um
from stepgauge.figures.legends import add_legend, axes_entries
from stepgauge.figures.style import COLORS, CYCLE, figure_style, new_figure
from stepgauge.files.arrays import Array
from stepgauge.standards.difference import ERRORS, Difference, differences

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LOOKS = (COLORS["before"], COLORS["after"], *CYCLE[2:])
"""The first evaluation, the second, and further ones."""
MARKERS = "os^Dv"
LEAST_UM = 0.5
"""Least height of a panel, so that rounding errors do not fill it."""


def overlay_figure(
    placements: Sequence[Mapping[str, Any]], found: Sequence[Difference], names: Sequence[str]
) -> Figure:
    """Left: XF, XB, XM, XR of every evaluation with 2s bands. Right: their differences from the first, with U.

    Parameters
    ----------
    placements : the same placement in each ``evaluation.json``, the first one first
    found : differences of the later ones from the first
    names : of the evaluations
    """
    with figure_style():
        figure = new_figure(180.0, 190.0)
        grid = figure.subplots(4, 2, sharex=True)
        for (errors, changes), name in zip(grid, ERRORS, strict=True):
            for number, placement in enumerate(placements):
                _draw_error(errors, placement["faces"], name, number, names[number])
            for number, one in enumerate(found, 1):
                draw_difference(changes, one, name, number, f"{names[number]} − {names[0]}")
            errors.set_ylabel(f"{NAMES[name]} (µm)")
            changes.set_ylabel(f"difference {name.upper()} (µm)")
        for axes in grid.flat:
            _finish(axes)
        figure.align_ylabels(grid)
        for axes in grid[-1]:
            axes.set_xlabel(POSITION_LABEL.replace("nominal position along the gauge, ", "position "))
        _legends(figure, grid[0])
    return figure


def _legends(figure: Figure, first: Sequence[Axes]) -> None:
    """What is drawn left and right, and what the bands are, above the panels."""
    for axes, where, bands in zip(first, ("upper left", "upper right"), ("2s", "U"), strict=True):
        add_legend(figure, axes_entries(axes), where, f"bands: ± {bands}")


def draw_over(axes: Axes, before: Evaluation, after: Evaluation, placement: int | None = None) -> None:
    """XM of two evaluations and the difference with a band of its U, um, on axes of somebody else."""
    number = after.select_placement(placement).placement
    index = [one.placement for one in after.results].index(number)
    found = differences(evaluation_to_dict(before), evaluation_to_dict(after))[index]
    for i, (evaluation, label) in enumerate(((before, "before"), (after, "after"))):
        result = evaluation.results[index]
        _line(axes, result.nominal_mm, result.xm_um, i, f"XM {label}")
    draw_difference(axes, found, "xm", 2, "after − before, ± U")
    _finish(axes)
    axes.set(xlabel=POSITION_LABEL, ylabel="mean error XM (µm)")
    axes.set_title(f"Placement {number}", loc="left")
    axes.legend(frameon=False)


def _draw_error(axes: Axes, rows: Sequence[Mapping[str, Any]], name: str, number: int, label: str) -> None:
    x, y, color = column(rows, "nominal_mm"), column(rows, f"{name}_um"), LOOKS[number % len(LOOKS)]
    s = deviation_um(rows, name)
    axes.fill_between(x, y - 2 * s, y + 2 * s, color=color, alpha=0.16, linewidth=0)
    _line(axes, x, y, number, label)


def draw_difference(axes: Axes, one: Difference, name: str, number: int = 1, label: str = "difference") -> None:
    """The difference of an error along the gauge with a band of its expanded uncertainty, um, on given axes."""
    d, expanded = one.of(name), one.expanded_um[name]
    color = LOOKS[number % len(LOOKS)]
    axes.fill_between(one.nominal_mm, d - expanded, d + expanded, color=color, alpha=0.2, linewidth=0)
    _line(axes, one.nominal_mm, d, number, label)


def _line(axes: Axes, x: Array, y: Array, number: int, label: str) -> None:
    color, marker = LOOKS[number % len(LOOKS)], MARKERS[number % len(MARKERS)]
    axes.plot(x, y, color=color, marker=marker, markersize=2.2, linewidth=0.9, label=label)


def _finish(axes: Axes) -> None:
    axes.axhline(0.0, color=COLORS["grey"], linewidth=0.7, zorder=1)
    axes.spines[["top", "right"]].set_visible(False)
    low, high = axes.get_ylim()
    if high - low < LEAST_UM:
        axes.set_ylim((low + high - LEAST_UM) / 2.0, (low + high + LEAST_UM) / 2.0)
