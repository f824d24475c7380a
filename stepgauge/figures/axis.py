"""Deviations of an axis before and after a diagnosis, in the user's units, against what they may depend on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from stepgauge.axis.recording import places_of
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
WAYS = {1: (CYCLE[0], ">", "towards +"), -1: (CYCLE[1], "<", "towards −")}
"""Colour, mark and name of each direction of travel."""
PRINTED = {"um": "µm", "uin": "µin", "deg": "°", "arcsec": "″", "urad": "µrad"}


@dataclass(frozen=True)
class DrawnAxis:
    """What the figures of an axis are drawn from.

    ``against``: what deviations may depend on ``(n,)``, by labels of axes; ``before`` and ``after (n,)`` in ``unit``;
    ``way (n,)``: directions of travel; ``two_sigma`` of the scatter; ``two_u (n,)``: of what the laws make together,
    empty where none are named; ``place (n,)``: which target, empty where there are none.
    """

    against: Mapping[str, Array]
    before: Array
    after: Array
    way: Array
    two_sigma: float
    unit: str
    two_u: Array = field(default_factory=lambda: np.zeros(0))
    place: Array = field(default_factory=lambda: np.zeros(0))

    @classmethod
    def read(cls, said: Mapping[str, Any]) -> DrawnAxis:
        """From what :func:`stepgauge.files.arrays.read_arrays` gives."""
        return cls(**said)

    def figures(self) -> dict[str, Figure]:
        """The laws over the targets, where there are both; deviations before and after."""
        laws = {"laws": laws_figure(self)} if len(self.two_u) and len(self.place) else {}
        return laws | {"residuals": axis_figure(self)}

    def means(self, values: Array) -> dict[int, tuple[Array, Array, Array]]:
        """Of each direction of travel the mean x and mean value at every place, and how many readings these are of."""
        x = next(iter(self.against.values()))
        found: dict[int, tuple[Array, Array, Array]] = {}
        for sense in (1, -1):
            rows = self.way == sense
            place = self.place if len(self.place) else np.arange(len(x))
            _, own = np.unique(place[rows], return_inverse=True)
            count = np.bincount(own).astype(float)
            if rows.any():
                found[sense] = np.bincount(own, x[rows]) / count, np.bincount(own, values[rows]) / count, count
        return found


def drawn_of(told: AxisDiagnosis) -> DrawnAxis:
    """What the figures of an axis are drawn from, in the user's units."""
    found, data, recording = told.found, told.data, told.data.recording
    factor = 1.0 / data.scaling.deviation / recording.units.base_deviation
    way = recording.frame["way"].to_numpy(float)
    before, after = (um * way * factor for um in (found.before_um, found.after_um))
    unit = _printed(recording.units.deviation)
    is_axis = recording.form == "axis"
    place = places_of(recording.frame["target"].to_numpy(float)).astype(float) if is_axis else np.zeros(0)
    against, two_u = dict(_panels(found, data)), 2.0 * told.u_laws_um * factor
    return DrawnAxis(against, before, after, way, 2.0 * found.noise.sigma_um * factor, unit, two_u, place)


def laws_figure(drawn: DrawnAxis) -> Figure:
    """Above the mean deviations by direction with the sum of the laws that are named, below what they leave."""
    label = next(iter(drawn.against))
    with figure_style():
        figure = new_figure(150.0, 110.0, solved=False)
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=[2.0, 1.0])
        _draw_means(above, drawn, drawn.before)
        _draw_laws(above, drawn)
        _draw_means(below, drawn, drawn.after)
        above.set_ylabel(f"deviation ({drawn.unit})")
        below.set(xlabel=label, ylabel=f"residual ({drawn.unit})")
        add_legend(figure, axes_entries(above))
    return figure


def _draw_means(axes: Axes, drawn: DrawnAxis, values: Array) -> None:
    """Mean readings at every target with two standard uncertainties, in each direction of travel."""
    for sense, (x, mean, count) in drawn.means(values).items():
        colour, marker, name = WAYS[sense]
        bars: dict[str, Any] = {"elinewidth": 0.8, "capsize": 1.5, "markersize": 3.6, "markeredgewidth": 0.0}
        axes.errorbar(x, mean, drawn.two_sigma / np.sqrt(count), fmt=marker, color=colour, label=name, **bars)
    axes.axhline(0.0, color=COLORS["grey"], linewidth=0.7, zorder=1)
    axes.spines[["top", "right"]].set_visible(False)


def _draw_laws(axes: Axes, drawn: DrawnAxis) -> None:
    """What the named laws make together at every target, with two standard uncertainties."""
    for sense, (x, mean, _) in drawn.means(drawn.before - drawn.after).items():
        order, (colour, _, _) = np.argsort(x), WAYS[sense]
        two_u = np.sqrt(drawn.means(drawn.two_u**2)[sense][1])
        low, high = (mean - two_u)[order], (mean + two_u)[order]
        axes.plot(x[order], mean[order], color=colour, linewidth=1.0, label="sum of the named causes")
        axes.fill_between(x[order], low, high, color=colour, alpha=0.25, linewidth=0.0, label="± two u of it")


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


def draw_laws(axes: Axes, told: AxisDiagnosis) -> None:
    """Mean deviations by direction with the sum of the named laws; without targets or laws, deviations before and
    after; on axes of somebody else."""
    drawn = told.drawn()
    label, x = next(iter(drawn.against.items()))
    if len(drawn.two_u) and len(drawn.place):
        _draw_means(axes, drawn, drawn.before)
        _draw_laws(axes, drawn)
        axes.set_title(f"verdict: {told.verdict}", loc="left")
        add_legend(axes, axes_entries(axes))
    else:
        draw_before_and_after(axes, x, drawn.before, drawn.after, told.verdict)
    axes.set(xlabel=label, ylabel=f"deviation ({drawn.unit})")


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
    for sense, (colour, marker, name) in WAYS.items():
        rows = np.flatnonzero(way == sense)
        rows = rows[np.linspace(0, len(rows) - 1, min(len(rows), MOST_POINTS)).astype(int)] if len(rows) else rows
        if len(rows):
            style: dict[str, Any] = {"linestyle": "none", "markersize": 2.6, "markeredgewidth": 0.0, "alpha": 0.6}
            axes.plot(x[rows], y[rows], marker=marker, color=colour, label=name, rasterized=True, **style)
    for level in () if two_sigma is None else (-two_sigma, two_sigma):
        axes.axhline(level, color="black", linewidth=0.7, linestyle=(0, (4, 3)), label="± two sigma of the scatter")
    axes.axhline(0.0, color=COLORS["grey"], linewidth=0.7, zorder=1)
    axes.spines[["top", "right"]].set_visible(False)
