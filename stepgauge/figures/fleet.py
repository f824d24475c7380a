"""A fleet over the years, a panel for each quantity; and the causes of its errors, a panel for each unit."""

from __future__ import annotations

import datetime
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import dates as mdates
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from stepgauge.figures.style import COLORS, CYCLE, DATE_FORMATS, figure_style, new_figure, save_figure
from stepgauge.files.notation import printed_unit
from stepgauge.fleet.hierarchical.answer import owner_of, words_of
from stepgauge.fleet.hierarchical.watch import Watched

WIDTH_MM, PANEL_MM, HEAD_MM = 170.0, 42.0, 14.0
NAMED = 6
"""Lines in colour in a panel; more cannot be told apart."""
LABELS = {
    "scale": "scale error\n(µm/m)",
    "squareness": "squareness\n(µrad)",
    "reversal": "reversal\n(µm)",
    "certificate_scale": "gauge: length\n(µm/m)",
    "wear": "gauge: fronts\n(µm)",
}
OWNERS = {"machine": CYCLE[0], "gauge": CYCLE[1], "type": CYCLE[2], "hall": CYCLE[3], "probe": CYCLE[4]}
MOST_CAUSES, ROW_MM, AXIS_MM = 30, 4.6, 13.0
"""Causes that a page has room for, the height of one, and what the axis of a panel needs."""
DAY_0 = datetime.date(1970, 1, 1)


def draw_watch(path: str | Path, watched: Sequence[Watched], simulated: bool = False) -> None:
    """Draw all quantities into a file (png, svg or pdf); ``simulated``: a recording in it is of no machine."""
    save_figure(watch_figure(watched), path, simulated)


def watch_figure(watched: Sequence[Watched]) -> Figure:
    """One panel per kind of quantity; in grey, where they are many, those that do as before and as their peers."""
    kinds = [kind for kind in LABELS if any(_kind(one) == kind for one in watched)]
    with figure_style():
        figure = new_figure(WIDTH_MM, HEAD_MM + PANEL_MM * max(len(kinds), 1))
        panels = np.atleast_1d(figure.subplots(max(len(kinds), 1), 1, sharex=True))
        for axes, kind in zip(panels, kinds, strict=False):
            _draw(axes, [one for one in watched if _kind(one) == kind])
            axes.set_ylabel(LABELS[kind])
            axes.spines[["top", "right"]].set_visible(False)
        locator = mdates.AutoDateLocator()
        panels[-1].xaxis.set_major_locator(locator)
        panels[-1].xaxis.set_major_formatter(
            mdates.ConciseDateFormatter(locator, formats=DATE_FORMATS, show_offset=False)
        )
        panels[0].set_title("Machines and gauges of the fleet", loc="left", fontweight="bold")
        figure.align_ylabels(panels)
    return figure


def _kind(one: Watched) -> str:
    return one.quantity.split()[0]


def _notable(one: Watched) -> bool:
    return bool(one.changes) or one.leaves_peers or one.outcome == "does not conform"


def _draw(axes: Axes, some: Sequence[Watched]) -> None:
    first = sorted(some, key=lambda one: (not _notable(one), not one.changes, one.by_chance))
    named = first if len(some) <= NAMED else [one for one in first if _notable(one)][:NAMED]
    for number, one in enumerate(one for one in some if one not in named):
        label = "_more" if number else "as before, as the peers"
        axes.plot(_dates(one), one.level, color=COLORS["grey"], lw=0.8, alpha=0.6, zorder=1, label=label)
    for one, color in zip(named, CYCLE, strict=False):
        level, u = np.array(one.level), np.array(one.u)
        axes.plot(_dates(one), level, "o-", color=color, ms=2.5, lw=1.0, label=f"{one.owner} {_place(one)}", zorder=3)
        axes.fill_between(_dates(one), level - 2.0 * u, level + 2.0 * u, color=color, alpha=0.15, lw=0.0, zorder=2)
    for limit in {one.limit for one in some if one.limit is not None}:
        for sign in (-1.0, 1.0):
            axes.axhline(sign * limit, color=COLORS["model"], lw=0.8, ls="--")
    _show_uncertainty(axes, some)
    if some:
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize=6.5)


def _show_uncertainty(axes: Axes, some: Sequence[Watched]) -> None:
    """No panel shows less than what the levels are known to, 2 u: smaller steps are of no machine."""
    u = [value for one in some for value in one.u if np.isfinite(value)]
    low, high = axes.get_ylim()
    lacking = 4.0 * float(np.median(u)) - (high - low) if u else 0.0
    if lacking > 0.0:
        axes.set_ylim(low - lacking / 2.0, high + lacking / 2.0)


def _place(one: Watched) -> str:
    return one.quantity.partition(" ")[2]


def _dates(one: Watched) -> NDArray[np.float64]:
    return np.asarray(mdates.date2num([DAY_0 + datetime.timedelta(days=int(day)) for day in one.days]))


@figure_style()
def causes_figure(causes: Sequence[Mapping[str, Any]]) -> Figure:
    """Sizes of causes (JSON types, the likeliest first) with U (k = 2), owner by owner; a set's is hollow."""
    by_unit: dict[str, list[Mapping[str, Any]]] = {}
    for one in causes[:MOST_CAUSES]:
        by_unit.setdefault(one["unit"], []).append(one)
    heights = [AXIS_MM + ROW_MM * len(some) for some in by_unit.values()]
    figure = new_figure(WIDTH_MM, sum(heights))
    panels = figure.subplots(len(by_unit), 1, squeeze=False, height_ratios=heights)[:, 0]
    for axes, (unit, some) in zip(panels, by_unit.items(), strict=True):
        _draw_causes(axes, sorted(some, key=lambda one: (list(OWNERS).index(one["owner_kind"]), one["owner"])))
        axes.set_xlabel(f"size ({printed_unit(unit)})")
    return figure


def _draw_causes(axes: Axes, some: Sequence[Mapping[str, Any]]) -> None:
    for row, one in enumerate(some):
        color = OWNERS[one["owner_kind"]]
        face = "white" if one.get("instead") else color
        axes.errorbar(one["size"], row, xerr=2.0 * one["u"], fmt="o", color=color, mfc=face, ms=3.5, capsize=2, lw=1.0)
    axes.axvline(0.0, color=COLORS["model"], lw=0.6)
    axes.set_yticks(range(len(some)), [f"{owner_of(one)}: {words_of(one)}" for one in some])
    axes.set_ylim(len(some) - 0.4, -0.6)
    axes.spines[["top", "right"]].set_visible(False)
