"""A small part of ``benchmarks.attack.tables``: a layout with one thing changed gives its own numbers or none."""

from __future__ import annotations

from pathlib import Path

from benchmarks.attack.tables import run, table
from tests.importing.layouts import gauges, interferometers, reports, series
from tests.importing.layouts.judge import GAUGE

LOGS = [layout for layout in gauges.LAYOUTS if layout.kind == GAUGE]
TABLES = [*interferometers.LAYOUTS[:6], *reports.LAYOUTS[6:8], *series.LAYOUTS[-2:]]


def test_logs_with_a_line_lost_or_displaced(tmp_path: Path) -> None:
    done = run(20, 1, tmp_path, LOGS[:9])
    assert not [one for one in done if one.verdict == "wrong"], table(done)
    assert len({one.verdict for one in done}) == 2, "some are refused, some accepted"


def test_tables_with_a_column_or_a_cell_changed(tmp_path: Path) -> None:
    done = run(24, 2, tmp_path, TABLES)
    assert not [one for one in done if one.verdict == "wrong"], table(done)
    assert len({one.verdict for one in done}) == 2, "some are refused, some accepted"
    assert len({one.kind for one in done}) >= 7
