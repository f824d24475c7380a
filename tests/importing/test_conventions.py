"""What a log does that its program does not say: touches again, alarms, inches, another origin, turned tables."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stepgauge.errors import InputError
from stepgauge.importing.build import ImportOptions
from stepgauge.importing.formats import FORMATS
from stepgauge.importing.logs import import_log
from stepgauge.importing.result import Imported
from stepgauge.importing.tables.read import TableLayout
from tests.importing.made import RADIUS_MM, Case, make_case

CASE = make_case(yaw=0.0, pitch=0.0, cycles=2)
PROGRAM = CASE.program("grbl")
SIGN = np.where(CASE.recording.frame["face"].to_numpy() % 2 == 1, 1.0, -1.0)
AXIS = CASE.placement.axis
PRINTED = CASE.recording.position_mm.round(3)


def prb(position_mm: np.ndarray, unit: float = 1.0, digits: int = 3, more: str = "") -> str:
    return f"[PRB:{','.join(f'{value / unit:.{digits}f}' for value in position_mm)}{more}:1]\nok\n"


def console(*touches_um: float, along: bool = True, shift: tuple[float, ...] = (0.0, 0.0, 0.0), **how: float) -> str:
    """Every point touched as often as there are numbers, so many um too far each time."""
    text = ""
    for point, sign in zip(PRINTED, SIGN, strict=True):
        for off in touches_um or (0.0,):
            text += prb(point + 1e-3 * off * (sign if along else 1.0) * AXIS + shift, **how)  # type: ignore[arg-type]
    return text


def imported(
    tmp_path: Path, text: str, *accept: str, case: Case = CASE, program: bool = True, unit: str = ""
) -> Imported:
    path = tmp_path / "console.log"
    path.write_text(text)
    layout = replace(TableLayout(), unit=unit) if unit else None
    options = ImportOptions(tip_radius_mm=RADIUS_MM, accept=accept)
    return import_log(path, "grbl", case.gauge, case.placement, PROGRAM if program else None, options, layout)


def words(result: Imported, what: str) -> list[str]:
    return [line for line in result.report if what in line]


@pytest.mark.parametrize("program", [True, False])
@pytest.mark.parametrize("along", [True, False])
@pytest.mark.parametrize("touches", [(21.0, 0.0), (21.0, 1.0, 0.0), (-8.0, 0.0)])
def test_fast_then_slow_is_recognised_and_the_slow_touch_is_the_reading(
    tmp_path: Path, touches: tuple[float, ...], along: bool, program: bool
) -> None:
    result = imported(tmp_path, console(*touches, along=along), program=program)
    np.testing.assert_allclose(result.recording.position_mm, PRINTED, atol=1e-9)
    assert result.recording.frame["cycle"].tolist() == CASE.recording.frame["cycle"].tolist()
    (told,) = words(result, "touched")
    assert f"{len(touches)} times in a row, the first {touches[0]:+.1f} and" in told
    assert f"dropped: {(len(touches) - 1) * len(PRINTED)} rows" in told


def test_touches_without_a_system_are_asked_for_with_a_program_and_repeats_without(tmp_path: Path) -> None:
    random = np.random.default_rng(3)
    text = "".join(prb(point + random.normal(0.0, 2e-3) * AXIS) + prb(point) for point in PRINTED)
    with pytest.raises(InputError, match=r"a reading is repeated.*accept=.doubled. takes the last touch of each"):
        imported(tmp_path, text)
    result = imported(tmp_path, text, "doubled")
    np.testing.assert_allclose(result.recording.position_mm, PRINTED, atol=1e-9)
    repeats = imported(tmp_path, text, program=False).recording
    assert len(repeats) == 2 * len(PRINTED)
    assert repeats.frame["cycle"].max() == 4


def test_two_points_touched_again_are_no_convention(tmp_path: Path) -> None:
    again = [3, 7]
    text = "".join(prb(point + 0.021 * AXIS) * (n in again) + prb(point) for n, point in enumerate(PRINTED))
    with pytest.raises(InputError, match="a reading is repeated"):
        imported(tmp_path, text)
    assert np.allclose(imported(tmp_path, text, "doubled").recording.position_mm, PRINTED)


ALARMS = {
    "ALARM:1": "ALARM:1",
    "ALARM:4": "ALARM:4",
    "ALARM: Hard limit. MPos?": "ALARM:Hard limit",
    "<Alarm|MPos:1.000,2.000,3.000|FS:0,0>": "state Alarm",
    "Grbl 1.1h ['$' for help]": "a restart of the controller",
    "GrblHAL 1.1f ['$' or '$HELP' for help]": "a restart of the controller",
}


def test_failures_that_are_no_alarms_are_told(tmp_path: Path) -> None:
    result = imported(tmp_path, "Grbl 1.1h ['$' for help]\n" + console() + "error:20\n")
    (line,) = words(result, "reported by the controller")
    assert line.startswith("reported by the controller: error:20 in line")


@pytest.mark.parametrize("error", ["E0000 ! Error(3, 0512, M, Collision)", "00004 ! Error(9, 0006, M, Fatal)"])
def test_a_machine_that_stopped_by_itself_in_an_i_plus_plus_session(tmp_path: Path, error: str) -> None:
    def touch(tag: int, point: np.ndarray, sign: float) -> str:
        normal = ",".join(f"{value:.9f}" for value in -sign * AXIS)
        xyz = ",".join(f"{axis}({value:.6f})" for axis, value in zip("XYZ", point, strict=True))
        return f"{tag:05d} PtMeas({xyz},IJK({normal}))\n{tag:05d} # {xyz}\n{tag:05d} %\n"

    pairs = zip(CASE.recording.position_mm, SIGN, strict=True)
    text = [touch(n, *pair) for n, pair in enumerate(pairs, 10)]
    stop = "" if error.startswith("E") else "00004 GoTo(X(1))\n"
    path = tmp_path / "session.log"
    path.write_text("".join([*text[:5], stop, error + "\n", *text[5:], "90000 EndSession()\n"]))
    with pytest.raises(InputError, match=r"an alarm in the middle of the run.*accept=.alarm."):
        import_log(path, "ippdme", CASE.gauge, CASE.placement)
    accepted = import_log(path, "ippdme", CASE.gauge, CASE.placement, options=ImportOptions(accept=["alarm"]))
    np.testing.assert_allclose(accepted.recording.position_mm, CASE.recording.position_mm, atol=1e-6)


@pytest.mark.parametrize("alarm", ALARMS)
def test_readings_after_an_alarm_are_asked_for(tmp_path: Path, alarm: str) -> None:
    lines = console().splitlines()
    text = "\n".join([*lines[:20], alarm, "[MSG:Caution: Unlocked]", "error:9", *lines[20:]])
    after = len(PRINTED) - 10
    with pytest.raises(
        InputError, match=rf"console.log:21: an alarm .*found {ALARMS[alarm]}.*, and {after} of .*accept=.alarm."
    ):
        imported(tmp_path, text)
    result = imported(tmp_path, text, "alarm")
    assert words(result, f"warning: {ALARMS[alarm]}")
    np.testing.assert_allclose(result.recording.position_mm, PRINTED, atol=1e-9)


def test_an_alarm_that_ended_the_run_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"before point 5 .*ALARM:5.* end for end, or the placement wrong") as early:
        imported(tmp_path, "\n".join(console().splitlines()[:8]) + "\nALARM:5\n")
    assert "as it is" not in str(early.value)  # hardly anything was measured
    assert "run it again" in str(early.value)
    most = "\n".join(console().splitlines()[:-2]) + "\nALARM:5\n"
    with pytest.raises(InputError, match=r"the log ends before point 16 .*ALARM:5.*as it is"):
        imported(tmp_path, most)
    with pytest.raises(InputError, match="the last of them on the way"):
        imported(tmp_path, "\n".join(console().splitlines()[:8]) + "\nALARM:4\n")
    (told,) = words(imported(tmp_path, console() + "ALARM:5\n"), "warning: the log ends in an alarm")
    assert f"ALARM:5 (no contact within the search) in line {len(console().splitlines()) + 1}; look there" in told


def test_how_far_the_points_are_from_their_faces_shows_the_tip(tmp_path: Path) -> None:
    assert words(imported(tmp_path, console()), "points are tip centres, 1.497 mm before their faces")


@pytest.mark.parametrize("program", [True, False])
def test_a_point_that_has_lost_one_of_its_touches_is_missing(tmp_path: Path, program: bool) -> None:
    touches = console(21.0, 0.0).splitlines()
    for lost in (0, 8, 18, 22):  # a coarse or a fine touch: which, nobody can tell
        text = "\n".join(touches[:lost] + touches[lost + 2 :])
        with pytest.raises(InputError, match=r"accept=.missing."):
            imported(tmp_path, text, program=program)
        point = lost // 4
        there = imported(tmp_path, text, "missing", program=program).recording
        np.testing.assert_allclose(there.position_mm, np.delete(PRINTED, point, axis=0), atol=1e-9)


def test_touches_that_may_be_either_are_asked_for(tmp_path: Path) -> None:
    over_um = np.where(np.arange(len(PRINTED)) % 6 < 5, 3.0, -3.0)
    pairs = zip(PRINTED, over_um, SIGN, strict=True)
    text = "".join(prb(point + 1e-3 * over * sign * AXIS) + prb(point) for point, over, sign in pairs)
    with pytest.raises(InputError, match=r"fast and then slowly, or repeats.*accept=.doubled. .* or repeats"):
        imported(tmp_path, text, program=False)
    last = imported(tmp_path, text, "doubled", program=False).recording
    np.testing.assert_allclose(last.position_mm, PRINTED, atol=1e-9)
    assert len(imported(tmp_path, text, "repeats", program=False).recording) == 2 * len(PRINTED)


SHIFT = (-1200.0, 35.0, -410.5)


def test_a_shift_of_all_coordinates_is_told_and_the_recording_keeps_those_of_the_log(tmp_path: Path) -> None:
    text = console(shift=SHIFT)
    with pytest.raises(InputError, match=r"shifted as a whole.*\(-1199.999, 35.000, -410.500\).*accept=.shift."):
        imported(tmp_path, text)
    result = imported(tmp_path, text, "shift")
    np.testing.assert_allclose(result.recording.position_mm, PRINTED + SHIFT, atol=1e-9)
    assert words(result, "the recording has the coordinates of the log")
    both = imported(tmp_path, console(21.0, 0.0, shift=SHIFT), "shift")
    np.testing.assert_allclose(both.recording.position_mm, PRINTED + SHIFT, atol=1e-9)


def test_a_shift_without_a_program_asks_for_the_placement_of_the_log(tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match=r"shifted as a whole.*\(-12\d\d.\d+, 3\d.\d+, -410.\d+\) .*expected placement"
    ):
        imported(tmp_path, console(shift=SHIFT), program=False)
    moved = replace(CASE, placement=replace(CASE.placement, c1_mm=CASE.placement.c1_mm + SHIFT))
    moved = replace(moved, placement=replace(moved.placement, c2_mm=CASE.placement.c2_mm + SHIFT))
    assert len(imported(tmp_path, console(shift=SHIFT), case=moved, program=False).recording) == len(PRINTED)


def test_a_shift_along_the_gauge_alone_is_told_as_that(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"shifted as a whole.*\(-12\d\d.\d+, -?0.\d+, -?0.\d+\) .*expected placement"):
        imported(tmp_path, console(shift=(-1200.0, 0.0, 0.0)), program=False)


@pytest.mark.parametrize("numbered", [True, False])
def test_numbered_points_are_touched_again_under_their_number(tmp_path: Path, numbered: bool) -> None:
    rows = []
    for n, (point, sign) in enumerate(zip(PRINTED, SIGN, strict=True), 1):
        touches = (point + 0.021 * sign * AXIS, point)
        rows += [" ".join(f"{value:.7f}" for value in touch) for touch in touches]
        numbers = (n, n) if numbered else (2 * n - 1, 2 * n)
        rows[-2:] = [f"{number} {row} 1" for number, row in zip(numbers, rows[-2:], strict=True)]
    path = tmp_path / "log.txt"
    path.write_text("\n".join(rows))
    options = ImportOptions(tip_radius_mm=RADIUS_MM)
    if not numbered:  # the log counts its touches as points, which the program does not have
        with pytest.raises(InputError, match="the program has no such point"):
            import_log(path, "linuxcnc", CASE.gauge, CASE.placement, CASE.program("linuxcnc"), options)
        return
    result = import_log(path, "linuxcnc", CASE.gauge, CASE.placement, CASE.program("linuxcnc"), options)
    np.testing.assert_allclose(result.recording.position_mm, PRINTED, atol=1e-9)
    assert words(result, "touched 2 times in a row")


def test_a_log_that_is_cut_is_not_taken_for_a_shifted_one(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="the log ends before point 9"):
        imported(tmp_path, "\n".join(console().splitlines()[:16]))


@pytest.mark.parametrize("program", [True, False])
@pytest.mark.parametrize("stated", ["$13=1\n", "> G20\n"])
def test_inches_are_read_where_they_are_stated(tmp_path: Path, stated: str, program: bool) -> None:
    result = imported(tmp_path, stated + console(unit=25.4, digits=5), program=program)
    np.testing.assert_allclose(result.recording.position_mm, PRINTED, atol=2e-4)
    assert words(result, "inch")


def test_inches_that_nothing_states_are_asked_for(tmp_path: Path) -> None:
    text = console(unit=25.4, digits=5)
    with pytest.raises(InputError, match=r"on it where they are in inch; .*expected unit inch"):
        imported(tmp_path, text)
    result = imported(tmp_path, text, unit="inch")
    np.testing.assert_allclose(result.recording.position_mm, PRINTED, atol=2e-4)


def test_a_program_in_inches_does_not_make_reports_in_mm_inches(tmp_path: Path) -> None:
    result = imported(tmp_path, "> G20\n" + console())
    np.testing.assert_allclose(result.recording.position_mm, PRINTED, atol=1e-9)


def test_a_unit_that_contradicts_the_log_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"unit is another unit than the log states; found inch; expected mm"):
        imported(tmp_path, "$13=0\n" + console(), unit="inch")


def test_linuxcnc_states_its_unit_in_a_comment() -> None:
    rows = "1 1.5 2.5 3.5 1\n2 1.25 2.5 3.5 1\n"
    for comment, units in (("# unit: inch\n", ("inch",)), ("# G20\n", ("inch",)), ("# G21\n", ("mm",)), ("", ())):
        assert FORMATS["linuxcnc"].read(comment + rows, "log.txt").units == units


TURNED = [
    ("grbl", "[PRB:1.000,2.000,3.000,0.000:1]\n[PRB:1.000,2.000,3.000,90.000:1]\n", "log:2"),
    ("linuxcnc", "1 2 3 0 0 0 0 0 0\n1 2 3 90 0 0 0 0 0\n", "log:2"),
    ("inspection", "START\nG801 N1 X1. Y2. Z3. R1.\nG801 N2 X1. Y2. Z3. A90. R1.\nEND\n", "log:3"),
    (
        "ippdme",
        "00001 PtMeas(X(1),Y(2),Z(3))\n00001 # X(1),Y(2),Z(3),R(90)\n00001 %\n00002 EndSession()\n",
        "log:2",
    ),
]


@pytest.mark.parametrize(("source", "text", "where"), TURNED, ids=[one[0] for one in TURNED])
def test_a_table_that_was_turned_is_refused_in_every_log(source: str, text: str, where: str) -> None:
    with pytest.raises(InputError, match=rf"{where}: an axis other than x, y, z was moved; found .*90"):
        FORMATS[source].read(text, "log")


def test_the_report_that_settings_repeat_is_no_contact() -> None:
    text = prb(PRINTED[0]) + prb(PRINTED[1]) + "[G54:0.000,0.000,0.000]\n[TLO:0.000]\n" + prb(PRINTED[1])
    log = FORMATS["grbl"].read(text, "log")
    assert len(log) == 2
    assert "1 reports that $# repeats" in log.left_out[0]


SNSDEF = "FA(C1F1)=FEAT/POINT,CART,1,2,3,-1,0,0\n"


def test_the_shape_of_a_tip_behind_its_diameter() -> None:
    before = "S(P)=SNSDEF/PROBE,FIXED,CART,0,0,0,0,0,-1,"
    assert FORMATS["dmis"].read(f"{before}4.0,SPHERE\n{SNSDEF}", "out").tip_radius_mm == 2.0
    with pytest.raises(InputError, match=r"out:1: the tip is no ball; found SNSDEF .. CYLNDR"):
        FORMATS["dmis"].read(f"{before}4.0,CYLNDR,12.0\n{SNSDEF}", "out")


def departed(kinds: tuple[str, ...]) -> str:
    """The console of a run in which several things went otherwise than the program has them."""
    lines = [prb(point) for point in PRINTED]
    if "doubled" in kinds:
        lines[7] = prb(PRINTED[7] + 0.02 * SIGN[7] * AXIS) + lines[7]
    if "order" in kinds:
        lines[14], lines[15] = lines[15], lines[14]
    if "foreign" in kinds:
        lines[1] = prb(PRINTED[0] - 30.0 * AXIS) + lines[1]
    if "alarm" in kinds:
        lines[4] = "ALARM:5\n" + lines[4]
    if "missing" in kinds:
        del lines[10]
    return "".join(lines)


@pytest.mark.parametrize("kinds", list(combinations(("alarm", "doubled", "foreign", "missing", "order"), 2)))
def test_one_message_names_all_that_is_to_be_accepted(tmp_path: Path, kinds: tuple[str, ...]) -> None:
    with pytest.raises(InputError) as error:
        imported(tmp_path, departed(kinds))
    named = re.findall(r'accept="(\w+)"', str(error.value).rpartition("all together: ")[2])
    assert sorted(named) == sorted(kinds)
    found = imported(tmp_path, departed(kinds), *named).recording
    assert len(found) == len(PRINTED) - ("missing" in kinds)


def test_all_five_at_once_and_a_choice_that_leads_nowhere(tmp_path: Path) -> None:
    every = ("alarm", "doubled", "foreign", "missing", "order")
    with pytest.raises(InputError, match="all together") as error:
        imported(tmp_path, departed(every))
    named = re.findall(r'accept="(\w+)"', str(error.value).rpartition("all together: ")[2])
    assert len(imported(tmp_path, departed(every), *named).recording) == len(PRINTED) - 1
    with pytest.raises(InputError, match=r"with accept=.alarm. it is refused, too: the probing is aimed beside"):
        imported(tmp_path, departed(("alarm",)) + prb(PRINTED[0] + np.array([0.0, 40.0, 0.0])) * 40)


def test_without_a_program_a_face_that_was_missed_once_is_no_other_face(tmp_path: Path) -> None:
    text = "".join(prb(point) for n, point in enumerate(PRINTED) if n != 10) + prb(PRINTED[-1])
    with pytest.raises(InputError) as error:
        imported(tmp_path, text, program=False)
    named = re.findall(r'accept="(\w+)"', str(error.value))
    assert {"missing", "doubled"} <= set(named)
    assert len(imported(tmp_path, text, *named, program=False).recording) == len(PRINTED) - 1


@pytest.mark.parametrize(
    ("stamps", "elapsed_s"),
    [
        (("23:59:58.5", "00:00:01.5", "00:00:02"), [0.0, 3.0, 3.5]),
        (("[2026-11-02 10:00:00]", "[2026-11-02 10:00:07]", "[2026-11-02 10:00:07]"), [0.0, 7.0, 7.0]),
        (("10:00:00", "", "10:00:02"), None),
        (("10:00:00", "10:00:00", "10:00:00"), None),
        (("", "", ""), None),
    ],
)
def test_the_clock_that_a_terminal_puts_before_lines_is_their_time(stamps: Any, elapsed_s: Any) -> None:
    text = "".join(f"{stamp} [PRB:1.000,{n}.000,3.000:1]\nok\n" for n, stamp in enumerate(stamps))
    time_s = FORMATS["grbl"].read(text, "log").time_s
    assert (None if time_s is None else time_s.tolist()) == elapsed_s
