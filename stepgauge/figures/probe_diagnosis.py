"""Figure of a map's diagnosis: what the probe file said and what it says now, against what was measured."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from stepgauge.diagnose.maps.result import MapDiagnosis, QuantityFit
from stepgauge.figures.style import COLORS, figure_style, new_figure, save_figure

_LABELS = {
    "trigger_force_N": "trigger force / N",
    "deflection_um": "deflection / \N{MICRO SIGN}m",
    "pretravel_um": "pre-travel / \N{MICRO SIGN}m",
}


@figure_style()
def draw_before_after(found: MapDiagnosis, path: str | Path) -> None:
    """Left: residuals over the azimuth; right: over the polar angle; one row of axes per quantity."""
    fig = new_figure(164.0, 58.0 * len(found.fits) + 8.0)
    axes = fig.subplots(len(found.fits), 2, squeeze=False, sharex="col", sharey="row")
    for row, fit in zip(axes, found.fits, strict=True):
        for panel, angle in zip(row, (found.data.azimuth_deg, found.data.polar_deg), strict=True):
            _draw_residuals(panel, fit, angle)
        row[0].set_ylabel(f"measured less simulated\n{_LABELS[fit.name]}")
    axes[-1][0].set_xlabel("azimuth of the normal / deg")
    axes[-1][1].set_xlabel("polar angle of the normal / deg")
    fig.legend(*axes[0][0].get_legend_handles_labels(), loc="outside upper center", ncols=3, frameon=False)
    save_figure(fig, path)


def _draw_residuals(axes: Any, fit: QuantityFit, angle: Any) -> None:
    band = 2.0 * fit.noise
    axes.axhspan(-band, band, color=COLORS["grey"], alpha=0.25, linewidth=0.0, label="2 sigma of the scatter")
    axes.plot(angle, fit.before, "s", color=COLORS["before"], markerfacecolor="none", label="before")
    axes.plot(angle, fit.after, "o", color=COLORS["after"], markersize=2.5, label="after")
    reach = 1.1 * float(np.max(np.abs([fit.before, fit.after]), initial=band))
    low = min(float(np.min([fit.before, fit.after])), -band)
    high = max(float(np.max([fit.before, fit.after])), band)
    axes.set_ylim(low - 0.08 * reach, high + 0.08 * reach)
