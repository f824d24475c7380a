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
    TEMPERATURE_CONVENTION,
    machine_option,
    mpe_from,
    mpe_options,
    output,
    say,
    say_lines,
    say_written,
)

if TYPE_CHECKING:
    from stepgauge.evaluation.evaluate import Evaluation
    from stepgauge.standards.mpe import Mpe


@click.command("evaluate")
@click.argument("recordings", nargs=-1, required=True, metavar="RECORDING...")
@GAUGE
@output("Folder for evaluation.json, evaluation.csv and the figures (made if missing).")
@PLACEMENTS
@BLOCKS
@R_EFF
@mpe_options(False, "Draw the lines of a maximum permissible error. Default: that of the machine file")
@machine_option(False, "Machine file: the maximum permissible error that it states.")
@click.option("--measured-at", metavar="DATE", help="When it was measured, 2026-03-02 or with time; for the history.")
@click.option("--machine-name", metavar="NAME", help="Machine that measured it, where the recording does not say.")
@TEMPERATURE_CONVENTION
@click.option("--correct-drift", is_flag=True, help="Take off a drift with time that the repeats show.")
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
    from stepgauge.public.evaluate import evaluate

    stated = mpe_from(options)
    result = evaluate(
        list(recordings),
        gauge,
        placements=list(options["placement_files"]),
        blocks=options["blocks"],
        r_eff=options["origin"],
        measured_at=options["measured_at"],
        machine_name=options["machine_name"],
        temperature_convention=options["temperature_convention"],
        correct_drift=options["correct_drift"],
    )
    limit = stated or _of_machine(options["machine"], result)
    written = result.write(output, options["suffix"], limit)
    say_lines(result.summary())
    if limit is not None:
        say(_against(result, limit))
    say_written(*written)


def _of_machine(machine: str | None, result: Evaluation) -> Mpe | None:
    """The limit of the machine file; one of another machine is refused before anything is written."""
    from stepgauge.standards.conformity import machine_limit

    return machine_limit(machine, result.comments) if machine else None


def _against(result: Evaluation, limit: Mpe) -> str:
    """Without a budget nothing is decided; what the errors alone are of the limit is said."""
    from stepgauge.evaluation.files import evaluation_to_dict
    from stepgauge.standards.conformity import conformity

    judged = conformity(evaluation_to_dict(result), None, limit)
    beyond = sum(abs(one.error_um) > one.limit_um for one in judged.faces)
    return f"{judged.text} {beyond} of {len(judged.faces)} errors are beyond the limit."
