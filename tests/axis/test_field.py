"""Recordings of other people's instruments, from the table as it was published to the diagnosis."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.cli.conftest import Run
from tests.diagnosis.test_field import FIELD

pytestmark = pytest.mark.skipif(FIELD is None, reason="the tables of other people's instruments are not here")
HEIGHTS = "edm-baseline-heights.csv"
TABLES = {
    "z-probe-warm-up.csv": ["--sensor", "inductive"],
    "edm-baseline-distances.csv": ["--sensor", "edm", "--unit", "m"],
}


@pytest.mark.parametrize("name", TABLES)
def test_a_field_table_is_imported_in_one_command_and_given_no_law_of_its_scale(
    run: Run, tmp_path: Path, name: str
) -> None:
    assert FIELD is not None
    recording = tmp_path / "axis.csv"
    assert run("import", FIELD / name, *TABLES[name], "-o", recording).code == 0
    assert run("diagnose", recording, "-o", tmp_path / "out").code == 0
    said = json.loads((tmp_path / "out/diagnosis.json").read_text())
    assert said["verdict"] == "unknown"
    assert {effect["kind"] for effect in said["effects"]} <= {"noise_growth"}
    assert said["axis"]["covariates"]


def test_with_the_heights_of_the_pillars_nothing_is_left_of_the_distances(run: Run, tmp_path: Path) -> None:
    """The offset of 2.4 mm of the slope distances is gone: below a tenth of a millimetre, if one is told at all."""
    assert FIELD is not None
    recording, log = tmp_path / "axis.csv", FIELD / "edm-baseline-distances.csv"
    done = run("import", log, *TABLES[log.name], "--heights", FIELD / HEIGHTS, "-o", recording)
    assert done.code == 0, done.err
    assert "horizontal" in done.err
    assert run("diagnose", recording, "-o", tmp_path / "out").code == 0
    said = json.loads((tmp_path / "out/diagnosis.json").read_text())
    constants = [one["parameters"]["um"]["value"] for one in said["effects"] if one["kind"] == "effective_radius"]
    assert all(abs(value) < 0.1 for value in constants)
    assert said["fit"]["rms_after_mm"] < 0.5
