"""Radial deviations of a probing test: over the hemisphere of each stylus, and beside each other with their range."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stepgauge.figures.legends import add_legend, axes_entries
from stepgauge.figures.style import COLORS, CYCLE, figure_style, new_figure
from stepgauge.files.arrays import Array
from stepgauge.physics.directions import angles_rad, probe_frame
from stepgauge.standards.iso10360_5 import ProbingTest, StylusPoints

WIDTH_MM, HEIGHT_MM = 170.0, 85.0
MARKERS = ("o", "s", "^", "D", "v", "P", "X")


def probing_figure(test: ProbingTest) -> Figure:
    """At the left the first stylus from above, coloured by deviation; at the right all deviations by point."""
    parts = np.split(test.fit.residuals_um, np.cumsum([len(one.surface_mm) for one in test.styli])[:-1])
    with figure_style():
        figure = new_figure(WIDTH_MM, HEIGHT_MM)
        left, right = figure.subplots(1, 2, width_ratios=[1.0, 1.35])
        _draw_polar(figure, left, test, parts)
        _draw_points(right, parts, test.fit.form_error_um)
        head = "five styli" if test.multiple else "one stylus"
        form, size = test.values[:2]
        right.set_title(
            f"{head}: P$_{{Form}}$ = {form.value_um:.2f} µm, P$_{{Size}}$ = {_signed(size.value_um)} µm",
            loc="left",
            fontweight="bold",
        )
    return figure


def _signed(value: float) -> str:
    return f"{value:.2f}".replace("-", "−")


def _draw_polar(figure: Figure, axes: Axes, test: ProbingTest, parts: list[Array]) -> None:
    """Seen along each stylus: the pole in the middle, the equator at the rim (angle from the pole as the radius)."""
    reach = float(np.abs(test.fit.residuals_um).max()) or 1.0
    for number, (one, off) in enumerate(zip(test.styli, parts, strict=True)):
        x, y = _places(one)
        dots = axes.scatter(
            x, y, c=off, marker=MARKERS[number % len(MARKERS)], s=26, cmap="coolwarm", vmin=-reach, vmax=reach,
            edgecolors=COLORS["grey"], linewidths=0.5, zorder=3,
        )  # fmt: skip
    turn = np.linspace(0.0, 2.0 * np.pi, 181)
    for angle in (45.0, 90.0):
        axes.plot(angle * np.cos(turn), angle * np.sin(turn), color=COLORS["grey"], linewidth=0.6, zorder=1)
        axes.annotate(f"{angle:.0f}°", (0.0, -angle), ha="center", va="bottom", fontsize=6.5, color=COLORS["grey"])
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_title("angle from the stylus axis", loc="left")
    figure.colorbar(dots, ax=axes, label="radial deviation (µm)", location="bottom", shrink=0.8, pad=0.02)


def _places(one: StylusPoints) -> tuple[Array, Array]:
    normals = (one.surface_mm - one.fit.centre_mm) @ probe_frame(tuple(one.from_sphere)).T
    azimuth, elevation = angles_rad(normals)
    from_pole = 90.0 - np.degrees(elevation)
    return from_pole * np.cos(azimuth), from_pole * np.sin(azimuth)


def _draw_points(axes: Axes, parts: list[Array], form_um: float) -> None:
    for number, off in enumerate(parts):
        label = f"stylus {number + 1}"
        place = np.arange(1, len(off) + 1)
        axes.plot(place, off, linestyle="none", marker=MARKERS[number % len(MARKERS)], color=CYCLE[number], label=label)
    every = np.concatenate(parts)
    for limit in (every.min(), every.max()):
        axes.axhline(limit, color=COLORS["model"], linewidth=0.8, linestyle=(0, (5, 3)))
    axes.axhline(0.0, color=COLORS["grey"], linewidth=0.7, zorder=1)
    axes.set_xlabel("point")
    axes.set_ylabel("radial deviation (µm)")
    axes.margins(y=0.12)
    axes.spines[["top", "right"]].set_visible(False)
    if len(parts) > 1:
        add_legend(axes, axes_entries(axes))
