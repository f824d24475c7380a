"""Every verb of the loop: what it writes and says, and that bad input ends with one line and exit code 2."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from stepgauge.verbs.catalogue import VERBS
from tests.cli.conftest import Result, Run, again
from tests.conftest import ROOT

G = ("-g", "step-gauge-420")


def refused(result: Result) -> str:
    """The one line on stderr that names what is wrong; exit code 2, no traceback."""
    assert result.code == 2, result
    complaint = result.err.strip().splitlines()[-1]
    assert complaint.startswith("stepgauge: error: ")
    assert "Traceback" not in result.err
    return complaint


def test_help_lists_every_verb_and_each_verb_explains_itself(run: Run) -> None:
    everything = run("--help").out
    for verb in VERBS:
        assert verb in everything
        text = run(verb, "--help")
        assert text.code == 0
        assert "Usage: stepgauge" in text.out
        assert len(text.out.splitlines()) > 8, f"the help of {verb} teaches nothing"


@pytest.mark.parametrize("words", [(), ("help",), ("probe",), ("probe", "help"), ("dcc",), ("fleet",)])
def test_a_group_alone_prints_its_help(run: Run, words: tuple[str, ...]) -> None:
    group = [word for word in words if word != "help"]
    assert run(*words) == run(*group, "--help")
    assert run(*words).code == 0


def test_help_of_a_verb_is_its_help(run: Run) -> None:
    assert run("help", "evaluate") == run("evaluate", "--help")
    assert "Did you mean 'evaluate'?" in refused(run("help", "evaluat"))


def test_a_mistyped_verb_is_corrected(run: Run) -> None:
    complaint = refused(run("evaluat"))
    assert "No such command 'evaluat'" in complaint
    assert "Did you mean 'evaluate'? There are: init, status, web, demo, locate," in complaint
    assert "Did you mean 'web'?" in refused(run("page"))


def test_locate_writes_the_placement_and_says_how_the_gauge_lies(files: Path) -> None:
    placement = tomllib.loads((files / "placement.toml").read_text())
    assert placement["first_block"] == 1
    assert placement["last_block"] == 21
    assert placement["c1_mm"] == pytest.approx([352.0, 318.0, 214.0], abs=0.002)
    assert placement["angles"]["yaw_deg"] == pytest.approx(89.6, abs=1e-3)
    assert placement["angles"]["pitch_deg"] == pytest.approx(0.35, abs=1e-3)
    assert {"c1_um", "c2_um", "yaw_urad", "pitch_urad"} <= set(placement["uncertainty"])


def test_plan_takes_the_points_as_well_as_the_placement(run: Run, files: Path) -> None:
    for source in ("points.csv", "placement.toml"):
        out = files / f"from-{source}.ngc"
        result = run("plan", files / source, *G, "-m", files / "machine.toml", "-d", "linuxcnc", "-o", out)
        assert result.code == 0, result.err
        assert "210 points" in result.err
        assert "path checked: gauge, rail, travel" in result.err
    one, other = ((files / f"from-{source}.ngc").read_text() for source in ("points.csv", "placement.toml"))
    assert one.count("G38.2 ") == other.count("G38.2 ") == 210


def test_plan_without_a_machine_says_that_the_travel_is_unchecked(run: Run, files: Path) -> None:
    result = run("plan", files / "placement.toml", *G, "-d", "ippdme", "-o", files / "p.ipp")
    assert "travel limits NOT checked" in result.err
    assert b"\r\n" in (files / "p.ipp").read_bytes()


def test_plan_writes_nothing_that_cannot_be_read_back_unless_asked_by_name(run: Run, files: Path) -> None:
    mine, out = files / "mine.j2", files / "p.txt"
    mine.write_text("{% for p in points %}P {{ p.measure.tip.x | fixed(3) }}\n{% endfor %}")
    line = ("plan", files / "placement.toml", *G, "-d", "dmis", "--template", mine, "-o", out)
    complaint = refused(run(*line))
    assert "mine.j2" in complaint
    assert "cannot be read back" in complaint
    assert "--unchecked" in complaint
    assert not out.exists()
    result = run(*line, "--unchecked")
    assert result.code == 0
    assert "NOT CHECKED: " in result.err
    assert out.read_text().startswith("$$ NOT CHECKED: stepgauge did not read this text back\nP 351.9")
    mine.write_text("; {{ checked }}\n" + mine.read_text())
    assert run(*line, "--unchecked").code == 0
    assert out.read_text().startswith("; NOT CHECKED")
    shipped = (ROOT / "templates/programs/dmis.j2").read_text()
    mine.write_text(shipped.replace("{{ p.x | fixed(6) }}", "{{ (p.x + 1) | fixed(6) }}"))
    for more in ((), ("--unchecked",)):
        complaint = refused(run(*line, *more))
        assert "mine.j2" in complaint
        assert "another one than planned" in complaint
        assert "line 22: x = " in complaint
        assert "planned " in complaint


def test_simulate_knows_every_dialect_by_its_text(run: Run, files: Path) -> None:
    recordings = []
    for dialect in ("jinyoung", "dmis", "linuxcnc", "ippdme"):
        program, out = files / f"p-{dialect}", files / f"{dialect}.csv"
        run("plan", files / "placement.toml", *G, "-d", dialect, "--blocks", "1:3", "--cycles", 1, "-o", program)
        result = run(
            "simulate", program, *G, "-m", "bridge-cmm", "-p", files / "placement.toml", "-o", out, "--seed", 3
        )
        assert result.code == 0, result.err
        recordings.append([line.split(",")[3:6] for line in out.read_text().splitlines() if line[0].isdigit()])
    for other in recordings[1:]:
        for one_row, other_row in zip(recordings[0], other, strict=True):
            assert [float(v) for v in one_row] == pytest.approx([float(v) for v in other_row], abs=2e-3)


def test_simulate_keeps_what_was_recorded_before_a_stop(run: Run, files: Path) -> None:
    """The gauge really lies 2.6 mm farther along; the program's line is named."""
    true = (files / "placement.toml").read_text()
    moved = tomllib.loads(true)
    shifted = [
        [round(c + 2.6 * a, 6) for c, a in zip(moved[k], moved["axis"], strict=True)] for k in ("c1_mm", "c2_mm")
    ]
    (files / "true.toml").write_text(f"c1_mm = {shifted[0]}\nc2_mm = {shifted[1]}\nfirst_block = 1\nlast_block = 21\n")
    out = files / "stopped.csv"
    line = ("simulate", files / "program.dmi", *G, "-m", files / "machine.toml", "-p", files / "placement.toml")
    result = run(*line, "--true-placement", files / "true.toml", "-o", out)
    first = next(n for n, text in enumerate((files / "program.dmi").read_text().splitlines(), 1) if "PTMEAS" in text)
    complaint = refused(result)
    assert f"program.dmi:{first}:" in complaint
    assert "the face was not found" in complaint
    assert "# stopped: " in out.read_text()
    assert "0 of 16 points recorded" in result.err


def test_simulate_draws_the_path(run: Run, files: Path) -> None:
    line = ("simulate", files / "program.dmi", *G, "-m", files / "machine.toml", "-p", files / "placement.toml")
    result = run(*line, "-o", files / "r.csv", "--plot", files / "path.png", "--plot-html", files / "path.html")
    assert result.code == 0, result.err
    assert (files / "path.png").read_bytes().startswith(b"\x89PNG")
    html = (files / "path.html").read_text()
    assert "<script src=" not in html, "the page must work without a network"
    assert "plotly" in html.lower()


def test_evaluate_writes_json_and_csv(run: Run, files: Path) -> None:
    result = run("evaluate", files / "recording.csv", *G, "-o", files / "result")
    assert result.code == 0, result.err
    written = {"evaluation.json", "evaluation.csv"}
    assert {path.name for path in (files / "result").iterdir()} == written
    assert run("evaluate", files / "recording.csv", *G, "--figure", "svg", "-o", files / "drawn").code == 0
    assert {path.name for path in (files / "drawn").iterdir()} == written | {"error.svg"}
    data = json.loads((files / "result/evaluation.json").read_text())
    # pre-travel 3 um and half of 0.9 um backlash, which passes for pre-travel
    assert data["r_eff_mm"] == pytest.approx(2.0 - 0.003 - 0.00045, abs=0.0008)
    assert "R_eff 1.99" in result.err


def test_evaluate_takes_several_recordings_as_placements(run: Run, files: Path) -> None:
    recording = files / "recording.csv"
    result = run(
        "evaluate", recording, again(run, files), *G, "--r-eff-origin", "all", "--blocks", "1:3", "-o", files / "two"
    )
    assert result.code == 0, result.err
    data = json.loads((files / "two/evaluation.json").read_text())
    assert [one["placement"] for one in data["placements"]] == [1, 2]
    assert data["r_eff_origin"] == "all"
    assert data["blocks"] == [1, 3]
    # a relative error in both placements is the same; the mean of two equal radii has less uncertainty
    each = [one["u_r_eff_mm"] for one in data["placements"]]
    assert data["u_r_eff_mm"] == pytest.approx((each[0] ** 2 + each[1] ** 2) ** 0.5 / 2.0)


def test_the_report_is_printable(run: Run, files: Path) -> None:
    run("evaluate", files / "recording.csv", *G, "-o", files / "result")
    result = run("report", files / "result", *G, "-o", files / "report.pdf")
    assert result.code == 0, result.err
    assert (files / "report.pdf").read_bytes().startswith(b"%PDF")


def test_shipped_files_can_be_listed_printed_and_copied_but_not_over_others(run: Run, tmp_path: Path) -> None:
    listed = run("list", "files").out
    for name in ("step-gauge-420.toml", "bridge-cmm.toml", "dmis.j2"):
        assert name in listed
    assert run("list", "files", "dmis").out == (ROOT / "templates/programs/dmis.j2").read_text()
    assert run("list", "files", "step-gauge-600", "--copy-to", tmp_path).code == 0
    assert (tmp_path / "step-gauge-600.csv").exists()
    assert "exists already" in refused(run("list", "files", "step-gauge-600", "--copy-to", tmp_path))
    assert "no such shipped file" in refused(run("list", "files", "nothing"))
    result = run(
        "locate",
        ROOT / "examples/fig6-x-axis/points.csv",
        "-g",
        tmp_path / "step-gauge-600.toml",
        "-o",
        tmp_path / "p.toml",
    )
    assert result.code == 0, result.err


BAD = [
    (["locate", "none.csv", *G, "-o", "out"], ["none.csv", "no such file"]),
    (["locate", "points.csv", "-g", "no-gauge", "-o", "out"], ["no-gauge", "step-gauge-420"]),
    (["locate", "points.csv", *G, "--blocks", "5:9", "-o", "out"], ["points.csv", "not blocks 5 and 9"]),
    (["locate", "points.csv", *G, "--tip-radius", "3", "-o", "out"], ["points.csv", "3 mm stated", "1.997"]),
    (["locate", "points.csv", *G, "--repeatability", "-1", "-o", "out"], ["--repeatability", "-1"]),
    (["locate", "machine.toml", *G, "-o", "out"], ["machine.toml:"]),
    (["plan", "placement.toml", *G, "-d", "basic", "-o", "out"], ["basic"]),
    (
        ["plan", "placement.toml", "-g", "step-gauge-1020", "-d", "dmis", "-o", "out"],
        ["placement.toml", "another gauge", "SG-420-001", "SG-1020-001"],
    ),
    (["plan", "placement.toml", *G, "-d", "dmis", "--blocks", "9:3", "-o", "out"], ["--blocks", "9:3"]),
    (["plan", "placement.toml", *G, "-d", "dmis", "--home", "1,2", "-o", "out"], ["--home", "X,Y,Z"]),
    (["plan", "placement.toml", *G, "-d", "dmis", "--standoff", "7", "-o", "out"], ["tip ball", "block", "--standoff"]),
    (["plan", "placement.toml", *G, "-d", "dmis", "--cycles", "0", "-o", "out"], ["cycles"]),
    (
        ["plan", "placement.toml", *G, "-m", "machine.toml", "-d", "dmis", "--measuring-speed", "3000", "-o", "out"],
        ["--measuring-speed", "3000 mm/s", "0.01 to 12 mm/s", "max_measuring_speed_mm_s"],
    ),
    (
        ["plan", "placement.toml", *G, "-d", "dmis", "--measuring-speed", "1e-7", "-o", "out"],
        ["--measuring-speed", "1e-07"],
    ),
    (["plan", "placement.toml", *G, "-d", "dmis", "--unchecked", "-o", "out"], ["--unchecked", "--template"]),
    (["plan", "placement.toml", *G, "-d", "ippdme", "--tool", "a)b", "-o", "out"], ["--tool", "a)b"]),
    (["locate", "slip.csv", *G, "-o", "out"], ["slip.csv: point 1 is off by 9.000 mm", "near (345."]),
    (
        ["plan", "placement.toml", *G, "-m", "narrow.toml", "-d", "dmis", "-o", "out"],
        ["travel is too small by", "mm in x"],
    ),
    (
        ["plan", "placement.toml", *G, "-m", "machining-centre", "-d", "dmis", "-o", "out"],
        ["placement.toml", "another tip", "1.997", "3 mm"],
    ),
    (["plan", "placement.toml", *G, "-d", "dmis", "--margin", "nan", "-o", "out"], ["margin", "nan", "finite"]),
    (["plan", "points.csv", *G, "-m", "machining-centre", "-d", "dmis", "-o", "out"], ["points.csv", "tip radius"]),
    (
        ["simulate", "program.dmi", *G, "-m", "bridge-cmm", "-p", "placement.toml", "-o", "out", "--seed", "-1"],
        ["--seed", "-1"],
    ),
    (
        ["simulate", "program.dmi", *G, "-m", "bridge-cmm", "-p", "placement.toml", "-o", "out", "--plot", "p.xyz"],
        ["p.xyz", "png"],
    ),
    (
        ["simulate", "program.dmi", *G, "-m", "bridge-cmm", "-p", "placement.toml", "--gauge-temperature", "293"],
        ["--gauge-temperature", "293"],
    ),
    (["plan", "placement.toml", *G, "-d", "dmis", "--template", "none.j2", "-o", "out"], ["none.j2", "no such file"]),
    (["plan", "recording.csv", *G, "-d", "dmis", "-o", "out"], ["recording.csv:", "column"]),
    (
        ["simulate", "points.csv", *G, "-m", "bridge-cmm", "-p", "placement.toml", "-o", "out"],
        ["points.csv:1", "known dialect"],
    ),
    (
        ["simulate", "program.dmi", *G, "-m", "placement.toml", "-p", "placement.toml", "-o", "out"],
        ["placement.toml", "not known"],
    ),
    (["simulate", "program.dmi", *G, "-m", "bridge-cmm", "-p", "machine.toml", "-o", "out"], ["machine.toml", "key"]),
    (["evaluate", "points.csv", *G, "-o", "out"], ["points.csv:2", "'cycle' is missing"]),
    (["evaluate", "recording.csv", "-g", "step-gauge-600", "--blocks", "1:40", "-o", "out"], ["1 to 30"]),
    (
        ["evaluate", "recording.csv", "-g", "step-gauge-600", "-o", "out"],
        ["recording.csv", "another gauge", "SG-420-001"],
    ),
    (
        [
            "evaluate",
            "recording.csv",
            *G,
            "--placement",
            "placement.toml",
            "--placement",
            "placement.toml",
            "-o",
            "out",
        ],
        ["one placement file per placement"],
    ),
    (["probe", "qualify", "points.csv", "--sphere-diameter", "nan"], ["--sphere-diameter", "nan", "finite"]),
    (["probe", "bench", "points.csv", "-k", "inf"], ["inf", "finite"]),
    (["report", "points.csv", "-o", "out.pdf"], ["points.csv"]),
]


@pytest.mark.parametrize(("line", "words"), BAD, ids=[" ".join(line[:4]) for line, _ in BAD])
def test_bad_input_is_one_line_and_leaves_nothing(
    run: Run, files: Path, monkeypatch: pytest.MonkeyPatch, line: list[str], words: list[str]
) -> None:
    monkeypatch.chdir(files)
    before = sorted(os.listdir(files))
    complaint = refused(run(*line))
    assert [word for word in words if word not in complaint] == []
    assert sorted(os.listdir(files)) == before


def test_an_output_that_stood_before_survives_an_error(run: Run, files: Path) -> None:
    before = (files / "placement.toml").read_text()
    complaint = refused(run("locate", files / "machine.toml", *G, "-o", files / "placement.toml"))
    assert "expected a table with the columns point, x_mm, y_mm, z_mm" in complaint
    assert (files / "placement.toml").read_text() == before


def test_an_output_in_an_impossible_place_is_refused(run: Run, files: Path) -> None:
    assert "cannot write here" in refused(
        run("locate", files / "points.csv", *G, "-o", files / "points.csv" / "x.toml")
    )


def test_the_command_runs_as_a_module_without_a_traceback(tmp_path: Path) -> None:
    line = [sys.executable, "-m", "stepgauge", "evaluate", "none.csv", "-g", "step-gauge-420", "-o", "x"]
    done = subprocess.run(line, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.strip().splitlines() == ["stepgauge: error: none.csv: no such file"]
    assert list(tmp_path.iterdir()) == []


def test_the_help_imports_nothing_heavy() -> None:
    script = (
        "import sys\nfrom stepgauge.cli import main\n"
        "try:\n    main(['--help'])\nexcept SystemExit:\n    pass\n"
        "heavy = {'numpy', 'pandas', 'scipy', 'matplotlib', 'jinja2', 'pydantic'} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_a_folder_that_was_deleted_is_said_without_a_traceback(tmp_path: Path) -> None:
    gone = tmp_path / "gone"
    gone.mkdir()
    script = f"import os, sys; os.rmdir({str(gone)!r}); from stepgauge.__main__ import main; main()"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    line = [sys.executable, "-c", script]
    done = subprocess.run(line, capture_output=True, text=True, check=False, cwd=gone, env=environment)
    assert done.returncode == 2
    assert done.stderr.startswith("stepgauge: error: the folder in which it is called is not there")
