"""Lines, tags, commands and answers of I++ DME."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepgauge.ippdme.codes import CODES, DmeError
from stepgauge.ippdme.lines import (
    LONGEST_LINE,
    NO_TAG,
    LineReader,
    is_tag,
    parse_answer,
    parse_command,
    parse_error,
)
from stepgauge.ippdme.values import MOST_DIGITS, Call, QuotedText, Word, fixed, named, parse_call, read_number

SEVERITIES = {
    0: "0000",
    1: "0504 0512",
    2: "0001 0002 0006 0513 0514 0515 1001 1003 1006 1010 1011 1012 2001 2505",
    3: "0007 0008 0500 0501 0502 0505 0506 0507 0508 0509 0510 0511 1000 1005 1007 1008 1009 1500 1501 1502 1503 2000"
    " 2002 2500 2501 2502 2504 2506",
    9: "0503 1002 1004 2503",
}
"""As the table of the specification gives them."""


def test_the_errors_have_the_severities_of_the_specification() -> None:
    stated = {int(number): severity for severity, numbers in SEVERITIES.items() for number in numbers.split()}
    assert {number: code.severity for number, code in CODES.items()} == stated
    assert DmeError(500, "GoTo").line() == '! Error(3, 0500, "GoTo", "Emergency stop")'


@pytest.mark.parametrize("number", CODES)
def test_an_error_is_read_as_it_was_written(number: int) -> None:
    error = DmeError(number, "PtMeas")
    back = parse_error(error.line()[2:])
    assert (back.number, back.severity, back.method, back.text) == (number, error.severity, "PtMeas", error.text)
    assert back.aborts == (error.severity >= 2)


@pytest.mark.parametrize("tag", ["00001", "99999", "E0001", "E9999"])
def test_tags_that_a_client_may_use(tag: str) -> None:
    assert is_tag(tag)


@pytest.mark.parametrize(
    "tag", ["00000", "E0000", "1", "000001", "E001", "e0001", "0001 ", "-0001", "E00001", "００００１", ""]
)
def test_tags_that_it_may_not_use(tag: str) -> None:
    assert not is_tag(tag)


@pytest.mark.parametrize(
    ("text", "call"),
    [
        ("Home()", Call("Home")),
        ("GoTo(X(1), Y(-2.5),Z(+.5))", Call("GoTo", (Call("X", (1.0,)), Call("Y", (-2.5,)), Call("Z", (0.5,))))),
        ("PtMeas(X(1e-7), IJK(0, 0, 1.))", Call("PtMeas", (Call("X", (1e-7,)), Call("IJK", (0.0, 0.0, 1.0))))),
        ('SetTool("Probe 1")', Call("SetTool", (QuotedText("Probe 1"),))),
        ("SetCoordSystem(PartCsy)", Call("SetCoordSystem", (Word("PartCsy"),))),
        ("StopDaemon(E0490)", Call("StopDaemon", (Word("E0490"),))),
        ("SetProp(Tool.PtMeasPar.Speed(3))", Call("SetProp", (Call("Tool.PtMeasPar.Speed", (3.0,)),))),
        ("  Home( )  ", Call("Home")),
    ],
)
def test_calls(text: str, call: Call) -> None:
    assert parse_call(text, "m") == call


@pytest.mark.parametrize(
    ("line", "number"),
    [
        (b"", 1),
        (b"1", 1),
        (b"00000 Home()", 1),
        (b"E0000 Home()", 1),
        (b"Home()", 1),
        (b"00001Home()", 2),
        (b"00001\tHome()", 7),
        (b"00001 Home()\xe4", 7),
        (b"00001 Home()\n", 7),
        (b"00001 ", 507),
        (b"00001 Home", 507),
        (b"00001 17", 507),
        (b"00001 (X)", 507),
        (b"00001 Home(", 502),
        (b"00001 Home())", 507),
        (b"00001 GoTo(X(1),)", 502),
        (b"00001 GoTo(X(1) Y(2))", 502),
        (b"00001 GoTo(X(1), Home()", 502),
        (b'00001 SetTool("a)', 509),
        (b"00001 A(B(C(D(E(F(G(1)))))))", 502),
        (b"00001 GoTo(X(1.2345678901234567))", 509),
        (b"00001 GoTo(X(1e999))", 509),
        (b"00001 GoTo(X(1,5)), Home()", 507),
        (b"00001 GoTo(" + b"X()," * 300 + b"X())", 502),
    ],
)
def test_lines_that_are_wrong_say_how(line: bytes, number: int) -> None:
    command = parse_command(line)
    assert command.error is not None
    assert command.error.number == number
    assert command.tag == (NO_TAG if number == 1 else "00001")


@pytest.mark.parametrize("text", ["GoTo(X(nan))", "GoTo(X(inf))"])
def test_what_is_no_number_is_a_word(text: str) -> None:
    with pytest.raises(DmeError, match="0509"):
        parse_call(text).arguments[0].number()  # type: ignore[union-attr]


@given(st.binary(max_size=200))
def test_any_bytes_are_a_command_or_an_error_of_the_table(line: bytes) -> None:
    command = parse_command(line)
    assert command.tag == NO_TAG or is_tag(command.tag)
    assert command.error is None or command.error.number in CODES


@given(st.from_regex(rb"\A0000[1-9] [A-Za-z]{1,8}[(][-+.0-9A-Za-z(),\" ]{0,40}[)]\Z"))
def test_what_looks_like_a_command_is_one_or_an_error_of_the_table(line: bytes) -> None:
    command = parse_command(line)
    assert command.error is None or command.error.number in (502, 507, 509)


@given(st.lists(st.binary(max_size=20).filter(lambda one: b"\n" not in one), max_size=8), st.integers(1, 7))
def test_lines_do_not_depend_on_how_their_bytes_arrive(lines: list[bytes], size: int) -> None:
    data = b"".join(line + b"\r\n" for line in lines)
    together = list(LineReader().feed(data))
    apart = LineReader()
    assert [one for at in range(0, len(data), size) for one in apart.feed(data[at : at + size])] == together
    assert together == [(line, False) for line in lines]


def test_a_line_that_is_too_long_is_cut_once_and_the_next_one_is_whole() -> None:
    lines = LineReader()
    assert list(lines.feed(b"00001 " + b"x" * LONGEST_LINE)) == [(b"00001 " + b"x" * (LONGEST_LINE - 6), True)]
    assert list(lines.feed(b"y" * 3 * LONGEST_LINE)) == []
    assert list(lines.feed(b"end\r\n00002 Home()\r\n")) == [(b"00002 Home()", False)]
    whole = b"z" * LONGEST_LINE
    assert list(LineReader().feed(whole + b"\r\n" + whole + b"z\r\nend\r\n")) == [
        (whole, False),
        (whole, True),
        (b"end", False),
    ]
    error = parse_command(b"00001 GoTo(X(1", cut=True).error
    assert error is not None
    assert error.number == 0


def test_a_line_that_ends_without_a_carriage_return_has_an_illegal_character() -> None:
    ((line, cut),) = LineReader().feed(b"00001 Home()\n")
    error = parse_command(line, cut).error
    assert error is not None
    assert error.number == 7


@given(st.floats(-1e5, 1e5), st.integers(0, 9))
def test_numbers_are_sent_short_and_never_as_minus_zero(value: float, decimals: int) -> None:
    text = fixed(value, decimals)
    assert sum(one.isdigit() for one in text) <= MOST_DIGITS
    assert read_number(text) == float(text)
    assert not text.startswith("-0.0") or float(text) != 0.0
    assert float(text) == pytest.approx(value, abs=0.5 * 10.0**-decimals + 1e-8)


@given(
    st.dictionaries(st.sampled_from(["X", "Y", "Z", "ER", "Tool.A", "Server.Time"]), st.floats(-1e4, 1e4), min_size=1)
)
def test_data_are_read_as_they_were_written(values: dict[str, float]) -> None:
    text = ", ".join(f"{name}({fixed(value, 6)})" for name, value in values.items())
    assert {name: found.number() for name, found in named([text]).items()} == pytest.approx(values, abs=1e-6)


@pytest.mark.parametrize(
    ("line", "kind", "text"),
    [
        (b"00001 &", "&", ""),
        (b"00001 # X(1)", "#", "X(1)"),
        (b"E0001 %", "%", ""),
        (b"E0000 ! Error(3)", "!", "Error(3)"),
    ],
)
def test_answers(line: bytes, kind: str, text: str) -> None:
    answer = parse_answer(line)
    assert answer is not None
    assert (answer.kind, answer.text) == (kind, text)


@pytest.mark.parametrize(
    "line", [b"", b"00001", b"00001&", b"00001 ?", b"1 &", b"00001 &x", b"HTTP/1.1 200 OK", b"00001 # \xff"]
)
def test_lines_that_are_no_answers(line: bytes) -> None:
    assert parse_answer(line) is None


def test_an_error_that_is_not_in_the_form_of_the_standard_is_one_of_protocol() -> None:
    assert parse_error("something broke").number == 8
