"""Deviations of an axis before and after a diagnosis, in the user's units, against what they may depend on."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.axis.residuals import AxisData
from stepgauge.diagnosis.result import Diagnosis
from stepgauge.figures.style import COLORS, CYCLE, figure_style, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
MOST_PANELS = 3
MOST_POINTS = 4000
"""Points drawn of each kind; more would hide each other."""
PRINTED = {"um": "µm", "uin": "µin", "deg": "°", "arcsec": "″", "urad": "µrad"}


def axis_figure(found: Diagnosis, data: AxisData) -> Figure:
    """Above before, below after, with two-sigma lines of the scatter; one column per quantity."""
    recording = data.recording
    factor = 1.0 / data.scaling.deviation / recording.units.base_deviation
    way = recording.frame["way"].to_numpy(float)
    panels = _panels(found, data)
    unit = PRINTED.get(recording.units.deviation, recording.units.deviation)
    with figure_style():
        figure = new_figure(70.0 + 55.0 * (len(panels) - 1) if len(panels) > 1 else 110.0, 100.0)
        grid = figure.subplots(2, len(panels), sharey="row", squeeze=False)
        for axes, um, name in zip(grid, (found.before_um, found.after_um), ("before", "after"), strict=True):
            for one, (label, x) in zip(axes, panels, strict=True):
                _draw(one, x, um * way * factor, way, 2.0 * found.noise.sigma_um * factor)
                one.set_xlabel(label if name == "after" else "")
            axes[0].set_ylabel(f"deviation {name} ({unit})")
        if recording.both_ways:
            grid[0][0].legend(frameon=False, loc="best")
    return figure


def _panels(found: Diagnosis, data: AxisData) -> list[tuple[str, Array]]:
    """What the deviations are drawn against: targets, time or order, and the columns in which they were located."""
    recording = data.recording
    frame, unit = recording.frame, PRINTED.get(recording.units.position, recording.units.position)
    panels = []
    if recording.form == "axis":
        panels.append((f"target ({unit})", frame["target"].to_numpy(float)))
    if recording.form == "distances":
        panels.append((f"distance ({unit})", frame["reading"].to_numpy(float)))
    if "time_s" in frame:
        panels.append(("time (min)", frame["time_s"].to_numpy(float) / 60.0))
    else:
        panels.append(("order of reading", np.arange(1.0, len(frame) + 1.0)))
    named = [one.covariate for one in (*found.unexplained, *found.located)]
    panels += [(name, frame[name].to_numpy(float)) for name in dict.fromkeys(named) if name in recording.covariates]
    return panels[:MOST_PANELS]


def _draw(axes: Axes, x: Array, y: Array, way: Array, two_sigma: float) -> None:
    for sense, colour, marker, name in ((1, CYCLE[0], ">", "towards +"), (-1, CYCLE[1], "<", "towards -")):
        rows = np.flatnonzero(way == sense)
        rows = rows[np.linspace(0, len(rows) - 1, min(len(rows), MOST_POINTS)).astype(int)] if len(rows) else rows
        if len(rows):
            style: dict[str, Any] = {"linestyle": "none", "markersize": 2.6, "markeredgewidth": 0.0, "alpha": 0.6}
            axes.plot(x[rows], y[rows], marker=marker, color=colour, label=name, rasterized=True, **style)
    for level in (-two_sigma, two_sigma):
        axes.axhline(level, color="black", linewidth=0.7, linestyle=(0, (4, 3)))
    axes.axhline(0.0, color=COLORS["grey"], linewidth=0.7, zorder=1)
    axes.spines[["top", "right"]].set_visible(False)
