"""DMIS output as controllers write it."""

from __future__ import annotations

import numpy as np
import pytest

from stepgauge.correspondence.probe_log import ProbeLog
from stepgauge.errors import InputError
from stepgauge.importing.formats import FORMATS, gist

OUTPUT = """DMISMN/'STEP GAUGE',05.2
FILNAM/'RESULTS',05.2
DATE=2026/03/02
TIME=10:11:12
$$ a comment with FA(NONE)=FEAT/POINT,CART,1,1,1,1,0,0
UNITS/MM,ANGDEC
D(MCS)=DATSET/MCS
S(PROBE)=SNSDEF/PROBE,FIXED,CART,0.0,0.0,0.0,0.0,0.0,-1.0,4.0
PRCOMP/OFF
F(C1F1)=FEAT/POINT,CART,10.0,20.0,30.0,-1.0,0.0,0.0
fa(C1F1) = feat/point,cart,10.001,20.002,$
  30.003,-1.0,0.0,0.0
TIME=10:11:15
TEXT/OPER,'MOVE THE CLAMP'
TEXT/OUTFIL,'gauge_serial: T-1, first'
FA(C1F2)=FEAT/POINT,CART,2.0E+1,-.5,+3,0.0,0.6,$
0.8
TA(1)=TOL/CORTOL,XAXIS,0.001
FA(LINE)=FEAT/LINE,UNBND,CART,1,2,3,4,5,6,7,8,9
ENDFIL
"""


def read(text: str = OUTPUT) -> ProbeLog:
    assert FORMATS["dmis"].recognises(gist(text))
    return FORMATS["dmis"].read(text, "results.dmo")


def test_points_normals_names_and_states() -> None:
    log = read()
    np.testing.assert_array_equal(log.position_mm, [[10.001, 20.002, 30.003], [20.0, -0.5, 3.0]])
    np.testing.assert_array_equal(log.approach, [[1.0, 0.0, 0.0], [0.0, -0.6, -0.8]])
    assert list(log.label or ()) == ["C1F1", "C1F2"]
    assert log.columns["cycle"].tolist() == [1, 1]
    assert log.columns["face"].tolist() == [1, 2]
    assert log.time_s is not None
    assert log.time_s.tolist() == [0.0, 3.0]
    assert log.line.tolist() == [11, 16]
    assert log.surface is False
    assert log.tip_radius_mm == 2.0
    assert log.comments == {"date": "2026-03-02", "gauge_serial": "T-1, first"}
    assert log.cut == ""
    assert log.left_out == ("dropped: 1 F(), 1 FA() that is no POINT,CART, 1 TA(), 1 TEXT",)


@pytest.mark.parametrize(("unit", "mm"), [("INCH", 25.4), ("CM", 10.0), ("M", 1000.0), ("MM", 1.0)])
def test_units_hold_for_points_and_tip(unit: str, mm: float) -> None:
    log = read(OUTPUT.replace("UNITS/MM", f"UNITS/{unit}"))
    np.testing.assert_allclose(log.position_mm[0], np.array([10.001, 20.002, 30.003]) * mm, rtol=1e-15)
    assert log.tip_radius_mm == pytest.approx(2.0 * mm)


def test_compensation_is_taken_from_the_file() -> None:
    assert read(OUTPUT.replace("PRCOMP/OFF", "PRCOMP/ON")).surface is True
    assert read(OUTPUT.replace("PRCOMP/OFF\n", "")).surface is None


def test_another_coordinate_system_is_remarked() -> None:
    words = read(OUTPUT.replace("DATSET/MCS", "DATSET/DAT(A),ZDIR,ZORIG")).left_out
    assert "coordinates are those of the part, DATSET/DAT(A),ZDIR,ZORIG" in "; ".join(words)


def test_a_file_without_its_end_is_cut_but_a_fragment_is_not() -> None:
    assert read(OUTPUT.replace("ENDFIL\n", "")).cut == "no ENDFIL"
    assert read("FA(A)=FEAT/POINT,CART,1,2,3,0,0,1\n").cut == ""


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            "30.003,-1.0",
            "30.003,-1.1",
            r"results.dmo:11: the normal of FA\(C1F1\) is not a unit vector; found length",
        ),
        ("10.001", "10,001", r"results.dmo:11: FA\(C1F1\) needs 6 numbers"),
        ("10.001", "1O.001", r"results.dmo:11: FA\(C1F1\) is not a number; found '1O.001'"),
        ("30.003,-1.0,0.0,0.0", "30.003", r"results.dmo:11: FA\(C1F1\) needs 6 numbers"),
        ("UNITS/MM", "UNITS/FURLONG", "results.dmo:6: unit of length not understood; found UNITS/FURLONG"),
        ("PRCOMP/OFF", "PRCOMP/MAYBE", "results.dmo:9: PRCOMP not understood"),
        ("TEXT/OPER,'MOVE THE CLAMP'", "PRCOMP/ON", "results.dmo:14: PRCOMP changes between measured points"),
        ("TIME=10:11:15", "TIME=25:61:15", "results.dmo:13: TIME not understood"),
        ("0.8\n", "0.8$\n$", "the text is cut short inside a continued line"),
    ],
)
def test_what_is_not_understood_is_named_with_its_line(old: str, new: str, words: str) -> None:
    assert old in OUTPUT
    text = OUTPUT.replace(old, new)
    text = text[: text.index("$\n$") + 1] if "$\n$" in text else text
    with pytest.raises(InputError, match=words):
        read(text)


def test_names_of_other_programs_say_nothing_of_faces() -> None:
    assert read(OUTPUT.replace("C1F2", "PT2")).columns == {}
    numbered = read(OUTPUT.replace("(C1F", "(P3C1F"))
    assert numbered.columns["placement"].tolist() == [3, 3]


def test_a_label_of_too_many_digits_is_a_name_and_no_cycle() -> None:
    log = read(OUTPUT.replace("FA(C1F2)", f"FA(C{'9' * 24}F2)"))
    assert "cycle" not in log.columns
    assert len(log) == 2


def test_a_file_of_blank_lines_is_looked_through_once() -> None:
    """Twice as many lines took four times as long: 50,000 of them 69 s."""
    blank = "\n" * 300_000
    assert not FORMATS["dmis"].recognises(gist(blank))
    assert not FORMATS["ippdme"].recognises(gist("12345" + blank))
    assert len(read(blank + OUTPUT)) == 2


@pytest.mark.parametrize("word", ["SCALE/1", "MEASURED/POINT", "CLOCK", "TEXT/OPER,'x'", "STATEMENT/'x'"])
def test_other_statements_are_counted_whatever_they_are_called(word: str) -> None:
    log = read(OUTPUT.replace("ENDFIL", f"{word}\nENDFIL"))
    assert len(log) == len(read())
    assert word.split("/")[0] in log.left_out[0]


def test_of_several_tips_nobody_knows_which_one_touched() -> None:
    other = "S(LONG)=SNSDEF/PROBE,FIXED,CART,0,0,0,0,0,-1,3.0\n"
    log = read(OUTPUT.replace("PRCOMP", other + "PRCOMP"))
    assert log.tip_radius_mm is None
    assert "the radii of several tips" in " ".join(log.left_out)
