"""``evaluate``: recordings and certificate to the errors of the machine."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

from stepgauge.verbs.define import verb
from stepgauge.verbs.kinds import OneOf, Reads, Repeated
from stepgauge.verbs.shared import (
    Convention,
    CorrectDrift,
    File,
    GaugeLike,
    MachineIfNeeded,
    MachineName,
    MeasuredAt,
    Mpe,
    OutputFolder,
    Placements,
    Recordings,
    ReffOrigin,
    Section,
)

if TYPE_CHECKING:
    from stepgauge.evaluation.evaluate import Evaluation
    from stepgauge.evaluation.face_errors import REffOrigin
    from stepgauge.standards.budget_files import StoredBudget


FIGURES = ("error", "bidirectional", "repeatability", "arrows", "run")
"""Written out so that --help needs no matplotlib; a test compares it with what is drawn."""


def write(
    evaluation: "Evaluation",
    output: OutputFolder,
    *,
    draw: Annotated["str | Iterable[str]", Repeated(OneOf(*FIGURES, "all"), "draw")] = (),
    figure: Annotated[str | None, OneOf("png", "svg", "pdf")] = None,
) -> list[Path]:
    """Files of an evaluation.

    Parameters
    ----------
    output : folder for evaluation.json, evaluation.csv and the figures (made if missing)
    draw : figures of the measurement. error: against position with 2s band and the lines of the limit;
        bidirectional: single probings and means of both directions; repeatability: single probings from the mean of
        their face; arrows: mean errors of all placements in the travel of ``machine``; run: every probing by time
    figure : format of the figures, without ``draw`` of that of the errors; default: png, and none without ``draw``
    """
    from stepgauge.files.outputs import open_set

    kinds = [draw] if isinstance(draw, str) else list(draw)
    kinds = kinds or ([] if figure is None else ["error"])
    with open_set():
        drawn = evaluation.draw(output, kinds, figure or "png") if kinds else []
        return [*evaluation.write(output), *drawn]


@verb(write)
def evaluate(
    recordings: Recordings,
    gauge: GaugeLike,
    *,
    placements: Placements = (),
    blocks: Section = None,
    r_eff_origin: ReffOrigin = None,
    measured_at: MeasuredAt = None,
    machine_name: MachineName = None,
    temperature_convention: Convention = None,
    correct_drift: CorrectDrift = False,
    mpe: Mpe = None,
    machine: MachineIfNeeded = None,
    budget: Annotated["File | StoredBudget | None", Reads("BUDGET", folder=True)] = None,
) -> "Evaluation":
    """Errors of the machine from recordings of the step gauge.

    At every face: the error probed forward XF (front faces) and backward XB (back faces), their mean XM, the reversal
    error XR, and 2s, s the standard deviation of the repeated probings (Pahk and Kim, equations 1 to 13). Also the
    effective tip radius R_eff with its standard uncertainty. Several recordings are evaluated as several placements.

    Parameters
    ----------
    mpe : maximum permissible error "A + L/K" or "min(A + L/K, B)", um with L in mm, to compare with;
        default: that of ``machine``
    machine : machine file, for its maximum permissible error, whether it corrects its readings to 20 deg C, and the
        travel of figures
    budget : budget.json of stepgauge budget, or its folder: its U decides on conformity with the limit

    Returns
    -------
    Errors XF, XB, XM, XR in um at every face, standard deviations, and the effective tip radius, by placement;
    ``decision`` on the limit.

    Raises
    ------
    InputError
        recordings that are not of this gauge, or a section without a complete block

    Examples
    --------
    stepgauge evaluate recording.csv --gauge step-gauge-420 --draw error -o result
    stepgauge evaluate x.csv y.csv --gauge my-gauge.toml --blocks 2:20 --r-eff-origin all -o result
    stepgauge evaluate x.csv y.csv diagonal.csv -g step-gauge-420 -m bridge-cmm --draw arrows --figure pdf -o result
    """
    from dataclasses import replace

    from stepgauge.errors import InputError, naming
    from stepgauge.evaluation.evaluate import evaluate as evaluate_recording
    from stepgauge.evaluation.files import evaluation_to_dict
    from stepgauge.standards.budget_files import resolve_budget
    from stepgauge.standards.conformity import conformity, limit_of
    from stepgauge.verbs.inputs import (
        joined_recordings,
        resolve_blocks,
        resolve_gauge,
        resolve_machine,
        resolve_placements,
    )

    cmm = None if machine is None else resolve_machine(machine)
    steps = resolve_gauge(gauge)
    section = resolve_blocks(blocks, steps)
    lies = resolve_placements(placements, steps)
    whole = joined_recordings(recordings, temperature_convention, cmm)
    whole = whole.assign_comments(measured_at=measured_at, machine=machine_name)
    found = evaluate_recording(whole, steps, section, cast("REffOrigin | None", r_eff_origin), lies, correct_drift)
    limit = limit_of(found.comments, cmm, asked=mpe)
    if budget is not None and limit is None:
        raise InputError(naming("budget"), naming("mpe", "machine", words="needs {}, or {} with a limit"))
    if limit is not None:
        stored = evaluation_to_dict(found)
        sure = None if budget is None else resolve_budget(budget, stored)
        decided = conformity(stored, sure, limit).decision
        found = replace(found, limit=limit, decision=decided)
    return replace(found, recording=whole, machine=cmm)
