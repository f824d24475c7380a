"""Evaluate or diagnose what is in the store and has no result yet, on any engine; results go into the store."""

from __future__ import annotations

import datetime
import json
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import asdict
from functools import partial
from itertools import islice
from typing import Any, cast

from stepgauge.errors import InputError
from stepgauge.evaluation.evaluate import Evaluation, PlacementResult, evaluate
from stepgauge.evaluation.face_errors import REffOrigin
from stepgauge.evaluation.files import UM, evaluation_to_dict
from stepgauge.fleet.batches import Batch, Kept, batches, named, opened
from stepgauge.fleet.results import Results
from stepgauge.fleet.rows import Stored
from stepgauge.fleet.schema import DIAGNOSES, EVALUATIONS, arrow_library, arrow_schema
from stepgauge.fleet.store import Fleet
from stepgauge.history.entries import make_entry
from stepgauge.planning.plan import parse_blocks
from stepgauge.work.run import Outcome, Progress, run
from stepgauge.work.task import Engine

BATCH = 100
"""Recordings of a task: many enough that to send them costs little, few enough that the last ones do not wait."""
PORTION = 500
"""Recordings whose results become one file: few files, and little to do again after a kill."""
_UNKNOWN = datetime.datetime(1, 1, 1)


def evaluate_fleet(
    fleet: Fleet,
    engine: Engine,
    blocks: str | None = None,
    r_eff: str = "first",
    progress: Callable[[int, int], None] | None = None,
) -> list[str]:
    """Evaluate the recordings that have no evaluation with these options; returns why some cannot be, a line each.

    The numbers are those of :func:`stepgauge.evaluation.evaluate.evaluate` of each recording alone, whose code they
    come from. What is done stays done where this is stopped.

    Parameters
    ----------
    fleet, engine : the store, and who does the work
    blocks : first and last block of the used section, ``"1:21"``; default: what each recording measured
    r_eff : effective radius from the ``"first"`` used block or from ``"all"``
    progress : told how many of how many recordings are done
    """
    table = Results(fleet, "evaluations", {"blocks": blocks, "r_eff": r_eff})
    keys = left_over(fleet, table)
    errors: list[str] = []
    function = partial(evaluate_batch, blocks=blocks, r_eff=r_eff)
    outcomes = run(function, _tasks(fleet, engine, keys, BATCH), engine, progress=_by_recording(progress, len(keys)))
    for some in in_portions(outcomes, PORTION // BATCH):
        done = [one.value for one in some if not one.error]
        if done:
            table.put(arrow_library().concat_tables(done))
        errors += [text for rows in done for text in rows["error"].to_pylist() if text]
        errors += [f"{BATCH} recordings from {one.key} on: {one.error}" for one in some if one.error]
    return errors


def in_portions(outcomes: Iterable[Outcome], size: int) -> Iterator[list[Outcome]]:
    """Lists of so many; the last one is shorter. What came before a stop comes as well."""
    left = iter(outcomes)
    while some := list(islice(left, size)):
        yield some


def _tasks(fleet: Fleet, engine: Engine, keys: Collection[str], size: int) -> Iterator[tuple[str, Batch | Kept]]:
    return named(fleet, keys, size) if engine.near else batches(fleet, keys, size)


def left_over(fleet: Fleet, table: Results) -> list[str]:
    """The keys of the recordings that have no row in a table of results."""
    done = table.done()
    return [key for key in fleet.index()["recording"].to_pylist() if key not in done]


def _by_recording(progress: Callable[[int, int], None] | None, total: int) -> Progress | None:
    return None if progress is None else lambda done: progress(min(done * BATCH, total), total)


def evaluate_batch(given: Batch | Kept, blocks: str | None, r_eff: str) -> Any:
    """The evaluations of a batch as an Arrow table of :data:`~stepgauge.fleet.schema.EVALUATIONS`."""
    batch = opened(given)
    rows = [row for one in batch.stored for row in _evaluated(batch, one, blocks, cast(REffOrigin, r_eff))]
    return arrow_library().Table.from_pylist(rows, arrow_schema(EVALUATIONS))


def _evaluated(batch: Batch, one: Stored, blocks: str | None, r_eff: REffOrigin) -> Iterator[dict[str, Any]]:
    try:
        gauge = batch.gauge(one)
        section = parse_blocks(blocks, gauge) if blocks else None
        found = evaluate(one.recording(), gauge, section, r_eff, batch.placements(one))
    except InputError as error:
        yield {"recording": one.key, "placement": 0, "error": error.as_typed(), "notes": [], "face": []}
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


def diagnose_fleet(
    fleet: Fleet,
    engine: Engine,
    without: tuple[str, ...] = (),
    priors: Any = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[str]:
    """Diagnose, each by itself, the recordings that have no diagnosis with these options; returns why some cannot be.

    Every diagnosis is on the disk as it is made, in a journal beside the table, so that a stop costs none of them.

    Parameters
    ----------
    fleet, engine : the store, and who does the work
    without : kinds of effects that are known to be absent
    priors : the table of priors, the shipped one by default
    progress : told how many of how many recordings are done
    """
    from stepgauge.fleet.journal import open_journal

    options = {"without": sorted(without), "priors": None if priors is None else repr(priors)}
    table = Results(fleet, "diagnoses", options)
    keys, errors = left_over(fleet, table), list[str]()
    tasks = _tasks(fleet, engine, keys, 1)
    function = partial(diagnose_batch, without=without, priors=priors)
    told = None if progress is None else (lambda done: progress(done, len(keys)))
    with open_journal(fleet, table) as journal:
        for some in in_portions(run(function, tasks, engine, journal=journal, progress=told), PORTION):
            rows = [_diagnosis_row(one.key, one.value, one.error) for one in some if not one.failed]
            if rows:
                table.put(arrow_library().Table.from_pylist(rows, arrow_schema(DIAGNOSES)))
            errors += [one.error for one in some if one.error]
    return errors


def diagnose_batch(given: Batch | Kept, without: tuple[str, ...], priors: Any) -> dict[str, Any]:
    """The diagnosis of a batch of one recording: the summary, and ``diagnosis.json`` but for the names of files."""
    from stepgauge.diagnosis.engine import diagnose
    from stepgauge.diagnosis.files import Inputs, told_to_dict
    from stepgauge.diagnosis.unknown_law import model_unknown

    batch = opened(given)
    (one,) = batch.stored
    recording = one.recording()
    found = diagnose(recording, batch.gauge(one), batch.machine(one), without, priors)
    return {"summary": found.summary(), "said": told_to_dict(found, Inputs((recording,)), model_unknown(found))}


def _diagnosis_row(key: str, value: Mapping[str, Any] | None, error: str) -> dict[str, Any]:
    said = {} if value is None else value["said"]
    effects = said.get("effects", [])
    return {
        "recording": key,
        "verdict": said.get("verdict"),
        "summary": None if value is None else value["summary"],
        "kinds": [str(one["kind"]) for one in effects],
        "labels": [str(one["label"]) for one in effects],
        "probabilities": [float(one["probability"]) for one in effects],
        "noise_um": said.get("fit", {}).get("noise_um"),
        "rms_before_um": said.get("fit", {}).get("rms_before_um"),
        "rms_after_um": said.get("fit", {}).get("rms_after_um"),
        "document": json.dumps(said) if said else None,
        "error": error or None,
    }
