"""Errors of length measurement against length, with the permissible error as a trumpet (ISO 10360-2).

Every repeat is a mark; the marks of a position have one shape and colour. Those of several positions at one length
stand side by side, by points of print and not by millimetres of length. The dashed lines are the permissible error
minus the expanded uncertainty: within them conformity is proven. They end where the uncertainty is the larger one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.transforms import ScaledTranslation

from stepgauge.figures.legends import add_legend
from stepgauge.figures.style import COLORS, CYCLE, figure_style, new_figure
from stepgauge.files.arrays import Array
from stepgauge.standards.iso10360 import KINDS, LengthTest
from stepgauge.standards.iso10360_positions import TestLength
from stepgauge.standards.lengths import Kind

WIDTH_MM, HEIGHT_MM = 170.0, 90.0
MARKERS = ("o", "s", "^", "D", "v", "P", "X")
DODGE_PT = 1.6
"""Distance between the marks of neighbouring positions at one length, points of print: no length is changed by it."""


def length_test_figure(test: LengthTest) -> Figure:
    """Bidirectional and unidirectional errors side by side, on one scale; a panel is left out where there are none."""
    kinds = [kind for kind in KINDS if test.lengths(kind)]
    with figure_style():
        figure = new_figure(WIDTH_MM, HEIGHT_MM)
        panels = figure.subplots(1, len(kinds), sharey=True, squeeze=False)[0]
        for axes, kind in zip(panels, kinds, strict=True):
            _draw(axes, test, test.lengths(kind))
            axes.set_title(_title(test, kind), loc="left", fontweight="bold")
            axes.set_xlabel("nominal length (mm); positions side by side")
        panels[0].set_ylabel("error of indication (µm)")
        panels[0].set_ylim(*_extent_um([one for kind in kinds for one in test.lengths(kind)]))
        _legend(figure, test)
    return figure


def _extent_um(lengths: Sequence[TestLength]) -> tuple[float, float]:
    """All errors and limits: matplotlib overlooks marks that are moved aside when it sets the limits of an axis."""
    largest = max(max(float(np.abs(one.error_um).max()), one.mpe_um) for one in lengths)
    return -1.12 * largest, 1.12 * largest


def _title(test: LengthTest, kind: Kind) -> str:
    """The decision on the errors and, where there is a limit, on the range of the repeats."""
    symbol = test.series.symbol.replace("E_0", "E$_0$").replace("E_150", "E$_{150}$")
    head = f"{symbol}, bidirectional: " if kind == "bidirectional" else "unidirectional, for information"
    ranges = test.repeatability_outcome(kind)
    said = f"{head}{test.outcome(kind) or ''}" + (f"\nrange of the repeats: {ranges}" if ranges else "")
    return said if test.complete else f"{said}\n(test incomplete)"


def _draw(axes: Axes, test: LengthTest, lengths: Sequence[TestLength]) -> None:
    longest = max(one.nominal_mm for one in lengths)
    axes.axhline(0.0, color=COLORS["grey"], linewidth=0.7, zorder=1)
    _draw_limits(axes, test, lengths, 1.06 * longest)
    numbers = [position.number for position in test.positions]
    for one in lengths:
        slot = numbers.index(one.position)
        aside = ScaledTranslation(DODGE_PT * (slot - (len(numbers) - 1) / 2.0) / 72.0, 0.0, axes.figure.dpi_scale_trans)
        axes.plot(
            np.full(len(one.error_um), one.nominal_mm),
            one.error_um,
            linestyle="none",
            marker=MARKERS[slot],
            markersize=3.4,
            color=CYCLE[slot],
            markerfacecolor="none",
            markeredgewidth=0.8,
            transform=axes.transData + aside,
            zorder=3,
        )
    axes.set_xlim(-0.03 * longest, 1.06 * longest)
    axes.spines[["top", "right"]].set_visible(False)


def _draw_limits(axes: Axes, test: LengthTest, lengths: Sequence[TestLength], end_mm: float) -> None:
    """The permissible error over all lengths, and the conformance zone where lengths were tested (the smallest one)."""
    along = np.linspace(0.0, end_mm, 200)
    limit = test.specification.mpe.at_um(along)
    sizes, zone = conformance_zone(lengths)
    for sign in (1.0, -1.0):
        axes.plot(along, sign * limit, color=COLORS["model"], linewidth=1.3, zorder=2)
        axes.plot(sizes, sign * zone, color=COLORS["model"], linewidth=0.8, linestyle=(0, (5, 3)), zorder=2)


def conformance_zone(lengths: Sequence[TestLength]) -> tuple[Array, Array]:
    """Nominal lengths in mm and MPE - U in um, the smallest of a length; NaN where U is larger: there is no zone.

    Between two lengths it ends where MPE = U on the straight line between them.
    """
    sizes = np.array(sorted({one.nominal_mm for one in lengths}))
    zone = np.array([min(one.mpe_um - one.expanded_um for one in lengths if one.nominal_mm == at) for at in sizes])
    ends = np.flatnonzero(zone[:-1] * zone[1:] < 0.0)
    at_zero = sizes[ends] + np.diff(sizes)[ends] * zone[ends] / (zone[ends] - zone[ends + 1])
    sizes, zone = np.insert(sizes, ends + 1, at_zero), np.insert(zone, ends + 1, 0.0)
    return sizes, np.where(zone < 0.0, np.nan, zone)


def _legend(figure: Figure, test: LengthTest) -> None:
    black = COLORS["model"]
    entries = [
        Line2D([], [], color=black, linewidth=1.3, label=f"± MPE = {test.specification.mpe.to_text()}"),
        Line2D([], [], color=black, linewidth=0.8, linestyle=(0, (5, 3)), label="± (MPE − U)"),
    ]
    entries += [
        Line2D([], [], color=CYCLE[slot], marker=MARKERS[slot], markerfacecolor="none", linewidth=0, label=label)
        for slot, label in enumerate(_position_labels(test))
    ]
    add_legend(figure, {str(one.get_label()): one for one in entries})


def _position_labels(test: LengthTest) -> list[str]:
    return [f"position {position.number}" for position in test.positions]
