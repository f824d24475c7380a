"""Recordings of other people's instruments, from the table as it was published to the diagnosis."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.cli.conftest import Run
from tests.diagnosis.test_field import FIELD

pytestmark = pytest.mark.skipif(FIELD is None, reason="the tables of other people's instruments are not here")
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
