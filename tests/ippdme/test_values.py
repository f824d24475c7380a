"""Numbers of I++ DME in both directions, in the forms that NIST's test suite 3.0 takes and refuses."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepgauge.ippdme.codes import DmeError
from stepgauge.ippdme.values import MOST_DIGITS, fixed, named, parse_call, read_number

TAKEN = {
    "0": 0.0,
    "123": 123.0,
    "+90": 90.0,
    "-90": -90.0,
    "12.2": 12.2,
    "+1.2": 1.2,
    "-1.2": -1.2,
    "-0000": 0.0,
    "1234567890123456": 1234567890123456.0,
    "1.234567890123456": 1.234567890123456,
    "+1.234567890123456": 1.234567890123456,
    "-0.123456789012345": -0.123456789012345,
    "0090": 90.0,
    "+0000.5": 0.5,
    "+0000.5E7": 5e6,
    "3.9E2": 390.0,
    "1.3E02": 130.0,
    "3.8E002": 380.0,
    "-9.333e01": -93.33,
    "+1.234567890123456E-123": 1.234567890123456e-123,
    "-1.234567890123456e+003": -1234.567890123456,
    ".123": 0.123,
    "123.": 123.0,
    "+.5": 0.5,
    "-6.382E-012": -6.382e-12,
    "0.000000000000001": 1e-15,
}
REFUSED = [
    *("12345671901234567", "2.1E0001", "+1.1.2", "+.", ".", "+", "", "1e", "1E+", "e5", "--1", "1-2", "0x10", "1_0"),
    *("1 2", "\uff11", "nan", "inf", "1e999", "1.2345678901234567", "1,5", "0.12345678901234567"),
]


@pytest.mark.parametrize("text", TAKEN)
def test_numbers_of_the_standard_are_taken_in_commands_and_in_data(text: str) -> None:
    assert read_number(text) == TAKEN[text]
    assert parse_call(f"GoTo(X({text}))", "GoTo").named()["X"].number() == TAKEN[text]
    assert named([f"X({text}), Y(1)"])["X"].number() == TAKEN[text]


@pytest.mark.parametrize("text", REFUSED)
def test_what_is_no_number_is_refused_by_name(text: str) -> None:
    with pytest.raises(DmeError) as refused:
        read_number(text)
    assert refused.value.number == 509
    assert refused.value.detail.startswith(f"no number of I++ DME: {text}")
    with pytest.raises(DmeError, match=r"0509|0502"):
        named([f"X({text})"])["X"].number()


@given(st.floats(-1e300, 1e300, allow_nan=False).filter(lambda value: abs(value) < 1e299), st.integers(0, 12))
def test_whatever_is_sent_is_a_number_of_the_standard(value: float, decimals: int) -> None:
    text = fixed(value, decimals)
    assert sum(one.isdigit() for one in text.partition("e")[0]) <= MOST_DIGITS
    assert read_number(text) == pytest.approx(value, rel=1e-13, abs=0.5 * 10.0**-decimals + 1e-9)


@pytest.mark.parametrize(
    ("lines", "detail"),
    [
        (["X(1), X(1)"], "X(..) is there twice"),
        (["X(1), Y(2)", "Y(2)"], "Y(..) is there twice"),
        (["X(1), 5"], "not all of data(..) have parentheses"),
        (["X(1.2.3)"], "no number of I++ DME: 1.2.3"),
        (["X(1.2345678901234567)"], "no number of I++ DME: 1.2345678901234567 has 17 digits, at most 16 are"),
    ],
)
def test_what_is_wrong_with_data_is_named(lines: list[str], detail: str) -> None:
    with pytest.raises(DmeError) as refused:
        named(lines)
    assert refused.value.detail == detail
