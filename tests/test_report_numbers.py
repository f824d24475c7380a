"""Values beside their expanded uncertainty, as a certificate states them (GUM 7.2.6; ILAC-P14)."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepgauge.files.notation import aligned, number_ranges, printed, printed_unit, rounded, uncertain


@pytest.mark.parametrize(
    ("value", "expanded", "shown"),
    [
        (5.034, 1.262, ("5.0", "1.3")),
        (-0.4346, 0.3146, ("−0.43", "0.31")),
        (0.4346, 0.0314, ("0.435", "0.031")),
        (12.34, 0.9961, ("12.3", "1.0")),
        (1234.6, 126.0, ("1230", "130")),
        (-0.02, 1.3, ("0.0", "1.3")),
        (0.0, 0.0, ("0.00", "0.00")),
        (None, 1.26, ("–", "1.3")),
        (0.5, None, ("0.50", "–")),
    ],
)
def test_by_hand(value: float | None, expanded: float | None, shown: tuple[str, str]) -> None:
    assert uncertain(value, expanded) == shown


@pytest.mark.parametrize(
    ("value", "digits", "said"),
    [
        (138.6, 2, "140"),
        (12345.0, 3, "12300"),
        (-2.5e6, 2, "-2500000"),
        (0.5, 2, "0.5"),
        (9.96, 2, "10"),
        (4.2e-6, 2, "0.0000042"),
        (0.0, 3, "0"),
        (3.84e-68, 2, "3.8e-68"),
    ],
)
def test_a_number_that_is_read_out_has_no_exponent(value: float, digits: int, said: str) -> None:
    assert rounded(value, digits) == said
    assert rounded(value, digits, plus=True).removeprefix("+") == said
    assert rounded(value, digits, plus=True)[0] in "+-"


@given(st.floats(-1e4, 1e4), st.floats(1e-3, 1e3))
def test_two_digits_of_the_uncertainty_and_the_value_to_the_same_place(value: float, expanded: float) -> None:
    shown, u = (float(text.replace("−", "-")) for text in uncertain(value, expanded))
    place = 10.0 ** (math.floor(math.log10(u) + 1e-9) - 1)
    assert u == pytest.approx(expanded, abs=0.5001 * place)
    assert shown == pytest.approx(value, abs=0.5001 * place)
    assert round(u / place) in range(10, 100)


def test_decimal_points_stand_below_each_other() -> None:
    digit, point = "\u2007", "\u2008"
    assert aligned(["5.0", "−0.43", "–", "130"]) == [f"5.0{digit}", "−0.43", "–", f"130{point}{digit}{digit}"]
    assert aligned(["1", "20"]) == ["1", "20"]
    assert aligned([]) == []


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("-0.14 um of XR", "−0.14 µm of XR"),
        ("4.8 um/N at -7 deg (um)", "4.8 µm/N at −7° (µm)"),
        ("12 urad/m", "12 µrad/m"),
        ("by +-0.51 um", "by ±0.51 µm"),
        (
            "um_per_N of SG-420 on 2026-11-26, --noise-um 3",
            "um_per_N of SG-420 on 2026-11-26, --noise-um 3",
        ),
        ("Messung um zehn", "Messung um zehn"),
    ],
)
def test_units_and_signs_in_print_but_not_in_names(text: str, shown: str) -> None:
    assert printed(text) == shown
    assert printed(shown) == shown


@pytest.mark.parametrize(
    ("unit", "shown"),
    [
        ("um", "µm"),
        ("um/(m K)", "µm/(m K)"),
        ("urad/m", "µrad/m"),
        ("1e-6/K", "10⁻⁶/K"),
        ("number", "number"),
        ("N", "N"),
    ],
)
def test_a_unit_alone_is_set_in_print(unit: str, shown: str) -> None:
    assert printed_unit(unit) == shown


def test_many_numbers_are_said_by_their_ranges() -> None:
    assert number_ranges([1, 2, 3, 7]) == "1 to 3, 7"
    assert number_ranges([5, 6, 8]) == "5, 6, 8"
    assert number_ranges(range(3, 93)) == "3 to 92"
    assert number_ranges([]) == ""
