"""Many evaluations of one machine: values by date, trends, limits, and a store for queries."""

from __future__ import annotations

from stepgauge.history.entries import QUANTITIES, HistoryEntry, of_one_machine, read_entries
from stepgauge.history.files import write_history
from stepgauge.history.store import Refreshed, refresh_store
from stepgauge.history.trend import Alert, Series, judge, make_series

__all__ = [
    "QUANTITIES",
    "Alert",
    "HistoryEntry",
    "Refreshed",
    "Series",
    "judge",
    "make_series",
    "of_one_machine",
    "read_entries",
    "refresh_store",
    "write_history",
]
