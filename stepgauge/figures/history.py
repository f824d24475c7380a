"""The history of a machine: one run chart per quantity, with trend lines, limits and control charts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import dates as mdates
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from stepgauge.figures.legends import add_legend
from stepgauge.figures.style import COLORS, CYCLE, DATE_FORMATS, figure_style, new_figure, save_figure
from stepgauge.files.dates import YEAR_DAYS
from stepgauge.history.entries import QUANTITIES
from stepgauge.history.result import History
from stepgauge.history.series import Series

WIDTH_MM, PANEL_MM, HEAD_MM = 170.0, 38.0, 26.0
MARKERS = ("o", "s", "^", "D", "v", "P", "X")
LIMIT_COLOR, GREY = COLORS["model"], COLORS["grey"]
LABELS = {
    "scale_ppm": "scale error\n(µm/m)",
    "reversal_um": "mean reversal\nXR (µm)",
    "r_eff_change_um": "R$_{eff}$ − first\n(µm)",
    "band_um": "range of XM\n(µm)",
    "worst_two_sigma_um": "largest 2s\n(µm)",
}


def draw_history(path: str | Path, series: Sequence[Series], limits: Mapping[str, float], machine: str) -> None:
    """Draw all series into a file (png, svg or pdf); ``limits`` by quantity."""
    simulated = any(entry.simulated for one in series for entry in one.entries)
    save_figure(history_figure(series, limits, machine), path, simulated)


def draw_scale(axes: Axes, history: History) -> None:
    """Draw the scale errors by date on axes, a colour and a marker per direction of the gauge, with their limit."""
    _draw_quantity(axes, "scale_ppm", history.series, history.limits)
    _dates(axes)


def _draw_quantity(axes: Axes, name: str, series: Sequence[Series], limits: Mapping[str, float]) -> None:
    directions = sorted({one.direction for one in series})
    for one in series:
        if one.quantity == name:
            _draw(axes, one, directions.index(one.direction))
    _limits(axes, limits.get(name), QUANTITIES[name].signed)
    axes.set_ylabel(LABELS[name])
    axes.spines[["top", "right"]].set_visible(False)


def history_figure(series: Sequence[Series], limits: Mapping[str, float], machine: str) -> Figure:
    """One panel per quantity, a colour and a marker per direction of the gauge."""
    directions = sorted({one.direction for one in series})
    with figure_style():
        single = len({entry.measured_at for one in series for entry in one.entries}) == 1
        figure = new_figure(WIDTH_MM, HEAD_MM + PANEL_MM * len(QUANTITIES) * (0.5 if single else 1.0))
        panels = figure.subplots(len(QUANTITIES), 1, sharex=True)
        for axes, name in zip(panels, QUANTITIES, strict=True):
            _draw_quantity(axes, name, series, limits)
        if single:
            _single_date(panels, series)
        else:
            _dates(panels[-1])
        panels[0].set_title(_title(series, machine), loc="left", fontweight="bold")
        figure.align_ylabels(panels)
        add_legend(figure, _legend(series, directions, limits))
    return figure


def _single_date(panels: Sequence[Axes], series: Sequence[Series]) -> None:
    """A single date is not a history: values are written beside their points, and the axis states what is missing."""
    when = series[0].entries[0].measured_at
    at = float(mdates.date2num(when))
    for axes, name in zip(panels, QUANTITIES, strict=True):
        axes.set_xlim(at - 1.0, at + 3.0)
        axes.set_xticks([at], [when.date().isoformat()])
        axes.margins(y=0.5)
        told = [f"{one.direction}: {one.value[0]:.3g}" for one in series if one.quantity == name]
        axes.text(at + 0.3, 0.5, "\n".join(told), transform=axes.get_xaxis_transform(), va="center", fontsize=6.5)
    panels[-1].set_xlabel("date of measurement (a trend needs a second one)")


def _title(series: Sequence[Series], machine: str) -> str:
    gauges = sorted({entry.gauge_serial for one in series for entry in one.entries})
    return f"{machine}, gauge {', '.join(gauges)}"


def _draw(axes: Axes, one: Series, number: int) -> None:
    color, marker = CYCLE[number % len(CYCLE)], MARKERS[number % len(MARKERS)]
    when = mdates.date2num([entry.measured_at for entry in one.entries])
    axes.plot(when, one.value, color=color, linewidth=0.5, alpha=0.5, zorder=2)
    u = np.where(np.isfinite(one.u), 2.0 * one.u, 0.0)
    axes.errorbar(when, one.value, u, color=color, marker=marker, linestyle="none", elinewidth=0.8, zorder=4)
    beyond = one.beyond
    axes.plot(
        when[beyond],
        one.value[beyond],
        linestyle="none",
        marker="o",
        markersize=9.0,
        markerfacecolor="none",
        markeredgecolor=LIMIT_COLOR,
        label="_beyond",
        zorder=5,
    )
    _draw_trend(axes, one, when, color)
    if one.charted:
        axes.fill_between(when, one.low, one.high, color=color, alpha=0.08, linewidth=0, zorder=1)


def _draw_trend(axes: Axes, one: Series, when: np.ndarray, color: str) -> None:
    if one.trend is None:
        return
    x = np.linspace(when.min(), when.max(), 50)
    years = (x - mdates.date2num(one.trend.middle)) / YEAR_DAYS
    line = one.trend.value + one.trend.per_year * years
    axes.plot(x, line, color=color, linewidth=1.3, linestyle="-" if one.trend.significant else (0, (4, 2)), zorder=3)


def _limits(axes: Axes, limit: float | None, signed: bool) -> None:
    if limit is None:
        return
    for value in [limit, -limit] if signed else [limit]:
        axes.axhline(value, color=LIMIT_COLOR, linewidth=1.0, linestyle=(0, (1, 1.5)), zorder=2)


def _dates(axes: Axes) -> None:
    locator = mdates.AutoDateLocator(minticks=3, maxticks=9)
    axes.xaxis.set_major_locator(locator)
    axes.xaxis.set_major_formatter(mdates.ConciseDateFormatter(locator, formats=DATE_FORMATS, show_offset=False))
    axes.set_xlabel("date of measurement")


def _legend(series: Sequence[Series], directions: list[str], limits: Mapping[str, float]) -> dict[str, Any]:
    colors = [CYCLE[n % len(CYCLE)] for n in range(len(directions))]
    entries: dict[str, Any] = {
        f"along {name} (± 2 u)": Line2D([], [], color=color, marker=MARKERS[n % len(MARKERS)])
        for n, (name, color) in enumerate(zip(directions, colors, strict=True))
    }
    trends = [one.trend for one in series if one.trend is not None]
    if any(trend.significant for trend in trends):
        entries["trend that is no noise"] = tuple(Line2D([], [], color=color) for color in colors)
    if any(not trend.significant for trend in trends):
        entries["trend within noise"] = tuple(Line2D([], [], color=color, linestyle=(0, (4, 2))) for color in colors)
    if any(one.charted for one in series):
        entries["control limits"] = tuple(Patch(color=color, alpha=0.2, linewidth=0) for color in colors)
    if any(one.beyond.any() for one in series):
        ring: dict[str, Any] = {"markersize": 8.0, "markerfacecolor": "none", "markeredgecolor": LIMIT_COLOR}
        entries["outside the control limits"] = Line2D([], [], linestyle="none", marker="o", **ring)
    if limits:
        entries["limit"] = Line2D([], [], color=LIMIT_COLOR, linestyle=(0, (1, 1.5)))
    return entries
