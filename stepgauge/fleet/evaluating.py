"""Evaluations of a store's recordings: those of each recording alone, worked out on any engine."""

from __future__ import annotations

import datetime
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any, cast

from stepgauge.conditions import require_statement
from stepgauge.errors import InputError
from stepgauge.evaluation.evaluate import Evaluation, PlacementResult, evaluate
from stepgauge.evaluation.face_errors import REffOrigin
from stepgauge.evaluation.files import UM, evaluation_to_dict
from stepgauge.executors.task import Engine
from stepgauge.fleet.batches import Batch, StoredBatch, opened
from stepgauge.fleet.results import Results
from stepgauge.fleet.rows import Stored
from stepgauge.fleet.schema import EVALUATIONS, arrow_library, arrow_schema
from stepgauge.fleet.store import Fleet
from stepgauge.fleet.working import Progress, work_in_batches
from stepgauge.history.entries import make_entry
from stepgauge.planning.plan import parse_blocks
from stepgauge.recording.conventions import complete_by_machine, state_convention

_UNKNOWN = datetime.datetime(1, 1, 1)


@dataclass(frozen=True)
class EvaluationChoices:
    """How the recordings of a store are evaluated; what each field means is the verb ``evaluate``'s to say.

    ``blocks``: ``"1:21"``, None: what each recording measured. A convention that a recording states and that is another
    one is an error of that recording.
    """

    blocks: str | None = None
    r_eff_origin: str | None = None
    temperature_convention: str | None = None
    correct_drift: bool = False


def evaluate_fleet(
    fleet: Fleet,
    engine: Engine,
    choices: EvaluationChoices | None = None,
    progress: Progress | None = None,
) -> list[str]:
    """Evaluate the recordings that have no evaluation with these options; returns why some cannot be, a line each.

    The numbers are those of :func:`stepgauge.evaluation.evaluate.evaluate` of each recording alone, whose code they
    come from. What is done stays done where this is stopped.

    Parameters
    ----------
    fleet, engine : the store, and who does the work
    choices : how each is evaluated; default: as usual
    progress : told how many of how many recordings are done
    """
    chosen = choices or EvaluationChoices()
    table = Results(fleet, "evaluations", asdict(chosen))
    return work_in_batches(table, engine, partial(evaluate_batch, choices=chosen), progress)


def evaluate_batch(given: Batch | StoredBatch, choices: EvaluationChoices) -> Any:
    """The evaluations of a batch as an Arrow table of :data:`~stepgauge.fleet.schema.EVALUATIONS`."""
    batch = opened(given)
    rows = [row for one in batch.stored for row in _evaluated(batch, one, choices)]
    return arrow_library().Table.from_pylist(rows, arrow_schema(EVALUATIONS))


def _evaluated(batch: Batch, one: Stored, choices: EvaluationChoices) -> Iterator[dict[str, Any]]:
    try:
        gauge = batch.gauge(one)
        section = parse_blocks(choices.blocks, gauge) if choices.blocks else None
        recording = state_convention(one.recording(), choices.temperature_convention)
        if one.machine_file is not None:
            recording = complete_by_machine(recording, batch.machine(one).table)
        origin = cast(REffOrigin | None, choices.r_eff_origin)
        found = evaluate(recording, gauge, section, origin, batch.placements(one), choices.correct_drift)
        require_statement(found.conditions.without("dates"), found.path)
    except InputError as error:
        yield {"recording": one.key, "placement": 0, "error": error.cli_text(), "notes": [], "face": []}
        return
    said = evaluation_to_dict(found)
    for result, row in zip(found.results, said["placements"], strict=True):
        yield _evaluation_row(one.key, found, result, said, row)


def _evaluation_row(
    key: str, found: Evaluation, result: PlacementResult, said: Mapping[str, Any], row: Mapping[str, Any]
) -> dict[str, Any]:
    entry = asdict(make_entry(said, row, found.path, key, _UNKNOWN, ""))
    names = {column.name for column in EVALUATIONS}
    return {
        **{name: value for name, value in entry.items() if name in names},
        "recording": key,
        "u_r_eff_mm": result.radius.u_mm,
        **{f"axis_{letter}": float(value) for letter, value in zip("ijk", result.axis, strict=True)},
        **{f"origin_{letter}_mm": float(value) for letter, value in zip("xyz", result.origin_mm, strict=True)},
        "notes": list(result.notes),
        "left_out": len(result.left_out),
        "face": result.face,
        "count": result.count,
        "position_mm": result.position_mm,
        **{name: getattr(result, name) for name in UM},
    }
