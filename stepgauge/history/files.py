"""The history as files for other programs: ``history.json`` and ``history.csv``."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from stepgauge import __version__
from stepgauge.files.json_types import json_types
from stepgauge.files.tables import csv_text, result_cell
from stepgauge.files.text import write_files
from stepgauge.history.entries import QUANTITIES, HistoryEntry
from stepgauge.history.series import FALSE_WARNINGS, Alert, Series
from stepgauge.history.trend import Trend


def write_history(
    folder: str | Path, series: Sequence[Series], warnings: Sequence[Alert], limits: Mapping[str, float]
) -> list[Path]:
    """Write both files into a folder (made if missing); returns their paths."""
    entries = _entries(series)
    document = _document(series, entries, warnings, limits)
    return write_files(folder, {"history.json": document, "history.csv": _csv(entries)})


def _entries(series: Sequence[Series]) -> list[HistoryEntry]:
    found = {(entry.path, entry.placement): entry for one in series for entry in one.entries}
    return sorted(found.values(), key=lambda entry: (entry.measured_at, entry.path, entry.placement))


def _document(
    series: Sequence[Series], entries: list[HistoryEntry], warnings: Sequence[Alert], limits: Mapping[str, float]
) -> dict[str, Any]:
    return {
        "format": "stepgauge history 1",
        "stepgauge": __version__,
        "machine": entries[0].machine,
        "gauges": sorted({entry.gauge_serial for entry in entries}),
        "limits": dict(limits),
        "false_warnings": FALSE_WARNINGS,
        "trends_tested": sum(one.drift is not None for one in series),
        "values_tested": sum(one.charted for one in series),
        "simulated": any(entry.simulated for entry in entries),
        "entries": [json_types(dataclasses.asdict(entry)) for entry in entries],
        "series": [
            json_types(
                {
                    "quantity": one.quantity,
                    "unit": QUANTITIES[one.quantity].unit,
                    "direction": one.direction,
                    "values": one.value.tolist(),
                    "u": one.u.tolist(),
                    "trend": _trend(one.trend),
                    "of_scale": one.of_scale.tolist(),
                    "drift": _trend(one.drift),
                    "control_low": one.low.tolist(),
                    "control_high": one.high.tolist(),
                }
            )
            for one in series
        ],
        "warnings": [json_types(dataclasses.asdict(warning)) for warning in warnings],
    }


def _trend(trend: Trend | None) -> dict[str, Any] | None:
    return None if trend is None else dataclasses.asdict(trend)


def _csv(entries: list[HistoryEntry]) -> str:
    names = [field.name for field in dataclasses.fields(HistoryEntry)]
    rows = [json_types(dataclasses.asdict(entry)) for entry in entries]
    return csv_text(names, [[result_cell(row[name]) for name in names] for row in rows])
