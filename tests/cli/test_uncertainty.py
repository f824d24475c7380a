"""``stepgauge budget --method monte-carlo`` and ``stepgauge list effects`` as a user calls them."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from numpy.testing import assert_allclose

from stepgauge.cli import cli
from stepgauge.effects import Probings, Setting, along_approach_um, effect_kinds, make_effects
from stepgauge.effects.maps import AXIS_COLUMNS
from stepgauge.errors import InputError
from stepgauge.evaluation.evaluate import evaluate
from stepgauge.files.resources import find_data
from stepgauge.gauge.certified import Gauge, read_gauge
from stepgauge.gauge.placement import make_placement, write_placement
from stepgauge.machine.file import read_machine
from stepgauge.machine.virtual import probing_settings, run_program
from stepgauge.planning.plan import PlanOptions, make_program
from stepgauge.programs import DIALECTS
from stepgauge.programs.render import render
from stepgauge.recording import APPROACH, read_recording, write_recording
from tests.build import heed_interrupts


@pytest.fixture
def folder(gauge: Gauge, tmp_path: Path) -> Path:
    """A program, its placement, a machine with an uncertain scale, and a recording as CSV and as Parquet."""
    source = find_data("bridge-cmm", "machine", "machines").read_text(encoding="utf-8")
    effect = '[[effect]]\nkind = "scale_error"\naxis = "x"\nppm = { value = 2.5, u = 0.8 }\n'
    (tmp_path / "machine.toml").write_text(f"{source}\n{effect}", encoding="utf-8")
    machine = read_machine(tmp_path / "machine.toml")
    placement = make_placement([150, 100, 100], [550, 100, 100], 1, gauge.n_blocks)
    program = make_program(placement, gauge, PlanOptions(1, gauge.n_blocks), probing_settings(machine, 2.0))
    write_placement(tmp_path / "placement.toml", placement)
    (tmp_path / "gauge.ngc").write_text(render(program, DIALECTS["linuxcnc"]), encoding="utf-8")
    recording = run_program(program, machine, gauge, placement, 3).recording
    write_recording(tmp_path / "recording.csv", recording)
    write_recording(tmp_path / "recording.parquet", recording)
    return tmp_path


def command(folder: Path, source: str, *more: str) -> list[str]:
    known = ["-m", str(folder / "machine.toml"), "-g", "step-gauge-420"]
    return ["budget", str(folder / source), *known, "--method", "monte-carlo", "--runs", "300", *more]


def run(*arguments: str) -> str:
    result = CliRunner().invoke(cli, list(arguments), catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


def test_program_and_recording_give_json_csv_and_figure(folder: Path) -> None:
    run(*command(folder, "gauge.ngc", "-p", str(folder / "placement.toml"), "-o", str(folder / "a"), "--jobs", "1"))
    said = run(*command(folder, "recording.csv", "-o", str(folder / "b"), "--jobs", "1", "--figure", "svg"))
    assert re.search(r"R_eff 1\.99\d+ mm, u 0\.0001 mm", said)
    assert (folder / "a" / "uncertainty-1.png").stat().st_size > 10_000
    assert (folder / "b" / "uncertainty-1.svg").stat().st_size > 10_000
    report = json.loads((folder / "a" / "uncertainty.json").read_text())
    table = pd.read_csv(folder / "a" / "uncertainty.csv")
    assert report["runs"] == 300
    assert {i["name"] for i in report["inputs"]} >= {"effect[1].ppm", "certificate", "repeatability"}
    assert len(table) == len(report["quantities"])
    last = next(q for q in report["quantities"] if (q["quantity"], q["face"]) == ("xf_um", 41))
    assert_allclose(last["mean"], 1.0, atol=0.1)  # 2.5 um/m over 400 mm
    assert_allclose(last["contributions"]["effect[1].ppm"], 0.8 * 0.4, rtol=0.15)
    assert last["low_95"] < last["value"] < last["high_95"]


def test_parquet_and_csv_processes_give_the_same(folder: Path) -> None:
    run(*command(folder, "recording.csv", "-o", str(folder / "a"), "--jobs", "1"))
    run(*command(folder, "recording.parquet", "-o", str(folder / "b"), "--jobs", "2"))
    assert (folder / "a" / "uncertainty.csv").read_text() == (folder / "b" / "uncertainty.csv").read_text()


def test_of_few_runs_no_interval_is_told(folder: Path) -> None:
    """The 2.5 % quantile of fewer than 40 values is beyond the smallest."""
    done = stepgauge(*command(folder, "recording.csv", "-o", str(folder / "a"), "--jobs", "1", "--runs", "2"))
    assert done.returncode == 0, done.stderr
    assert "too few runs for an interval of 95 % (40 at least)" in done.stderr
    assert "95 % from" not in done.stderr


def test_a_program_without_placement_is_an_error(folder: Path) -> None:
    done = stepgauge(*command(folder, "gauge.ngc", "-o", str(folder / "a")))
    assert done.returncode == 2
    assert done.stderr.startswith("stepgauge: error: --placement: a program needs to know how the gauge lies")


def stepgauge(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "stepgauge", *arguments], capture_output=True, text=True, check=False, timeout=120
    )


@pytest.mark.skipif(os.name != "posix", reason="sends SIGINT to a process")
def test_an_interrupted_command_goes_on_when_it_is_repeated(folder: Path) -> None:
    arguments = [sys.executable, "-m", "stepgauge", *command(folder, "recording.csv", "--jobs", "2", "--runs", "6000")]
    process = subprocess.Popen(
        [*arguments, "-o", str(folder / "a")], stderr=subprocess.PIPE, text=True, preexec_fn=heed_interrupts
    )
    done = folder / "a" / ".uncertainty-runs" / "blocks.sha256"
    waited_until = time.monotonic() + 60
    while not (done.exists() and any(done.read_bytes())) and time.monotonic() < waited_until:
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in said
    kept = [any(done.read_bytes()[at : at + 32]) for at in range(0, len(done.read_bytes()), 32)]
    assert 0 < sum(kept) < len(kept)
    for name in ("a", "b"):
        run(*command(folder, "recording.csv", "--jobs", "1", "--runs", "6000", "-o", str(folder / name)))
    assert (folder / "a" / "uncertainty.csv").read_text() == (folder / "b" / "uncertainty.csv").read_text()
    assert not done.exists()


def test_parquet_keeps_comments_and_numbers(folder: Path, gauge: Gauge) -> None:
    one, other = read_recording(folder / "recording.csv"), read_recording(folder / "recording.parquet")
    assert dict(one.comments) == dict(other.comments)
    pd.testing.assert_frame_equal(one.frame, other.frame, check_exact=False, atol=1e-12, rtol=0)
    assert evaluate(other, gauge).results[0].band_um == pytest.approx(evaluate(one, gauge).results[0].band_um)


def test_parquet_without_pyarrow_says_what_to_install(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(InputError, match=r"Parquet needs pyarrow; expected pip install 'stepgauge\[parquet\]'"):
        read_recording(folder / "recording.parquet")


@pytest.mark.parametrize("content", [b"", b"PAR1 and then nothing", b"cycle,face\n1,1\n"])
def test_what_only_calls_itself_parquet_is_an_error(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "r.parquet").write_bytes(content)
    with pytest.raises(InputError, match=r"r\.parquet: not a Parquet file"):
        read_recording(tmp_path / "r.parquet")


def test_a_value_out_of_place_in_parquet_is_named_by_its_row(folder: Path) -> None:
    frame = pd.read_parquet(folder / "recording.parquet")
    frame.loc[4, "x_mm"] = float("nan")
    frame.to_parquet(folder / "bad.parquet")
    with pytest.raises(InputError, match=r"bad\.parquet:5: column x_mm is not a finite number; found nothing"):
        read_recording(folder / "bad.parquet")


def test_effects_lists_the_vocabulary_and_explains_each_with_an_example_that_works(tmp_path: Path) -> None:
    tables = {"error_map": "coordinate_mm,error\n0,0\n700,1\n"}
    tables["axis_compensation"] = ",".join(AXIS_COLUMNS) + "\n0,0,0,0,0\n700,1,1,0,0\n"
    listed = run("list", "effects")
    for kind, effect in effect_kinds(every=True).items():
        assert f"\n{kind} " in f"\n{listed}"
        said = run("list", "effects", kind)
        assert effect.equation in said
        for parameter in effect.parameters():
            assert re.search(rf"\n  {parameter.name} +\S.*{re.escape(parameter.unit)}", said)
        example = tomllib.loads(said[said.index("[[effect]]") :])["effect"]
        (tmp_path / "map.csv").write_text(tables.get(kind, ""))
        (made,) = make_effects(example, tmp_path / "machine.toml")
        assert made.kind == kind


def test_what_a_formula_may_name_is_listed_and_understood() -> None:
    said = run("list", "effects", "empirical")
    listed = re.findall(r"^  (\w+) {2,}\S", said[said.index("A formula knows") : said.index("and + -")], re.MULTILINE)
    assert {"rest_s", "rested_N", "touches_N", "way"} <= set(listed)
    frame = pd.DataFrame({"face": [1, 2, 1], "time_s": [0.0, 3.0, 9.0], "placement": 1, "cycle": 1})
    frame[APPROACH] = [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
    seen = Probings(frame, Setting.of(read_machine("bridge-cmm"), read_gauge("step-gauge-420")))
    for name in listed:
        (effect,) = make_effects(
            [{"kind": "empirical", "formula": name.replace("_N", "_5").replace("COLUMN", "time_s")}], "machine.toml"
        )
        assert np.isfinite(along_approach_um(effect, seen)).all()


def test_an_unknown_effect_is_an_error_with_the_known_ones() -> None:
    done = stepgauge("list", "effects", "gremlins")
    assert done.returncode == 2
    assert "gremlins: no such effect; expected angular_error" in done.stderr


def test_errors_of_the_geometry_together_are_explained_as_effects_are() -> None:
    said = run("list", "effects", "geometric_errors")
    assert "straightness" in said
    assert "from 4 placements on" in said
    assert "prior odds: 1 to 200" in said


def test_what_a_diagnosis_can_leave_out_stands_with_the_effects() -> None:
    from stepgauge.diagnosis.laws.geometry import KIND

    assert f"\n{KIND}: " in run("list", "effects")
