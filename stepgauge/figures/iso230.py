"""Deviations of positioning against position in both directions, with A, E, M and B (the figure of ISO 230-2).

Solid lines are the means of a direction, the band is plus and minus two standard deviations, the thin black line is the
mean of both. Brackets at the right show what A, E and M are ranges of, the arrow inside where the largest reversal is.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.text import Text

from stepgauge.figures.legends import add_legend
from stepgauge.figures.style import COLORS, CYCLE, draw_dimension, figure_style, new_figure
from stepgauge.standards.iso230 import AxisParameters, Direction
from stepgauge.standards.positioning import AxisTest, Units

WIDTH_MM, HEIGHT_MM = 170.0, 100.0
MARGIN = 0.015
"""Share of the width right of the parameters, whose last letter is cut where another font is used."""
TITLE_GAP_PT = 10.0
"""Between the name of the axis and the parameters beside it, points of print."""


class _LineStyle(NamedTuple):
    label: str
    color: str
    marker: str


UP = _LineStyle("up ↑", CYCLE[0], "^")
DOWN = _LineStyle("down ↓", CYCLE[1], "v")
LINE_STYLES = {"up": UP, "down": DOWN}
REVERSAL = COLORS["accent"]


def positioning_figure(test: AxisTest) -> Figure:
    """The figure of one axis."""
    parameters, at = test.parameters, test.targets.machine_mm
    with figure_style():
        figure = new_figure(WIDTH_MM, HEIGHT_MM)
        axes = figure.subplots()
        axes.axhline(0.0, color=COLORS["grey"], linewidth=0.7, zorder=1)
        for way, direction in parameters.directions.items():
            _draw_direction(axes, at, direction, LINE_STYLES[way])
        if isinstance(parameters, AxisParameters):
            axes.plot(at, parameters.mean_um, color=COLORS["model"], linewidth=1.0, zorder=5)
            _mark_reversal(axes, parameters, at, test.units)
        _brackets(axes, test)
        _label(axes, test)
        _legend(figure, [LINE_STYLES[way] for way in parameters.directions])
        _part_titles(figure, axes)
    return figure


def _draw_direction(axes: Axes, at: np.ndarray, direction: Direction, look: _LineStyle) -> None:
    axes.fill_between(at, direction.low_um, direction.high_um, color=look.color, alpha=0.15, linewidth=0, zorder=2)
    for limit in (direction.low_um, direction.high_um):
        axes.plot(at, limit, color=look.color, linewidth=0.6, linestyle=(0, (4, 2)), zorder=3)
    size = float(np.clip(120.0 / len(at), 2.0, 4.5))
    axes.plot(at, direction.mean_um, color=look.color, linewidth=1.2, marker=look.marker, markersize=size, zorder=4)


def _mark_reversal(axes: Axes, parameters: AxisParameters, places: np.ndarray, units: Units) -> None:
    row = int(np.abs(parameters.B_at_um).argmax())
    at = places[row]
    ends = parameters.up.mean_um[row], parameters.down.mean_um[row]
    axes.plot([at, at], ends, color=REVERSAL, linewidth=2.2, zorder=6)
    axes.annotate(
        f"B = {units.printed(parameters.B_um)}",
        (at, min(ends)),
        xytext=(0, -7),
        textcoords="offset points",
        ha="left" if row < len(places) / 2.0 else "right",  # clear of the brackets
        va="top",
        color=REVERSAL,
        fontweight="bold",
        zorder=7,
        bbox={"facecolor": "white", "alpha": 0.8, "edgecolor": "none", "pad": 1.0},
    )


def _brackets(axes: Axes, test: AxisTest) -> None:
    """Ranges beside the last target: of the bands (A), of the means of the directions (E), of their mean (M)."""
    p, at = test.parameters, test.targets.machine_mm
    found = list(p.directions.values())
    means, lows, highs = (np.concatenate([getattr(d, f"{of}_um") for d in found]) for of in ("mean", "low", "high"))
    ranges = [("A", lows.min(), highs.max()), ("E", means.min(), means.max())]
    if isinstance(p, AxisParameters):
        ranges.append(("M", p.mean_um.min(), p.mean_um.max()))
    arrows = {"up": "↑", "down": "↓"}
    one_way = "" if len(found) > 1 else arrows[next(iter(p.directions))]
    span = float(np.ptp(at))
    for slot, (name, low, high) in enumerate(ranges):
        place = at.max() + (0.04 + 0.055 * slot) * span
        axes.hlines([low, high], at.max(), place, color=COLORS["grey"], linewidth=0.5, linestyle=":", zorder=1)
        text = f"{name}{one_way} = {test.units.printed(high - low)}"
        draw_dimension(axes, place, low, high, text, COLORS["model"])
    axes.set_xlim(at.min() - 0.02 * span, at.max() + 0.21 * span)


def _label(axes: Axes, test: AxisTest) -> None:
    p = test.parameters
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_xlabel(f"position on {test.nearest} ({test.units.position_symbol})")
    axes.set_ylabel(f"deviation: actual − target position ({test.units.deviation_symbol})")
    axes.set_title(f"{test.name}, {len(test.runs)} runs", loc="left", fontweight="bold")
    values = {"R↑" if way == "up" else "R↓": one.R_um for way, one in p.directions.items()}
    if isinstance(p, AxisParameters):
        values = {"R": p.R_um, **values, "mean B": p.mean_B_um}
    told = (f"{name} = {test.units.printed(value)}".replace("-", "−") for name, value in values.items())
    axes.set_title(", ".join(told), loc="right", x=1.0 - MARGIN)


def _part_titles(figure: Figure, axes: Axes) -> None:
    """A long name of the axis goes above the parameters, where the two have no room side by side."""
    figure.draw_without_rendering()
    left, right = axes.get_title(loc="left"), axes.get_title(loc="right")
    name, told = (
        next(t for t in axes.get_children() if isinstance(t, Text) and t.get_text() == s) for s in (left, right)
    )
    if name.get_window_extent().x1 + TITLE_GAP_PT > told.get_window_extent().x0:
        axes.set_title(f"{left}\n", loc="left", fontweight="bold")


def _legend(figure: Figure, looks: Sequence[_LineStyle]) -> None:
    entries = [
        Line2D([], [], color=look.color, marker=look.marker, linewidth=1.2, label=f"mean {look.label}")
        for look in looks
    ]
    if len(looks) > 1:
        entries.append(Line2D([], [], color=COLORS["model"], linewidth=1.0, label="mean of both"))
        entries.append(Line2D([], [], color=REVERSAL, linewidth=2.2, label="largest reversal B"))
    both = tuple(
        Patch(facecolor=to_rgba(look.color, 0.15), edgecolor=look.color, linewidth=0.6, linestyle=(0, (4, 2)))
        for look in looks
    )
    add_legend(figure, {**{str(one.get_label()): one for one in entries}, "± 2 s": both})
