"""Deviations of an axis before and after a diagnosis, in the user's units, against what they may depend on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from stepgauge.diagnosis.axis.residuals import AxisData
from stepgauge.diagnosis.result import GaugeDiagnosis
from stepgauge.figures.legends import add_legend, axes_entries
from stepgauge.figures.style import COLORS, CYCLE, draw_before_and_after, figure_style, new_figure
from stepgauge.files.arrays import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from stepgauge.axis.recording import AxisRecording
    from stepgauge.diagnosis.axis.diagnosis import AxisDiagnosis

MOST_PANELS = 3
MOST_POINTS = 4000
"""Points drawn of each kind; more would hide each other."""
PRINTED = {"um": "µm", "uin": "µin", "deg": "°", "arcsec": "″", "urad": "µrad"}


@dataclass(frozen=True)
class DrawnAxis:
    """What the figure of an axis is drawn from.

    ``against``: what deviations may depend on ``(n,)``, by labels of axes; ``before`` and ``after (n,)`` in ``unit``;
    ``way (n,)``: directions of travel; ``two_sigma`` of the scatter.
    """

    against: Mapping[str, Array]
    before: Array
    after: Array
    way: Array
    two_sigma: float
    unit: str

    @classmethod
    def read(cls, said: Mapping[str, Any]) -> DrawnAxis:
        """From what :func:`stepgauge.files.arrays.read_arrays` gives."""
        return cls(**said)

    def figures(self) -> dict[str, Figure]:
        """Deviations before and after."""
        return {"residuals": axis_figure(self)}


def drawn_of(found: GaugeDiagnosis, data: AxisData) -> DrawnAxis:
    """What the figure of an axis is drawn from, in the user's units."""
    recording = data.recording
    factor = 1.0 / data.scaling.deviation / recording.units.base_deviation
    way = recording.frame["way"].to_numpy(float)
    before, after = (um * way * factor for um in (found.before_um, found.after_um))
    unit = _printed(recording.units.deviation)
    return DrawnAxis(dict(_panels(found, data)), before, after, way, 2.0 * found.noise.sigma_um * factor, unit)


def axis_figure(drawn: DrawnAxis) -> Figure:
    """Above before, below after, with two-sigma lines of the scatter; one column per quantity."""
    columns = len(drawn.against)
    with figure_style():
        figure = new_figure(70.0 + 55.0 * (columns - 1) if columns > 1 else 110.0, 100.0, solved=False)
        grid = figure.subplots(2, columns, sharey="row", squeeze=False)
        for axes, values, name in zip(grid, (drawn.before, drawn.after), ("before", "after"), strict=True):
            for one, (label, x) in zip(axes, drawn.against.items(), strict=True):
                _draw(one, x, values, drawn.way, drawn.two_sigma)
                one.set_xlabel(label if name == "after" else "")
            axes[0].set_ylabel(f"deviation {name} ({drawn.unit})")
        add_legend(figure, axes_entries(grid[0][0]))
    return figure


def draw_residuals(axes: Axes, told: AxisDiagnosis) -> None:
    """Deviations before and after against the targets, or the time, on axes of somebody else."""
    found, recording = told.found, told.data.recording
    (label, x), unit = _panels(found, told.data)[0], _printed(recording.units.deviation)
    factor = recording.frame["way"].to_numpy(float) / told.data.scaling.deviation / recording.units.base_deviation
    draw_before_and_after(axes, x, found.before_um * factor, found.after_um * factor, told.verdict)
    axes.set(xlabel=label, ylabel=f"deviation ({unit})")


def draw_recording(axes: Axes, recording: AxisRecording) -> None:
    """Deviations (of distances: readings) against the targets, or the time, on axes of somebody else."""
    frame, of_distances = recording.frame, recording.form == "distances"
    label, x = _places(recording)[-1 if of_distances else 0]
    y = frame["reading"].to_numpy(float) if of_distances else recording.deviation
    _draw(axes, x, y, frame["way"].to_numpy(float), None)
    what, unit = ("distance", recording.units.position) if of_distances else ("deviation", recording.units.deviation)
    axes.set(xlabel=label, ylabel=f"{what} ({_printed(unit)})")
    if recording.both_ways:
        axes.legend(frameon=False)


def _printed(unit: str) -> str:
    return PRINTED.get(unit, unit)


def _panels(found: GaugeDiagnosis, data: AxisData) -> list[tuple[str, Array]]:
    """What the deviations are drawn against: targets, time or order, and the columns in which they were located."""
    panels, frame = _places(data.recording), data.recording.frame
    named = [one.covariate for one in (*found.unexplained, *found.located)]
    wanted = [name for name in dict.fromkeys(named) if name in data.recording.covariates]
    return [*panels, *((name, frame[name].to_numpy(float)) for name in wanted)][:MOST_PANELS]


def _places(recording: AxisRecording) -> list[tuple[str, Array]]:
    """Targets or distances where there are any, then the time or else the order."""
    frame, unit, panels = recording.frame, _printed(recording.units.position), list[tuple[str, Array]]()
    if recording.form == "axis":
        panels.append((f"target ({unit})", frame["target"].to_numpy(float)))
    if recording.form == "distances":
        panels.append((f"distance ({unit})", frame["reading"].to_numpy(float)))
    if "time_s" in frame:
        panels.append(("time (min)", frame["time_s"].to_numpy(float) / 60.0))
    else:
        panels.append(("order of reading", np.arange(1.0, len(frame) + 1.0)))
    return panels


def _draw(axes: Axes, x: Array, y: Array, way: Array, two_sigma: float | None) -> None:
    for sense, colour, marker, name in ((1, CYCLE[0], ">", "towards +"), (-1, CYCLE[1], "<", "towards −")):
        rows = np.flatnonzero(way == sense)
        rows = rows[np.linspace(0, len(rows) - 1, min(len(rows), MOST_POINTS)).astype(int)] if len(rows) else rows
        if len(rows):
            style: dict[str, Any] = {"linestyle": "none", "markersize": 2.6, "markeredgewidth": 0.0, "alpha": 0.6}
            axes.plot(x[rows], y[rows], marker=marker, color=colour, label=name, rasterized=True, **style)
    for level in () if two_sigma is None else (-two_sigma, two_sigma):
        axes.axhline(level, color="black", linewidth=0.7, linestyle=(0, (4, 3)), label="± two sigma of the scatter")
    axes.axhline(0.0, color=COLORS["grey"], linewidth=0.7, zorder=1)
    axes.spines[["top", "right"]].set_visible(False)
