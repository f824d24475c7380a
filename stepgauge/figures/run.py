"""The figures of a run on the virtual CMM: its path, on paper and in a browser, and the shares of the effects."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.collections import LineCollection

from stepgauge.figures.path import path_figure
from stepgauge.figures.path_scene import path_scene, write_path_html
from stepgauge.figures.shares import draw_shares
from stepgauge.figures.style import MEASURE_COLOR, STOP_COLOR, TRAVEL_COLOR, save_figure
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.machine.file import Machine
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
