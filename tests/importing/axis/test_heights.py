"""Slope distances and heights of stations: horizontal distances, by one option."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from stepgauge.axis.recording import read_axis_recording
from stepgauge.importing.axis.heights import read_heights
from tests.cli.conftest import Run

PLACES, HEIGHTS = np.array([0.0, 20.0, 90.0, 250.0]), np.array([10.3, 10.9, 9.2, 12.0])
INSTRUMENT_M, TARGET_M = 0.234, 0.241


def log(folder: Path) -> Path:
    """All pairs there and back, each twice: slopes to the digits of a float."""
    rows = ["from,to,height of instrument [m],height of target [mm],slope distance [m]"]
    for a in range(4):
        for b in range(4):
            rise = HEIGHTS[b] + TARGET_M - HEIGHTS[a] - INSTRUMENT_M
            slope = float(np.hypot(PLACES[b] - PLACES[a], rise))
            rows += [f"P{a},P{b},{INSTRUMENT_M},{TARGET_M * 1e3},{slope!r}"] * (2 if a != b else 0)
    path = folder / "log.csv"
    path.write_text("\n".join(rows) + "\n")
    return path


def heights(folder: Path, *more: str) -> Path:
    path = folder / "heights.csv"
    path.write_text(
        "\n".join(["station,height_m,u_m", *(f"P{n},{h},0.002" for n, h in enumerate(HEIGHTS)), *more]) + "\n"
    )
    return path


def test_slopes_become_horizontal_distances(run: Run, tmp_path: Path) -> None:
    """Exactly, with instrument and target above their stations, each in its own unit."""
    out = tmp_path / "d.csv"
    done = run("import", log(tmp_path), "--sensor", "edm", "--heights", heights(tmp_path), "-o", out)
    assert done.code == 0, done.err
    assert "slope distances to horizontal ones, heights of heights.csv" in done.err
    read = read_axis_recording(out)
    ends = [read.frame[name].str[1:].astype(int) for name in ("from_station", "to_station")]
    np.testing.assert_allclose(read.frame["reading"], np.abs(PLACES[ends[1]] - PLACES[ends[0]]), rtol=1e-11)
    assert "reduced" in read.comments


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ("P0,10\nP1,10\nP2,10\n", "station P3 has no height; found P0, P1, P2"),
        ("P0,10\nP0,11\n", "station P0 is there twice; found 10 and 11"),
        ("name,height\n", "no heights; expected rows of a station and its height"),
        (
            "P0,0\nP1,10300\nP2,0\nP3,0\n",
            "the heights differ by more than a distance; .* heights in m, as the distances",
        ),
    ],
)
def test_heights_that_do_not_fit_are_refused(run: Run, tmp_path: Path, table: str, words: str) -> None:
    (tmp_path / "h.csv").write_text(table)
    done = run("import", log(tmp_path), "--sensor", "edm", "--heights", tmp_path / "h.csv", "-o", tmp_path / "d.csv")
    assert done.code == 2
    assert re.search(words, done.err)
    assert not (tmp_path / "d.csv").exists()


def test_heights_are_for_distances(run: Run, tmp_path: Path) -> None:
    (tmp_path / "axis.csv").write_text("target_mm,reading_mm\n0,0.001\n50,50.002\n100,100.001\n")
    line = (
        "import",
        tmp_path / "axis.csv",
        "--sensor",
        "laser",
        "--heights",
        heights(tmp_path),
        "-o",
        tmp_path / "d.csv",
    )
    assert "--heights: needs distances between stations; found axis" in run(*line).err


def test_a_station_may_be_told_twice_where_its_height_is_the_same(tmp_path: Path) -> None:
    assert read_heights(heights(tmp_path, "P0,10.3,0.1"))["P0"] == 10.3
