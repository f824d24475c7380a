"""A gauge as certified and as it lies, on axes of somebody else."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stepgauge.figures.style import COLORS, CYCLE
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw_axis(axes: Axes, placement: Placement) -> None:
    """Plan view: the axis of the gauge from block centre to block centre, in machine coordinates."""
    centres = np.array([placement.c1_mm, placement.c2_mm])
    axes.plot(centres[:, 0], centres[:, 1], marker="s", color=CYCLE[0])
    for block, centre in zip((placement.first_block, placement.last_block), centres, strict=True):
        axes.annotate(f"block {block}", centre[:2], (5, 5), textcoords="offset points")
    axes.set(xlabel="machine x (mm)", ylabel="machine y (mm)", aspect="equal", adjustable="datalim")
    axes.set_title("axis of the gauge, from above", loc="left")


def draw_certificate(axes: Axes, gauge: Gauge) -> None:
    """Certified minus nominal position with two standard uncertainties, um, by the nominal position."""
    off_um = (gauge.position_mm - gauge.nominal_mm) * 1e3
    side = np.arange(gauge.n_faces) % 2
    for number, (name, marker) in enumerate((("front faces", ">"), ("back faces", "<"))):
        rows = side == number
        nominal, u_um = gauge.nominal_mm[rows], 2.0 * gauge.u_um[rows]
        axes.errorbar(nominal, off_um[rows], u_um, fmt=marker, color=CYCLE[number], label=name, elinewidth=0.8)
    axes.axhline(0.0, color=COLORS["grey"], linewidth=0.7)
    axes.set(xlabel="nominal position, from face 1 (mm)", ylabel="certified minus nominal, ± 2u (µm)")
    axes.set_title(gauge.table.name, loc="left")
    axes.legend(frameon=False)
