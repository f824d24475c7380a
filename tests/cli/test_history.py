"""``stepgauge history`` as a user runs it."""

from __future__ import annotations

import csv
import json
import sqlite3
from pathlib import Path

import pytest

from tests.cli.conftest import Run
from tests.test_history import write

DATES = ("2024-01-01", "2024-04-01", "2024-07-01", "2024-10-01", "2025-01-01", "2025-04-01")


@pytest.fixture
def archive(tmp_path: Path) -> Path:
    """Six dates of a machine whose x scale grows."""
    for number, date in enumerate(DATES):
        ppm = 2.0 * number
        write(
            tmp_path / "archive" / date / "x",
            error_um=lambda x, ppm=ppm: ppm * 1e-3 * x,
            noise_um=0.1,
            cycles=3,
            seed=number,
        )
    return tmp_path / "archive"


def test_table_trend_warnings_and_files(run: Run, tmp_path: Path, archive: Path) -> None:
    result = run("history", archive, "-o", tmp_path / "h", "--limit", "scale_ppm=7", "--figure", "svg")
    assert result.code == 0, result.err
    assert all(date in result.out for date in DATES)
    assert "drift" in result.out
    assert "2025-04-01, along x: scale_ppm drifts by +" in result.out
    assert "2025-01-01, along x: scale_ppm 8" in result.out or "2025-01-01, along x: scale_ppm 7" in result.out
    assert "beyond the limit 7 um/m" in result.out
    data = json.loads((tmp_path / "h" / "history.json").read_text())
    scale = next(one for one in data["series"] if one["quantity"] == "scale_ppm")
    assert scale["trend"]["per_year"] == pytest.approx(8.0, abs=0.5)
    with (tmp_path / "h" / "history.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["measured_at"][:10] for row in rows] == list(DATES)
    assert [float(row["scale_ppm"]) for row in rows] == pytest.approx(scale["values"], rel=1e-6)
    with sqlite3.connect(tmp_path / "h" / "history.sqlite") as connection:
        assert connection.execute("SELECT count(*) FROM entry").fetchone() == (6,)
    connection.close()
    assert (tmp_path / "h" / "history.svg").read_text().startswith("<?xml")
    again = run("history", archive, "-o", tmp_path / "h", "--limit", "scale_ppm=7", "--figure", "svg")
    assert again.out == result.out
    assert "0 files read, 6 unchanged" in again.err


def test_several_machines_need_a_choice(run: Run, tmp_path: Path, archive: Path) -> None:
    write(archive / "2025-06-01", machine="Mill")
    result = run("history", archive, "-o", tmp_path / "h")
    assert result.code == 2
    assert "evaluations of several machines; found CMM, Mill; expected one: --machine-name" in result.err
    assert run("history", archive, "-o", tmp_path / "h", "--machine-name", "Mill").code == 0
    result = run("history", archive, "-o", tmp_path / "h", "--machine-name", "Lathe")
    assert "no evaluation of machine 'Lathe'; expected CMM, Mill" in result.err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--limit", "reversal=2"], "found 'reversal=2'; expected NAME=NUMBER with NAME one of scale_ppm"),
        (["--limit", "scale_ppm=nan"], "found 'scale_ppm=nan'"),
        (["--limit", "scale_ppm"], "found 'scale_ppm'"),
        (["--gauge-serial", "none"], "no evaluation of gauge 'none'; expected T-1"),
    ],
)
def test_wrong_input_is_one_line(run: Run, tmp_path: Path, archive: Path, arguments: list[str], message: str) -> None:
    result = run("history", archive, "-o", tmp_path / "h", *arguments)
    assert result.code == 2
    assert message in result.err
    assert "Traceback" not in result.err
    assert not (tmp_path / "h" / "history.json").exists()


def test_folders_without_evaluations(run: Run, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    assert "no evaluation.json in this folder" in run("history", tmp_path / "empty", "-o", tmp_path / "h").err
    assert "no such folder" in run("history", tmp_path / "none", "-o", tmp_path / "h").err
    write(tmp_path / "undated")
    result = run("history", tmp_path / "undated", "-o", tmp_path / "h")
    assert result.code == 2
    assert "nothing says when this was measured" in result.err
    assert run("history", tmp_path / "undated", "-o", tmp_path / "h", "--date-from", "file").code == 0


def test_evaluate_writes_the_date_that_history_reads(run: Run, files: Path) -> None:
    line = ("evaluate", files / "recording.csv", "-g", "step-gauge-420", "-o", files / "r")
    assert run(*line, "--measured-at", "2026-03-05", "--machine-name", "Mine").code == 0
    data = json.loads((files / "r" / "evaluation.json").read_text())
    assert (data["measured_at"], data["machine"]) == ("2026-03-05", "Mine")
    result = run("history", files, "-o", files / "h")
    assert "2026-03-05" in result.out
    wrong = run(*line, "--measured-at", "5.3.2026")
    assert wrong.code == 2
    assert "measured_at is no date; found '5.3.2026'" in wrong.err
