"""The examples of ISO 10360-2, ISO 230-2 and the figures: they run, and what they publish is current."""

from __future__ import annotations

import csv
import importlib.util
import json
from pathlib import Path

import numpy as np
import pytest

from stepgauge.evaluation.evaluate import evaluate
from stepgauge.gauge.certified import read_gauge
from stepgauge.recording import join_recordings, read_recording
from tests.conftest import ROOT


def run_example(name: str, folder: Path) -> Path:
    """Run an example's script into a folder."""
    spec = importlib.util.spec_from_file_location(f"{name}_example", ROOT / "examples" / name / "run.py")
    assert spec is not None
    assert spec.loader is not None
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    example.main(folder)
    return folder


def published_is_current(found: Path, published: Path) -> None:
    """The same cells; numbers to the last digits that another platform may round otherwise."""
    rows = [list(csv.reader(path.read_text().splitlines())) for path in (found, published)]
    assert len(rows[0]) == len(rows[1])
    for line, expected in zip(*rows, strict=True):
        for cell, other in zip(line, expected, strict=True):
            try:
                assert float(cell) == pytest.approx(float(other), rel=1e-3, abs=1e-3)
            except ValueError:
                assert cell == other


def test_iso10360(tmp_path: Path) -> None:
    folder = run_example("iso10360", tmp_path)
    published_is_current(folder / "iso10360.csv", ROOT / "examples/iso10360/expected/iso10360.csv")
    data = json.loads((folder / "iso10360.json").read_text())
    assert data["complete"]
    assert data["results"]["bidirectional"]["outcome"] == "conforms"
    longest = {one["position"]: one for one in data["lengths"] if one["nominal_mm"] == 1010.0}
    errors = {position: np.mean(one["errors_um"]) for position, one in longest.items()}
    assert errors[6] == pytest.approx(2.5e-3 * 1010.0, abs=0.4)  # the scale of y
    # squareness: 2 urad i j L lengthens two diagonals and shortens the others
    i, j, _ = np.abs(data["positions"][0]["axis"])
    assert (errors[2] + errors[4] - errors[1] - errors[3]) / 4.0 == pytest.approx(2e-3 * i * j * 1010.0, abs=0.2)


def test_iso230(tmp_path: Path) -> None:
    folder = run_example("iso230", tmp_path)
    published_is_current(folder / "iso230.csv", ROOT / "examples/iso230/expected/iso230.csv")
    (axis,) = json.loads((folder / "iso230.json").read_text())["axes"]
    assert axis["parameters_um"]["mean_B"] == pytest.approx(-2.4, abs=0.2)
    scatter = np.sqrt(np.mean([[t["s_up_um"] ** 2, t["s_down_um"] ** 2] for t in axis["targets"]]))
    assert scatter == pytest.approx(0.6, rel=0.15)


def test_iso10360_5(tmp_path: Path) -> None:
    folder = run_example("iso10360-5", tmp_path)
    published_is_current(folder / "five-styli/iso10360-5.csv", ROOT / "examples/iso10360-5/expected/iso10360-5.csv")
    one, five = (json.loads((folder / name / "iso10360-5.json").read_text()) for name in ("one-stylus", "five-styli"))
    assert [value["outcome"] for value in (*one["values"], *five["values"])] == ["conforms"] * 5


def test_iso230_3(tmp_path: Path) -> None:
    """The ranges of the closed forms: 2 x 1 K / sqrt(1 + (omega tau)^2) times um per K; 10 um of drift."""
    folder = run_example("iso230-3", tmp_path)
    for name in ("etve", "warm-up"):
        published_is_current(folder / name / "iso230-3.csv", ROOT / f"examples/iso230-3/expected/{name}.csv")
    etve, axis = (json.loads((folder / name / "iso230-3.json").read_text()) for name in ("etve", "warm-up"))
    structure_K = 2.0 / np.hypot(1.0, 2.0 * np.pi / 24.0 * 3.0)
    ranges = {one["channel"]: one["range_um"] for one in etve["channels"]}
    assert ranges["z"] == pytest.approx(6.0 * structure_K, abs=0.4)
    assert {one["channel"]: one["end_um"] for one in axis["channels"]}["P1 +"] == pytest.approx(10.0, abs=0.7)
    assert axis["complete"]


def test_three_placements_with_three_faults(tmp_path: Path) -> None:
    """Every figure of the README's table is drawn, and the errors are those of the faults that were put in."""
    folder = run_example("figures", tmp_path)
    drawn = {path.stem for path in folder.glob("*.png")}
    each = {f"{what}-placement-{n}" for what in ("error", "bidirectional", "repeatability") for n in (1, 2, 3)}
    assert drawn == each | {"arrows", "run"}
    gauge = read_gauge("step-gauge-420")
    recording = join_recordings([read_recording(folder / f"{name}.csv") for name in ("along-x", "along-y", "diagonal")])
    last = [one.xm_um[-2] for one in evaluate(recording, gauge).results]
    # 6 ppm of y, and 12 urad of x leaning along y: (6 j^2 + 12 i j) um/m over 400 mm, j = 0.714
    expected = [0.0, 2.4, 0.4 * (6.0 * 0.714**2 + 12.0 * 0.7 * 0.714)]
    np.testing.assert_allclose(last, expected, atol=0.8)
