"""All figures of a measurement in a folder: errors, single probings, repeatability, arrows, run chart."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from stepgauge.evaluation.evaluate import Evaluation
from stepgauge.evaluation.files import evaluation_to_dict
from stepgauge.evaluation.probings import TEMPERATURES, probing_errors
from stepgauge.figures.arrows import arrows_figure
from stepgauge.figures.evaluation import BACKWARD, FORWARD, evaluation_figure
from stepgauge.figures.legends import add_legend, axes_entries
from stepgauge.figures.probings import bidirectional_figure, repeatability_figure
from stepgauge.figures.style import COLORS, CYCLE, figure_style, new_figure, save_figure
from stepgauge.machine.file import Machine
from stepgauge.recording import Recording
from stepgauge.recording.simulated import is_simulated
from stepgauge.standards.mpe import Mpe

KINDS = ("error", "bidirectional", "repeatability", "arrows", "run")


def draw_measurement(
    folder: str | Path,
    recording: Recording,
    evaluation: Evaluation,
    kinds: Collection[str] = KINDS,
    mpe: Mpe | None = None,
    machine: Machine | None = None,
    suffix: str = "png",
) -> list[Path]:
    """Draw the figures named in ``kinds`` into a folder (made if missing); returns their paths.

    ``recording`` is that of the evaluation; ``mpe``: lines in the errors; ``machine``: its travel is the box of the
    arrows; ``suffix``: png, svg or pdf. Nothing is written before all of them are drawn.
    """
    drawn = list(_figures(recording, evaluation, kinds, mpe, machine))
    paths = [Path(folder) / f"{name}.{suffix}" for name, _ in drawn]
    for path, (_, figure) in zip(paths, drawn, strict=True):
        save_figure(figure, path, is_simulated(recording.comments))
    return paths


def _figures(
    recording: Recording, evaluation: Evaluation, kinds: Collection[str], mpe: Mpe | None, machine: Machine | None
) -> Iterator[tuple[str, Figure]]:
    tables = [table[table["used"]] for table in probing_errors(recording, evaluation)]
    for placement, table in zip(evaluation_to_dict(evaluation)["placements"], tables, strict=True):
        end = f"-placement-{placement['placement']}" if len(tables) > 1 else ""
        if "error" in kinds:
            yield f"error{end}", evaluation_figure(placement, mpe)
        if "bidirectional" in kinds:
            yield f"bidirectional{end}", bidirectional_figure(table, mpe)
        if "repeatability" in kinds:
            yield f"repeatability{end}", repeatability_figure(table)
    if "arrows" in kinds:
        travel, name = (None, "") if machine is None else (machine.travel_mm, machine.table.name)
        yield "arrows", arrows_figure(evaluation.results, travel, name)
    if "run" in kinds:
        yield "run", run_chart_figure(tables)


WIDTH_MM, HEIGHT_MM, ALONE_MM = 170.0, 110.0, 75.0
GREY = COLORS["grey"]
_NAMES = ("gauge", "scale x", "scale y", "scale z")
_LINES = (("-", CYCLE[6]), ((0, (4, 1.5)), CYCLE[2]), ((0, (1, 1)), CYCLE[3]), ((0, (4, 1, 1, 1)), CYCLE[4]))


def run_chart_figure(tables: Sequence[pd.DataFrame]) -> Figure:
    """Deviation of every probing from the mean of its face by time, placements one after the other.

    ``tables``: of :func:`stepgauge.evaluation.probings.probing_errors`. Where no times were recorded probings are
    counted; where no temperatures were, their panel is left out.
    """
    temperatures = [name for name in TEMPERATURES if all(name in table for table in tables)]
    timed = all("time_s" in table for table in tables)
    with figure_style():
        figure = new_figure(WIDTH_MM, HEIGHT_MM if temperatures else ALONE_MM)
        panels = figure.subplots(
            2 if temperatures else 1, 1, sharex=True, squeeze=False, height_ratios=[2.0, 1.0] if temperatures else [1.0]
        )[:, 0]
        places = _places(tables, timed)
        for number, (table, x) in enumerate(zip(tables, places, strict=True)):
            _draw_probings(panels[0], table, x)
            _mark_placement(panels[0], table, x, number)
            for name, label in _drawn(tables, temperatures).items():
                line, color = _LINES[TEMPERATURES.index(name)]
                panels[-1].plot(
                    x, table[name], color=color, linestyle=line, linewidth=1.2,
                    label=label if number == 0 else "_more",
                )  # fmt: skip
        _label(list(panels), temperatures, timed)
        add_legend(figure, axes_entries(*panels))
    return figure


def _drawn(tables: Sequence[pd.DataFrame], temperatures: Sequence[str]) -> dict[str, str]:
    """Columns to draw with their labels: scales that are equally warm throughout are one line, not three above each
    other."""
    scales = [name for name in temperatures if name.startswith("scale_")]
    alike = all(table[name].equals(table[scales[0]].rename(name)) for table in tables for name in scales)
    if len(scales) < 2 or not alike:
        return {name: _NAMES[TEMPERATURES.index(name)] for name in temperatures}
    label = "scales " + ", ".join(_NAMES[TEMPERATURES.index(name)].split()[-1] for name in scales)
    others = {name: _NAMES[TEMPERATURES.index(name)] for name in temperatures if name not in scales}
    return {**others, scales[0]: label}


def _places(tables: Sequence[pd.DataFrame], timed: bool) -> list[NDArray[np.float64]]:
    """Minutes from the first probing, or numbers of the probings; clocks that start anew follow each other."""
    places: list[NDArray[np.float64]] = []
    end = 0.0
    for table in tables:
        x = table["time_s"].to_numpy(float) / 60.0 if timed else np.arange(1.0, len(table) + 1)
        if places and x.min() <= end:
            x = x - x.min() + end * 1.02 + (0.0 if timed else 1.0)
        places.append(x)
        end = float(x.max())
    return places


def _draw_probings(axes: Axes, table: pd.DataFrame, x: NDArray[np.float64]) -> None:
    for direction in (FORWARD, BACKWARD):
        part = (table["front"] == direction.odd).to_numpy()
        axes.plot(
            x[part], table["residual_um"][part], linestyle="none", marker=direction.marker, markersize=2.6,
            markeredgewidth=0, color=direction.color, alpha=0.6, label="_points",
        )  # fmt: skip
    by_cycle = pd.DataFrame({"x": x, "y": table["residual_um"], "cycle": table["cycle"]}).groupby("cycle").mean()
    axes.plot(
        by_cycle["x"], by_cycle["y"], color=COLORS["model"], marker="o", markersize=4.0, linewidth=1.1, label="_cycles"
    )


def _mark_placement(axes: Axes, table: pd.DataFrame, x: NDArray[np.float64], number: int) -> None:
    if number:
        axes.axvline(float(x.min()), color=GREY, linewidth=0.7, linestyle=(0, (2, 2)))
    text = f" placement {table['placement'].iloc[0]}"
    axes.text(float(x.min()), 0.99, text, transform=axes.get_xaxis_transform(), va="top", fontsize=7, color="#505050")


def _label(panels: Sequence[Axes], temperatures: Sequence[str], timed: bool) -> None:
    errors = panels[0]
    errors.axhline(0.0, color=GREY, linewidth=0.7, zorder=1)
    errors.set_ylabel("from the mean of the face,\nalong the gauge (µm)")
    errors.set_title("Run chart" + ("" if timed else " (no times recorded)"), loc="left", fontweight="bold")
    low, high = errors.get_ylim()
    errors.set_ylim(low, high + 0.12 * (high - low))
    for direction in (FORWARD, BACKWARD):
        errors.plot(
            [], [], linestyle="none", marker=direction.marker, color=direction.color, label=direction.label.split()[0]
        )
    errors.plot([], [], color=COLORS["model"], marker="o", markersize=4.0, label="mean of a cycle")
    if temperatures:
        panels[-1].set_ylabel("temperature (°C)")
        low, high = panels[-1].get_ylim()
        if high - low < 0.5:
            panels[-1].set_ylim((low + high - 0.5) / 2.0, (low + high + 0.5) / 2.0)
        panels[-1].ticklabel_format(axis="y", useOffset=False)
    panels[-1].set_xlabel("time (min)" if timed else "probing")
    for axes in panels:
        axes.spines[["top", "right"]].set_visible(False)
