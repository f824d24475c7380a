"""``stepgauge evaluate``: recording + certificate -> errors of the machine."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from stepgauge.cli.options import (
    BLOCKS,
    GAUGE,
    PLACEMENTS,
    R_EFF,
    SUFFIX,
    mpe_from,
    mpe_options,
    output,
    say,
    say_written,
)

if TYPE_CHECKING:
    from stepgauge.evaluation.evaluate import PlacementResult
    from stepgauge.standards.mpe import Mpe


@click.command("evaluate")
@click.argument("recordings", nargs=-1, required=True, metavar="RECORDING...")
@GAUGE
@output("Folder for evaluation.json, evaluation.csv and the figures (made if missing).")
@PLACEMENTS
@BLOCKS
@R_EFF
@mpe_options(False, "Draw the lines of a maximum permissible error")
@click.option("--measured-at", metavar="DATE", help="When it was measured, 2026-03-02 or with time; for the history.")
@click.option("--machine-name", metavar="NAME", help="Machine that measured it, where the recording does not say.")
@SUFFIX
def command(recordings: tuple[str, ...], gauge: str, output: str, **options: Any) -> None:
    """Errors of the machine from a recording of the step gauge (Pahk & Kim, equations 1 to 13).

    At every face: the error probed forward XF (front faces) and backward XB (back faces), their mean XM, the reversal
    error XR, and 2s (s: standard deviation of the repeated probings). Also the effective tip radius R_eff with its
    standard uncertainty. Several recordings are evaluated as several placements.

    Writes evaluation.json, evaluation.csv (one row per face, um) and one figure per placement.

    \b
    stepgauge evaluate recording.csv --gauge step-gauge-420 -o result
    stepgauge evaluate x.csv y.csv --gauge my-gauge.toml --blocks 2:20 --r-eff all -o result
    """
    from stepgauge.evaluation.evaluate import evaluate
    from stepgauge.evaluation.files import write_evaluation
    from stepgauge.figures.evaluation import draw_evaluations
    from stepgauge.files.dates import parse_moment
    from stepgauge.gauge.certified import read_gauge
    from stepgauge.gauge.placement import read_placements
    from stepgauge.planning.plan import parse_section
    from stepgauge.recording import read_recordings

    limit, measured_at = mpe_from(options), options["measured_at"]
    if measured_at:
        parse_moment(measured_at, "--measured-at")
    steps = read_gauge(gauge)
    section = parse_section(options["blocks"], steps)
    placements = read_placements(options["placement_files"], steps)
    recording = read_recordings(recordings).with_comments(measured_at=measured_at, machine=options["machine_name"])
    result = evaluate(recording, steps, section, options["origin"], placements)
    written = [*write_evaluation(output, result), *draw_evaluations(output, result, options["suffix"], limit)]
    for one in result.results:
        for note in one.notes:
            say(f"placement {one.placement}: note: {note}")
        say(
            f"placement {one.placement}: span {one.span_mm:.1f} mm, range of the mean error XM {_um(one.band_um)},"
            f" largest 2s {_um(one.worst_two_sigma_um)},"
            f" R_eff {one.radius.r_eff_mm:.5f} mm (u = {one.radius.u_mm * 1e3:.2f} um)"
        )
        if limit is not None:
            say(_against(one, limit))
    say_written(*written)


def _against(result: PlacementResult, limit: Mpe) -> str:
    from stepgauge.evaluation.files import face_rows
    from stepgauge.figures.evaluation import beyond_mpe

    rows = face_rows(result)
    beyond, faces = beyond_mpe(rows, limit), sum(row["count"] > 0 for row in rows)
    return (
        f"placement {result.placement}: {beyond} of {faces} faces have a mean error beyond MPE = {limit} um"
        " (lengths from the reference face; no decision rule applied)"
    )


def _um(value: float) -> str:
    return "undefined" if value != value else f"{value:.2f} um"
