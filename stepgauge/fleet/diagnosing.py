"""Diagnoses of a store's recordings: those of each recording alone, worked out on any engine."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from stepgauge.errors import for_command
from stepgauge.executors.task import Engine
from stepgauge.fleet.batches import Batch, StoredBatch, opened
from stepgauge.fleet.results import Results
from stepgauge.fleet.schema import DIAGNOSES
from stepgauge.fleet.store import Fleet
from stepgauge.fleet.working import Progress, work_one_by_one


def diagnose_fleet(
    fleet: Fleet,
    engine: Engine,
    without: tuple[str, ...] = (),
    priors: Any = None,
    progress: Progress | None = None,
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
    options = {"without": sorted(without), "priors": None if priors is None else repr(priors)}
    table = Results(fleet, "diagnoses", options)
    function = partial(diagnose_batch, without=without, priors=priors)
    return work_one_by_one(table, engine, function, _rows, DIAGNOSES, progress)


def diagnose_batch(given: Batch | StoredBatch, without: tuple[str, ...], priors: Any) -> dict[str, Any]:
    """The diagnosis of a batch of one recording: the summary, and ``diagnosis.json`` but for the names of files."""
    from stepgauge.diagnosis.engine import diagnose
    from stepgauge.diagnosis.output.files import statements_to_dict

    batch = opened(given)
    (one,) = batch.stored
    recording = one.recording()
    # what a recording leaves open the crossing settles: a further run of each would cost a tenth of the work
    found = diagnose(recording, batch.gauge(one), batch.machine(one), without, priors, separations=False)
    with for_command():
        summary = found.summary()
    return {"summary": summary, "said": statements_to_dict(replace(found, recordings=(recording,)))}


def _rows(key: str, value: Mapping[str, Any] | None, error: str) -> list[dict[str, Any]]:
    said = {} if value is None else value["said"]
    effects = said.get("effects", [])
    row = {
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
    return [row]
