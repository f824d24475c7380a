"""The figures of a run on the virtual CMM: its path, on paper and in a browser, and the shares of the effects."""

from __future__ import annotations

from pathlib import Path

from stepgauge.figures.path import draw_path
from stepgauge.figures.path_scene import write_path_html
from stepgauge.figures.shares import draw_shares
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.machine.file import Machine
from stepgauge.machine.virtual import Run


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
    title, radius_mm = f"{gauge.table.name} on {machine.table.name}", machine.probe.tip_radius_mm
    if path is not None:
        draw_path(path, run.path, gauge, placement, radius_mm, run.stop_piece, title)
    if path_html is not None:
        write_path_html(path_html, run.path, gauge, placement, radius_mm, machine.travel_mm, run.stop_piece, title)
    drawn = [path, path_html]
    if shares is not None and run.shares is not None and len(run.recording):
        face = run.recording.frame["face"].to_numpy()
        draw_shares(shares, run.shares, face, gauge.position_mm, title)
        drawn.append(shares)
    return [Path(name) for name in drawn if name is not None]
