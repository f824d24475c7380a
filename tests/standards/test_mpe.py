"""The maximum permissible error of length measurement, A + L/K."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepgauge.errors import InputError
from stepgauge.standards.mpe import Mpe


def test_by_hand() -> None:
    """1.8 + 420/350 = 3.0 um; lengths count by their size; a cap holds."""
    np.testing.assert_allclose(Mpe.parse("1.8 + L/350").at_um([0.0, 420.0, -420.0]), [1.8, 3.0, 3.0])
    np.testing.assert_allclose(Mpe.parse("min(1.8+L/350, 2.5)").at_um([0.0, 420.0]), [1.8, 2.5])
    assert Mpe.parse("2,5 + L/300") == Mpe.parse("2.5 + L/300")
    np.testing.assert_allclose(Mpe.parse("2.5 um").at_um([0.0, 420.0]), 2.5)
    np.testing.assert_allclose(Mpe.parse("L/200").at_um([100.0]), 0.5)


@pytest.mark.parametrize(
    ("text", "at_700"),
    [("1.8+L/350 um", 3.8), ("2 + 3L/1000", 4.1), ("2 + 3*L/1000 µm", 4.1), ("3L/1000", 2.1), (".5", 0.5), ("2.", 2.0)],
)
def test_the_ways_of_writing_it(text: str, at_700: float) -> None:
    assert float(Mpe.parse(text).at_um(700.0)) == pytest.approx(at_700)


def test_a_cap_holds_from_where_it_is_reached() -> None:
    """Hand: 1.8 + L/350 reaches 3 um at 420 mm."""
    capped = Mpe.parse("min(1.8 + L/350, 3)")
    assert capped.at_um([0.0, 350.0, 420.0, 1000.0]) == pytest.approx([1.8, 2.8, 3.0, 3.0])


def test_units_are_printed_where_they_matter() -> None:
    assert Mpe.parse("1.8 + L/350").to_text() == "(1.8 + L/350) µm, L in mm"
    assert Mpe.parse("2.5").to_text() == "2.5 µm"


def test_a_limit_of_many_lengths_keeps_its_shape() -> None:
    assert Mpe.parse("1 + L/100").at_um(np.zeros((2, 3))).shape == (2, 3)


@given(st.floats(0.01, 50).map(lambda v: round(v, 3)), st.integers(1, 5000), st.none() | st.integers(51, 90))
def test_what_is_printed_is_read_again(a: float, k: int, cap: int | None) -> None:
    limit = Mpe(a, float(k), float("inf") if cap is None else float(cap))
    assert Mpe.parse(str(limit)) == limit


@pytest.mark.parametrize(
    "text",
    [
        "",
        "A + L/K",
        "1.8 + L*350",
        "1,8,2 + L/350",
        "-1 + L/300",
        "1 + L/0",
        "1 + 0L/9",
        "0",
        "L/350 + 1",
        "nan",
        "min(1, 0)",
    ],
)
def test_anything_else_is_refused(text: str) -> None:
    with pytest.raises(InputError, match=r"mpe: .*found .*expected \"A \+ L/K\""):
        Mpe.parse(text)
