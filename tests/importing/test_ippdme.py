"""I++ DME sessions: answers late and in pieces, errors, events, clocks and temperatures."""

from __future__ import annotations

import re

import numpy as np
import pytest

from stepgauge.correspondence.probe_log import ProbeLog
from stepgauge.errors import InputError
from stepgauge.importing.formats import FORMATS, gist

SESSION = """# gauge_serial: T-1
2026-03-02 10:00:00.000 -> 00001 StartSession()
2026-03-02 10:00:00.010 <- 00001 &
2026-03-02 10:00:00.020 <- 00001 %
2026-03-02 10:00:01.000 -> 00002 GetProp(Part.Temperature())
2026-03-02 10:00:01.100 <- 00002 &
2026-03-02 10:00:01.200 <- 00002 # Part.Temperature(20.4)
2026-03-02 10:00:01.300 <- 00002 %
2026-03-02 10:00:02.000 -> 00003 PtMeas(X(10.0), Y(20.0), Z(30.0), IJK(-1, 0, 0))
2026-03-02 10:00:02.100 <- 00003 &
2026-03-02 10:00:02.200 -> 00004 PtMeas(X(11.0), Y(20.0), Z(30.0), IJK(0, 0.6, 0.8))
2026-03-02 10:00:02.300 <- 00004 &
2026-03-02 10:00:02.400 <- E0001 # X(1), Y(2), Z(3)
2026-03-02 10:00:03.500 <- 00003 # X(10.001), Y(20.002), Z(30.003), ER(0.5)
2026-03-02 10:00:03.600 <- 00003 %
2026-03-02 10:00:05.000 <- 00004 # Z(31.003), X(11.001), ER(0.25)
2026-03-02 10:00:05.750 <- 00004 # Y(21.002)
2026-03-02 10:00:06.000 <- 00004 %
2026-03-02 10:00:07.000 -> 00005 PtMeas(X(12.0), Y(20.0), Z(30.0), IJK(-1, 0, 0))
2026-03-02 10:00:07.100 <- 00005 &
2026-03-02 10:00:07.200 <- 00005 ! Error(2, 1006, "server", "Surface not found")
2026-03-02 10:00:07.300 <- 00005 %
2026-03-02 10:00:09.000 -> 00006 EndSession()
2026-03-02 10:00:09.100 <- 00006 &
2026-03-02 10:00:09.200 <- 00006 %
"""


def read(text: str = SESSION) -> ProbeLog:
    assert FORMATS["ippdme"].recognises(gist(text))
    return FORMATS["ippdme"].read(text, "session.log")


def test_answers_find_their_commands_by_tag() -> None:
    log = read()
    np.testing.assert_array_equal(log.position_mm, [[10.001, 20.002, 30.003], [11.001, 21.002, 31.003]])
    np.testing.assert_array_equal(log.approach, [[1.0, 0.0, 0.0], [0.0, -0.6, -0.8]])
    assert log.time_s is not None
    assert log.time_s.tolist() == [3.5, 5.75]
    assert log.line.tolist() == [14, 17]
    assert log.columns["gauge_temperature_C"].tolist() == [20.4, 20.4]
    assert log.columns["ER"].tolist() == [0.5, 0.25]
    assert log.failures == ((21, 'PtMeas: Error(2, 1006, "server", "Surface not found")'),)
    assert log.comments == {"gauge_serial": "T-1", "measured_at": "2026-03-02T10:00:00"}
    assert log.surface is False
    assert log.cut == ""
    assert "1 events" in log.left_out[0]
    assert "1 PtMeas that failed" in log.left_out[0]


def test_bare_lines_have_no_time() -> None:
    bare = "\r\n".join(line[27:] if line.startswith("2026") else line for line in SESSION.splitlines())
    log = read(bare)
    assert log.time_s is None
    np.testing.assert_array_equal(log.position_mm, read().position_mm)


def test_a_session_without_its_end_is_cut_and_open_commands_are_named() -> None:
    lines = SESSION.splitlines()
    log = read("\n".join(lines[:17]))  # the second point was reported, but not complete
    assert len(log) == 1
    assert log.cut == "no EndSession()"
    assert log.failures == ((11, "PtMeas without an answer"),)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("X(10.001), ", "X(ten), ", r"session.log:14: X is not a number; found 'ten'"),
        ("Z(30.003), ER(0.5)", "Z(30.00", r"session.log:14: the answer is cut, or not understood"),
        ("IJK(0, 0.6, 0.8))", "IJK(0, 0, 0))", r"session.log:11: IJK is no direction"),
        ("IJK(-1, 0, 0))\n", "IJK(-1, 0, 0)\n", r"session.log:9: the command is cut, or not understood"),
        ("Part.Temperature(20.4)", "Part.Temperature(warm)", r"session.log:7: Part.Temperature is not a number"),
    ],
)
def test_what_is_not_understood_is_named_with_its_line(old: str, new: str, words: str) -> None:
    assert old in SESSION
    with pytest.raises(InputError, match=words):
        read(SESSION.replace(old, new, 1))


def test_a_clock_of_the_day_passes_midnight() -> None:
    text = SESSION.replace("2026-03-02 10:00:0", "23:59:5")
    text = text.replace("23:59:55.000 <- 00004 #", "00:00:01.000 <- 00004 #")
    for second in range(5, 10):
        text = text.replace(f"23:59:5{second}.", f"00:00:0{second}.") if second > 4 else text
    log = read(text.replace("00:00:05.750", "00:00:01.500"))
    assert log.time_s is not None
    assert log.time_s[0] == 3.5
    assert log.time_s[1] == pytest.approx(11.5)


def test_points_stand_in_the_order_of_their_commands() -> None:
    """The server reports the second point first: it was measured second all the same."""
    lines = SESSION.splitlines()
    first = [i for i, line in enumerate(lines) if "<- 00003 #" in line or "<- 00003 %" in line]
    last = max(i for i, line in enumerate(lines) if "<- 00004 %" in line)
    moved = [line for i, line in enumerate(lines) if i not in first]
    moved[last - 1 : last - 1] = [lines[i].replace("10:00:03", "10:00:06") for i in first]
    log = read("\n".join(moved))
    np.testing.assert_array_equal(log.position_mm, read().position_mm)
    assert log.time_s is None
    assert log.left_out[-1] == "dropped: times that are not there for all points, or run back"


def with_lines(*lines: str) -> str:
    """The session with lines of a client that looks around before it measures."""
    first, rest = SESSION.split("2026-03-02 10:00:02.000", 1)
    return first + "".join(f"2026-03-02 10:00:01.500 {line}\n" for line in lines) + "2026-03-02 10:00:02.000" + rest


OTHER_ANSWERS = [
    ("EnumTools()", 'Name("StepGaugeProbe"', "NoTool"),
    ("EnumProp(Tool.PtMeasPar())", '"Speed", "Number"', '"Tool.PtMeasPar"'),
    ("EnumAllProp(Tool())", '"Tool.Id()"', "<Tool id='1'>(((</Tool>"),
    ("GetErrorInfo(1006)", '"Surface not found :-("', ""),
    ("AlignTool(0,0,1, 0)", "0, 0, 1", "0.5, 20"),
    ("GetProp(Tool.Name())", 'Tool.Name("a(b")', ""),
]


@pytest.mark.parametrize(("command", "one", "other"), OTHER_ANSWERS)
def test_answers_to_other_commands_may_look_as_they_like(command: str, one: str, other: str) -> None:
    """Every client enumerates the tools first; only the answers to PtMeas are read strictly."""
    answers = (f"-> 00100 {command}", "<- 00100 &", f"<- 00100 # {one}", f"<- 00100 # {other}", "<- 00100 %")
    log = read(with_lines(*answers))
    np.testing.assert_array_equal(log.position_mm, read().position_mm)
    assert command.split("(")[0] in log.left_out[0]


def stamped(day: str, separator: str) -> str:
    return SESSION.replace("2026-03-02 ", day + separator)


@pytest.mark.parametrize(
    ("day", "separator"),
    [("26:11:22", "_"), ("2026/11/22", " "), ("22.11.2026", " "), ("2026-11-22", "T"), ("2026:11:22", "_")],
)
def test_time_stamps_with_their_date_are_read_in_the_forms_that_servers_write(day: str, separator: str) -> None:
    log = read(stamped(day, separator))
    assert log.time_s is not None
    assert log.time_s.tolist() == [3.5, 5.75]


def test_times_pass_midnight_with_their_date() -> None:
    text = stamped("26:11:22", "_").replace("26:11:22_10:00:05", "26:11:23_00:00:05")
    log = read(text.replace("26:11:22_10:00:0", "26:11:22_23:59:5"))
    assert log.time_s is not None
    assert log.time_s.tolist() == [3.5, 15.75]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (SESSION.replace("2026-03-02 10:", "26:11:22 99:"), "not understood"),
        (re.sub(r"2026-03-02 10:00:\d\d\.\d{3}", "10:00:00.000", SESSION), "the clock stands at 10:00:00.000"),
        (SESSION.replace("2026-03-02 10:00:05.750 <- ", ""), "not there for all points"),
    ],
)
def test_times_that_cannot_be_used_are_left_out_with_a_word(text: str, words: str) -> None:
    log = read(text)
    assert log.time_s is None
    assert words in log.left_out[-1]
    assert "no time_s" in log.mapped


def test_the_commanded_direction_counts_and_not_what_the_server_reports() -> None:
    """Some servers always answer IJK(0,0,1)."""
    text = SESSION.replace("Z(30.003), ER", "Z(30.003), IJK(0,0,1), ER").replace(
        "Y(21.002)", "Y(21.002), IJK(0,0.6,0.8)"
    )
    log = read(text)
    np.testing.assert_array_equal(log.approach, read().approach)
    assert "IJK as commanded; 1 of 2 answers report another one, which was not used" in log.mapped
    alone = read(text.replace(", IJK(-1, 0, 0))", ")").replace(", IJK(0, 0.6, 0.8))", ")"))
    assert alone.approach is not None
    np.testing.assert_array_equal(alone.approach, [[0, 0, -1], [0, -0.6, -0.8]])


def test_the_radius_of_the_servers_tool_is_that_of_all_answers() -> None:
    assert read().tip_radius_mm is None  # 0.5 and 0.25
    log = read(SESSION.replace("ER(0.25)", "ER(0.5)"))
    assert log.tip_radius_mm == 0.5
    assert "effective radius ER of 0.5 mm" in " ".join(log.mapped)
