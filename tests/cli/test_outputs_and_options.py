"""What a slip of the hand must not do: overwrite an input, print an empty program, pass an option that is not used."""

from __future__ import annotations

from pathlib import Path

import pytest

from stepgauge.cli import main
from stepgauge.errors import InputError
from stepgauge.files.text import check_folder, check_output
from stepgauge.reports.render import render_html, render_pdf
from tests.conftest import ROOT

GAUGE, MACHINE = "step-gauge-420", "bridge-cmm"
IMPORTS = ROOT / "examples" / "import"


def call(capsys: pytest.CaptureFixture[str], *words: object) -> tuple[int, str]:
    try:
        main([str(word) for word in words])
        code = 0
    except SystemExit as stop:
        code = int(stop.code or 0)
    return code, capsys.readouterr().err


def refused(capsys: pytest.CaptureFixture[str], message: str, *words: object) -> None:
    code, said = call(capsys, *words)
    assert (code, message in said, len(said.splitlines())) == (2, True, 1), said


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a recording of three blocks along y and its evaluation."""
    folder = tmp_path_factory.mktemp("measured")
    placement = IMPORTS / "placement.toml"
    main([str(w) for w in ("simulate", IMPORTS / "gauge.dmi", "-m", MACHINE, "-g", GAUGE, "-p", placement, "--seed", 1)]
         + ["-o", str(folder / "recording.csv")])  # fmt: skip
    main(["evaluate", str(folder / "recording.csv"), "-g", GAUGE, "-o", str(folder / "result")])
    return folder


def test_an_output_never_replaces_what_the_command_reads(
    measured: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, points = tmp_path / "log.dmo", tmp_path / "points.csv"
    log.write_bytes((IMPORTS / "dmis.dmo").read_bytes())
    points.write_bytes((ROOT / "examples" / "demo" / "points.csv").read_bytes())
    placement, recording = IMPORTS / "placement.toml", measured / "recording.csv"
    evaluation = measured / "result" / "evaluation.json"
    (tmp_path / "same.csv").symlink_to(recording)
    for name in ("evaluation.csv", "iso230.csv"):
        (tmp_path / name).write_bytes(recording.read_bytes())
    probe, machine = tmp_path / "probe.toml", tmp_path / "machine.toml"
    probe.write_bytes((ROOT / "calibration_data" / "probes" / "omp40-2-50mm.toml").read_bytes())
    machine.write_bytes((ROOT / "calibration_data" / "machines" / "bridge-cmm.toml").read_bytes())
    lies = ("-m", machine, "-g", GAUGE, "-p", placement)
    commands: tuple[tuple[Path, tuple[object, ...]], ...] = (
        (log, ("import", log, "-g", GAUGE, "-p", placement, "-o", log)),
        (recording, ("export", recording, "--to", "csv", "-o", tmp_path / "same.csv")),
        (points, ("locate", points, "-g", GAUGE, "-m", MACHINE, "-o", points)),
        (points, ("plan", points, "-g", GAUGE, "-m", MACHINE, "-d", "dmis", "-o", points)),
        (evaluation, ("compensate", measured / "result", "--axis", "y", "--to", "csv", "-o", evaluation)),
        (recording, ("compensate", measured / "result", "--axis", "y", "--to", "csv", "-o", recording)),
        (recording, ("compensate", measured / "result", "--axis", "y", "--to", "csv", "-o", tmp_path / "same.csv")),
        (tmp_path / "evaluation.csv", ("evaluate", tmp_path / "evaluation.csv", "-g", GAUGE, "-o", tmp_path)),
        (tmp_path / "iso230.csv", ("test", "iso230", tmp_path / "iso230.csv", "-g", GAUGE, "-o", tmp_path)),
        (probe, ("probe", "sphere", probe, "-o", probe)),
        (machine, ("measure", *lies, "--server", "127.0.0.1:1", "-o", tmp_path / "o.csv", "--spy", machine)),
        (machine, ("serve", *lies, "--log", machine)),
    )
    for source, words in commands:
        before = source.read_bytes()
        refused(capsys, "would replace what the command reads", *words)
        assert source.read_bytes() == before


def test_places_for_outputs_are_looked_at_before_any_work(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_text("x")
    check_folder(tmp_path / "new" / "deeper")
    check_output(tmp_path / "new" / "file.csv", tmp_path / "file", None)
    assert not (tmp_path / "new").exists()
    for place in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(InputError, match="cannot write here"):
            check_folder(place)
        seven = ("test", "plan", "-g", "step-gauge-1020", "-m", MACHINE, "-d", "dmis", "-o", place)
        refused(capsys, "cannot write here", *seven)
    with pytest.raises(InputError, match="this is a folder"):
        check_output(tmp_path)


@pytest.mark.parametrize("text", ["", '{"a": 1}\n', "[table]\nkey = 1\n"])
def test_another_file_given_for_a_template_is_refused(
    measured: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str
) -> None:
    """It would print itself: a program without moves, a table without rows, an empty page."""
    other = tmp_path / "other.j2"
    other.write_text(text)
    nothing = "template: it uses nothing of what it is given"
    plan = ("plan", IMPORTS / "placement.toml", "-g", GAUGE, "-m", MACHINE, "-d", "dmis", "--template", other)
    refused(capsys, nothing, *plan, "-o", tmp_path / "out.dmi")
    table = ("compensate", measured / "result", "--axis", "y", "--to", "csv", "--template", other)
    refused(capsys, nothing, *table, "-o", tmp_path / "out.csv")
    for render in (render_pdf, render_html):
        with pytest.raises(InputError, match="it prints nothing of the report"):
            render({}, other)
    assert not list(tmp_path.glob("out*"))


def test_options_that_are_not_used_are_refused(
    measured: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recording = measured / "recording.csv"
    out = tmp_path / "out.csv"
    table = ("compensate", measured / "result", "--axis", "y", "-o", out)
    budget = ("budget", recording, "-g", GAUGE, "-m", MACHINE, "--runs", 0, "-o", tmp_path / "b")
    test = ("test", "iso10360", recording, "-g", GAUGE, "--mpe", "1.8 + L/350", "-o", tmp_path / "t")
    cases: tuple[tuple[str, tuple[object, ...]], ...] = (
        ("belongs to a program", (*budget, "--gauge-temperature", 25)),
        ("not a list of numbers; found 'nan,30,50'", (*test, "--lengths", "nan,30,50")),
        ("expected MM,...: numbers above 0 mm", (*test, "--lengths", "30,-50")),
        ("are for linuxcnc and siemens; found csv", (*table, "--to", "csv", "--file-type", 1)),
        ("of another tip: the difference", (*table, "--to", "csv", "--tip-radius", 3)),
        ("of another tip (a diameter?)", (*table, "--to", "linuxcnc", "--tip-radius", 3.994)),
        ("are of a CSV table", ("export", recording, "--to", "dmis", "--decimal", "comma", "-o", out)),
        ("--log-form: is of LinuxCNC", ("export", recording, "--to", "csv", "--log-form", "probeopen", "-o", out)),
        ("expected NAME.xlsx", ("export", recording, "--to", "xlsx", "-o", out)),
        ("another suffix than .xlsx", ("export", recording, "--to", "csv", "-o", tmp_path / "out.xlsx")),
        ("--sheet is of a", ("import", recording, "--sheet", "1", "-g", GAUGE, "-o", out)),
        ("--delimiter is of a", ("import", IMPORTS / "points.xlsx", "--delimiter", "tab", "-g", GAUGE, "-o", out)),
    )
    for message, words in cases:
        refused(capsys, message, *words)
    assert not list(tmp_path.iterdir())
