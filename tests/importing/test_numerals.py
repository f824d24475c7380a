"""Numbers of programs and of spreadsheets."""

from __future__ import annotations

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from stepgauge.files.numerals import Numerals, decimal_mark, looks_numeric, number

values = st.floats(-1e6, 1e6, allow_subnormal=False)


@given(values, st.integers(0, 9), st.sampled_from(".,"), st.sampled_from(["", "'", " ", "\u00a0", "\u202f", "other"]))
def test_every_way_of_writing_gives_the_same_number(value: float, digits: int, mark: str, group: str) -> None:
    group = {".": ",", ",": "."}[mark] if group == "other" else group
    plain = f"{value:.{digits}f}"
    written = f"{value:,.{digits}f}".replace(",", "g").replace(".", mark).replace("g", group)
    assert Numerals(mark).number(written) == float(plain)
    assert Numerals(mark).number(" \u2212" + written.lstrip("-") + " ") == -abs(float(plain))
    assert looks_numeric(written)


@given(st.lists(values, min_size=1, max_size=5), st.integers(1, 9), st.sampled_from(".,"))
def test_the_decimal_mark_shows_or_is_in_doubt_but_never_wrong(cells: list[float], digits: int, mark: str) -> None:
    found = decimal_mark([f"{value:.{digits}f}".replace(".", mark) for value in cells])
    assert found in (mark, None)
    if digits != 3 or mark == ".":
        assert found == mark


@pytest.mark.parametrize(
    ("cells", "mark"),
    [
        (["1,234", "5,678"], None),
        (["1,234", "5,67"], ","),
        (["1,234", "0,500"], ","),
        (["1,234", "20.4"], "."),
        (["1.234,5"], ","),
        (["1,234.5"], "."),
        (["1.234.567"], ","),
        (["1,234,567"], "."),
        (["1.234", "5.678"], "."),
        (["12", "ok"], "."),
        (["1,5", "2.5"], None),
    ],
)
def test_marks_of_known_tables(cells: list[str], mark: str | None) -> None:
    assert decimal_mark(cells) == mark


@pytest.mark.parametrize("text", ["", "nan", "inf", "1_000", "1e", "0x10", "1,5", "12 34", "--1", "1.2.3"])
def test_what_is_no_number(text: str) -> None:
    assert math.isnan(number(text))


@pytest.mark.parametrize("text", ["1,23,456.0", "12,34", "0,123.5", "1,2345"])
def test_thousands_that_are_not_in_threes_are_no_number(text: str) -> None:
    assert math.isnan(Numerals(".").number(text))


@given(values)
def test_plain_numbers_are_those_of_python(value: float) -> None:
    assume(math.isfinite(value))
    assert number(repr(value)) == value
