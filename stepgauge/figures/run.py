"""The figures of a run on the virtual CMM: its path, on paper and in a browser, and the shares of the effects."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from matplotlib.collections import LineCollection

from stepgauge.figures.legends import add_legend, axes_entries
from stepgauge.figures.path import path_figure
from stepgauge.figures.path_scene import path_scene, write_path_html
from stepgauge.figures.style import (
    COLORS,
    CYCLE,
    MEASURE_COLOR,
    STOP_COLOR,
    TRAVEL_COLOR,
    figure_style,
    new_figure,
    save_figure,
)
from stepgauge.files.arrays import Array
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.machine.file import Machine
from stepgauge.machine.readout import TOTAL_SHARE
from stepgauge.machine.virtual import Run
from stepgauge.motion.moves import Path as MotionPath
from stepgauge.motion.moves import trace
from stepgauge.planning.planned import Plan

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw_plan_view(axes: Axes, run: Run) -> None:
    """The path from above in machine coordinates, its searches in another colour, and where it stopped."""
    travelled = run.path.until(run.stop_piece)
    draw_from_above(axes, travelled)
    if run.stop is not None and len(travelled.end_mm):
        axes.plot(*travelled.end_mm[-1, :2], "x", color=STOP_COLOR, markersize=7, label="stopped")
        axes.legend(frameon=False)


def draw_plan(axes: Axes, plan: Plan) -> None:
    """The path of a plan from above in machine coordinates."""
    draw_from_above(axes, trace(plan.program))


def draw_from_above(axes: Axes, path: MotionPath) -> None:
    """Pieces of a path in x and y, mm."""
    for measuring, color, label in ((False, TRAVEL_COLOR, "travel"), (True, MEASURE_COLOR, "search")):
        some = path.measuring == measuring
        ends = np.stack([path.start_mm[some, :2], path.end_mm[some, :2]], axis=1)
        axes.add_collection(LineCollection(list(ends), colors=color, linewidths=0.8, label=label))
    axes.autoscale_view()
    axes.set(xlabel="machine x (mm)", ylabel="machine y (mm)", aspect="equal", adjustable="datalim")
    axes.legend(frameon=False)


def draw_run(
    run: Run,
    machine: Machine,
    gauge: Gauge,
    placement: Placement,
    path: str | Path | None = None,
    path_html: str | Path | None = None,
    shares: str | Path | None = None,
) -> list[Path]:
    """Draw what is named: the path as png, svg or pdf, the path as HTML, the shares; returns the files.

    ``gauge`` lies as ``placement`` says. Shares need a run that was explained and recorded something; else there is no
    figure of them.
    """
    title, radius_mm = f"{gauge.table.name}, {machine.table.name}", machine.probe.tip_radius_mm
    if path is not None:
        drawn = path_figure(run.path, gauge, placement, radius_mm, run.stop_piece, title)
        save_figure(drawn, path, simulated=True)
    if path_html is not None:
        scene = path_scene(run.path, gauge, placement, radius_mm, machine.travel_mm, run.stop_piece, title)
        write_path_html(path_html, scene)
    files = [path, path_html]
    if shares is not None and run.shares is not None and len(run.recording):
        face = run.recording.frame["face"].to_numpy()
        draw_shares(shares, run.shares, face, gauge.position_mm, title)
        files.append(shares)
    return [Path(name) for name in files if name is not None]


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
