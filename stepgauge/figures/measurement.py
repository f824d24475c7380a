"""All figures of a measurement in a folder: errors, single probings, repeatability, arrows, run chart."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path

from matplotlib.figure import Figure

from stepgauge.evaluation.evaluate import Evaluation
from stepgauge.evaluation.files import evaluation_to_dict
from stepgauge.evaluation.probings import probing_errors
from stepgauge.figures.arrows import arrows_figure
from stepgauge.figures.evaluation import evaluation_figure
from stepgauge.figures.probings import bidirectional_figure, repeatability_figure
from stepgauge.figures.run_chart import run_chart_figure
from stepgauge.figures.style import save_figure
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
