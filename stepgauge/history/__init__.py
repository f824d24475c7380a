"""Many evaluations of one machine: values by date, trends, limits, and a store for queries."""

from __future__ import annotations

from stepgauge.history.entries import QUANTITIES, HistoryEntry, read_entries, select_machine
from stepgauge.history.result import write_history
from stepgauge.history.series import Alert, Series, false_warning_words, judge, make_series
from stepgauge.history.store import Refreshed, refresh_store

__all__ = [
    "QUANTITIES",
    "Alert",
    "HistoryEntry",
    "Refreshed",
    "Series",
    "false_warning_words",
    "judge",
    "make_series",
    "read_entries",
    "refresh_store",
    "select_machine",
    "write_history",
]
