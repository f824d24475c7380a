"""``stepgauge probe bench``: known pushes come out, wrong recordings are named."""

import json

import numpy as np
import pytest

from stepgauge.errors import InputError
from tests.cli.conftest import invoke

from .probe_files import bench_series

TRUTH_UM = {0.0: 3.0, 90.0: 3.2, 180.0: 3.6, 270.0: 3.2}
STEP_UM = 0.025  # rod travel between two samples


def run(*arguments):
    return invoke("probe bench", *arguments)


@pytest.fixture
def series(tmp_path):
    return bench_series(tmp_path / "series.csv", TRUTH_UM)


@pytest.mark.parametrize("contact_from", ["signal", "tip"])
def test_pretravel_hysteresis_and_anisotropy(series, tmp_path, contact_from):
    out = tmp_path / "bench.csv"
    result = run(series, "--contact-from", contact_from, "-o", out, "--plot", tmp_path / "b.png")
    assert result.exit_code == 0, result.output
    summary = json.loads((tmp_path / "bench.json").read_text())
    for direction in summary["directions"]:
        assert direction["count"] == 3
        assert direction["pretravel_um"] == pytest.approx(TRUTH_UM[direction["direction_deg"]], abs=0.06)
        assert direction["hysteresis_um"] == pytest.approx(0.15, abs=STEP_UM)
    assert summary["anisotropy"]["pretravel_um"] == pytest.approx(0.6, abs=0.08)
    assert len(out.read_text().splitlines()) == 1 + 12
    assert (tmp_path / "b.png").stat().st_size > 10_000


def test_uncertainty_uses_the_repeatability_found(series, tmp_path):
    run(series, "-o", tmp_path / "bench.csv", "-k", 1)
    summary = json.loads((tmp_path / "bench.json").read_text())
    pooled = np.sqrt(np.mean([d["pretravel_std_um"] ** 2 for d in summary["directions"]]))
    # Rows 1 to 4 of Ren's Table 2 stay: 0.034, 0.030, 0.030, 0.020 um.
    expected = np.sqrt(0.034**2 + 2 * 0.030**2 + 0.020**2 + pooled**2)
    assert summary["uncertainty"]["fixed_um"] == pytest.approx(expected)
    assert summary["uncertainty"]["expanded_um"] == pytest.approx(expected, rel=1e-3)


def test_single_pushes_keep_the_budget_of_the_paper(tmp_path):
    run(bench_series(tmp_path / "s.csv", TRUTH_UM, repeats=1), "-o", tmp_path / "bench.csv")
    uncertainty = json.loads((tmp_path / "bench.json").read_text())["uncertainty"]
    assert uncertainty["fixed_um"] == pytest.approx(0.0999, abs=5e-5)
    assert "single push" in uncertainty["repeatability"]


@pytest.mark.parametrize(
    ("change", "parts"),
    [
        (lambda t: t.replace("contact,", "touch,"), ["series.csv:2", "column contact is missing"]),
        (lambda t: t.replace(",1,1\n", ",0.5,1\n", 1), ["series.csv:3", "signal contact", "0 or 1"]),
        (lambda t: t.replace(",0\n", ",1\n"), ["push 1 in direction 0 deg", "trigger signal does not fall"]),
        (lambda t: t.replace("0.0,1,0.00050,", "0.0,1,-1.0,", 1), ["series.csv:4", "time_s does not grow"]),
    ],
)
def test_wrong_recordings_are_named(series, tmp_path, change, parts):
    series.write_text(change(series.read_text()))
    result = run(series, "-o", tmp_path / "bench.csv")
    assert isinstance(result.exception, InputError), result.output
    for part in parts:
        assert part in str(result.exception)
    assert not (tmp_path / "bench.csv").exists()


@pytest.mark.parametrize(
    ("options", "part"),
    [(["-k", 0], "--coverage-factor"), (["-o", "b.json"], "output: this name is that of the summary")],
)
def test_impossible_options_are_named(series, tmp_path, options, part):
    result = run(series, "-o", tmp_path / "b.csv", *options)
    assert result.exit_code != 0
    assert part in (result.output + str(result.exception))
