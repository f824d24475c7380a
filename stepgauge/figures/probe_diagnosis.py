"""Figures of a probe map's diagnosis: residuals before and after, where on the map they lie, and every effect found."""

from __future__ import annotations

from dataclasses import dataclass
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.maps.model import ChangeTerm, changed_table, predict
from stepgauge.diagnosis.maps.result import MapDiagnosis, QuantityFit
from stepgauge.diagnosis.result import rms
from stepgauge.diagnosis.wording.findings import name_of
from stepgauge.figures.legends import add_legend, axes_entries
from stepgauge.figures.style import COLORS, draw_before_and_after, figure_style, new_figure
from stepgauge.files.arrays import Array
from stepgauge.physics.directions import unit_vectors

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Rows = NDArray[np.bool_]
RESIDUALS, DIRECTIONS, EFFECTS = "residuals", "directions", "effects"
MOST_PANELS = 6
MOST_CURVES = 6
LOBES_SEEN = 0.1
"""Mean square over the azimuth against that over the polar angle from which on lobes are drawn as such."""
FULL_TURN_DEG = 270.0
LEAST = 1e-9
"""Reach of a scale on which all is zero."""
FINE = 241
"""Points of a drawn law."""
TITLE = 44
"""Letters in a line of a title."""
SHARE_SEEN = 0.1
"""An effect is drawn in the quantities that it moves by this share of what it moves most, each over its scatter."""
AZIMUTH, POLAR = "azimuth of the normal (°)", "polar angle of the normal (°)"
WORDS = {"trigger_force_N": "trigger force", "deflection_um": "deflection", "pretravel_um": "pre-travel"}
UNITS = {"N": "N", "um": "\N{MICRO SIGN}m"}
_DIVERGING = "PuOr"
_SEQUENTIAL = "viridis"


@dataclass(frozen=True)
class Panel:
    """An effect or a form in one quantity: title, fit of the quantity, what it adds (n,), and the term of a law."""

    title: str
    fit: QuantityFit
    share: Array
    term: ChangeTerm | None = None


def figures_of(found: MapDiagnosis) -> dict[str, Figure]:
    """All figures of a diagnosis by name; effects where there are any."""
    drawn = {RESIDUALS: residual_figure(found), DIRECTIONS: direction_figure(found)}
    return drawn | ({EFFECTS: effect_figure(found)} if panels(found) else {})


@figure_style()
def residual_figure(found: MapDiagnosis) -> Figure:
    """Residuals over azimuth and polar angle: before, and after on a scale of their own where something was changed."""
    drawn = [(fit, *stage) for fit in found.fits for stage in _stages(fit, found)]
    fig = new_figure(180.0, 42.0 * len(drawn) + 14.0, solved=False)
    axes = fig.subplots(len(drawn), 2, squeeze=False, sharex="col", sharey="row")
    for row, (fit, stage, values) in zip(axes, drawn, strict=True):
        for panel, angle in zip(row, (found.data.azimuth_deg % 360.0, found.data.polar_deg), strict=True):
            _residuals(panel, angle, values, fit, found.kept, stage)
        row[0].set_ylabel(f"{WORDS[fit.name]}\nresidual {stage}".rstrip() + f" ({UNITS[fit.unit]})")
        row[1].set_title(f"rms {rms(values[found.kept]):.3g} {UNITS[fit.unit]}", loc="right")
    axes[-1][0].set_xlabel(AZIMUTH)
    axes[-1][1].set_xlabel(POLAR)
    _azimuth_ticks(axes[-1][0], found)
    fig.align_ylabels(axes[:, 0])
    add_legend(fig, axes_entries(*axes.flat))
    return fig


def draw_residuals(axes: Axes, found: MapDiagnosis) -> None:
    """Residuals of the first quantity before and after against the azimuth, on axes of somebody else."""
    fit = found.fits[0]
    draw_before_and_after(axes, found.data.azimuth_deg, fit.before, fit.after, found.verdict)
    axes.set(xlabel=AZIMUTH, ylabel=f"{WORDS[fit.name]}: residual ({UNITS[fit.unit]})")


@figure_style()
def direction_figure(found: MapDiagnosis) -> Figure:
    """Where on the map residuals lie, before and after, mean of the repeats by colour; each with its own scale."""
    drawn = [(fit, *stage) for fit in found.fits for stage in _stages(fit, found)]
    columns = min(len(drawn), 2)
    rows = -(-len(drawn) // columns)
    fig = new_figure(90.0 * columns, 58.0 * rows + 10.0)
    axes = fig.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    for panel, (fit, stage, values) in zip(axes.flat, drawn, strict=False):
        _directions(fig, panel, found, fit, values)
        panel.set_title(f"{WORDS[fit.name]}{', ' * bool(stage)}{stage}", loc="left")
    for panel in axes.flat[len(drawn) :]:
        panel.set_axis_off()
    for row in axes:
        row[0].set_ylabel(POLAR)
    for panel in axes[-1]:
        panel.set_xlabel(AZIMUTH)
    _azimuth_ticks(axes[-1][0], found)
    add_legend(fig, axes_entries(*axes.flat))
    return fig


@figure_style()
def effect_figure(found: MapDiagnosis) -> Figure:
    """Every effect and form with its law drawn through what all others leave, in the quantities that it moves."""
    drawn = panels(found)
    columns = min(len(drawn), 2)
    rows = -(-len(drawn) // columns)
    fig = new_figure(180.0 if columns > 1 else 110.0, 66.0 * rows + 4.0)
    grid = fig.subplots(rows, columns, squeeze=False)
    for axes, panel in zip(grid.flat, drawn, strict=False):
        _effect(axes, panel, found)
    for axes in grid.flat[len(drawn) :]:
        axes.set_axis_off()
    _explain(fig)
    return fig


def _explain(fig: Figure) -> None:
    from matplotlib.lines import Line2D

    dot = Line2D([], [], linestyle="none", marker="o", color=COLORS["grey"], markersize=3.0)
    line = Line2D([], [], color=COLORS["grey"], linewidth=1.1)
    add_legend(fig, {"measured, all else taken out": dot, "fitted law": line})


def panels(found: MapDiagnosis) -> list[Panel]:
    """What can be drawn of the effects and forms found, most important first."""
    by_name = {fit.name: fit for fit in found.fits}
    by_label = {term.candidate.label: term for term in found.terms}
    drawn = []
    for finding in found.findings:
        shares = found.shares(finding)
        strength = {name: rms(share) / by_name[name].noise for name, share in shares.items()}
        largest = max(strength.values(), default=0.0)
        drawn += [
            Panel(name_of(finding.label, "map"), by_name[name], shares[name], by_label[finding.label])
            for name, value in strength.items()
            if value > SHARE_SEEN * largest
        ]
    for form in found.forms:
        title = fill(f"no known law: {form.where.split(': ', 1)[1]}", TITLE)
        drawn += [Panel(title, by_name[name], share) for name, share in found.shares(form).items() if share.any()]
    return drawn[:MOST_PANELS]


def _law(panel: Panel, term: ChangeTerm, found: MapDiagnosis, polar_deg: Array, azimuth_deg: Array) -> Array:
    """What the effect adds in other directions than those measured, (n,)."""
    normals = unit_vectors(np.radians(azimuth_deg), np.pi / 2.0 - np.radians(polar_deg))
    without = tuple(one for one in found.terms if one.candidate != term.candidate)
    values = [
        predict(changed_table(found.probe, terms), "", normals, [panel.fit.name])[0] for terms in (found.terms, without)
    ]
    return values[0] - values[1]


def _stages(fit: QuantityFit, found: MapDiagnosis) -> list[tuple[str, Array]]:
    """Residuals before and after; where nothing was changed there is one of them, and no word is needed."""
    return [("before", fit.before), ("after", fit.described)] if found.terms or found.forms else [("", fit.before)]


def _residuals(axes: Axes, angle: Array, values: Array, fit: QuantityFit, kept: Rows, stage: str) -> None:
    band = 0.0 if np.isnan(fit.noise) else 2.0 * fit.noise
    if band > 0.0:
        axes.axhspan(-band, band, color=COLORS["grey"], alpha=0.22, linewidth=0.0, label="± two sigma of the scatter")
    axes.axhline(0.0, color=COLORS["grey"], linewidth=0.7)
    axes.plot(
        angle[kept],
        values[kept],
        "o",
        color=COLORS[stage or "before"],
        markersize=2.8,
        alpha=0.75,
        label=f"residual {stage}".strip(),
    )
    limit = 1.12 * max(float(np.abs(values[kept]).max(initial=0.0)), band, LEAST)
    margin = max(1.4 * band, 0.15 * limit)
    low = -limit if values[kept].min(initial=0.0) < -band else -margin
    high = limit if values[kept].max(initial=0.0) > band else margin
    axes.set_ylim(low, high)
    _outliers(axes, angle[~kept], np.clip(values[~kept], low, high))
    axes.spines[["top", "right"]].set_visible(False)


def _outliers(axes: Axes, x: Array, y: Array) -> None:
    """Rings, at the rim where the values lie beyond it."""
    if x.size:
        axes.plot(
            x, y, "o", color="black", markerfacecolor="none", markersize=6.0, label="outlier", clip_on=False, zorder=6
        )


def _directions(fig: Figure, axes: Axes, found: MapDiagnosis, fit: QuantityFit, values: Array) -> None:
    data, kept = found.data, found.kept
    group = data.direction
    count = np.maximum(np.bincount(group, kept), 1.0)
    first = np.unique(group, return_index=True)[1]
    mean = np.bincount(group, np.where(kept, values, 0.0)) / count
    seen = np.bincount(group, kept) > 0
    limit = max(float(np.abs(mean).max(initial=0.0)), np.nan_to_num(2.0 * fit.noise), LEAST)
    drawn = axes.scatter(
        (data.azimuth_deg[first] % 360.0)[seen],
        data.polar_deg[first][seen],
        _dot_size(found),
        mean[seen],
        cmap=_DIVERGING,
        vmin=-limit,
        vmax=limit,
        edgecolors="#606060",
        linewidths=0.3,
    )
    _outliers(axes, data.azimuth_deg[~kept] % 360.0, data.polar_deg[~kept])
    bar = fig.colorbar(drawn, ax=axes, pad=0.02, aspect=16)
    bar.set_label(f"measured minus simulated ({UNITS[fit.unit]})")
    axes.margins(0.07, 0.12)


def _dot_size(found: MapDiagnosis) -> float:
    """Dots that nearly touch in a regular map."""
    spokes, rings = int(found.data.spokes.max()) + 1, int(found.data.rings.max()) + 1
    return float(np.clip(min(170.0 / spokes, 110.0 / rings) ** 2 * 0.62, 6.0, 110.0))


def _effect(axes: Axes, panel: Panel, found: MapDiagnosis) -> None:
    """Against the angle on which the effect depends more, one curve for each value of the other.

    Lobes want to be seen as such: of a full turn the azimuth is taken even where the polar angle does more.
    """
    data, kept, fit = found.data, found.kept, panel.fit
    azimuth, polar = data.azimuth_deg % 360.0, data.polar_deg
    enough = LOBES_SEEN if np.ptp(azimuth) >= FULL_TURN_DEG else 1.0
    around = _spread(panel.share, data.rings) > enough * _spread(panel.share, data.spokes)
    x, other, index = (azimuth, polar, data.rings) if around else (polar, azimuth, data.spokes)
    rest = fit.described + panel.share
    for number, colour in _curves(index):
        own = (index == number) & kept
        order = np.argsort(x[own], kind="stable")
        label = f"{other[own][0]:g}°" if own.any() else ""
        axes.plot(x[own][order], rest[own][order], "o", color=colour, markersize=2.8, alpha=0.65, label=label)
        if panel.term is None:
            axes.plot(x[own][order], panel.share[own][order], "-", color=colour, linewidth=1.1)
        elif own.any():
            fine = np.linspace(*_reach(x[own], around), FINE)
            level = np.full(FINE, other[own][0])
            law = _law(panel, panel.term, found, *((level, fine) if around else (fine, level)))
            axes.plot(fine, law, "-", color=colour, linewidth=1.1)
    axes.axhline(0.0, color=COLORS["grey"], linewidth=0.7, zorder=0)
    axes.set_title(panel.title, loc="left")
    axes.set_xlabel(AZIMUTH if around else POLAR)
    axes.set_ylabel(f"share in the {WORDS[fit.name]} ({UNITS[fit.unit]})")
    if around:
        _azimuth_ticks(axes, found)
    axes.legend(title="polar angle" if around else "azimuth", ncols=1, frameon=False, loc="center left",
                bbox_to_anchor=(1.0, 0.5), handletextpad=0.2, borderaxespad=0.1)  # fmt: skip
    axes.spines[["top", "right"]].set_visible(False)


def _reach(angle: Array, around: bool) -> tuple[float, float]:
    """From where to where a law is drawn: over what was measured, and over all of a turn that was."""
    full = around and np.ptp(angle) >= FULL_TURN_DEG
    return (0.0, 360.0) if full else (float(angle.min()), float(angle.max()))


def _spread(share: Array, index: NDArray[np.intp]) -> float:
    """Mean square of what an effect changes by within groups of rows."""
    mean = np.bincount(index, share) / np.bincount(index)
    return float(np.mean((share - mean[index]) ** 2))


def _curves(index: NDArray[np.intp]) -> list[tuple[int, Any]]:
    """Some of the groups, evenly chosen, with their colours."""
    from matplotlib import colormaps

    count = int(index.max()) + 1
    some = np.unique(np.linspace(0, count - 1, min(count, MOST_CURVES)).astype(int))
    return [(int(n), colormaps[_SEQUENTIAL](s)) for n, s in zip(some, np.linspace(0.0, 0.88, len(some)), strict=True)]


def _azimuth_ticks(axes: Axes, found: MapDiagnosis) -> None:
    if np.ptp(found.data.azimuth_deg) > 180.0:
        axes.set_xticks(np.arange(0.0, 361.0, 60.0))
