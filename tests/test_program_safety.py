"""Only the checked plan reaches a controller: hostile templates, unread statements, speeds beyond the machine."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from benchmarks.dialects import refusal
from stepgauge.errors import InputError
from stepgauge.machine.file import MachineTable
from stepgauge.motion.moves import ProbingSettings, Program
from stepgauge.planning.log_check import log_difference
from stepgauge.planning.plan import PlanOptions, make_program
from stepgauge.planning.program import ProbingChoice, check_tool, checked_program, make_settings, program_text
from stepgauge.programs import DIALECTS
from stepgauge.programs.compare import difference, read_again
from tests.build import make_gauge, make_machine, make_pose
from tests.conftest import ROOT


def plan(**settings: float) -> Program:
    gauge = make_gauge(3)
    placement = make_pose(0.3, 0.01, origin=(100.0, -50.0, 30.0)).placement(gauge)
    return make_program(placement, gauge, PlanOptions(1, 3, cycles=1), ProbingSettings(**settings))


def changed(folder: Path, dialect: str, old: str, new: str, count: int = 1) -> Path:
    """The shipped template of a dialect with a piece replaced."""
    text = (ROOT / "templates/programs" / DIALECTS[dialect].template).read_text()
    assert old in text
    path = folder / "mine.j2"
    path.write_text(text.replace(old, new, count))
    return path


REACHES = [
    "{{ program.position_mm.put([0], [1.0]) }}",
    "{{ program.position_mm.fill(0) }}",
    "{{ points[0].measure.tip.sort() }}",
    "{{ program.position_mm.tofile('FILE') }}",
    "{{ settings.dump('FILE') }}",
    "{{ points[0].__setattr__('name', 'x') }}",
    "{{ points[0]._replace(name='x') }}",
]


@pytest.mark.parametrize("reach", REACHES)
def test_a_template_sees_values_that_it_cannot_change_or_write(tmp_path: Path, reach: str) -> None:
    template, program = tmp_path / "mine.j2", plan()
    before = program.position_mm.copy()
    template.write_text(reach.replace("FILE", str(tmp_path / "written")))
    with pytest.raises(InputError, match=r"mine\.j2:1: .*(no attribute|unsafe)"):
        program_text(program, "jinyoung", template)
    np.testing.assert_array_equal(program.position_mm, before)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.j2"]


ENDLESS = [
    "{{ 'A' * 10**9 }}{{ version }}",
    "{{ 1.0 | fixed(10**9) }}",
    "{% for i in range(99999) %}{% for j in range(99999) %}{% set k = i %}{% endfor %}{% endfor %}{{ version }}",
    "{% for i in range(99999) %}{{ version * 999 }}{% endfor %}",
    "{{ 9 ** (9 ** 9) }}{{ version }}",
    "{% macro m() %}{{ m() }}{% endmacro %}{{ m() }}{{ version }}",
]


@pytest.mark.parametrize("text", ENDLESS)
def test_a_template_without_an_end_is_ended(tmp_path: Path, text: str) -> None:
    template = tmp_path / "mine.j2"
    template.write_text(text)
    with pytest.raises(InputError, match=r"mine\.j2.*template: .*(end|memory|decimals|recursion)"):
        program_text(plan(), "jinyoung", template)


UNREAD = [
    ("linuxcnc", "G21 G90", "G20 G90"),
    ("linuxcnc", "G21 G90", "G10 L2 P1 Z-50\nG21 G90"),
    ("linuxcnc", "G21 G90", "G92 Z50\nG21 G90"),
    ("linuxcnc", "G54", "G55"),
    ("linuxcnc", "M2", "g0 z-500\nM2"),
    ("linuxcnc", "M2", "M3 S1000\nM2"),
    ("linuxcnc", "G54 ", ""),
    ("linuxcnc", "G49 ", ""),
    ("linuxcnc", " F{{ measuring }}", ""),
    ("linuxcnc", "#<_n>=0", "#<_n>=0 G1 X-500"),
    ("linuxcnc", "G38.2 {{", "G38.2 X0 {{"),
    ("linuxcnc", "F{{ travel }}", "F{{ loop.index * 100 }}"),
    ("linuxcnc", "G1 {{ xyz(move.tip) }} F{{ travel }}", "G0 {{ xyz(move.tip) }}"),
    ("linuxcnc", "#<_search_mm>={{ settings.search_mm | fixed(6) }}\n", ""),
    ("linuxcnc", "G1 {{", "; {{ '\\x0c' }}G1 {{"),
    ("dmis", "D(MCS)=DATSET/MCS", "D(X)=DATSET/DAT(A),XDIR"),
    ("dmis", "D(MCS)=DATSET/MCS\n", ""),
    ("dmis", "SNSLCT/S({{ program.tool }})", "SNSLCT/S(OTHER)"),
    ("dmis", "SNSLCT/S({{ program.tool }})\n", ""),
    ("dmis", "MODE/PROG,MAN", "MODE/AUTO"),
    ("dmis", "PRCOMP/OFF\n", ""),
    ("dmis", "SNSET/RETRCT,{{ settings.retract_mm | fixed(6) }}\n", ""),
    ("dmis", "{% for point in points %}", "{% for point in points %}\nFEDRAT/POSVEL,MPM,{{ loop.index }}.0"),
    ("dmis", "(2 * settings.tip_radius_mm)", "(settings.tip_radius_mm)"),
    ("ippdme", "{{ send('SetCoordSystem(MachineCsy)') -}}\n", ""),
    ("ippdme", "SetCoordSystem(MachineCsy)", "SetCoordSystem(PartCsy)"),
    ("ippdme", "SetTool(\"' ~ program.tool ~ '\")", 'SetTool("Other")'),
    ("ippdme", "{{ send('EndSession()') -}}", "{{ send('Home()') -}}\n{{ send('EndSession()') -}}"),
    ("jinyoung", "END;", "MV 0 0 0 ;\nEND;"),
    ("fanuc", "G21 G90", "G20 G90"),
    ("fanuc", "G80 {{ control.offset }}", "G80 G55"),
    ("fanuc", "#100=", "#99="),
    ("fanuc", "IF [#4008 NE 43] GOTO 9003\n", ""),
    ("fanuc", "\nM30\n", "\nM3 S1000\nM30\n"),
    ("fanuc", "\nM30\n", "\nG01 X0 Y0 Z0 F10\nM30\n"),
    ("fanuc", "\nM30\n", "\nG65 P8000\nM30\n"),
    ("fanuc", "N9002 ", "N9012 "),
    ("fanuc", "LT 0.01] GOTO 9002", "GT 0.01] GOTO 9002"),
    ("siemens", "G710", "G700"),
    ("siemens", "STOPRE\nIF $AC_MEA[1]==0", "IF $AC_MEA[1]==0"),
    ("siemens", "IF $P_TOOLNO==0 GOTOF NOTOOL\n", ""),
    ("siemens", "{{ control.offset }}\nM5", "G55\nM5"),
    ("siemens", "M30\nOBS", "G0 X=0\nM30\nOBS"),
    ("heidenhain", "BEGIN PGM STEPGAUGE MM", "BEGIN PGM STEPGAUGE INCH"),
    ("heidenhain", "M30", "L X+0 Y+0 Z+0 R0 F1\nM30"),
    ("heidenhain", " MB {{ way }}", " MB 0.5"),
    ("heidenhain", "IX{{ p.x | signed(6) }}", "IX{{ p.y | signed(6) }}"),
    ("grbl", "P6 X0", "P6 X5"),
    ("grbl", "G59\n", ""),
    ("grbl", "G92.1\n", ""),
    ("grbl", "G54\nM2", "G54\nG1 X0 Y0 Z0\nM2"),
    ("grbl", "M0\n", "G10 L20 P6 X0 Y0 Z0\nM0\n"),
    ("rrf", "{{ control.offset }}\nvar", "G55\nvar"),
    ("rrf", "G21\n", ""),
    ("rrf", "M558 K{{ control.probe }} F{{ measuring }}\nG38.2", "G38.2"),
    ("rrf", "G38.2 K{{ control.probe }}", "G38.2 K9"),
    ("rrf", "result != 0", "result == 0"),
    ("rrf", '"END"\nM121', '"END"\nG1 X0 Y0 Z0 F100\nM121'),
]


@pytest.mark.parametrize(("dialect", "old", "new"), UNREAD)
def test_a_text_that_may_do_something_else_than_planned_is_no_program(
    tmp_path: Path, dialect: str, old: str, new: str
) -> None:
    template = changed(tmp_path, dialect, old, new)
    with pytest.raises(InputError, match=r"cannot be read back|another one than planned|control character|xyz"):
        program_text(plan(), dialect, template)


@pytest.mark.parametrize("dialect", [name for name, one in DIALECTS.items() if not one.family])
def test_an_unchanged_copy_of_the_shipped_template_makes_the_same_text(tmp_path: Path, dialect: str) -> None:
    own = changed(tmp_path, dialect, "", "")
    assert program_text(plan(), dialect, own).text == program_text(plan(), dialect).text


@pytest.mark.parametrize("dialect", ["dmis", "linuxcnc", "ippdme"])
def test_a_speed_that_its_digits_round_away_is_seen(dialect: str) -> None:
    with pytest.raises(InputError, match=r"measuring speed 0 mm/s, planned 1e-07 mm/s|the feed must be positive"):
        program_text(plan(measuring_speed_mm_s=1e-7), dialect)


def test_a_dialect_without_comments_asks_the_template_to_say_that_it_is_not_checked(tmp_path: Path) -> None:
    template = changed(tmp_path, "ippdme", "SetCoordSystem(MachineCsy)", "AlignTool(1)")
    with pytest.raises(InputError, match=r"cannot say that it is not checked; expected \{\{ checked \}\}"):
        program_text(plan(), "ippdme", template, unchecked=True)


def test_the_stylus_points_where_the_plan_was_checked_with(tmp_path: Path) -> None:
    """A steep gauge is clear of a stylus that stands square to it, and of no other."""
    gauge, pose = make_gauge(5), make_pose(0.3, 1.0)
    square = tuple(float(value) for value in -pose.rotation[2])
    machine = make_machine(stylus_direction=square)
    settings = make_settings(gauge, machine, 2.0, ProbingChoice())
    program = checked_program(pose.placement(gauge), gauge, machine, PlanOptions(1, 5, cycles=1), settings)
    assert f"{square[0]:.9f},{square[1]:.9f},{square[2]:.9f},4.000000" in program_text(program, "dmis").text
    template = changed(tmp_path, "dmis", "{{ ijk(program.stylus) }}", "0.0,0.0,-1.0")
    with pytest.raises(InputError, match=r"the stylus points along \(0\.0, 0\.0, -1\.0\), planned"):
        program_text(program, "dmis", template)


def test_speeds_are_held_against_the_machine() -> None:
    gauge, machine = make_gauge(3), make_machine()  # measures at 3 mm/s, travels at 50 mm/s
    for choice in (
        ProbingChoice(measuring_speed_mm_s=3000.0),
        ProbingChoice(measuring_speed_mm_s=12.1),
        ProbingChoice(measuring_speed_mm_s=1e-7),
        ProbingChoice(travel_speed_mm_s=51.0),
    ):
        with pytest.raises(InputError, match=r"--(measuring|travel)-speed: .* beyond the limit"):
            make_settings(gauge, machine, 2.0, choice)
    table = MachineTable(
        **{**machine.table.model_dump(), "max_travel_speed_mm_s": 80.0, "max_measuring_speed_mm_s": 2.0}
    )
    limited = type(machine)(table, machine.probe)
    fast = ProbingChoice(measuring_speed_mm_s=1.5, travel_speed_mm_s=80.0)
    assert make_settings(gauge, limited, 2.0, fast).travel_speed_mm_s == 80.0
    with pytest.raises(InputError, match=r"found 3 mm/s; expected 0\.01 to 2 mm/s"):
        make_settings(gauge, limited, 2.0, ProbingChoice())


def test_the_tool_has_the_name_that_its_controller_knows() -> None:
    for dialect, words in (("dmis", "SNSLCT/S(RUBY4)"), ("ippdme", 'SetTool("RUBY4")')):
        named = Program(**{**plan().__dict__, "tool": "RUBY4"})
        assert words in program_text(named, dialect).text
    assert "tool StepGaugeProbe must have 2 mm" in program_text(plan(), "ippdme").note
    for dialect, name in (("linuxcnc", "RUBY4"), ("ippdme", 'x") Home("')):
        with pytest.raises(InputError, match="tool: "):
            check_tool(name, dialect)


HAZARDS = [
    # the ten inputs of the findings: shipped template, what is changed, the word and what is expected instead
    (
        "dmis",
        "SNSET/APPRCH",
        "USE/DID(RESULTS)\nSNSET/APPRCH",
        r":\d+: .*'USE/DID\(RESULTS\)'; expected .*dialects\(.dmis.\)",
    ),
    ("fanuc", "G01 {{ xyz", "G53 G01 {{ xyz", r":\d+: .*found 'G01X.*expected not"),
    ("fanuc", "#121=#4001", "M97 P9001\n#121=#4001", r":\d+: .*'M97'; expected M0, M5, M19, M30"),
    ("fanuc", "#121=#4001", "G17 ; G0 Z-500.\n#121=#4001", r":\d+: .*';G0Z-500.'"),
    ("fanuc", "p.x | fixed(4) }} Y", "p.x | fixed(0) }} Y", r":\d+: .*found 'X-?\d+'; expected X with .*decimal point"),
    ("fanuc", "#121=#4001", "#5223=-100.\n#121=#4001", r":\d+: .*'5223=-100.'; expected 3006 or 3000 .*101 to 119"),
    (
        "heidenhain",
        "; point",
        'FN12: IF Q5 LT 99999 GOTO LBL "A{{point.number}}"\nCALL PGM CRASH\nLBL "A{{point.number}}"\n; point',
        "'CALL PGM CRASH'",
    ),
    ("ippdme", "GoTo(' ~", "GoTo(Z(-500), ' ~", r":\d+: a field twice in a command; found Z\("),
    ("rrf", "M120\n", 'M291 P"x" S3 G1 Z-500\nM120\n', r":\d+: .*'G1 Z-500'; expected nothing more"),
    ("siemens", "R91=$AA", "IF R91<99999 GOTOF AB{{point.number}}\nL9000\nAB{{point.number}}:\nR91=$AA", "'L9000'"),
]


@pytest.mark.parametrize(("dialect", "old", "new", "words"), HAZARDS)
def test_what_is_not_in_the_table_is_named_with_line_and_word(
    tmp_path: Path, dialect: str, old: str, new: str, words: str
) -> None:
    with pytest.raises(InputError) as refused:
        program_text(plan(), dialect, changed(tmp_path, dialect, old, new))
    assert re.search(words, str(refused.value)), refused.value


BRANCHES = [
    ("fanuc", "#100=", "IF [#106 GT 999] GOTO 50\nG01 X0. Y0. Z0. F10.\nN50\n#100=", "each way goes on in its own way"),
    ("fanuc", "#100=", "IF [#106 GT 999] GOTO 50\nG91\nN50\n#100=", "not in the table"),
    ("fanuc", "#100=", "IF [#106 GT 999] GOTO 50\nM19\nN50\n#100=", "each way goes on in its own way"),
    ("fanuc", "#100=", "GOTO 50\nG01 X0. Y0. Z0. F10.\nN50\n#100=", "no way comes to"),
    ("fanuc", "#100=", "N50\nIF [#106 GT 999] GOTO 50\n#100=", "a jump backwards"),
    ("fanuc", "N9002 #3000=2 (FACE NOT FOUND)", "N9002 G01 Z0.\n#3000=2", "each way goes on|no way comes to"),
    ("fanuc", "N9003 ", "N9002 ", "the label stands twice|cut short"),
    ("fanuc", "GT 0.01] GOTO 9001", "GT 900.] GOTO 9001", "a contact on this way does not stop"),
    ("fanuc", "LT 0.01] GOTO 9002", "LT -1.] GOTO 9002", "a search without a contact does not stop"),
    ("fanuc", "#4008 NE 43", "#4008 EQ 0", "tool length not stated"),
    ("siemens", "==1 GOTOF OBS", "==7 GOTOF OBS", "a contact on this way does not stop"),
    ("siemens", "==0 GOTOF MISSED", "==7 GOTOF MISSED", "a search without a contact does not stop"),
    ("siemens", 'MISSED: MSG("ALARM: face not found")\nM0', "MISSED: G1 Z=0", "each way goes on|no way comes to"),
    ("heidenhain", "Q8 LT 0", "Q8 LT -5", "a search without a contact does not stop"),
    (
        "heidenhain",
        '\nLBL "NOTRIGGER"\n',
        '\nLBL "NOTRIGGER"\nL X+0 Y+0 Z+0 R0 F1\n',
        "each way goes on|no way comes to",
    ),
    ("rrf", '  abort "face', '  G1 Z0\n  abort "face', "each way goes on"),
    ("rrf", "> 0.05}", "> 5000}", "a contact on this way does not stop"),
    ("rrf", "result != 0", "result > 5", "a search without a contact does not stop"),
    ("rrf", "if {{ '{' }}result", "M400\nif {{ '{' }}result", "a search without a contact does not stop"),
    (
        "grbl",
        "G38.2 {{ xyz(point.measure.search_end)",
        "G1 {{ xyz(point.measure.tip)",
        "a contact on this way does not stop",
    ),
]


@pytest.mark.parametrize(("dialect", "old", "new", "words"), BRANCHES)
def test_every_way_through_a_program_is_the_planned_one_or_ends_without_a_move(
    tmp_path: Path, dialect: str, old: str, new: str, words: str
) -> None:
    with pytest.raises(InputError, match=words):
        program_text(plan(), dialect, changed(tmp_path, dialect, old, new))


EVERYWHERE = {
    "fanuc": r"""
(A % B)
#1=16
G#1
G#121
G10 L2 P1 Z0.
G52 Z1.
G68 X0. Y0. R10.
M98 P1
G65 P8000
#3007=1
#[5221]=1.
/G0 Z0.
G1 X1. X2.
WHILE [1 EQ 1] DO1
G28 Z0.
#100=5
G17 G18
""",
    "haas": r"""
M97 P1
M59 P5
G103 P1 X1.
G65 P9810 X1.
M96 P1 Q1
""",
    "siemens": r"""
WRITE(RET,"OTHER_LOG","x")
EXTCALL("A")
TRANS X1
G153 Z0
SUPA G0 Z0
$P_UIFR[1]=0
R1=5
; $PATH=/_N_SPF_DIR
L6
GOTOB NOFILE
G1 X=IC(5)
MEAS=-1 G1 X=1
T1 D1
G0 G1 X=1
""",
    "heidenhain": r"""
L Z-5 R0 FMAX M91
L IZ-5 R0 F10
TRANS DATUM AXIS Z5
CYCL DEF 7.0 DATUM SHIFT
FN17: SYSWRITE ID 50 NR1 =0
FN16: F-PRINT TNC:\A.A / TNC:\B.TXT
M3
M0 M3
TOOL CALL 1 Z
LBL 0
CALL LBL 1
CYCL DEF 13.1 ANGLE +0
TCH PROBE 4.2 IX+1 IY+0 IZ+0
Q114 = +5
""",
    "linuxcnc": r"""
(DEBUG,#5061)
(PRINT,x)
(LOGOPEN,../x.ngc)
(MSG,x)
; py,import os
%
(py,1)
(abort,x)
o1 call
#5221=1
#1=5
G10 L2 P1 Z0
G92 Z5
G43 H1
M66 P0 L3 Q1
M100
G1 X[1+1]
T1 M6
""",
    "grbl": r"""
$J=G91X1F1
$H
(A ! B)
(A ~)
; ?
(MSG,x)
G92 Z0
G10 L20 P6 Z0
G28
G53 G0 Z0
M3 S1
G43.1 Z1
$130=1
[ESP1]
G38.4 Z0 F1
""",
    "rrf": r"""
echo >"0:/sys/config.g" "x"
echo >>"0:/sys/other.txt" "x"
M98 P"x.g"
set var.search = 9
M208 Z0
G10 L2 P1 Z0
while true
; printing object A
G92 Z0
T0
M290 S1
G1 X{1+1}
M28 "a.g"
M112
global a = 1
G1 H2 Z5
M558 K0 F100 P5
elif true
M291 P"x" S0
""",
    "dmis": r"""
USE/DID(X)
CALL/M(X)
SNSET/CLRSRF,5
ROTATE/X
TRANS/XORIG,5
D(X)=ROTATE/ZAXIS,5
GOHOME
GOTO/INCR,0,0,-5
DATSET/MCS
MODE/AUTO
DMEHW/CONTIN
CALIB/SENS,S(PROBE),F(X),9
IF/(1.EQ.1)
OPEN/DID(X),FDATA
WRITE/DID(X),'A'
SNSDEF/PROBE
JUMPTO/(X)
GOTO/1,2,3,4
ACLRAT/POSACL,G,1
""",
    "ippdme": r"""
90001 GoTo(X(1), X(2), Y(1), Z(1))
90001 SetCsyTransformation(PartCsy, 1, 2, 3, 4, 5, 6)
90001 AbortE()
90001 AlignTool(0,0,1,5)
90001 SetTool("Other")
90001 GoTo(R(5))
90001 EnableUser()
E0001 AbortE()
90001 GoTo(X(1e3), Y(0), Z(0))
90001 SetProp(Tool.PtMeasPar.Speed.Max(5))
90001 ScanOnLine()
""",
    "jinyoung": r"""
MV 1 2 3
MV 1 2 3 ; MV 4 5 6 ;
PO 2 ;
MX 1 2 3 ;
MV 1,2,3 ;
SET 1 ;
""",
}


@pytest.mark.parametrize("dialect", EVERYWHERE)
def test_a_statement_outside_of_the_table_is_refused_wherever_it_stands(dialect: str) -> None:
    """Before and behind every line of a program; the shipped text itself is read."""
    program, known = plan(), DIALECTS[dialect]
    lines = program_text(program, dialect).text.splitlines()
    for hazard in EVERYWHERE[dialect].strip().splitlines():
        for place in range(1, len(lines), max(1, len(lines) // 12)):
            text = "\n".join([*lines[:place], hazard, *lines[place:]])
            try:
                refused = difference(program, read_again(text, known, program.settings), known) is not None
            except InputError:
                refused = True
            assert refused, f"{hazard} at line {place + 1}"


LOGS = [
    ("fanuc", "#112=#5062", "#112=#5062+0.003", r"line \d+ of the log: y = "),
    ("fanuc", "#113=#5063-#106", "#113=#5063", r"^$"),  # without a tool length in the register it is the same
    ("fanuc", "{{ control.digits }}", "43", r"the log is not what|of the log: "),
    ("fanuc", "#110={{ point.number }}", "#110=1", "not numbered 1, 2, 3"),
    ("siemens", "R91=$AA_MW[X]\nR92=$AA_MW[Y]", "R91=$AA_MW[Y]\nR92=$AA_MW[X]", "of the log: "),
    ("heidenhain", "DECIMALS4 )\nQS4", "DECIMALS5 )\nQ6 = Q5\nQS4", "of the log: y"),
    ("linuxcnc", "%.7f#5061", "%.3f#5061", "of the log: x"),
    ("rrf", '" Y" ^', '" Y0" ^', "what the probe says; found log:2: not a point"),
    (
        "dmis",
        "OUTPUT/FA({{ point.name }})",
        "{% if loop.first %}\nOUTPUT/FA({{ point.name }})\n{% endif %}",
        "1 points in the log, 6",
    ),
]


@pytest.mark.parametrize(("dialect", "old", "new", "words"), LOGS)
def test_the_log_of_a_program_holds_what_the_probe_says(
    tmp_path: Path, dialect: str, old: str, new: str, words: str
) -> None:
    template = changed(tmp_path, dialect, old, new)
    if words == "^$":
        assert "the log" not in program_text(plan(), dialect, template).note
        return
    with pytest.raises(InputError, match=words):
        program_text(plan(), dialect, template)


def test_a_log_in_a_form_of_ones_own_is_said_not_to_be_checked(tmp_path: Path) -> None:
    own = changed(tmp_path, "linuxcnc", "(LOG,%d#<_n> %.7f#5061 %.7f#5062 %.7f#5063 %d#5070)", "(LOG,POINT %d#<_n>)")
    assert "was not checked" in program_text(plan(), "linuxcnc", own).note


OPTIONS = [
    ("fanuc", "probe_on", "#5223=-100.", "none, G65 P9832"),
    ("fanuc", "probe_on", "M97 P1", "none, G65 P9832"),
    ("fanuc", "orient", "; G0 Z-500.", "M19, none"),
    ("haas", "probe_on", "M13", "M59 P1134, G65 P9832, none"),
    ("heidenhain", "spindle_deg", "+0 M3", "a number from -360 to 360 deg"),
    ("siemens", "spindle_deg", "nan", "a number from -360 to 360 deg"),
    ("fanuc", "digits", "41", "34, 44"),
    ("fanuc", "digits", "42", "34, 44"),
    ("fanuc", "length_in_z", "maybe", "parameter, yes, no"),
    ("heidenhain", "length_in_z", "YES", "yes, no"),
    ("heidenhain", "mask", "a/b.A", "a name that ends in .A"),
    ("heidenhain", "folder", "TNC:\\A\\..\\", "TNC:"),
    ("heidenhain", "file", "OUT.H", "ends in .TXT or .LOG"),
    ("dmis", "file", "x'y", "a file name"),
    ("dmis", "file", "A.DMI", "a file name"),
    ("dmis", "device", "A)=B", "a letter, then"),
    ("dmis", "sphere", "25 mm", "a number from 1 to 100 mm"),
    ("siemens", "file", "L9000_SPF", "the name of the log"),
    ("siemens", "offset", "G58", "G54, G55"),
    ("rrf", "file", "0:/sys/config.g", ".txt, .log or .csv"),
    ("rrf", "probe", "0.5", "a whole number from 0 to 31"),
    ("fanuc", "number", "9832", "a whole number from 1 to 7999"),
    ("fanuc", "open", "POPEN G0", "POPEN, none"),
    ("fanuc", "look_ahead", "G53 Z0", "G53, G04 P1, none"),
]


@pytest.mark.parametrize(("dialect", "name", "value", "expected"), OPTIONS)
def test_a_value_of_an_option_is_of_its_type(dialect: str, name: str, value: str, expected: str) -> None:
    with pytest.raises(InputError) as refused:
        program_text(plan(), dialect, options={name: value})
    assert f"{name} is not of its type; found {value!r}; expected " in str(refused.value)
    assert expected in str(refused.value)


@pytest.mark.parametrize("dialect", DIALECTS)
def test_shipped_templates_with_any_options_are_read(dialect: str) -> None:
    random = np.random.default_rng(3)
    assert [refusal(DIALECTS[dialect], random) for _ in range(3)] == [None] * 3


def test_names_that_a_controller_would_execute_are_words_in_a_comment() -> None:
    for name in ("PROBEOPEN x", "Layer 5", "MSG,hello", "x" * 300, "printing object", "%"):
        for dialect in DIALECTS:
            text = program_text(Program(**{**plan().__dict__, "name": name}), dialect)
            assert len(text.text.splitlines()) > plan().n_points


def _relaid(dialect: str, text: str) -> str:
    """The same program in another layout: block numbers, other blanks and comments, other order of words."""
    lines, family = [], DIALECTS[dialect].family or dialect
    for number, line in enumerate(text.splitlines(), 1):
        words = line.split(" ")
        if family in ("fanuc", "linuxcnc", "grbl") and line[:1] in "GM" and len(words) > 3 and words[-1][0] == "F":
            line = "".join([f"N{number}", words[-1], *words[:-1]]) + " (note: 1/2)"
        elif family == "siemens" and line[:3] in ("G1 ", "MEA", "OBS", "STO"):
            line = f"N{10 * number} " + re.sub("([XYZ])=", r"\1", line).lower() + "  ; a note"
        elif family == "heidenhain":
            line = f"{number} " + line.replace("FN16: ", "FN 16:").replace(" = ", "=")
        elif family == "rrf":
            line = re.sub("^  ", "     ", line).replace(" ^ ", "^").replace(" X", "  X")
        elif family == "dmis" and "'" not in line:
            line = line.lower().replace(",", ", ").replace("/", " / ")
        elif family == "ippdme":
            line = re.sub(r"(GoTo|PtMeas)\((X\(.*?\)), (Y\(.*?\)), (Z\(.*?\))", r"\1(\4,\2, \3", line)
        elif family == "jinyoung":
            line = "  " + line.replace(" ", "\t ")
        lines += [line] if line.endswith("$") else [line, ""]
    return "\r\n".join(lines)


@pytest.mark.parametrize("dialect", DIALECTS)
def test_the_same_words_in_a_foreign_layout_are_the_same_program(dialect: str, tmp_path: Path) -> None:
    known = DIALECTS[dialect]
    program = known.slowed(plan())
    text = _relaid(dialect, program_text(program, dialect).text)
    assert difference(program, read_again(text, known, program.settings), known) is None
    assert known.log_decimals is None or log_difference(text, program, known) is None
    judge = shutil.which("rs274")
    if dialect in ("linuxcnc", "grbl") and judge:  # LinuxCNC's own interpreter reads the layout, too
        (tmp_path / "p.ngc").write_text(text)
        done = subprocess.run([judge, "-g", "p.ngc"], cwd=tmp_path, capture_output=True, text=True, timeout=60)
        assert done.returncode == 0, done.stderr
        assert done.stdout.count("STRAIGHT_") > program.n_points
