"""Files that are not what they say: refused by import, evaluate and diagnose, with the numbers that show it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from stepgauge.diagnosis.engine import diagnose
from stepgauge.errors import InputError
from stepgauge.evaluation.evaluate import evaluate
from stepgauge.gauge.certified import Gauge
from stepgauge.importing.build import ImportOptions
from stepgauge.importing.logs import import_log
from stepgauge.recording import Recording, read_recording, write_recording
from tests.build import make_gauge, make_machine
from tests.importing.made import Case, make_case

POSITION = ["x_mm", "y_mm", "z_mm"]
APPROACH = ["approach_i", "approach_j", "approach_k"]
CASE = make_case(gauge=make_gauge(6), comments={})
Lie = Callable[[Case], Recording]


def frame_of(case: Case, **columns: object) -> Recording:
    return case.changed(**columns).recording


def swapped(case: Case) -> np.ndarray:
    face = case.recording.frame["face"].to_numpy()
    return np.where(face % 2 == 1, face + 1, face - 1)


def flipped(case: Case) -> dict[str, np.ndarray]:
    return {name: -case.recording.frame[name] for name in APPROACH}


def stated(case: Case, **comments: str) -> Recording:
    return replace(case.recording, comments=comments)


LIES: dict[str, tuple[Lie, str]] = {
    "serial": (
        lambda case: stated(case, gauge_serial="T-9"),
        r"recording of another gauge; found gauge_serial T-9; expected T-1 \(Test gauge\)",
    ),
    "serial twice": (
        lambda case: stated(case, gauge_serial="T-1", serial="T-9"),
        r"recording of another gauge; found serial T-9; expected T-1",
    ),
    "serial twice, once in words": (
        lambda case: stated(case, gauge_serial="T-1", gauge="Test gauge (serial number T-9), steel"),
        r"recording of another gauge; found gauge: serial T-9; expected T-1",
    ),
    "serial in words": (
        lambda case: stated(case, gauge="Old gauge, serial X/17"),
        "recording of another gauge; found gauge: serial X/17",
    ),
    "longer gauge": (
        lambda _: make_case(gauge=make_gauge(7), comments={}).recording,
        "has no face 14; found face 14; expected 1 to 12",
    ),
    "other pitch": (
        lambda _: make_case(gauge=make_gauge(6, gap=12.0), comments={}).recording,
        r"is not where Test gauge has that face; found .* mm off; measured span 122\.99\d mm; expected cert",
    ),
    "swapped faces": (
        lambda case: frame_of(case, face=swapped(case)),
        r"fronts and backs are swapped: fronts lie behind the backs of their blocks; found .*12\.99\d mm behind",
    ),
    "swapped faces and directions": (
        lambda case: frame_of(case, face=swapped(case), **flipped(case)),
        r"fronts and backs are swapped: .*found an effective tip radius of -11\.49\d mm; expected a radius above 0",
    ),
    "normals for approaches": (
        lambda case: frame_of(case, **flipped(case)),
        r"the approaches are reversed: they point out of the faces.*found positions that change by -1\.\d+ mm per",
    ),
    "inches": (
        lambda case: frame_of(case, **{name: case.recording.frame[name] / 25.4 for name in POSITION}),
        r"looks like inches: a span of 4\.4\d+ where 11\d\.\d mm",
    ),
    "metres": (
        lambda case: frame_of(case, **{name: case.recording.frame[name] / 1e3 for name in POSITION}),
        r"looks like m: a span of 0\.11\d+ where 11\d\.\d mm",
    ),
    "compensated": (
        lambda case: replace(
            frame_of(
                case,
                **dict(zip(POSITION, (case.recording.position_mm + 1.5 * case.recording.approach).T, strict=True)),
            ),
            comments={"tip_radius_mm": "1.5", "points": "tip centres"},
        ),
        r"compensated by the tip radius, not tip centres; found an effective radius of -0\.00\d+ mm; expected about",
    ),
    "diameter": (
        lambda case: stated(case, tip_radius_mm="3"),
        r"a diameter was taken for the radius; found an effective radius of 1\.49\d+ mm; expected about tip",
    ),
    "radius": (lambda case: stated(case, tip_radius_mm="0.75"), "a radius was taken for the diameter"),
}


@pytest.mark.parametrize("name", LIES)
@pytest.mark.parametrize("verb", ["evaluate", "diagnose", "import"])
def test_every_verb_refuses_with_the_same_evidence(tmp_path: Path, name: str, verb: str) -> None:
    lie, words = LIES[name]
    path = tmp_path / "recording.csv"
    if (verb, name) == ("import", "compensated"):
        words = "the points are said to be tip centres, but they are compensated"
    write_recording(path, lie(CASE))
    with pytest.raises(InputError, match=words) as error:
        run(verb, path, CASE.gauge)
    assert "recording.csv" in str(error.value)


def run(verb: str, path: Path, gauge: Gauge) -> None:
    if verb == "import":
        import_log(path, "csv", gauge)
    elif verb == "diagnose":
        diagnose(read_recording(path), gauge, make_machine(tip_radius_mm=1.5))
    else:
        evaluate(read_recording(path), gauge)


def test_a_large_pretravel_is_no_lie(tmp_path: Path) -> None:
    """R_eff is 0.4 mm below the stated radius, as with a soft probe and a long delay."""
    late = CASE.recording.position_mm + 0.4 * CASE.recording.approach
    recording = frame_of(CASE, **dict(zip(POSITION, late.T, strict=True)))
    radius = evaluate(replace(recording, comments={"tip_radius_mm": "1.5"}), CASE.gauge).results[0].radius
    assert radius.r_eff_mm == pytest.approx(1.5 - 0.003 - 0.4, abs=0.003)


def test_the_truth_passes(tmp_path: Path) -> None:
    path = tmp_path / "recording.csv"
    comments = {"gauge_serial": "T-1", "gauge": "Test gauge (serial no. T-1), steel", "tip_radius_mm": "1.5"}
    write_recording(path, stated(CASE, **comments))
    recording = read_recording(path)
    assert evaluate(recording, CASE.gauge).results[0].left_out == ()
    found = diagnose(recording, CASE.gauge, make_machine(tip_radius_mm=1.5))
    assert (found.findings, found.unexplained) == ((), ())
    assert len(import_log(path, "csv", CASE.gauge).recording) == len(recording)


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (293.55, r"found 293.55; expected -10 to 60 deg C \(looks like K: 293.55 K is 20.40 deg C\)"),
        (68.72, r"found 68.72; expected -10 to 60 deg C \(looks like F: 68.72 F is 20.40 deg C\)"),
        (2040.0, r"found 2040.?0?; expected -10 to 60 deg C \(K or F\?\)"),
    ],
)
@pytest.mark.parametrize("column", ["gauge_temperature_C", "scale_temperature_y_C"])
def test_temperatures_in_another_unit(tmp_path: Path, value: float, words: str, column: str) -> None:
    path = tmp_path / "recording.csv"
    write_recording(path, frame_of(CASE, **{column: value}))
    with pytest.raises(InputError, match=rf"{column} is no temperature in deg C.*{words}"):
        read_recording(path)
    with pytest.raises(InputError, match=rf"{column} is no temperature in deg C.*{words}"):
        import_log(path, "csv", CASE.gauge)


def test_a_stated_temperature_does_not_overrule_another_one_of_the_log(tmp_path: Path) -> None:
    path = tmp_path / "recording.csv"
    write_recording(path, CASE.recording)
    words = r"two temperatures of the gauge; found 25 deg C, and 20.4 deg C on average in the log"
    with pytest.raises(InputError, match=words):
        import_log(path, "csv", CASE.gauge, options=ImportOptions(gauge_temperature_C=25.0))
    same = import_log(path, "csv", CASE.gauge, options=ImportOptions(gauge_temperature_C=20.4))
    assert set(same.recording.frame["gauge_temperature_C"]) == {20.4}


def test_a_recording_that_was_cut_or_grew(tmp_path: Path) -> None:
    path = tmp_path / "recording.csv"
    write_recording(path, CASE.recording)
    lines = path.read_text().splitlines()
    assert lines[0] == "# probings: 36"
    for text, rows in ((lines[:-7], 29), ([*lines, lines[-1]], 37)):
        path.write_text("\n".join(text))
        with pytest.raises(InputError, match=f"is cut, or rows were added; found {rows} rows; expected 36"):
            read_recording(path)
        path.write_text("\n".join(text[1:]))
        assert len(read_recording(path)) == rows


@pytest.mark.parametrize("factor", [25.4, 1e-3])
def test_stated_faces_against_the_placement(tmp_path: Path, factor: float) -> None:
    path = tmp_path / "recording.csv"
    far = make_case(gauge=make_gauge(6), yaw=0.0, pitch=0.0)
    write_recording(path, frame_of(far, face=swapped(far)))
    with pytest.raises(InputError, match=r"\(fronts and backs are swapped\); found face 2, 36 of 36 rows differ"):
        far.imported(path, "csv")
    write_recording(path, frame_of(far, **{name: far.recording.frame[name] * factor for name in POSITION}))
    with pytest.raises(InputError, match=r"\(looks like .* mm is expected\)"):
        far.imported(path, "csv")


def test_a_wrong_program_is_named_with_its_line(tmp_path: Path) -> None:
    """The program of another gauge does not fit this one; that of another placement leaves no row in its place."""
    path = tmp_path / "recording.csv"
    write_recording(path, CASE.recording)
    with pytest.raises(InputError, match=r"program.txt:\d+: the measuring move meets no front face of the gauge"):
        CASE.imported(path, "csv", make_case(gauge=make_gauge(6, gap=11.0)).program())
    fewer = make_case(gauge=make_gauge(6), cycles=2).program()
    with pytest.raises(InputError, match=r"the log goes on after the last point .*found 36 points; expected 24"):
        CASE.imported(path, "csv", fewer)
    more = make_case(gauge=make_gauge(6), cycles=4).program()
    with pytest.raises(InputError, match=r"the log ends before point 37 .*cycle 4, face 1, .*found 36 points"):
        CASE.imported(path, "csv", more)
