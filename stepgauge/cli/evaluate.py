"""``stepgauge evaluate``: recording + certificate -> errors with two-sigma bands."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from stepgauge.cli.options import GAUGE, output, say

if TYPE_CHECKING:
    from stepgauge.evaluate import PlacementResult
    from stepgauge.standards.mpe import Mpe


@click.command("evaluate")
@click.argument("recordings", nargs=-1, required=True, metavar="RECORDING...")
@GAUGE
@output("Folder for evaluation.json, evaluation.csv and the figures (made if missing).")
@click.option("--blocks", metavar="A:B", help="First and last block of the used section; default: what was measured.")
@click.option(
    "--r-eff",
    "r_eff_from",
    type=click.Choice(["first", "all"]),
    default="first",
    show_default=True,
    help="Effective radius from the first used block (its XB is then zero by construction) or from all used blocks.",
)
@click.option(
    "--placement",
    "placement_files",
    multiple=True,
    metavar="P",
    help="Placement file; once per placement in the recording. Default: the axis is the mean approach.",
)
@click.option("--measured-at", metavar="DATE", help="When it was measured, 2026-03-02 or with time; for the history.")
@click.option("--machine-name", metavar="NAME", help="Machine that measured it, where the recording does not say.")
@click.option(
    "--mpe", metavar="LIMIT", help='Draw the lines of a maximum permissible error, e.g. "1.8 + L/350" (um, mm).'
)
@click.option("--figure", "suffix", type=click.Choice(["png", "svg", "pdf"]), default="png", show_default=True)
def command(
    recordings: tuple[str, ...],
    gauge: str,
    output: str,
    blocks: str | None,
    r_eff_from: str,
    placement_files: tuple[str, ...],
    measured_at: str | None,
    machine_name: str | None,
    mpe: str | None,
    suffix: str,
) -> None:
    """Errors of the machine from a recording of the step gauge (Pahk & Kim, equations 1 to 13).

    Forward XF (fronts), backward XB (backs), their mean XM and the reversal XR at every face, with two-sigma bands from
    the cycles, and the effective radius R_eff with its standard uncertainty. Several recordings are evaluated as
    several placements.

    Writes evaluation.json, evaluation.csv (one row per face, um) and one figure per placement.

    \b
    stepgauge evaluate recording.csv --gauge step-gauge-420 -o result
    stepgauge evaluate x.csv y.csv --gauge my-gauge.toml --blocks 2:20 --r-eff all -o result
    """
    from stepgauge.dates import parse_moment
    from stepgauge.evaluate import evaluate
    from stepgauge.evaluation_files import write_evaluation
    from stepgauge.figures.evaluation import draw_evaluations
    from stepgauge.gauge import read_gauge
    from stepgauge.placement import read_placement
    from stepgauge.plan import parse_blocks
    from stepgauge.recording import join_recordings, read_recording
    from stepgauge.standards.mpe import Mpe

    limit = Mpe.parse(mpe) if mpe else None
    if measured_at:
        parse_moment(measured_at, "--measured-at")
    steps = read_gauge(gauge)
    section = parse_blocks(blocks, steps) if blocks else None
    placements = [read_placement(path, steps) for path in placement_files]
    tables = [read_recording(path) for path in recordings]
    recording = tables[0] if len(tables) == 1 else join_recordings(tables)
    recording = recording.with_comments(measured_at=measured_at, machine=machine_name)
    result = evaluate(recording, steps, section, "all" if r_eff_from == "all" else "first", placements)
    written = [*write_evaluation(output, result), *draw_evaluations(output, result, suffix, limit)]
    for one in result.results:
        for note in one.notes:
            say(f"placement {one.placement}: note: {note}")
        say(
            f"placement {one.placement}: span {one.span_mm:.1f} mm, band of XM {_um(one.band_um)},"
            f" worst two-sigma {_um(one.worst_two_sigma_um)},"
            f" R_eff {one.radius.r_eff_mm:.5f} mm (u = {one.radius.u_mm * 1e3:.2f} um)"
        )
        if limit is not None:
            say(_against(one, limit))
    say("wrote " + ", ".join(str(path) for path in written))


def _against(result: PlacementResult, limit: Mpe) -> str:
    from stepgauge.evaluation_files import face_rows
    from stepgauge.figures.evaluation import beyond_mpe

    rows = face_rows(result)
    beyond, faces = beyond_mpe(rows, limit), sum(row["count"] > 0 for row in rows)
    return (
        f"placement {result.placement}: {beyond} of {faces} faces have a mean error beyond MPE = {limit} um"
        " (lengths from the reference face; no decision rule applied)"
    )


def _um(value: float) -> str:
    return "undefined" if value != value else f"{value:.2f} um"
