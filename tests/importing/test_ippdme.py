"""I++ DME sessions: answers late and in pieces, errors, events, clocks and temperatures."""

from __future__ import annotations

import numpy as np
import pytest

from stepgauge.errors import InputError
from stepgauge.importing import FORMATS
from stepgauge.importing.log import ProbeLog

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
    assert FORMATS["ippdme"].recognises(text)
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
    assert log.comments == {"gauge_serial": "T-1"}
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
