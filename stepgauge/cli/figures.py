"""``stepgauge figures``: the figures of a measurement, for the wall and the report."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from stepgauge.cli.options import GAUGE, machine_option, output, say

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from stepgauge.evaluate import Evaluation
    from stepgauge.recording import Recording
    from stepgauge.standards.mpe import Mpe

KINDS = ("error", "bidirectional", "repeatability", "arrows", "run")


@click.command("figures")
@click.argument("recordings", nargs=-1, required=True, metavar="RECORDING...")
@GAUGE
@output("Folder for the figures (made if missing).")
@click.option(
    "--only",
    "kinds",
    multiple=True,
    type=click.Choice(KINDS),
    help="Only this one; repeatable. Default: all.",
)
@click.option("--mpe", metavar="LIMIT", help='Lines of a maximum permissible error, e.g. "1.8 + L/350" (um, mm).')
@machine_option(False, "Machine file, or the name of a shipped one: its travel is the box of the arrows.")
@click.option("--blocks", metavar="A:B", help="First and last block of the used section; default: what was measured.")
@click.option(
    "--r-eff", type=click.Choice(["first", "all"]), default="first", show_default=True, help="As of 'evaluate'."
)
@click.option(
    "--placement",
    "placement_files",
    multiple=True,
    metavar="P",
    help="Placement file; once per placement in the recording. Default: the axis is the mean approach.",
)
@click.option("--figure", "suffix", type=click.Choice(["png", "svg", "pdf"]), default="png", show_default=True)
def command(recordings: tuple[str, ...], gauge: str, output: str, **options: Any) -> None:
    """Draw what a metrologist wants to see of a measurement. Sizes are the printed ones; svg and pdf are vectors.

    \b
    error          error against position with two-sigma band, and MPE lines
    bidirectional  single probings and means of both ways of probing
    repeatability  single probings from the mean of their face; two sigma and range
    arrows         mean errors of all placements in the machine's travel, magnified
    run            every probing by time, with the temperatures

    \b
    stepgauge figures recording.csv -g step-gauge-420 --mpe "1.8 + L/350" -o figures
    stepgauge figures x.csv y.csv diagonal.csv -g step-gauge-420 -m bridge-cmm --only arrows --figure pdf -o figures
    """
    from stepgauge.evaluate import evaluate
    from stepgauge.figures.style import save_figure
    from stepgauge.gauge import read_gauge
    from stepgauge.placement import read_placement
    from stepgauge.plan import parse_blocks
    from stepgauge.recording import join_recordings, read_recording
    from stepgauge.standards.mpe import Mpe

    limit = Mpe.parse(options["mpe"]) if options["mpe"] else None
    steps = read_gauge(gauge)
    section = parse_blocks(options["blocks"], steps) if options["blocks"] else None
    placements = [read_placement(path, steps) for path in options["placement_files"]]
    tables = [read_recording(path) for path in recordings]
    recording = tables[0] if len(tables) == 1 else join_recordings(tables)
    result = evaluate(recording, steps, section, options["r_eff"], placements)
    wanted = options["kinds"] or KINDS
    written = []
    for name, figure in list(_figures(recording, result, wanted, limit, options["machine"])):
        path = Path(output) / f"{name}.{options['suffix']}"
        save_figure(figure, path)
        written.append(str(path))
    say("wrote " + ", ".join(written))


def _figures(
    recording: Recording, result: Evaluation, wanted: tuple[str, ...], limit: Mpe | None, machine: str | None
) -> Iterator[tuple[str, Figure]]:
    from stepgauge.evaluation_files import evaluation_to_dict
    from stepgauge.figures.arrows import arrows_figure
    from stepgauge.figures.evaluation import evaluation_figure
    from stepgauge.figures.probings import bidirectional_figure, repeatability_figure
    from stepgauge.figures.run_chart import run_chart_figure
    from stepgauge.machine_file import read_machine
    from stepgauge.probing_errors import probing_errors

    cmm = read_machine(machine) if machine else None
    tables = probing_errors(recording, result)
    for placement, table in zip(evaluation_to_dict(result)["placements"], tables, strict=True):
        end = f"-placement-{placement['placement']}" if len(tables) > 1 else ""
        if "error" in wanted:
            yield f"error{end}", evaluation_figure(placement, limit)
        if "bidirectional" in wanted:
            yield f"bidirectional{end}", bidirectional_figure(table, limit)
        if "repeatability" in wanted:
            yield f"repeatability{end}", repeatability_figure(table)
    if "arrows" in wanted:
        travel, name = (None, "") if cmm is None else (cmm.travel_mm, cmm.table.name)
        yield "arrows", arrows_figure(result.results, travel, name)
    if "run" in wanted:
        yield "run", run_chart_figure(tables)
