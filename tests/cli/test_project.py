"""The project file: found upward, taken where an option is left out, told; what is wrong in it is named."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from stepgauge.verbs.catalogue import VERBS, all_verbs
from tests.cli.conftest import Run
from tests.conftest import ROOT


@pytest.fixture
def project(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A new project with the 16 points of the demo, as the working folder."""
    for name in ("STEPGAUGE_GAUGE", "STEPGAUGE_MACHINE"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.chdir(tmp_path)
    made = run("init", "mine", "-g", "step-gauge-420", "-m", "bridge-cmm", "-d", "dmis", "--operator", "A. Person")
    assert made.code == 0
    assert "mine/stepgauge.toml" in made.err
    shutil.copy(ROOT / "examples/demo/points.csv", tmp_path / "mine")
    monkeypatch.chdir(tmp_path / "mine")
    return tmp_path / "mine"


def test_the_loop_needs_no_option_in_a_project(
    run: Run, project: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every command that 'status' names next, with the file that only a person can name, until all is there."""
    said = run("locate", "points.csv")
    assert said.code == 0
    stated = "--gauge gauge/step-gauge-420.toml, --machine machine/bridge-cmm.toml"
    assert f"from stepgauge.toml: {stated}\n" in said.err  # and where to, which the last line names
    assert said.err.splitlines()[-1] == "wrote placement.toml"
    assert run("plan", "placement.toml").code == 0
    assert run("simulate", "program.dmi", "--seed", 3).code == 0
    (project / "deep/er").mkdir(parents=True)
    monkeypatch.chdir(project / "deep/er")
    said = run("evaluate", "../../recordings/virtual.csv")
    assert said.code == 0
    assert "--gauge ../../gauge/step-gauge-420.toml" in said.err
    monkeypatch.chdir(project)
    assert (project / "results/evaluation/evaluation.json").exists()
    shown = run("status").out
    assert re.search(r"next +stepgauge budget recordings/virtual.csv", shown)
    assert "210 probings in 1 placement; simulated" in shown
    assert run("budget", "recordings/virtual.csv").code == 0
    assert run("diagnose", "recordings/virtual.csv").code == 0
    assert re.search(r"next +stepgauge report results/evaluation", run("status").out)
    said = run("report", "results/evaluation")
    assert said.code == 0
    shown = run("status").out
    assert re.search(r"next +stepgauge history results\n +all is there", shown)
    assert run("history", "results").code == 0
    assert (project / "results/history/history.json").exists()
    assert re.search(r"PDF +results/report.pdf\n +written 20", shown)
    assert "--placement placement.toml" in said.err
    assert "--operator A. Person" in said.err
    (project / "recordings/virtual.csv").write_text((project / "recordings/virtual.csv").read_text() + "\n")
    assert re.search(r"evaluation +results/evaluation\n +! .*changed", run("status").out)


def test_the_command_line_wins_then_the_environment(run: Run, project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    said = run("locate", "points.csv", "-g", "step-gauge-420", "-o", "mine.toml")
    assert said.code == 0
    assert "--gauge" not in said.err
    assert (project / "mine.toml").exists()
    monkeypatch.setenv("STEPGAUGE_MACHINE", "machining-centre")
    said = run("locate", "points.csv", "-o", "mine.toml")
    assert "--machine" not in said.err


def test_status_sees_recordings_beside_the_project_file(run: Run, project: Path) -> None:
    """The names that README uses; other tables are no recordings."""
    for line in ("locate points.csv", "plan placement.toml -o gauge.dmi --blocks 1:3 --cycles 2"):
        assert run(*line.split()).code == 0
    assert re.search(r"next +stepgauge plan placement.toml\n +write the measuring program", run("status").out)
    assert run("simulate", "gauge.dmi", "--seed", 1, "-o", "recording.csv").code == 0
    shown = run("status").out
    assert re.search(r"next +stepgauge evaluate recording.csv", shown)
    assert "points.csv" not in shown


def test_points_that_are_not_there_are_asked_for_with_an_example(run: Run, project: Path) -> None:
    said = run("locate", "nowhere.csv")
    assert said.code == 2
    assert "nowhere.csv: no such file; expected point,x_mm,y_mm,z_mm with points 1 to 16; 'stepgauge demo'" in said.err


def test_status_reads_axes_and_diagnoses(run: Run, project: Path) -> None:
    """A recording of an axis is one, and what was diagnosed from it is told until the recording changes."""
    table = ROOT / "examples/line-spacing/spacings.csv"
    said = run("import", table, "--sensor", "optical", "--set", "direction=+", "-o", "recordings/axis.csv")
    assert said.code == 0
    assert "from stepgauge.toml" not in said.err  # an axis has no gauge, placement or machine
    said = run("diagnose", "recordings/axis.csv")
    assert said.code == 0
    assert "from stepgauge.toml" not in said.err
    said = run("report", "results/diagnosis", "-o", "axis.html")
    assert said.code == 0
    assert "from stepgauge.toml" not in said.err
    shown = run("status").out
    assert re.search(r"recording +recordings/axis.csv\n +axis by optical sensor: 40 readings at 10 targets", shown)
    assert re.search(r"diagnosis +results/diagnosis\n +unknown", shown)
    for line in ("locate points.csv", "plan placement.toml --blocks 1:3 --cycles 2", "simulate program.dmi --seed 1"):
        assert run(*line.split()).code == 0
    assert run("evaluate", "recordings/virtual.csv").code == 0
    assert run("budget", "recordings/virtual.csv").code == 0
    shown = run("status").out  # the diagnosis of the axis is none of the gauge's recording, and is not written over
    assert re.search(r"next +stepgauge diagnose recordings/virtual.csv -o results/diagnosis-virtual\n", shown)
    assert re.search(
        r"budget +results/budget\n +up to date; incomplete: not stated are temperature of the gauge, ", shown
    )
    path = project / "recordings/axis.csv"
    (project / "laser").mkdir()
    (project / "laser/again.csv").write_text(path.read_text() + "\n")
    assert re.search(r"recording +laser/again.csv\n +axis by optical sensor", run("status").out)
    path.write_text(path.read_text() + "\n")
    assert re.search(r"diagnosis +results/diagnosis\n +! .*axis.csv has changed", run("status").out)


def test_the_next_command_can_be_typed_as_it_stands(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a project without a dialect, and whose file states nothing but gauge and machine; paths have blanks."""
    monkeypatch.chdir(tmp_path)
    made = run("init", "ein Ordner ü", "-g", "step-gauge-420", "-m", "bridge-cmm")
    assert "next: cd 'ein Ordner ü'; stepgauge status" in made.err
    folder = tmp_path / "ein Ordner ü"
    file = folder / "stepgauge.toml"
    monkeypatch.chdir(folder)
    for stated in (file.read_text(), file.read_text().partition("\n[")[0]):
        file.write_text(stated)
        (folder / "POINTS.csv").write_text((ROOT / "examples/demo/points.csv").read_text())
        for verb in ("locate", "plan"):
            words = shlex.split(run("status").out.partition("next")[2].splitlines()[0])
            assert words[:2] == ["stepgauge", verb]
            assert run(*words[1:]).code == 0, words
        assert run("simulate", "program.dmi", "--seed", 1, "-o", "recordings/a b.csv").code == 0
        words = shlex.split(run("status").out.partition("next")[2].splitlines()[0])
        assert run(*words[1:]).code == 0, words
        for made_here in (*folder.glob("placement.toml"), *folder.glob("recordings/*")):
            made_here.unlink()


def test_status_says_what_is_wrong_with_a_key(run: Run, project: Path) -> None:
    file = project / "stepgauge.toml"
    file.write_text(file.read_text().replace('gauge = "gauge/step-gauge-420.toml"', "gauge = 5"))
    assert "stepgauge.toml: key gauge is no text; found 5; expected a path" in run("status").out


def test_status_says_what_comes_next(run: Run, project: Path) -> None:
    assert re.search(r"placement +placement.toml\n +! not there yet\nnext +stepgauge locate", run("status").out)
    (project / "gauge/step-gauge-420.csv").unlink()
    shown = run("status").out
    assert re.search(r"gauge .*\n +! .*step-gauge-420.csv", shown)
    assert re.search(r"next +stepgauge list files", shown)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ('gague = "step-gauge-420"', r"stepgauge.toml: key gague is not known; expected gauge\?"),
        ('[evalute]\noutput = "x"', r"table \[evalute\] is not known; expected evaluate\?"),
        ("[locate]\nrepeatibility = 1.0", r"key repeatibility in \[locate\] is not known; expected repeatability\?"),
        (
            "[locate]\nrepeatability = -1.0",
            r"key repeatability is wrong; found -1.0; expected at least 0 um",
        ),
        ('[locate]\nblocks = ["1:3"]', "key blocks is a list; expected one value"),
        ("operator = ", "not valid TOML"),
        ("tip-radius = nan", "key tip-radius is wrong"),
    ],
)
def test_what_is_wrong_in_the_file_is_named(run: Run, project: Path, line: str, words: str) -> None:
    (project / "stepgauge.toml").write_text(f'gauge = "gauge/step-gauge-420.toml"\n{line}\n')
    said = run("locate", "points.csv", "-o", "placement.toml")
    assert said.code == 2
    assert re.search(words, said.err)
    assert len(said.err.strip().splitlines()) == 1
    assert not (project / "placement.toml").exists()


FAR = "placement.toml", "-d", "dmis", "-o", "far.dmi"


@pytest.mark.parametrize(
    ("stated", "words", "key"),
    [
        ('machine = "machine/bridge-cm.toml"', ("plan", *FAR), "machine"),
        ('machine = "bridge-cmm.toml"', ("plan", *FAR), "machine"),
        ('machine = "bridge-cm"', ("plan", *FAR), "machine"),
        ('gauge = "gauges/step-gauge-420.toml"', ("plan", *FAR), "gauge"),
        ('[plan]\ntemplate = "shop.j2"', ("plan", *FAR), r"template in \[plan\]"),
        ('[evaluate]\nplacement = ["mine.toml"]', ("evaluate", "r.csv", "-o", "e"), r"placement in \[evaluate\]"),
        ('machine = "bridge"', ("diagnose", "r.csv", "-o", "d"), "machine"),
        ('certificate = "lab.toml"', ("report", "e", "-o", "r.pdf"), "certificate"),
        ('machine = "../cmm.toml"', ("report", "e", "-o", "r.pdf"), "machine"),
        ('machine = "../cmm.toml"', ("test", "iso230", "r.csv", "-o", "i"), "machine"),
        (
            '[test.iso230]\nplacement = "p.toml"',
            ("test", "iso230", "r.csv", "-o", "i"),
            r"placement in \[test.iso230\]",
        ),
        ('[budget]\nplacement = "p.toml"', ("budget", "r.csv", "-o", "b"), r"placement in \[budget\]"),
        ('[diagnose]\npriors = "mine.toml"', ("diagnose", "r.csv", "-o", "d"), r"priors in \[diagnose\]"),
        ('placement = "lies.toml"', ("measure", "--server", "127.0.0.1", "-o", "m.csv"), "placement"),
    ],
)
def test_a_file_that_is_stated_and_not_there_is_never_a_default(
    run: Run, project: Path, stated: str, words: tuple[str, ...], key: str
) -> None:
    table, _, line = stated.rpartition("\n")
    top = 'gauge = "step-gauge-420"\nmachine = "bridge-cmm"\n'
    top = "".join(one + "\n" for one in top.splitlines() if table or one.split()[0] != line.split()[0])
    file = project / "stepgauge.toml"
    file.write_text(f"{top}{stated}\n" if table else f"{stated}\n{top}")
    (project / "e").mkdir()
    (project / "e/evaluation.json").write_text("{}")
    (project / "r.csv").touch()
    said = run(*words)
    assert said.code == 2
    value = re.escape(line.split('"')[1])
    assert re.search(rf"stepgauge.toml: key {key} names a file that is not there; found {value}; expected ", said.err)
    assert len(said.err.strip().splitlines()) == 1
    assert not list(project.glob("far.dmi"))
    shown = run("status")
    assert shown.code == 0
    assert value in shown.out or re.search("placement.toml|lies.toml", shown.out)


def test_a_file_that_is_not_there_matters_only_to_the_verb_that_reads_it(run: Run, project: Path) -> None:
    (project / "stepgauge.toml").write_text('gauge = "no.toml"\nmachine = "no.toml"\n')
    assert run("list", "files").code == 0
    assert run("locate", "points.csv", "-g", "step-gauge-420", "-m", "bridge-cmm", "-o", "placement.toml").code == 0
    assert run("init", "other", "-g", "step-gauge-420", "-m", "bridge-cmm").code == 0


def test_what_an_editor_puts_before_the_text_is_no_fault(run: Run, project: Path) -> None:
    """Editors of Windows begin UTF-8 with a byte order mark; UTF-16 is told by its name."""
    path = project / "stepgauge.toml"
    text = path.read_text(encoding="utf-8")
    path.write_text(text, encoding="utf-8-sig")
    assert run("status").code == 0
    path.write_text(text, encoding="utf-16")
    said = run("status")
    assert said.code == 2
    assert "not a UTF-8 text file; found text in UTF-16" in said.err


def test_nothing_is_overwritten(run: Run, project: Path) -> None:
    before = (project / "stepgauge.toml").read_bytes()
    said = run("init", "-g", "step-gauge-420", "-m", "bridge-cmm")
    assert said.code == 2
    assert "exists already" in said.err
    assert (project / "stepgauge.toml").read_bytes() == before


def test_where_nobody_can_be_asked_what_is_missing_is_named(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "stepgauge", "init", tmp_path / "new"], stdin=subprocess.DEVNULL, capture_output=True,
        text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 2
    assert "--gauge: is missing, and nobody is there to be asked" in done.stderr
    assert not (tmp_path / "new").exists()


def test_the_keys_at_the_top_are_options_of_several_verbs() -> None:
    names = [one.key for _, verb in all_verbs() for one in verb.parameters if one.at_command and not one.argument]
    assert {name for name in VERBS.common if names.count(name) < 2} == set()
    assert set(VERBS.meanings()) == set(VERBS.common)
