"""Deviations of positioning against position in both directions, with A, E, M and B (the figure of ISO 230-2).

Solid lines are the means of a direction, the band is plus and minus two standard deviations, the thin black line is the
mean of both. Brackets at the right show what A, E and M are ranges of, the arrow inside where the largest reversal is.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.legend_handler import HandlerTuple
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from stepgauge.figures.style import COLORS, CYCLE, figure_style, new_figure
from stepgauge.standards.iso230 import Direction
from stepgauge.standards.positioning import AxisTest

WIDTH_MM, HEIGHT_MM = 170.0, 100.0


class _Look(NamedTuple):
    label: str
    color: str
    marker: str


UP = _Look("up ↑", CYCLE[0], "^")
DOWN = _Look("down ↓", CYCLE[1], "v")
REVERSAL = COLORS["accent"]


def positioning_figure(test: AxisTest) -> Figure:
    """The figure of one axis."""
    parameters, at = test.parameters, test.targets.machine_mm
    with figure_style():
        figure = new_figure(WIDTH_MM, HEIGHT_MM)
        axes = figure.subplots()
        axes.axhline(0.0, color=COLORS["grey"], linewidth=0.7, zorder=1)
        for direction, look in ((parameters.up, UP), (parameters.down, DOWN)):
            _draw_direction(axes, at, direction, look)
        axes.plot(at, parameters.mean_um, color=COLORS["model"], linewidth=1.0, zorder=5)
        _mark_reversal(axes, test)
        _brackets(axes, test)
        _label(axes, test)
        _legend(figure)
    return figure


def _draw_direction(axes: Axes, at: np.ndarray, direction: Direction, look: _Look) -> None:
    axes.fill_between(at, direction.low_um, direction.high_um, color=look.color, alpha=0.15, linewidth=0, zorder=2)
    for limit in (direction.low_um, direction.high_um):
        axes.plot(at, limit, color=look.color, linewidth=0.6, linestyle=(0, (4, 2)), zorder=3)
    size = float(np.clip(120.0 / len(at), 2.0, 4.5))
    axes.plot(at, direction.mean_um, color=look.color, linewidth=1.2, marker=look.marker, markersize=size, zorder=4)


def _mark_reversal(axes: Axes, test: AxisTest) -> None:
    row = int(np.abs(test.parameters.B_at_um).argmax())
    at = test.targets.machine_mm[row]
    ends = test.parameters.up.mean_um[row], test.parameters.down.mean_um[row]
    axes.plot([at, at], ends, color=REVERSAL, linewidth=2.2, zorder=6)
    axes.annotate(
        f"B = {test.parameters.B_um:.2f} µm",
        (at, min(ends)),
        xytext=(0, -7),
        textcoords="offset points",
        ha="left" if row < len(test.targets.machine_mm) / 2.0 else "right",  # clear of the brackets
        va="top",
        color=REVERSAL,
        fontweight="bold",
        zorder=7,
        bbox={"facecolor": "white", "alpha": 0.8, "edgecolor": "none", "pad": 1.0},
    )


def _brackets(axes: Axes, test: AxisTest) -> None:
    """Ranges beside the last target: of the bands (A), of the means of the directions (E), of their mean (M)."""
    p, at = test.parameters, test.targets.machine_mm
    means = np.concatenate([p.up.mean_um, p.down.mean_um])
    lows, highs = np.concatenate([p.up.low_um, p.down.low_um]), np.concatenate([p.up.high_um, p.down.high_um])
    ranges = (("A", lows.min(), highs.max()), ("E", means.min(), means.max()), ("M", p.mean_um.min(), p.mean_um.max()))
    span = float(np.ptp(at))
    for slot, (name, low, high) in enumerate(ranges):
        place = at.max() + (0.04 + 0.055 * slot) * span
        axes.hlines([low, high], at.max(), place, color=COLORS["grey"], linewidth=0.5, linestyle=":", zorder=1)
        arrow = {"arrowstyle": "<->", "color": COLORS["model"], "linewidth": 0.8, "shrinkA": 0, "shrinkB": 0}
        axes.annotate("", (place, high), (place, low), arrowprops={**arrow, "mutation_scale": 7})
        axes.annotate(
            f"{name} = {high - low:.2f} µm",
            (place, (low + high) / 2.0),
            xytext=(3, 0),
            textcoords="offset points",
            rotation=90,
            va="center",
        )
    axes.set_xlim(at.min() - 0.02 * span, at.max() + 0.21 * span)


def _label(axes: Axes, test: AxisTest) -> None:
    p = test.parameters
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_xlabel(f"position on {test.nearest} (mm)")
    axes.set_ylabel("deviation: actual − target position (µm)")
    axes.set_title(f"{test.name}, {len(test.runs)} runs", loc="left", fontweight="bold")
    mean_B = f"{p.mean_B_um:.2f}".replace("-", "−")
    values = (("R", f"{p.R_um:.2f}"), ("R↑", f"{p.up.R_um:.2f}"), ("R↓", f"{p.down.R_um:.2f}"), ("mean B", mean_B))
    axes.set_title(", ".join(f"{name} = {value} µm" for name, value in values), loc="right")


def _legend(figure: Figure) -> None:
    entries = [
        Line2D([], [], color=look.color, marker=look.marker, linewidth=1.2, label=f"mean {look.label}")
        for look in (UP, DOWN)
    ]
    entries.append(Line2D([], [], color=COLORS["model"], linewidth=1.0, label="mean of both"))
    entries.append(Line2D([], [], color=REVERSAL, linewidth=2.2, label="largest reversal B"))
    both = tuple(
        Patch(facecolor=to_rgba(look.color, 0.15), edgecolor=look.color, linewidth=0.6, linestyle=(0, (4, 2)))
        for look in (UP, DOWN)
    )
    figure.legend(
        handles=[*entries, both],
        labels=[*(str(one.get_label()) for one in entries), "± 2 s"],
        handler_map={tuple: HandlerTuple(ndivide=None, pad=0.3)},
        loc="outside upper center",
        ncols=len(entries) + 1,
        columnspacing=1.2,
        frameon=False,
    )
