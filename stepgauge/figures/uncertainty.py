"""Uncertainty of the mean errors: the 95 % interval along the gauge, and the contributions to its width."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from stepgauge.figures.legends import add_legend, axes_entries
from stepgauge.figures.style import COLORS, CYCLE, figure_style, new_figure, save_figure
from stepgauge.files.arrays import Array
from stepgauge.montecarlo.model import MonteCarloModel, PlacementReadings
from stepgauge.montecarlo.result import MonteCarloBudget
from stepgauge.montecarlo.summary import Summary
from stepgauge.recording.simulated import is_simulated
from stepgauge.standards.budget_sources import LABELS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST = 6
"""Inputs with a colour of their own; the smaller ones are added up in quadrature as "others"."""


def draw_uncertainty(folder: str | Path, model: MonteCarloModel, summary: Summary, suffix: str = "png") -> list[Path]:
    """One figure per placement, ``uncertainty-P.SUFFIX`` (png, svg or pdf) in a folder; returns their paths."""
    paths = []
    for part in model.parts:
        path = Path(folder) / f"uncertainty-{part.placement}.{suffix}"
        with figure_style():
            figure = new_figure(160.0, 145.0)
            upper, lower = figure.subplots(2, 1, sharex=True)
            _draw_interval(upper, model, summary, part)
            _draw_contributions(lower, model, summary, part)
            lower.set_xlabel("position along the gauge (mm)")
            title = f"{model.gauge.table.name}, {model.machine.table.name}, {summary.runs} runs"
            figure.suptitle(title, x=0.01, ha="left", fontsize=9, fontweight="bold")
            save_figure(figure, path, model.sign < 0 and is_simulated(model.nominal.comments))
        paths.append(path)
    return paths


def draw_distribution(axes: Axes, budget: MonteCarloBudget) -> None:
    """Draw the mean error XM of the first placement with its interval along the gauge on axes."""
    _draw_interval(axes, budget.model, budget.distributions, budget.model.parts[0])
    axes.set_xlabel("position along the gauge (mm)")


def _xm_values(summary: Summary, values: Array, part: PlacementReadings) -> Array:
    """The values of XM at every face of a placement."""
    first = summary.index("xm_um", int(part.readings.faces[0]), part.placement)
    return values[first : first + len(part.readings.faces)]


def _draw_interval(axes: Axes, model: MonteCarloModel, summary: Summary, part: PlacementReadings) -> None:
    position = model.gauge.position_mm[part.readings.faces - 1]
    low, high, mean = (_xm_values(summary, v, part) for v in (summary.low, summary.high, summary.mean))
    axes.fill_between(
        position, low, high, color=COLORS["light"], alpha=0.5, linewidth=0, label="95 % coverage interval"
    )
    axes.plot(position, mean, "o-", color=COLORS["after"], label="mean of the runs")
    axes.axhline(0.0, color="black", linewidth=0.6)
    axes.set_ylabel("mean error XM (µm)")
    add_legend(axes, axes_entries(axes))


def _draw_contributions(axes: Axes, model: MonteCarloModel, summary: Summary, part: PlacementReadings) -> None:
    """Stacked variances: their heights add up, standard uncertainties do not."""
    total = _xm_values(summary, summary.u, part) ** 2
    defined = ~np.isnan(total)
    position = model.gauge.position_mm[part.readings.faces - 1][defined]
    variance = {
        LABELS.get(name) or model.label(name): _xm_values(summary, u, part)[defined] ** 2
        for name, u in summary.contribution.items()
    }
    order = sorted(variance, key=lambda name: variance[name].sum(), reverse=True)
    shown = {name: variance[name] for name in order[:MOST]}
    if len(order) > MOST:
        shown["others"] = np.sum([variance[name] for name in order[MOST:]], axis=0)
    axes.stackplot(position, *shown.values(), labels=list(shown), colors=[*CYCLE[:MOST], COLORS["grey"]], linewidth=0)
    axes.plot(position, total[defined], color="black", label="all contributions")
    axes.set_ylabel("variance of XM (µm²)")
    add_legend(axes, axes_entries(axes))
