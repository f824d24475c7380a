"""The error table of an axis: both senses of travel with their uncertainty, and the reversal below."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from stepgauge.compensation.table import CompensationTable
from stepgauge.figures.style import COLORS, CYCLE, figure_style, new_figure, save_figure

WIDTH_MM, HEIGHT_MM = 170.0, 100.0


def draw_compensation(path: str | Path, table: CompensationTable) -> None:
    """Draw a table into a file (png, svg or pdf)."""
    save_figure(compensation_figure(table), path)


def compensation_figure(table: CompensationTable) -> Figure:
    """Error by coordinate in positive and negative travel with two standard uncertainties; their difference below."""
    with figure_style():
        figure = new_figure(WIDTH_MM, HEIGHT_MM)
        errors, reversal = figure.subplots(2, 1, sharex=True, height_ratios=[3.0, 1.0])
        x = table.position_mm
        errors.axhline(0.0, color=COLORS["grey"], linewidth=0.7)
        one = table.travel != "both"
        for sense, label, color, marker in (
            ("positive", "mean of both senses" if table.travel == "mean" else "positive travel", CYCLE[0], ">"),
            ("negative", "negative travel", CYCLE[1], "<"),
        ):
            if one and sense != ("negative" if table.travel == "negative" else "positive"):
                continue
            value, u = getattr(table, f"{sense}_um"), getattr(table, f"u_{sense}_um")
            measured = np.ones(len(x), bool) if table.travel == "mean" else getattr(table, f"from_{sense}")
            errors.fill_between(x, value - 2 * u, value + 2 * u, color=color, alpha=0.18, linewidth=0)
            errors.plot(x, value, color=color, linewidth=0.9)
            for where, fill in ((measured, color), (~measured, "white")):
                errors.plot(
                    x[where], value[where], marker=marker, color=color, markerfacecolor=fill, linestyle="none", label="_"
                )
            errors.plot([], [], color=color, marker=marker, label=label)
        errors.plot([], [], color=COLORS["grey"], marker="o", markerfacecolor="white", linestyle="none", label="inferred")
        errors.fill_between([], [], [], color=COLORS["grey"], alpha=0.3, linewidth=0, label="± 2 u")
        reversal.axhline(0.0, color=COLORS["grey"], linewidth=0.7)
        reversal.plot(x, table.reversal_um, color=COLORS["measured"], marker="D", markersize=2.5, linewidth=1.0)
        errors.axvline(table.zero_at_mm, color=COLORS["grey"], linewidth=0.7, linestyle=(0, (2, 2)))
        errors.annotate(
            "zero", (table.zero_at_mm, 1.0), xycoords=("data", "axes fraction"), xytext=(2, -8), textcoords="offset points",
            fontsize=7, color=COLORS["grey"],
        )  # fmt: skip
        errors.set_ylabel("indicated − true (µm)")
        reversal.set_ylabel("reversal (µm)")
        reversal.set_xlabel(f"machine coordinate {table.axis} (mm)")
        low, high = reversal.get_ylim()
        if high - low < 1.0:
            reversal.set_ylim((low + high - 1.0) / 2.0, (low + high + 1.0) / 2.0)
        errors.set_title(f"Error table of axis {table.axis}: {len(table)} rows", loc="left", fontweight="bold")
        for axes in (errors, reversal):
            axes.spines[["top", "right"]].set_visible(False)
        figure.legend(loc="outside upper center", ncols=4, frameon=False)
    return figure
