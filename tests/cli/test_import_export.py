"""Import and export as a user runs them, and the example of one measurement in six files."""

from __future__ import annotations

import json
import re
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest

from stepgauge.correspondence.pairing import KINDS as KNOWN_KINDS
from stepgauge.importing.formats import FORMATS as KNOWN
from stepgauge.recording import read_recording
from stepgauge.verbs.import_ import ACCEPTED, FORMATS
from tests.cli.conftest import Run
from tests.conftest import ROOT

GAUGE = ("-g", "step-gauge-420")


def test_the_verb_offers_what_there_is() -> None:
    assert tuple(KNOWN) == FORMATS
    assert tuple(KNOWN_KINDS) == ACCEPTED


@pytest.fixture(scope="module")
def example(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("import")
    for path in (ROOT / "examples/import").iterdir():
        if path.is_file():
            shutil.copy(path, folder / path.name)
    return folder


def test_the_commands_of_the_example_give_one_evaluation(
    run: Run, example: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(example)
    readme = (example / "README.md").read_text()
    commands = re.findall(r"^stepgauge (import .*)$", readme.replace("\\\n", " "), re.MULTILINE)
    assert len(commands) == 7
    results = []
    for line in commands[:6]:
        done = run(*shlex.split(line))
        assert done.code == 0, done.err
        written = line.split("-o ")[1]
        assert run("evaluate", written, *GAUGE, "-o", "out/one").code == 0
        data = json.loads(Path("out/one/evaluation.json").read_text())
        results.append([data["r_eff_mm"], data["band_um"] * 1e-3, data["worst_two_sigma_um"] * 1e-3])
        assert (read_recording(written).frame["gauge_temperature_C"].round(9) == 20.4).all()
    assert results[0][0] == 2.0  # by which its points had been corrected
    results[0][0] = results[1][0]
    assert np.ptp(np.array(results), axis=0).max() < 2e-5  # the protocol prints 1e-5 mm
    said = re.search(r"range of the mean error XM (\S+) um.*R_eff (\S+) mm", readme)
    assert said is not None
    assert results[0][1] * 1e3 == pytest.approx(float(said[1]), abs=0.006)
    assert results[0][0] == pytest.approx(float(said[2]), abs=6e-6)

    rows = Path("linuxcnc-probeopen.txt").read_text().splitlines()
    Path("out/lost.txt").write_text("\n".join([*rows[:2], *rows[3:]]) + "\n")
    lost = run(*shlex.split(commands[6]))
    assert lost.code == 2
    assert " ".join(re.search(r"stepgauge: error:[^`]*", readme)[0].split()) in " ".join(lost.err.split())  # type: ignore[index]
    assert not Path("out/lost.csv").exists()


def test_export_and_import_on_the_command_line(run: Run, files: Path) -> None:
    recording, placement = files / "recording.csv", files / "placement.toml"
    first = read_recording(recording)
    for form, options in (
        ("csv", ["--delimiter", "bar", "--decimal", "comma", "--length-unit", "inch"]),
        ("csv", ["--decimal", "comma"]),
        ("xlsx", ["--length-unit", "um"]),
        ("dmis", ["--points", "surface", "--length-unit", "inch"]),
        ("ippdme", []),
        ("linuxcnc", []),
    ):
        out, back = files / f"out.{form}", files / f"back.{form}.csv"
        done = run("export", recording, "--to", form, *options, "-o", out)
        assert done.code == 0, done.err
        done = run("import", out, *GAUGE, "-p", placement, "--program", files / "program.dmi", "-o", back)
        assert done.code == 0, done.err
        assert "16 rows, 16 points of the program" in done.err
        second = read_recording(back)
        np.testing.assert_allclose(second.position_mm, first.position_mm, atol=0.51e-7)
        assert second.frame[["cycle", "face"]].equals(first.frame[["cycle", "face"]])
        assert second.comments["gauge_serial"] == "SG-420-001"
        assert second.comments["import"].split("\n")[0] in done.err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["import", "r.csv", "-p", "placement.toml", "-o", "x.csv"], "--placement: needs --gauge"),
        (["import", "r.csv", *GAUGE, "--program", "p.dmi", "-o", "x.csv"], "--program: needs --gauge and --placement"),
        (["import", "recording.csv", "--column", "x=X", "-o", "x.csv"], "--column: not understood; found 'x=X'"),
        (["import", "none.csv", "-o", "x.csv"], "none.csv: no such file"),
        (["import", "", "-o", "x.csv"], "--log: not a file; found ''"),
        (["export", "recording.csv", "--to", "csv", "-o", ""], "--output: not a name of a file; found ''"),
        (["import", "recording.csv", "--format", "dmis", "-o", "x.csv"], "recording.csv:1: this is not a DMIS output"),
        (
            ["import", "program.dmi", *GAUGE, "-o", "x.csv"],
            "program.dmi: this is a measuring program, not what a machine",
        ),
        (["import", "program.dmi", "--format", "dmis", "--sheet", "A", "-o", "x.csv"], "can be said of tables only"),
        (
            ["import", "recording.csv", "--tip-radius", "nan", "-o", "x.csv"],
            "--tip-radius: not a finite number; found nan",
        ),
        (
            ["export", "recording.csv", "--to", "csv", "--delimiter", "comma", "--decimal", "comma", "-o", "x.csv"],
            "the decimal mark",
        ),
        (
            ["export", "recording.csv", "--to", "dmis", "--length-unit", "um", "-o", "x.dmo"],
            "--length-unit: not a unit of DMIS",
        ),
        (
            ["export", "recording.csv", "--to", "linuxcnc", "--length-unit", "inch", "-o", "x.txt"],
            "the log has tip centres in mm",
        ),
        (
            ["export", "recording.csv", "--to", "csv", "--placement-number", "2", "-o", "x.csv"],
            "there is no placement 2",
        ),
    ],
)
def test_wrong_input_is_one_line_and_leaves_nothing(
    run: Run, files: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], words: str
) -> None:
    monkeypatch.chdir(files)
    before = set(files.iterdir())
    done = run(*arguments)
    assert done.code == 2
    assert words in done.err
    assert len(done.err.strip().splitlines()) == 1
    assert set(files.iterdir()) == before


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_a_recording_may_be_parquet(run: Run, files: Path, suffix: str) -> None:
    out = files / f"back{suffix}"
    assert run("import", files / "recording.csv", *GAUGE, "-o", out).code == 0
    assert run("evaluate", out, *GAUGE, "-o", files / "result").code == 0
    assert read_recording(out).comments["import"].startswith("table: 16 rows, faces as stated")
    report = files / "report.html"
    assert run("report", files / "result", *GAUGE, "-p", files / "placement.toml", "-o", report).code == 0
    assert "recording.csv" in report.read_text()
    assert "faces as stated" not in report.read_text()  # how it was read is no part of a certificate


def test_the_tip_of_a_servers_log_is_compared_with_the_machine_file(run: Run, files: Path) -> None:
    """ER of an I++ server: within a pre-travel of the machine's tip radius, or it was another tip."""
    log = files / "session.ipp"
    assert run("export", files / "recording.csv", "--to", "ippdme", "-o", log).code == 0
    plain = log.read_text()
    common = ("import", log, "--format", "ippdme", *GAUGE, "-p", files / "placement.toml", "-m", files / "machine.toml")
    for radius, code in (("1.9970", 0), ("1.6000", 2)):
        log.write_text(re.sub(r"(# X\([^\n\r]*)", rf"\1, ER({radius})", plain))
        done = run(*common, "-o", files / f"back-{radius}.csv")
        assert done.code == code, done.err
        assert (files / f"back-{radius}.csv").exists() == (code == 0)
    assert "machine.toml: the recording was made with another tip" in done.err
    assert "1.6 mm, as recorded" in done.err


def test_no_tip_is_assumed_for_a_program_of_surface_points(run: Run, files: Path) -> None:
    """An I++ program leaves the radius to the server: an option, the placement or the machine file must state it."""
    placement, program, log = files / "bare.toml", files / "program.ipp", files / "session.ipp"
    text = (files / "placement.toml").read_text()
    kept = (line for line in text.splitlines(True) if not line.startswith(("tip_radius_mm", "# checksum")))
    placement.write_text("".join(kept))
    machine = ("-m", files / "machine.toml")
    assert (
        run("plan", placement, *GAUGE, *machine, "-d", "ippdme", "--blocks", "1:4", "--cycles", "2", "-o", program).code
        == 0
    )
    assert run("export", files / "recording.csv", "--to", "ippdme", "-o", log).code == 0
    common = ("import", log, *GAUGE, "-p", placement, "--program", program, "-o", files / "back.csv")
    done = run(*common)
    assert done.code == 2
    assert "the program has surface points, and nothing states the radius of the tip" in done.err
    assert "expected --tip-radius, or tip_radius_mm in the machine file or that of --placement" in done.err
    assert not (files / "back.csv").exists()
    for stated in (("--tip-radius", "2"), machine):
        assert run(*common, *stated).code == 0
        assert (files / "back.csv").exists()
        (files / "back.csv").unlink()


def test_a_recording_of_another_tip_is_no_recording_of_this_machine(run: Run, files: Path) -> None:
    other = files / "other-machine.toml"
    other.write_text((files / "machine.toml").read_text().replace("tip_radius_mm = 2.0", "tip_radius_mm = 1.5"))
    done = run("budget", files / "recording.csv", *GAUGE, "-m", other, "-o", files / "out")
    assert done.code == 2
    assert "other-machine.toml: the recording was made with another tip; found tip_radius_mm = 1.5" in done.err
