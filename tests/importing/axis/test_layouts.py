"""What a recording keeps beside the readings of a table: its date, and the order of travel."""

from __future__ import annotations

from pathlib import Path

import pytest

from stepgauge.axis.recording import AxisRecording, read_axis_recording
from stepgauge.reports.sections import DATE_MISSING, recording_section
from tests.cli.conftest import Run
from tests.importing.layouts.axes import LAYOUTS, swept, travelled, written
from tests.importing.layouts.judge import Layout


def imported(run: Run, folder: Path, layout: Layout) -> AxisRecording:
    path = folder / f"table{layout.suffix}"
    path.write_bytes(layout.data)
    result = run("import", path, "--sensor", layout.sensor, *layout.options, "-o", folder / "axis.csv")
    assert result.code == 0, result.err
    return read_axis_recording(folder / "axis.csv")


@pytest.mark.parametrize("name", ["date and time in every row", "date and time of day in two columns"])
def test_the_date_is_kept(run: Run, tmp_path: Path, name: str) -> None:
    (layout,) = (one for one in LAYOUTS if one.name == name)
    comments = imported(run, tmp_path, layout).comments
    assert comments["measured_at"] == "2026-03-02T10:01:00"
    section = recording_section({"recording": "axis.csv", "comments": comments})
    assert DATE_MISSING not in section.missing


def test_sweeps_below_one_another_are_in_the_order_of_travel(run: Run, tmp_path: Path) -> None:
    """There and back in every sweep, before the next one."""
    frame = imported(run, tmp_path, written("swept", swept(counted=True))).frame
    assert list(frame[["target", "way", "cycle"]].itertuples(index=False, name=None)) == travelled()
