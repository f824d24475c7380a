"""A drift test as files: ``iso230-3.json`` and ``iso230-3.csv`` (a row per channel)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from stepgauge import __version__
from stepgauge.files.tables import csv_text, result_cell
from stepgauge.files.text import write_files
from stepgauge.standards.drift import NAMES, STANDARD, UNCONFIRMED, Channel, DriftTest
from stepgauge.standards.drift_rules import rules_of

COLUMNS = ("channel", "range_um", "first_hour_um", "end_um", "last_hour_um")


def drift_to_dict(test: DriftTest) -> dict[str, Any]:
    """Everything the test says, as JSON types."""
    rules, requirement = rules_of(test), test.requirement
    return {
        "format": "stepgauge test iso230-3 1",
        "stepgauge": __version__,
        "standard": STANDARD,
        "test": test.kind,
        "name": NAMES[test.kind],
        "recording": test.drift.path,
        "comments": dict(test.drift.comments),
        "duration_s": test.duration_s,
        "readings": len(test.drift.time_s),
        "span_mm": test.drift.span_mm,
        "channels": [_channel(one) for one in test.channels],
        "settled": test.settled,
        "temperature_ranges_K": test.temperature_ranges_K,
        "tolerances_um": dict(requirement.tolerance_um),
        "expanded_uncertainty_um": requirement.expanded_um,
        "outcomes": requirement.outcomes(test.values_um),
        "decision": requirement.decision([("", test.values_um)]).to_dict(),
        "conditions": test.conditions.to_dicts(),
        "complete": all(rule.met for rule in rules),
        "rules": [rule.to_dict() for rule in rules],
        "unconfirmed": list(UNCONFIRMED[test.kind]),
    }


def _channel(one: Channel) -> dict[str, Any]:
    return {
        "channel": one.name,
        "range_um": one.range_um,
        "first_hour_um": one.first_hour_um,
        "end_um": one.end_um,
        "last_hour_um": one.last_hour_um,
    }


def drift_csv(test: DriftTest) -> str:
    """A row per channel."""
    return csv_text(COLUMNS, [[result_cell(_channel(one)[name]) for name in COLUMNS] for one in test.channels])


def write_drift(folder: str | Path, test: DriftTest) -> list[Path]:
    """Write both files into a folder (made if missing); returns their paths."""
    return write_files(folder, {"iso230-3.json": drift_to_dict(test), "iso230-3.csv": drift_csv(test)})
