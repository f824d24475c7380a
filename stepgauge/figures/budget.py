"""Contributions to an uncertainty as bars, and the expanded uncertainty beside the Monte Carlo."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from stepgauge.figures.legends import add_legend, axes_entries
from stepgauge.figures.style import COLORS, CYCLE, figure_style, new_figure, save_figure
from stepgauge.files.notation import number, uncertainty
from stepgauge.standards.budget_files import StoredBudget, StoredLine, farthest, label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ALONG_MM = 58.0
"""Height of the lower panel."""
MOST = 8
"""Sources with a bar of their own; the smaller ones are added in quadrature as "others"."""


def draw_budget(folder: str | Path, budget: StoredBudget, suffix: str = "png") -> list[Path]:
    """One figure per placement, ``budget-P.SUFFIX`` (png, svg or pdf) in a folder; returns their paths."""
    paths = []
    for placement in sorted({line.placement for line in budget.quantities}):
        path = Path(folder) / f"budget-{placement}.{suffix}"
        save_figure(budget_figure(budget, placement), path, budget.simulated)
        paths.append(path)
    return paths


@figure_style()
def budget_figure(budget: StoredBudget, placement: int) -> Figure:
    """Contributions to R_eff and to XM at its farthest face; U of XM along the gauge with the Monte Carlo's."""
    bars_mm = 18.0 + 6.5 * (min(len(budget.sources), MOST + 1) + 2)
    figure = new_figure(160.0, bars_mm + ALONG_MM)
    upper, lower = figure.subplots(2, 1, height_ratios=(bars_mm, ALONG_MM))
    lines = (budget.find("r_eff", placement, None), farthest(budget, placement))
    _draw_bars(upper, budget, [line for line in lines if line is not None])
    draw_along(lower, budget, placement)
    return figure


def _draw_bars(axes: Axes, budget: StoredBudget, lines: Sequence[StoredLine]) -> None:
    names = sorted(lines[-1].contributions_um, key=lambda name: lines[-1].contributions_um[name], reverse=True)
    shown, rest = (names, []) if len(names) <= MOST + 1 else (names[:MOST], names[MOST:])
    rows = [*shown, *(["others"] if rest else []), "combined u", f"expanded U ({budget.coverage_percent:g} %)"]
    place = np.arange(len(rows))[::-1]
    height = 0.8 / len(lines)
    for i, line in enumerate(lines):
        values = [line.contributions_um.get(name, 0.0) for name in shown]
        if rest:
            values.append(float(np.hypot.reduce([line.contributions_um.get(name, 0.0) for name in rest])))
        values += [line.u_um, line.expanded_um]
        at = place + (0.5 * (len(lines) - 1) - i) * height
        name = label(line).replace("R_eff", "R$_{eff}$")
        bars = axes.barh(at, values, height=height * 0.92, color=CYCLE[i], label=f"{name}, k = {line.k:.2f}")
        said = [*(number(one, 3) for one in values[:-2]), *map(uncertainty, values[-2:])]
        axes.bar_label(bars, said, padding=2, fontsize=6.5)
    labels = {source.name: source.label for source in budget.sources}
    axes.set_yticks(place, [labels.get(name, name) for name in rows])
    axes.axhline(1.5, color="black", linewidth=0.5)
    axes.grid(visible=False, axis="y")
    axes.margins(x=0.12)
    axes.set_xlabel("contributions to the standard uncertainty; u and U below the line (µm)")
    add_legend(axes, axes_entries(axes))


def draw_along(axes: Axes, budget: StoredBudget, placement: int) -> None:
    """Standard and expanded uncertainty of XM along the gauge, with that of the Monte Carlo."""
    lines = [q for q in budget.quantities if q.quantity == "xm" and q.placement == placement]
    position = np.array([line.position_mm for line in lines], float)
    axes.plot(position, [line.expanded_um for line in lines], color=COLORS["after"], label="U, all sources")
    axes.plot(position, [line.u_um for line in lines], color=COLORS["model"], label="u, all sources")
    if all(line.monte_carlo for line in lines):
        axes.plot(
            position,
            [line.same_terms_u_um for line in lines],
            "--",
            color=COLORS["model"],
            linewidth=0.9,
            label="u, sources that the Monte Carlo has",
        )
        runs = [line.monte_carlo.u_um for line in lines if line.monte_carlo]
        axes.plot(
            position,
            runs,
            "o",
            color=COLORS["before"],
            markersize=3.0,
            label=f"u, Monte Carlo, {budget.monte_carlo_runs} runs",
        )
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("position along the gauge (mm)")
    axes.set_ylabel("uncertainty of XM (µm)")
    add_legend(axes, axes_entries(axes))
