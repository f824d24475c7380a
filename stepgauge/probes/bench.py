"""A session at a probe bench: its pushes evaluated, summarised by direction, and written as CSV and JSON."""

from __future__ import annotations

import dataclasses
import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stepgauge.errors import InputError, naming
from stepgauge.files.tables import csv_text
from stepgauge.files.text import write_json, write_text
from stepgauge.physics.bench import (
    Anisotropy,
    BenchStroke,
    ContactFrom,
    DirectionResult,
    Events,
    anisotropy,
    find_events,
    summarise,
)
from stepgauge.physics.probe_budget import add_repeatability
from stepgauge.probes.files import BenchSeries
from stepgauge.recording.simulated import SIMULATED_LINE

PUSH_COLUMNS = (
    *("direction_deg", "push", "r0_mm", "r1_mm", "r2_mm", "r3_mm"),
    *("pretravel_um", "hysteresis_um", "overtravel_um", "resolution_um"),
)


@dataclass(frozen=True)
class BenchSession:
    """The pushes with what happened in each, and the results by direction; ``simulated``: no probe was measured."""

    pushes: Sequence[BenchSeries]
    events: Sequence[Events]
    directions: Sequence[DirectionResult]
    anisotropy: Anisotropy
    simulated: bool = False


def evaluate_bench(pushes: Sequence[BenchSeries], contact_from: ContactFrom = "signal") -> BenchSession:
    """Find the events of every push and summarise them by direction.

    ``contact_from``: the contact signal, or the tip that leaves rest. :class:`InputError` names the push that has no
    such events.
    """
    events = [_events(push, contact_from) for push in pushes]
    groups: dict[float, list[Events]] = {}
    for push, found in zip(pushes, events, strict=True):
        groups.setdefault(push.direction_deg, []).append(found)
    results = [summarise(direction, group) for direction, group in sorted(groups.items())]
    simulated = any(push.simulated for push in pushes)
    return BenchSession(pushes, events, results, anisotropy(results), simulated)


def _events(series: BenchSeries, contact_from: ContactFrom) -> Events:
    channels = series.channels
    push = BenchStroke(
        channels["time_s"], channels["rod_mm"], channels["tip_mm"], channels["contact"] > 0.5, channels["trigger"] > 0.5
    )
    try:
        return find_events(push, contact_from)
    except ValueError as error:
        name = f"push {series.push} in direction {series.direction_deg:g} deg"
        raise InputError(series.where, f"{name}: {error}") from None


def write_bench(path: str | Path, session: BenchSession, coverage_factor: float = 2.0) -> list[Path]:
    """Write one row per push (CSV) and, under the same name, directions and budget (JSON); returns both paths.

    :class:`InputError` where the name of the table is that of the JSON file.
    """
    table = check_bench_output(path)
    rows = [_row(push, events) for push, events in zip(session.pushes, session.events, strict=True)]
    write_text(table, (SIMULATED_LINE if session.simulated else "") + csv_text(PUSH_COLUMNS, rows))
    summary = table.with_suffix(".json")
    write_json(summary, session_to_dict(session, coverage_factor))
    return [table, summary]


def check_bench_output(path: str | Path) -> Path:
    """The path of the table; :class:`InputError` where it is the name of the JSON file beside it."""
    if Path(path).suffix.lower() == ".json":
        raise InputError(
            naming("output"), "this name is that of the summary", found=path, expected="a name ending in .csv"
        )
    return Path(path)


def _row(push: BenchSeries, events: Events) -> list[object]:
    readings = [events.r0_mm, events.r1_mm, events.r2_mm, events.r3_mm]
    lengths = [events.pretravel_um, events.hysteresis_um, events.overtravel_um, events.resolution_um]
    return [push.direction_deg, push.push, *(round(r, 7) for r in readings), *(round(w, 4) for w in lengths)]


def session_to_dict(session: BenchSession, coverage_factor: float) -> dict[str, Any]:
    """Directions, anisotropy and uncertainty as JSON types."""
    return {
        "format": "stepgauge bench 1",
        "directions": [dataclasses.asdict(result) for result in session.directions],
        "anisotropy": dataclasses.asdict(session.anisotropy),
        "uncertainty": _uncertainty(session, coverage_factor),
        "simulated": session.simulated,
    }


def _uncertainty(session: BenchSession, coverage_factor: float) -> dict[str, Any]:
    """Ren's budget with the repeatabilities of this recording, for its mean pre-travel."""
    pooled = [result.pretravel_std_um for result in session.directions if result.pretravel_std_um is not None]
    std_um = statistics.fmean(std**2 for std in pooled) ** 0.5 if pooled else None
    budget = add_repeatability(std_um)
    length_m = 1e-3 * max(events.r2_mm for events in session.events)
    return {
        "coverage_factor": coverage_factor,
        "expanded_um": float(budget.expanded_um(length_m, coverage_factor)),
        "fixed_um": budget.fixed_um,
        "per_m_um": budget.per_m_um,
        "repeatability": "measured" if pooled else "Ren Table 2: a single push tells none",
        "components": [dataclasses.asdict(part) for part in budget.components],
    }
