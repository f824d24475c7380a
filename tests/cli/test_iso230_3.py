"""``stepgauge test iso230-3`` as a user runs it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from pypdf import PdfReader

from tests.cli.conftest import Run

TABLE = "# machine: Mill\ntime_s,x1_um,room_C\n0,0,20\n1800,2,20.5\n3600,3,21\n9000,3.1,21\n"


@pytest.fixture
def table(tmp_path: Path) -> Path:
    path = tmp_path / "sensors.csv"
    path.write_text(TABLE)
    return path


def test_tolerances_are_decided_and_printed(run: Run, table: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    sure = ("--tolerance", "x1=4", "--expanded-uncertainty", 0.2)
    result = run("test", "iso230-3", table, "--test", "etve", *sure, "--operator", "Op", "-o", out)
    assert result.code == 0, result.err
    data = json.loads((out / "iso230-3.json").read_text())
    assert data["channels"][0]["range_um"] == pytest.approx(3.1)
    assert data["outcomes"] == {"x1": "conforms"}
    assert sorted(path.name for path in out.iterdir()) == [
        "iso230-3-figure.png", "iso230-3.csv", "iso230-3.json", "iso230-3.pdf",
    ]  # fmt: skip
    text = " ".join("\n".join(page.extract_text() for page in PdfReader(out / "iso230-3.pdf").pages).split())
    for words in ("Op", "Mill", "ETVE", "The parameters conform", "Decision rule", "unconfirmed", "24 h at least"):
        assert words in text


@pytest.mark.parametrize(
    ("text", "more", "words"),
    [
        (TABLE, ("--test", "etve", "-g", "step-gauge-420"), ["--test axis"]),
        (TABLE, ("--test", "etve", "--tolerance", "y=3"), ["--tolerance", "x1"]),
        (TABLE.replace("x1_um", "x1_C"), ("--test", "etve"), ["no displacement"]),
        (TABLE.replace("room_C", "y1_mm"), ("--test", "etve"), ["neither displacement nor temperature; found y1_mm"]),
        (TABLE.replace("room_C", "x1_um"), ("--test", "axis"), ["sensors.csv:2: column x1_um is there twice"]),
        (TABLE.replace("3600", "1800"), ("--test", "axis"), ["does not rise"]),
        (TABLE.replace("3.1", "much"), ("--test", "axis"), ["sensors.csv:6", "x1_um"]),
        ("time_s,x1_um\n", ("--test", "axis"), ["no rows"]),
        (TABLE, ("--test", "axis", "-g", "step-gauge-420"), ["sensors.csv"]),
    ],
)
def test_wrong_input(run: Run, table: Path, tmp_path: Path, text: str, more: tuple, words: list[str]) -> None:
    table.write_text(text)
    result = run("test", "iso230-3", table, *more, "-o", tmp_path / "out")
    assert result.code == 2
    for word in words:
        assert word in result.err
    assert not (tmp_path / "out").exists()
