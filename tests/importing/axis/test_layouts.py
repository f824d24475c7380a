"""Tables of foreign make: every reading arrives with its target, direction, cycle and unit, in one command."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from stepgauge.axis.recording import AxisRecording, read_axis_recording
from stepgauge.reports.sections import DATE_MISSING, recording_section
from tests.cli.conftest import Run
from tests.importing.axis.layouts import LAYOUTS, Layout, swept, travelled, truth

MOST_OPTIONS = 3


def imported(run: Run, folder: Path, layout: Layout) -> AxisRecording:
    path = folder / f"table{layout.suffix}"
    content = layout.content
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    result = run("import", path, "--sensor", layout.sensor, *layout.options, "-o", folder / "axis.csv")
    assert result.code == 0, result.err
    return read_axis_recording(folder / "axis.csv")


def sorted_deviations(frame: pd.DataFrame, deviation: np.ndarray) -> pd.DataFrame:
    table = frame[["target", "way", "cycle"]].assign(deviation=deviation)
    return table.sort_values(["target", "way", "cycle"]).reset_index(drop=True)


def test_there_are_enough_of_them() -> None:
    assert len({layout.name for layout in LAYOUTS}) >= 25
    assert all(len([o for o in layout.options if o.startswith("--")]) + 1 <= MOST_OPTIONS for layout in LAYOUTS)


@pytest.mark.parametrize("layout", LAYOUTS, ids=lambda layout: layout.name)
def test_every_reading_arrives(run: Run, tmp_path: Path, layout: Layout) -> None:
    back = imported(run, tmp_path, layout)
    assert (back.form, back.sensor) == ("axis", layout.sensor)
    assert (back.units.position, back.units.deviation) == (layout.unit, layout.deviation_unit)
    expected = truth()
    expected["target"] *= layout.factor
    of_file = {"mm": 1e-3}.get(layout.deviation_unit, 1.0)  # metres with readings in metres: told in mm
    expected = sorted_deviations(expected, expected["deviation"].to_numpy() * of_file)
    found = sorted_deviations(back.frame, back.deviation)
    np.testing.assert_allclose(found["target"], expected["target"], atol=1e-9)
    assert found[["way", "cycle"]].to_numpy().tolist() == expected[["way", "cycle"]].to_numpy().tolist()
    np.testing.assert_allclose(found["deviation"], expected["deviation"], atol=2e-3 * of_file)
    assert back.covariates == list(layout.covariates)


@pytest.mark.parametrize("name", ["date and time in every row", "date and time of day in two columns"])
def test_the_date_is_kept(run: Run, tmp_path: Path, name: str) -> None:
    (layout,) = (one for one in LAYOUTS if one.name == name)
    comments = imported(run, tmp_path, layout).comments
    assert comments["measured_at"] == "2026-03-02T10:01:00"
    section = recording_section({"recording": "axis.csv", "comments": comments})
    assert DATE_MISSING not in section.missing


def test_sweeps_below_one_another_are_in_the_order_of_travel(run: Run, tmp_path: Path) -> None:
    """There and back in every sweep, before the next one."""
    frame = imported(run, tmp_path, Layout("swept", swept(counted=True))).frame
    assert list(frame[["target", "way", "cycle"]].itertuples(index=False, name=None)) == travelled()
