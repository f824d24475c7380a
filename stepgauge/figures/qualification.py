"""Figures of a probe's qualification, compensation and bench: polar plots across and along the stylus."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.figures.legends import add_legend, axes_entries
from stepgauge.figures.style import COLORS, figure_style, new_figure, save_figure
from stepgauge.files.arrays import Array
from stepgauge.physics.directions import angles_rad, probe_frame

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from stepgauge.physics.bench import DirectionResult, Events
    from stepgauge.physics.sphere import SphereFit
    from stepgauge.probes.qualification import Qualification
    from stepgauge.probes.results import Qualified


# Points this near a section are drawn in it: less than half of the 9 deg between the points of a dense pattern.
_SECTION_RAD = np.radians(4.0)

_TITLE_MM = 6.0
# Lines of many directions carry about this many marks in a full turn.
_MARKS = 40


@dataclass(frozen=True)
class PolarSection:
    """Errors along one polar section: angles in rad, values in um.

    ``before_um`` and ``after_um`` (n,) are deviations of the pre-travel from what the compensation takes off;
    ``sigma_um`` is the standard deviation of one probing, drawn as the band of twice its size about ``after_um``.
    """

    title: str
    angle_rad: Array
    before_um: Array
    after_um: Array
    sigma_um: float = 0.0


def draw_sections(
    sections: Sequence[PolarSection], path: str | Path, columns: int = 2, simulated: bool = False
) -> None:
    """Polar plots of errors before and after compensation, each row on one radial scale (Wozniak Fig 5)."""
    rows = -(-len(sections) // columns)
    with _drawing(path, 82.0 * columns, 80.0 * rows + 8.0, simulated=simulated) as fig:
        for i, section in enumerate(sections):
            limits = _radial_limits(sections[i - i % columns :][:columns])
            _draw_section(fig.add_subplot(rows, columns, i + 1, projection="polar"), section, limits)
        add_legend(fig, axes_entries(fig.axes[0]), "lower center")


def draw_qualification(approach: Array, result: Qualification, path: str | Path) -> None:
    """Radial residuals of the probed sphere, with the mean R_eff and with the lobes taken off."""
    azimuth, elevation = angles_rad(-approach @ probe_frame(result.stylus_axis).T)
    series = [("mean effective radius", "o", "before", result.residuals_um)]
    if result.residuals_compensated_um is not None:
        series.append(("corrected for the lobes", "*", "after", result.residuals_compensated_um))
    with _drawing(path, 160.0, 75.0, title_mm=0.0, simulated=result.simulated) as fig:
        left, right = fig.subplots(1, 2, sharey=True)
        for axes, angle, name in ((left, azimuth, "azimuth"), (right, elevation, "elevation")):
            axes.axhline(0.0, color=COLORS["grey"], linewidth=0.6)
            for label, marker, color, values in series:
                axes.plot(np.degrees(angle), values, marker, color=COLORS[color], label=label)
            axes.set_xlabel(f"{name} about the stylus (°)")
        left.set_ylabel("radial residual (\N{MICRO SIGN}m)")
        add_legend(fig, axes_entries(left), "lower center")


def draw_residuals(axes: Axes, result: Qualified) -> None:
    """Radial residuals of the points by the direction that they were approached from, about the stylus, in one plot."""
    found = result.qualification
    azimuth_deg = np.degrees(np.arctan2(-result.approach[:, 1], -result.approach[:, 0])) % 360.0
    axes.axhline(0.0, color=COLORS["grey"], linewidth=0.6, zorder=1)
    axes.plot(azimuth_deg, found.residuals_um, "o", color=COLORS["before"], label="with the mean radius")
    if found.residuals_compensated_um:
        axes.plot(azimuth_deg, found.residuals_compensated_um, "s", color=COLORS["after"], label="lobes corrected")
    axes.set_xlabel("azimuth of the point (°)")
    axes.set_ylabel("radial residual (µm)")
    axes.set_xticks(range(0, 361, 60))
    axes.legend()


def draw_compensation(
    approach: Array, pretravel_um: Array, stylus_axis: Sequence[float], path: str | Path, simulated: bool = False
) -> None:
    """The pre-travel taken off each point, about the stylus and from equator to pole."""
    azimuth, elevation = angles_rad(-approach @ probe_frame(stylus_axis).T)
    with _drawing(path, 164.0, 80.0, simulated=simulated) as fig:
        about, up = fig.add_gridspec(1, 2)
        axes = fig.add_subplot(about, projection="polar")
        dots = axes.scatter(azimuth, pretravel_um, c=np.degrees(elevation), s=9, cmap="viridis", vmin=0.0, vmax=90.0)
        _polar_title(axes, "pre-travel (\N{MICRO SIGN}m) over the azimuth")
        axes.set_rlabel_position(112.5)
        fig.colorbar(dots, ax=axes, label="elevation (°)", shrink=0.7, pad=0.12)
        plain = fig.add_subplot(up)
        plain.plot(np.degrees(elevation), pretravel_um, "o", markersize=3, color=COLORS["after"])
        plain.set_xlabel("elevation above the equator (°)")
        plain.set_ylabel("correction for the pre-travel (\N{MICRO SIGN}m)")


def draw_sphere_errors(
    approach: Array,
    fits: Mapping[str, SphereFit],
    stylus_axis: Sequence[float],
    path: str | Path,
    simulated: bool = False,
) -> None:
    """Radial errors of a sphere across and along the stylus; the first fit is before, the second after compensation.

    A pattern without points in either section is drawn over the azimuth as a whole.
    """
    azimuth, elevation = angles_rad(-approach @ probe_frame(stylus_axis).T)
    before, after = (-fit.residuals_um for fit in fits.values())
    sections = _sphere_sections(azimuth, elevation, before, after)
    whole = [PolarSection("all points, error (\N{MICRO SIGN}m)", azimuth, before, after)]
    draw_sections(sections or whole, path, simulated=simulated)


def draw_bench(
    channels: Mapping[str, Array], events: Events, results: Sequence[DirectionResult], path: str | Path, simulated: bool
) -> None:
    """One push over time with its four readings (Ren Fig 4), and the pre-travel over the directions (Ren Fig 8)."""
    with _drawing(path, 170.0, 85.0, simulated=simulated) as fig:
        push, directions = fig.add_gridspec(1, 2, width_ratios=[3, 2])
        _draw_push(fig.add_subplot(push), channels, events)
        _draw_directions(fig.add_subplot(directions, projection="polar"), results)


@contextmanager
def _drawing(
    path: str | Path, width_mm: float, height_mm: float, title_mm: float = _TITLE_MM, simulated: bool = False
) -> Iterator[Any]:
    """A figure in the common style, saved when it is drawn."""
    with figure_style():
        fig = new_figure(width_mm, height_mm)
        # The layout overlooks the titles of polar axes: keep their height free.
        layout = fig.get_layout_engine()
        if layout is not None:
            layout.set(rect=(0.0, 0.0, 1.0, 1.0 - title_mm / height_mm))  # type: ignore[call-arg]
        yield fig
    save_figure(fig, path, simulated)


def _polar_title(axes: Any, text: str) -> None:
    """A title clear of the 90 deg label."""
    axes.set_title(text, pad=10.0)


def _radial_limits(sections: Sequence[PolarSection]) -> tuple[float, float]:
    """One scale for these: the centre lies as far below the smallest value as the values spread."""
    values = np.concatenate(
        [np.r_[s.before_um, s.after_um - 2 * s.sigma_um, s.after_um + 2 * s.sigma_um] for s in sections]
    )
    low, high = float(values.min()), float(values.max())
    spread = max(high - low, 0.1)
    return low - 0.5 * spread, high + 0.05 * spread


def _draw_section(axes: Any, section: PolarSection, limits: tuple[float, float]) -> None:
    order = np.argsort(section.angle_rad)
    # A section that goes all around is closed; one from pole to equator and back is not.
    if np.ptp(section.angle_rad) > 1.5 * np.pi:
        order = np.append(order, order[0])
    else:
        axes.set_thetalim(0.0, np.pi)
    around = np.linspace(0.0, 2.0 * np.pi, 181)
    axes.plot(around, np.zeros_like(around), color=COLORS["grey"], linewidth=0.8, label="no error")
    _draw_errors(axes, section, order)
    axes.set_ylim(*limits)
    axes.yaxis.set_major_locator(_few_ticks(limits))
    axes.set_rlabel_position(112.5)
    _polar_title(axes, section.title)


def _draw_errors(axes: Any, section: PolarSection, order: NDArray[np.intp]) -> None:
    angle = section.angle_rad[order]
    every = max(1, round(2.0 * np.pi * len(angle) / (_MARKS * max(float(np.ptp(angle)), 0.1))))
    for name, marker, values in (("before", "o", section.before_um), ("after", "*", section.after_um)):
        style = {"marker": marker, "markersize": 3.0, "markevery": every, "color": COLORS[name]}
        axes.plot(angle, values[order], label=f"{name} compensation", **style)
    if section.sigma_um > 0.0:
        for side in (-2.0, 2.0):
            values = section.after_um[order] + side * section.sigma_um
            axes.plot(angle, values, ":", color=COLORS["after"], linewidth=0.7)


def _few_ticks(limits: tuple[float, float]) -> Any:
    """Four or five radial ticks at round numbers, none of them at the centre, where labels meet."""
    from matplotlib.ticker import FixedLocator, MaxNLocator

    ticks = MaxNLocator(5).tick_values(*limits)
    inner = limits[0] + 0.2 * (limits[1] - limits[0])
    return FixedLocator([tick for tick in ticks if inner <= tick <= limits[1]])


def _sphere_sections(azimuth: Array, elevation: Array, before: Array, after: Array) -> list[PolarSection]:
    """The points of a sphere near the equator and near the meridian of azimuth 0, as far as there are enough."""
    level = np.abs(elevation) <= _SECTION_RAD
    meridian = (np.abs(np.sin(azimuth)) <= np.sin(_SECTION_RAD)) | (elevation >= np.pi / 2 - _SECTION_RAD)
    in_plane = np.where(np.cos(azimuth) >= 0.0, elevation, np.pi - elevation)
    candidates = (("across the stylus", level, azimuth), ("along the stylus", meridian, in_plane))
    return [
        PolarSection(f"{title}, error (\N{MICRO SIGN}m)", angle[chosen], before[chosen], after[chosen])
        for title, chosen, angle in candidates
        if np.count_nonzero(chosen) > 2
    ]


def _draw_push(axes: Any, channels: Mapping[str, Array], events: Events) -> None:
    time, rod, tip = channels["time_s"], 1e3 * channels["rod_mm"], 1e3 * channels["tip_mm"]
    axes.plot(time, rod, color=COLORS["before"], label="push rod")
    axes.plot(time, tip, color=COLORS["after"], label="probe tip")
    height = float(np.ptp(rod))
    for i, name in enumerate(("contact", "trigger")):
        level = rod.max() + (0.18 + 0.2 * i) * height
        axes.plot(time, level + 0.1 * height * channels[name], color=COLORS["grey"], linewidth=0.9)
        axes.annotate(name, (time[0], level + 0.12 * height), fontsize="small", color=COLORS["grey"])
    _mark_readings(axes, events)
    axes.margins(y=0.09)
    axes.set_xlabel("time (s)")
    axes.set_ylabel("displacement (\N{MICRO SIGN}m)")
    add_legend(axes, axes_entries(axes))


def _mark_readings(axes: Any, events: Events) -> None:
    """r0 to r3 on the line of the rod."""
    times = (events.t0_s, events.t1_s, events.t2_s, events.t3_s)
    readings = (events.r0_mm, events.r1_mm, events.r2_mm, events.r3_mm)
    for i, (at, reading) in enumerate(zip(times, readings, strict=True)):
        axes.plot(at, 1e3 * reading, "o", color=COLORS["model"], markersize=4)
        axes.annotate(f"$r_{i}$", (at, 1e3 * reading), textcoords="offset points", xytext=(6, -3))


def _draw_directions(axes: Any, results: Sequence[DirectionResult]) -> None:
    angle = np.radians([result.direction_deg for result in results])
    mean = np.array([result.pretravel_um for result in results])
    half_range = np.array([result.pretravel_range_um for result in results]) / 2.0
    closed = np.append(np.arange(len(results)), 0)
    axes.plot(angle[closed], mean[closed], marker="o", markersize=3, color=COLORS["after"])
    axes.errorbar(angle, mean, yerr=half_range, fmt="none", color=COLORS["after"], capsize=2)
    limits = (0.0, 1.15 * float((mean + half_range).max()))
    axes.set_ylim(*limits)
    axes.yaxis.set_major_locator(_few_ticks(limits))
    axes.set_rlabel_position(112.5)
    _polar_title(axes, "pre-travel and its range (\N{MICRO SIGN}m)")
