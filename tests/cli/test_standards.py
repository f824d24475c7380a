"""``stepgauge test iso10360``, ``iso230`` and ``test plan`` as a user runs them."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

import pytest
from pypdf import PdfReader

from stepgauge.files.resources import find_data
from stepgauge.gauge.certified import read_gauge
from stepgauge.recording import Recording, read_recording, write_recording
from tests.cli.conftest import Run
from tests.standards.made import made

G = ("-g", "step-gauge-420")
MPE = ("--mpe", "1.8 + L/350")


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """Five cycles of the 420 mm gauge along x, 5 ppm too long and 0.2 um of reversal."""
    gauge = read_gauge("step-gauge-420")
    frame = made(
        gauge,
        lambda c, f: 5e-3 * gauge.position_mm[f - 1] + (0.1 if f % 2 else -0.1) + 0.1 * (c % 3) + 0.001 * c,
        cycles=5,
    )
    path = tmp_path / "x.csv"
    write_recording(path, Recording(frame.frame, {"gauge_serial": "SG-420-001", "machine": "Test CMM"}))
    return path


def text_of(path: Path) -> str:
    return " ".join("\n".join(page.extract_text() for page in PdfReader(path).pages).split())


def test_iso10360_writes_everything_and_says_what_is_open(run: Run, recording: Path, tmp_path: Path) -> None:
    out = tmp_path / "result"
    result = run(
        "test", "iso10360", recording, *G, "--mpe", "min(1.8 + L/350, 3)",
        "--mpe-repeatability", 1.0, "-m", "bridge-cmm",
        "--tip-diameter", 3.994, "--u-gauge-temperature", 0.05, "--u-alignment", 0.1, "--u-fixture", 0.1,
        "--number", "N-7", "--operator", "Op",
        "--figure", "svg", "-o", out,
    )  # fmt: skip
    assert result.code == 0, result.err
    assert "7 positions; 1 in the recording" in result.err
    assert "cycles 4, 5" in json.dumps(json.loads((out / "iso10360.json").read_text())["excluded"])
    assert sorted(path.name for path in out.iterdir()) == [
        "iso10360-figure.svg", "iso10360.csv", "iso10360.json", "iso10360.pdf",
    ]  # fmt: skip
    with (out / "iso10360.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2 * 5 * 3
    long = next(row for row in rows if row["kind"] == "bidirectional" and row["nominal_mm"] == "410")
    assert float(long["error_um"]) == pytest.approx(5e-3 * 410 - 0.2, abs=0.01)
    assert float(long["mpe_um"]) == pytest.approx(min(1.8 + 410 / 350, 3.0), rel=1e-5)
    text = text_of(out / "iso10360.pdf")
    for word in ("N-7", "Op", "EXAMPLE-2026-0420", "not met", "conforms", "min(1.8 + L/350, 3)"):
        assert word in text


def other(path: Path, recording: Path, name: str, **changes: float) -> Path:
    """The recording once more in another place of the machine."""
    first = read_recording(recording)
    frame = first.frame[first.frame["cycle"] <= 3].assign(**{k: first.frame[k] + v for k, v in changes.items()})
    write_recording(path / name, Recording(frame, first.comments))
    return path / name


def test_e150_goes_with_two_recordings_of_the_offset_stylus(run: Run, recording: Path, tmp_path: Path) -> None:
    offset = [other(tmp_path, recording, f"offset-{n}.csv", y_mm=9.0 * n + 9.0) for n in (0, 1)]
    stylus = tmp_path / "stylus.toml"
    shipped = find_data("bridge-cmm", "machine", "machines").read_text()
    level = "stylus_length_mm = 150.0\nstylus_direction = [1.0, 0.0, 0.0]\nbody_length_mm = 0.0"
    stylus.write_text(shipped.replace("stylus_length_mm = 50.0", level))
    common = ("test", "iso10360", recording, *G, *MPE, "-m", "bridge-cmm", "--tip-diameter", 3.994)
    said = ("--offset-recording", offset[0], "--offset-recording", offset[1], "--mpe-offset", "2.5 + L/300")
    done = run(*common, *said, "--offset-machine", stylus, "-o", tmp_path / "out")
    assert done.code == 0, done.err
    (e150,) = json.loads((tmp_path / "out/iso10360.json").read_text())["further"]
    assert e150["series"]["key"] == "e150"
    text = text_of(tmp_path / "out/iso10360.pdf")
    assert "2.5 + L/300" in text
    assert "150 mm" in text
    assert "two positions, and their directions" in text  # what is unconfirmed is said
    assert run(*common, *said[:4], "-o", tmp_path / "no").code == 2
    assert run(*common, *said[4:], "-o", tmp_path / "no").code == 2
    assert not (tmp_path / "no").exists()


def test_a_gauge_of_normal_expansion_beside_one_of_low(run: Run, recording: Path, tmp_path: Path) -> None:
    """The rule is not met without --normal, and met with it; the further lengths are in result and report."""
    for name in ("step-gauge-420.toml", "step-gauge-420.csv"):
        text = find_data(name.replace("csv", "toml"), "gauge").with_suffix(Path(name).suffix).read_text()
        (tmp_path / name).write_text(re.sub(r"expansion_per_K = \S+", "expansion_per_K = 0.5e-6", text))
    low = ("test", "iso10360", recording, "-g", tmp_path / "step-gauge-420.toml", *MPE, "--tip-diameter", 3.994)
    without = run(*low, "-o", tmp_path / "without")
    assert without.code == 0, without.err
    assert "normal expansion" in without.err
    normal = other(tmp_path, recording, "normal.csv", y_mm=9.0)
    done = run(*low, "--normal", normal, "--normal-gauge", "step-gauge-420", "-o", tmp_path / "with")
    assert done.code == 0, done.err
    assert "8 to 13" not in done.err
    (series,) = json.loads((tmp_path / "with/iso10360.json").read_text())["further"]
    assert series["series"]["key"] == "normal"
    assert "normal expansion" in text_of(tmp_path / "with/iso10360.pdf")
    alone = run(*low, "--normal", normal, "-o", tmp_path / "no")
    assert alone.code == 2
    assert "--normal: needs --normal-gauge" in alone.err


def test_iso230_writes_everything(run: Run, recording: Path, tmp_path: Path) -> None:
    out = tmp_path / "result"
    result = run("test", "iso230", recording, *G, "-m", "bridge-cmm", "--tip-diameter", 3.994, "-o", out)
    assert result.code == 0, result.err
    data = json.loads((out / "iso230.json").read_text())
    (axis,) = data["axes"]
    assert axis["axis"] == "x"
    assert axis["parameters_um"]["mean_B"] == pytest.approx(-0.2, abs=0.01)
    assert axis["parameters_um"]["M"] == pytest.approx(5e-3 * 400.0, abs=0.01)
    assert axis["axis_travel_mm"] == 700.0
    assert len((out / "iso230.csv").read_text().splitlines()) == 1 + 21
    assert len((out / "iso230-deviations.csv").read_text().splitlines()) == 1 + 2 * 21 * 5
    assert (out / "iso230-figure.png").stat().st_size > 10_000
    assert "mean B" in text_of(out / "iso230.pdf")
    assert "constant step of 20.000 mm" in result.err


def test_plan_writes_seven_positions_that_the_machine_runs(run: Run, tmp_path: Path) -> None:
    out, gauge = tmp_path / "seven", ("-g", "step-gauge-1020")
    result = run("test", "plan", *gauge, "-m", "bridge-cmm", "-d", "linuxcnc", "-o", out)
    assert result.code == 0, result.err
    plan = json.loads((out / "plan.json").read_text())
    assert [one["problem"] for one in plan["positions"]] == [None] * 7
    name = out / "position-7"
    done = run(
        "simulate", f"{name}.ngc", "-m", f"{name}-machine.toml", *gauge, "-p", f"{name}.toml", "-o", f"{name}.csv"
    )
    assert done.code == 0, done.err
    blocks = ",".join(map(str, plan["positions"][6]["blocks"]))
    again = run(
        "plan", f"{name}.toml", *gauge, "-m", f"{name}-machine.toml", "-d", "linuxcnc", "--cycles", 3, "--blocks",
        blocks, "-o", tmp_path / "again.ngc",
    )  # fmt: skip
    assert again.code == 0, again.err
    assert (tmp_path / "again.ngc").read_text() == Path(f"{name}.ngc").read_text()


def test_a_gauge_that_does_not_fit_leaves_nothing_unless_allowed(run: Run, tmp_path: Path) -> None:
    line = ("test", "plan", *G, "-m", "bridge-cmm", "-d", "dmis", "-o", tmp_path / "seven")
    result = run(*line)
    assert result.code == 2
    assert "short by 588.8 mm" in result.err
    assert not (tmp_path / "seven").exists()
    allowed = run(*line, "--allow-short")
    assert allowed.code == 0, allowed.err
    assert len(list((tmp_path / "seven").glob("position-?.dmi"))) == 7


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (("test", "iso10360", "{r}", *G, "--mpe", "about 2", "-o", "{o}"), ["--mpe", "A + L/K"]),
        (("test", "iso10360", "{r}", *G, *MPE, "--tip-diameter", 1.997, "-o", "{o}"), ["a radius?", "about 3.9938"]),
        (("test", "iso10360", "{r}", *G, *MPE, "--u-tip-diameter", 0.1, "-o", "{o}"), ["needs --tip-diameter"]),
        (("test", "iso10360", "{r}", *G, *MPE, "--lengths", "30,x", "-o", "{o}"), ["--lengths"]),
        (("test", "iso10360", "{r}", "-g", "step-gauge-600", *MPE, "-o", "{o}"), ["another gauge", "SG-420-001"]),
        (("test", "iso10360", "{r}", *G, *MPE, "--template", "none.typ", "-o", "{o}"), ["none.typ"]),
        (("test", "iso230", "{r}", "-g", "step-gauge-1020", "-o", "{o}"), ["another gauge"]),
        (("test", "iso230", "{r}", *G, "--template", "none.typ", "-o", "{o}"), ["none.typ"]),
        (("test", "plan", *G, "-d", "dmis", "-o", "{o}"), ["--machine"]),
        (("test", "plan", "p.toml", *G, "-m", "bridge-cmm", "-d", "dmis", "-o", "{o}"), ["unexpected extra argument"]),
        (("test", "plan", *G, "-m", "bridge-cmm", "--blocks", "1:4", "-d", "dmis", "-o", "{o}"), ["--blocks"]),
        (("plan", *G, "-d", "dmis", "-o", "{o}"), ["Missing argument"]),
        (("plan", "p.toml", *G, "-d", "dmis", "--allow-short", "-o", "{o}"), ["No such option"]),
    ],
)
def test_wrong_input_is_one_line_and_leaves_nothing(
    run: Run, recording: Path, tmp_path: Path, line: tuple, words: list[str]
) -> None:
    result = run(*(str(part).format(r=recording, o=tmp_path / "out") for part in line))
    assert result.code == 2
    assert "Traceback" not in result.err
    for word in words:
        assert word in result.err
    assert not (tmp_path / "out").exists()
