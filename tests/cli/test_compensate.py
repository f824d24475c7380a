"""``stepgauge compensate`` as a user runs it, with the proof on the virtual CMM."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from stepgauge.cli import main
from stepgauge.compensation import FORMATS as KNOWN
from stepgauge.files.text import write_json
from stepgauge.recording import read_recording, write_recording
from stepgauge.verbs.compensate import FORMATS, UNCONFIRMED
from tests.cli.conftest import Result, Run
from tests.conftest import ROOT
from tests.drawn import text_of

EXAMPLE = ROOT / "examples" / "compensation"
GAUGE = ("-g", "step-gauge-420")


def measure(run: Run, folder: Path, name: str, machine: Path, placement: str, blocks: str, seed: int) -> dict:
    """Plan, simulate, evaluate: the placement's part of evaluation.json."""
    common = (*GAUGE, "-m", machine)
    program, recording = folder / f"{name}.dmi", folder / f"{name}.csv"
    where = EXAMPLE / placement
    for line in (
        ("plan", where, *common, "-d", "dmis", "--blocks", blocks, "--cycles", 5, "-o", program),
        ("simulate", program, *common, "-p", where, "--seed", seed, "-o", recording),
        ("evaluate", recording, *GAUGE, "-o", folder / name),
    ):
        result = run(*line)
        assert result.code == 0, result.err
    return json.loads((folder / name / "evaluation.json").read_text())["placements"][0]


def mean_um(placement: dict) -> np.ndarray:
    return np.array([row["xm_um"] for row in placement["faces"] if row["xm_um"] is not None])


def plain_run(*arguments: object) -> Result:
    """A command that must go well, without what it said."""
    main([str(argument) for argument in arguments])
    return Result(0, "", "")


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The measurement before, made once."""
    folder = tmp_path_factory.mktemp("first")
    measure(plain_run, folder, "before", EXAMPLE / "machine.toml", "placement.toml", "1:21", 1)
    return folder


@pytest.fixture
def before(first: Path, tmp_path: Path) -> dict:
    """A copy of it in the folder of the test."""
    shutil.copytree(first, tmp_path, dirs_exist_ok=True)
    return json.loads((tmp_path / "before" / "evaluation.json").read_text())["placements"][0]


def test_measured_again_with_the_table_applied_xm_is_noise(run: Run, tmp_path: Path, before: dict) -> None:
    """The faces of the check lie between those of the table; 0.3 um of noise by probing, five cycles, in both runs."""
    table = tmp_path / "x.csv"
    result = run("compensate", tmp_path / "before", "--axis", "x", "--to", "csv", "--tip-radius", 1.997, "-o", table)
    assert result.code == 0, result.err
    effect = '\n[[effect]]\nkind = "axis_compensation"\naxis = "x"\nfile = "x.csv"\n'
    corrected = tmp_path / "corrected.toml"
    corrected.write_text((EXAMPLE / "machine.toml").read_text() + effect)
    after = measure(run, tmp_path, "after", corrected, "check.toml", "1:20", 2)
    assert np.ptp(mean_um(before)) > 15.0
    noise_um = 0.3 / np.sqrt(5) * np.sqrt(2)  # of a face's mean, in the table and in the check
    chord_um = 20.0**2 / 8 * 3.0 * (2 * np.pi / 180.0) ** 2  # straight lines in the wave between fronts
    assert np.abs(mean_um(after) - mean_um(after).mean()).max() < 3.0 * noise_um + chord_um
    assert np.ptp(mean_um(after)) < np.ptp(mean_um(before)) / 15
    assert abs(after["r_eff_mm"] - 1.997) < 3e-4 < abs(before["r_eff_mm"] - 1.997)


def test_the_figure_says_that_no_machine_was_measured(run: Run, tmp_path: Path, before: dict) -> None:
    line = ("compensate", tmp_path / "before", "--axis", "x", "--to", "csv", "-o", tmp_path / "x.csv")
    assert run(*line, "--plot", tmp_path / "x.pdf").code == 0
    assert "no machine was measured" in text_of(tmp_path / "x.pdf")


def test_every_format_with_what_it_says(run: Run, tmp_path: Path, before: dict) -> None:
    assert {*FORMATS} == {*KNOWN, "klipper"}
    assert {*UNCONFIRMED} == {name for name, one in KNOWN.items() if one.convention.unconfirmed}
    for to, name, *asked in (
        ("linuxcnc", "x.comp"),
        ("siemens", "x.ini"),
        ("csv", "x.csv"),
        ("fanuc", "x.txt", "--unconfirmed-sense", "fanuc"),
        ("rrf", "x.g"),
    ):
        result = run(
            "compensate",
            tmp_path / "before" / "evaluation.json",
            "--axis",
            "x",
            "--to",
            to,
            *asked,
            "-o",
            tmp_path / name,
        )
        assert result.code == 0, result.err
        assert ("mean reversal is taken as 0" in result.err) == (to != "siemens"), "a mean has no reversal to hide"
        said = json.loads((tmp_path / f"{name}.json").read_text())
        assert said["controller"]["format"] == to
        assert f"{to} needs: {said['controller']['needs']}" in result.err
        assert said["about"]["gauge_serial"] == "SG-420-001"
        assert said["about"]["cycles"] == [5, 5]
        assert all(0 < row["u_positive_um"] < 1 for row in said["rows"][1:])
    assert "[JOINT_0]: COMP_FILE = x.comp, COMP_FILE_TYPE = 0" in run(
        "compensate", tmp_path / "before", "--axis", "x", "--to", "linuxcnc", "-o", tmp_path / "x.comp"
    ).err  # fmt: skip


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--axis", "x", "--plane", "xy"], "--axis for a table, or --plane for a skew"),
        (["--plane", "xy"], "no two placements along the diagonals of xy; found 1 placements in the plane"),
        (["--axis", "y"], "placement 1: 89.86 deg off y; expected at most 1 deg"),
        (["--axis", "x", "--range", "0,300"], "the range of the table is outside what was measured on x"),
        (["--axis", "x", "--range", "300,200"], "--range: must rise"),
        (["--axis", "x", "--zero-at", "0"], "the zero of the table is outside what was measured"),
        (["--axis", "x", "--u-tip-radius", "1"], "--tip-radius, which is missing"),
        (["--axis", "x", "--step", "0.0001"], "the table is too long"),
        (["--axis", "x", "--unconfirmed-sense", "fanuc"], "--unconfirmed-sense: the sense of csv is confirmed"),
        (["--axis", "x", "--to", "fanuc"], "expected --unconfirmed-sense fanuc, and a comparison at one position"),
        (["--axis", "x", "--to", "heidenhain", "--unconfirmed-sense", "fanuc"], "--unconfirmed-sense heidenhain, and"),
        (["--plane", "xy", "--to", "marlin", "--unconfirmed-sense", "fanuc"], "--unconfirmed-sense: is for a table"),
        (["--axis", "x", "--step", "1000"], "fewer than two rows"),
        (["--axis", "x", "--template", "none.j2"], "none.j2: no such file"),
        (["--axis", "x", "--plot", "x.jpg"], "--plot: not a name with such a suffix; found 'x.jpg'"),
    ],
)
def test_wrong_input_is_one_line_and_nothing_is_written(
    run: Run, tmp_path: Path, before: dict, arguments: list[str], message: str
) -> None:
    result = run("compensate", tmp_path / "before", "--to", "csv", "-o", tmp_path / "out" / "x.csv", *arguments)
    assert result.code == 2
    assert message in result.err
    assert len(result.err.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_no_evaluation_is_said(run: Run, tmp_path: Path) -> None:
    result = run("compensate", tmp_path, "--axis", "x", "--to", "csv", "-o", tmp_path / "x.csv")
    assert result.code == 2
    assert "evaluation.json: no such file" in result.err


def test_an_incomplete_evaluation_is_named(run: Run, tmp_path: Path, before: dict) -> None:
    path = tmp_path / "before" / "evaluation.json"
    data = json.loads(path.read_text())
    del data["placements"][0]["origin_mm"]
    write_json(path, data)
    result = run("compensate", path, "--axis", "x", "--to", "csv", "-o", tmp_path / "x.csv")
    assert result.code == 2
    assert "origin_mm" in result.err
    assert len(result.err.splitlines()) == 1


def test_an_older_evaluation_says_what_is_unknown(run: Run, tmp_path: Path, before: dict) -> None:
    path = tmp_path / "before" / "evaluation.json"
    data = json.loads(path.read_text())
    del data["gauge"]["expansion_uncertainty_per_K"]
    for row in data["placements"][0]["faces"]:
        del row["u_certificate_um"]
    write_json(path, data)
    result = run("compensate", path, "--axis", "x", "--to", "csv", "-o", tmp_path / "x.csv")
    assert result.code == 0
    assert "not in the stated uncertainty: the gauge's certificate" in result.err


def test_a_single_cycle_has_no_repeatability(run: Run, tmp_path: Path, before: dict) -> None:
    recording = read_recording(tmp_path / "before.csv")
    frame = recording.frame[recording.frame["cycle"] == 1]
    write_recording(tmp_path / "one.csv", type(recording)(frame, recording.comments))
    assert run("evaluate", tmp_path / "one.csv", *GAUGE, "-o", tmp_path / "one").code == 0
    result = run("compensate", tmp_path / "one", "--axis", "x", "--to", "csv", "-o", tmp_path / "x.csv")
    assert "not in the stated uncertainty: repeatability" in result.err
