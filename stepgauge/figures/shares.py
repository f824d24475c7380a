"""What each effect did to a recording: shares along the gauge, stacked, forward and backward faces apart."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from stepgauge.figures.legends import add_legend, axes_entries
from stepgauge.figures.style import COLORS, CYCLE, figure_style, new_figure, save_figure
from stepgauge.files.arrays import Array
from stepgauge.machine.readout import TOTAL_SHARE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST = 6
"""Effects with a colour of their own; the smaller ones are added up as "others"."""


def draw_shares(path: str | Path, shares: pd.DataFrame, face: Array, position_mm: Array, title: str = "") -> None:
    """Draw the shares of :attr:`stepgauge.machine.virtual.Run.shares` by face, the mean over the cycles.

    Parameters
    ----------
    path : file to write, png, svg or pdf
    shares : one column per effect, um along the approach, and the total; one row per probing
    face : face of every row
    position_mm : certified position of every face of the gauge, entry ``k - 1`` for face ``k``
    """
    by_face = _largest(shares).groupby(np.asarray(face)).mean()
    faces = by_face.index.to_numpy()
    with figure_style():
        figure = new_figure(160.0, 110.0)
        panels = figure.subplots(2, 1, sharex=True, sharey=True)
        for axes, odd, name in zip(panels, (1, 0), ("forward (fronts)", "backward (backs)"), strict=True):
            rows = faces % 2 == odd
            _stack(axes, position_mm[faces[rows] - 1], by_face[rows])
            axes.set_title(name, loc="left")
            axes.set_ylabel("share along the\napproach (µm)")
        panels[1].set_xlabel("position along the gauge (mm)")
        add_legend(figure, axes_entries(panels[0]), "lower center")
        if title:
            figure.suptitle(title)
        save_figure(figure, path, simulated=True)


def _largest(shares: pd.DataFrame) -> pd.DataFrame:
    """The largest shares by rms under readable names, the rest in one column, then the total."""
    parts = shares.drop(columns=TOTAL_SHARE)
    order = (parts**2).mean().sort_values(ascending=False).index
    kept = parts[order[:MOST]].rename(columns=_readable)
    if len(order) > MOST:
        kept = kept.assign(others=parts[order[MOST:]].sum(axis=1))
    return kept.assign(total=shares[TOTAL_SHARE])


def _readable(name: str) -> str:
    return name.removeprefix("share_").removesuffix("_um").replace("_", " ")


def _stack(axes: Axes, position_mm: Array, shares: pd.DataFrame) -> None:
    """Positive shares upwards from zero, negative ones downwards, the total as points."""
    width = 0.7 * float(np.diff(position_mm).min()) if len(position_mm) > 1 else 1.0
    up, down = np.zeros(len(shares)), np.zeros(len(shares))
    colours = [*CYCLE[:MOST], COLORS["grey"]]
    for name, colour in zip(shares.columns.drop("total"), colours, strict=False):
        um = shares[name].to_numpy()
        base = np.where(um >= 0.0, up, down)
        axes.bar(position_mm, um, width, bottom=base, color=colour, label=name, linewidth=0)
        up, down = up + np.maximum(um, 0.0), down + np.minimum(um, 0.0)
    total = shares["total"].to_numpy()
    axes.plot(position_mm, total, "o", color="black", markerfacecolor="white", markersize=3.0, label="total")
    axes.axhline(0.0, color="black", linewidth=0.6)
