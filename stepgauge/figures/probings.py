"""Every probing of a placement: bidirectional errors with single cycles, and repeatability by face.

Both are drawn from the table of :func:`stepgauge.evaluation.probings.probing_errors`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from stepgauge.figures.evaluation import BACKWARD, FORWARD, DirectionStyle, draw_mpe
from stepgauge.figures.legends import add_legend
from stepgauge.figures.style import COLORS, figure_style, new_figure
from stepgauge.files.notation import counted
from stepgauge.standards.mpe import Mpe

WIDTH_MM, HEIGHT_MM = 170.0, 100.0
GREY = COLORS["grey"]


def bidirectional_figure(table: pd.DataFrame, mpe: Mpe | None = None) -> Figure:
    """Errors of single probings (dots), their means by face and 2s bars, for both ways of probing."""
    with figure_style():
        figure = new_figure(WIDTH_MM, HEIGHT_MM)
        axes = figure.subplots()
        axes.axhline(0.0, color=GREY, linewidth=0.7)
        for direction in (FORWARD, BACKWARD):
            _draw_direction(axes, table[table["front"] == direction.odd], direction, _shift_mm(table))
        nominal = np.sort(table["nominal_mm"].unique())
        if mpe is not None:
            draw_mpe(axes, nominal, float(table[table["front"]]["nominal_mm"].min()), mpe)
        axes.set_xlabel("nominal position along the gauge, from face 1 (mm)")
        axes.set_ylabel("error, indicated − certified (µm)")
        axes.set_title(f"{_title(table)}, both ways of probing", loc="left", fontweight="bold")
        axes.spines[["top", "right"]].set_visible(False)
        add_legend(figure, _legend(axes))
    return figure


def _draw_direction(axes: Axes, part: pd.DataFrame, direction: DirectionStyle, shift_mm: float) -> None:
    if part.empty:
        return
    by_face = part.groupby("nominal_mm")["error_um"]
    mean, sigma = by_face.mean(), by_face.std().fillna(0.0)
    axes.plot(
        part["nominal_mm"] + shift_mm * part["cycle"], part["error_um"], linestyle="none", marker=".", markersize=3.0,
        color=direction.color, markeredgewidth=0, zorder=3, label="_single",
    )  # fmt: skip
    axes.errorbar(
        mean.index, mean, 2 * sigma, color=direction.color, marker=direction.marker, markersize=3.6, linewidth=0.9,
        elinewidth=0.8, capsize=1.6, capthick=0.8, zorder=4, label=direction.label,
    )  # fmt: skip


def _pair(**look: Any) -> tuple[Line2D, ...]:
    """The same mark in the colours of both ways of probing; ``marker`` True: the marker of the way."""
    return tuple(
        Line2D([], [], **{**look, "color": d.color, "marker": d.marker if look["marker"] is True else look["marker"]})
        for d in (FORWARD, BACKWARD)
    )


def _legend(axes: Axes) -> dict[str, Any]:
    entries: dict[str, Any] = {
        d.label: Line2D([], [], color=d.color, marker=d.marker, markersize=4.0) for d in (FORWARD, BACKWARD)
    }
    entries["± 2s"] = _pair(marker="|", markersize=8.0, linestyle="none")
    entries["single probings, beside"] = _pair(marker=".", linestyle="none")
    return entries | {str(one.get_label()): one for one in axes.get_lines() if "MPE" in str(one.get_label())}


def repeatability_figure(table: pd.DataFrame) -> Figure:
    """Deviations of single probings from the mean of their face; below, 2s and range of every face."""
    with figure_style():
        figure = new_figure(WIDTH_MM, HEIGHT_MM)
        single, spread = figure.subplots(2, 1, sharex=True, height_ratios=[1.6, 1.0])
        pooled = _pooled_sigma(table)
        single.axhline(0.0, color=GREY, linewidth=0.7)
        for sign in (1, -1):
            single.axhline(sign * 2 * pooled, color=GREY, linewidth=0.8, linestyle=(0, (4, 2)))
        shift = _shift_mm(table)
        for direction in (FORWARD, BACKWARD):
            _draw_spread(single, spread, table[table["front"] == direction.odd], direction, shift)
        single.set_ylabel("from the mean of the face (µm)")
        spread.set_ylabel("spread (µm)")
        spread.set_xlabel("nominal position along the gauge, from face 1 (mm)")
        spread.set_ylim(bottom=0.0)
        single.set_title(f"{_title(table)}: repeatability", loc="left", fontweight="bold")
        single.set_title(f"pooled 2s: ±{2 * pooled:.2f} µm", loc="right")
        for axes in (single, spread):
            axes.spines[["top", "right"]].set_visible(False)
        add_legend(figure, _spread_legend())
    return figure


def _draw_spread(single: Axes, spread: Axes, part: pd.DataFrame, direction: DirectionStyle, shift_mm: float) -> None:
    if part.empty:
        return
    cycles = part["cycle"].to_numpy(float)
    beside = shift_mm * (cycles - (cycles.min() + cycles.max()) / 2.0)
    single.plot(
        part["nominal_mm"] + beside, part["residual_um"], linestyle="none", marker=direction.marker, markersize=2.4,
        color=direction.color, markeredgewidth=0, zorder=3,
    )  # fmt: skip
    by_face = part.groupby("nominal_mm")["residual_um"]
    sigma, extent = by_face.std(), by_face.max() - by_face.min()
    spread.plot(sigma.index, 2 * sigma, color=direction.color, marker=direction.marker, markersize=3.0, linewidth=0.9)
    spread.plot(
        extent.index, extent, color=direction.color, marker=direction.marker, markersize=3.0, linewidth=0.7,
        linestyle=(0, (2, 1.5)), markerfacecolor="white",
    )  # fmt: skip


def _spread_legend() -> dict[str, Any]:
    dashed: Any = (0, (2, 1.5))
    return {
        "forward": Line2D([], [], color=FORWARD.color, marker=FORWARD.marker, markersize=2.4, linestyle="none"),
        "backward": Line2D([], [], color=BACKWARD.color, marker=BACKWARD.marker, markersize=2.4, linestyle="none"),
        "± pooled 2s": Line2D([], [], color=GREY, linestyle=(0, (4, 2))),
        "2s of a face": _pair(marker=True, markersize=3.0, linewidth=0.9),
        "range of a face": _pair(marker=True, markersize=3.0, linewidth=0.7, linestyle=dashed, markerfacecolor="white"),
    }


def _pooled_sigma(table: pd.DataFrame) -> float:
    """Standard deviation of a single probing about the mean of its face, over all faces."""
    freedom = len(table) - table["face"].nunique()
    return float(np.sqrt((table["residual_um"] ** 2).sum() / freedom)) if freedom > 0 else float("nan")


def _shift_mm(table: pd.DataFrame) -> float:
    """Cycles of a face stand side by side, in half of the smallest gap between faces."""
    gaps: NDArray[np.float64] = np.diff(np.sort(table["nominal_mm"].unique()))
    return 0.5 * float(gaps.min()) / max(int(table["cycle"].max()), 1)


def _title(table: pd.DataFrame) -> str:
    cycles = table["cycle"].nunique()
    return f"Placement {table['placement'].iloc[0]}, {counted(cycles, 'cycle')}"
