"""The visits of a store: the statistics of every placement are worked out once, on any engine, and kept beside it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from stepgauge.errors import InputError
from stepgauge.executors.task import Engine
from stepgauge.fleet.batches import Batch, StoredBatch, opened
from stepgauge.fleet.hierarchical.answer import FleetInference
from stepgauge.fleet.hierarchical.infer import infer
from stepgauge.fleet.hierarchical.statistics import PlacementStatistics, placement_statistics
from stepgauge.fleet.hierarchical.visits import Visit
from stepgauge.fleet.results import Results
from stepgauge.fleet.schema import arrow_library
from stepgauge.fleet.store import Fleet
from stepgauge.fleet.working import Progress, work_in_batches
from stepgauge.gauge.certified import Gauge
from stepgauge.recording.simulated import is_simulated

TABLE = "statistics"
NAMES = tuple(one.name for one in fields(PlacementStatistics))
UNKNOWN = "?"
"""Stands for an owner that was not stated, with the machine behind it: nobody is known to share it."""


def work_out_statistics(fleet: Fleet, engine: Engine, progress: Progress | None = None) -> list[str]:
    """The statistics of the recordings that have none; returns why some cannot be had, a line each."""
    return work_in_batches(Results(fleet, TABLE), engine, statistics_batch, progress)


def statistics_batch(given: Batch | StoredBatch) -> Any:
    """Rows of a batch as an Arrow table, one for each placement, or one with the error."""
    batch, rows = opened(given), list[dict[str, Any]]()
    for one in batch.stored:
        try:
            found = placement_statistics(one.recording(), batch.gauge(one), batch.machine(one))
            rows += [{"recording": one.key, "error": "", **_plain(placed)} for placed in found]
        except InputError as error:
            rows.append({"recording": one.key, "error": error.cli_text(), **dict.fromkeys(NAMES)})
    return arrow_library().Table.from_pylist(rows)


def _plain(placed: PlacementStatistics) -> dict[str, Any]:
    values = asdict(placed)
    values["at_mm"] = placed.at_mm.ravel()
    return {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in values.items()}


def read_visits(fleet: Fleet) -> tuple[list[Visit], dict[str, Gauge]]:
    """All visits with their owners, by date, and the certificates by the names of gauges that the visits have.

    A gauge that was certified anew is another one: its faces are where the new certificate says. Days are counted from
    1970-01-01.
    """
    table = Results(fleet, TABLE).read()
    if table is None:
        return [], {}
    owners = {row["recording"]: row for row in fleet.recordings().to_dict("records")}
    known = table.filter(arrow_library().compute.equal(table["error"], "")).to_pylist()
    rows = [row | {"owners": owners[row["recording"]]} for row in known if row["recording"] in owners]
    rows.sort(key=lambda row: (row["owners"]["measured_at"], row["recording"], row["placement"]))
    names = _gauge_names([row["owners"] for row in rows])
    gauges = {name: fleet.gauge(certificate) for (_, certificate), name in names.items()}
    return [_visit(row, names) for row in rows], gauges


def _gauge_names(owners: list[Mapping[str, Any]]) -> dict[tuple[str, str], str]:
    """The gauge's name by gauge and certificate; from its second certificate on with a number."""
    names: dict[tuple[str, str], str] = {}
    count: dict[str, int] = {}
    for row in owners:
        key = (row["gauge"], row["certificate"])
        if key not in names:
            count[row["gauge"]] = count.get(row["gauge"], 0) + 1
            names[key] = row["gauge"] + (f" #{count[row['gauge']]}" if count[row["gauge"]] > 1 else "")
    return names


def _visit(row: Mapping[str, Any], names: Mapping[tuple[str, str], str]) -> Visit:
    own = row["owners"]
    day = own["measured_at"].timestamp() / 86400.0
    others = {kind: own[kind] or f"{UNKNOWN} {own['machine']}" for kind in ("type", "hall", "probe")}
    values = {name: row[name] for name in NAMES}
    for name in ("um", "count", "at_mm", "axis"):
        values[name] = np.array(values[name], float)
    values["at_mm"] = values["at_mm"].reshape(-1, 3)
    values["faces"] = np.array(values["faces"], np.int64)
    placed = PlacementStatistics(**values)
    return Visit(
        row["recording"],
        own["machine"],
        others["type"],
        others["hall"],
        names[own["gauge"], own["certificate"]],
        others["probe"],
        day,
        placed,
    )


def infer_store(store: str | Path, engine: Engine, progress: Progress | None = None) -> FleetInference:
    """The inference over a store; its ``left_out`` says why some recordings are not in it, a line each.

    Raises
    ------
    InputError
        no recording that can be used
    """
    fleet = Fleet(store)
    errors = work_out_statistics(fleet, engine, progress)
    visits, gauges = read_visits(fleet)
    if not visits:
        reason = errors[0] if errors else "no recordings"
        raise InputError(store, reason, expected="recordings that were added with their machine file")
    simulated = any(is_simulated(json.loads(row["comments"])) for row in fleet.index().to_pylist())
    return replace(infer(visits, gauges), left_out=tuple(errors), simulated=simulated)
