"""Displacements and temperatures over time, one below the other (the figure of ISO 230-3)."""

from __future__ import annotations

from collections.abc import Mapping

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stepgauge.figures.legends import add_legend, axes_entries
from stepgauge.figures.style import COLORS, CYCLE, figure_style, new_figure
from stepgauge.files.arrays import Array
from stepgauge.standards.drift import FIRST_S, DriftTest

WIDTH_MM, PANEL_MM = 170.0, 62.0
MARKERS = ("o", "s", "^", "D", "v", "P", "X")
MOST_MARKS = 40
LONG_S = 3.0 * 3600.0
"""From here on the axis of time counts hours."""


def drift_figure(test: DriftTest) -> Figure:
    """Displacements from the first reading on above, temperatures below where there are any."""
    drift = test.drift
    since_s = drift.time_s - drift.time_s[0]
    unit, in_s = ("h", 3600.0) if since_s[-1] > LONG_S else ("min", 60.0)
    time = since_s / in_s
    panels = 2 if drift.temperature_C else 1
    with figure_style():
        figure = new_figure(WIDTH_MM, PANEL_MM * (0.4 + panels))
        grid = figure.subplots(panels, 1, sharex=True, squeeze=False, height_ratios=[1.5, 1.0][:panels])[:, 0]
        _draw(grid[0], time, {name: um - um[0] for name, um in drift.displacement_um.items()})
        grid[0].axhline(0.0, color=COLORS["grey"], linewidth=0.7, zorder=1)
        if test.kind == "axis" and test.duration_s > FIRST_S:
            grid[0].axvline(FIRST_S / in_s, color=COLORS["model"], linewidth=0.8, linestyle=(0, (5, 3)))
            grid[0].annotate(
                "60 min", (FIRST_S / in_s, 1.0), xycoords=("data", "axes fraction"), xytext=(2, -8),
                textcoords="offset points", fontsize=6.5,
            )  # fmt: skip
        grid[0].set_ylabel("displacement (µm)")
        if drift.temperature_C:
            _draw(grid[1], time, drift.temperature_C)
            grid[1].set_ylabel("temperature (°C)")
        grid[-1].set_xlabel(f"time ({unit})")
    return figure


def _draw(axes: Axes, time: Array, channels: Mapping[str, Array]) -> None:
    step = max(1, len(time) // MOST_MARKS)
    for number, (name, values) in enumerate(channels.items()):
        look = {"color": CYCLE[number % len(CYCLE)], "marker": MARKERS[number % len(MARKERS)], "markevery": step}
        axes.plot(time, values, linewidth=1.0, label=name.replace("_", " "), **look)  # type: ignore[arg-type]
    axes.spines[["top", "right"]].set_visible(False)
    add_legend(axes, axes_entries(axes))
