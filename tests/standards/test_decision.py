"""Permissible errors as they are written, and the decision rule of ISO 14253-1."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepgauge.errors import InputError
from stepgauge.standards.decision import decide, parse_mpe, together

POSITIVE = st.floats(0.01, 100.0)


@pytest.mark.parametrize(
    ("text", "at_700"),
    [("1.8 + L/350", 3.8), ("1.8+L/350 um", 3.8), ("2 + 3L/1000", 4.1), ("2 + 3*L/1000 µm", 4.1), ("2.5", 2.5)],
)
def test_the_ways_of_writing_a_permissible_error(text: str, at_700: float) -> None:
    assert float(parse_mpe(text).at(700.0)) == pytest.approx(at_700)


def test_the_cap_holds_from_where_it_is_reached() -> None:
    """Hand: 1.8 + L/350 reaches 3 um at 420 mm."""
    mpe = parse_mpe("1.8 + L/350", 3.0)
    assert mpe.at([0.0, 350.0, 420.0, 1000.0]) == pytest.approx([1.8, 2.8, 3.0, 3.0])


@pytest.mark.parametrize("text", ["", "abc", "1.8 - L/350", "L/350 + 1.8", "1.8 + L/0", "0", "1,8 + L/350", "nan"])
def test_what_is_no_permissible_error_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="--mpe"):
        parse_mpe(text)


@given(a=POSITIVE, k=st.floats(1.0, 5000.0), length=st.floats(0.0, 5000.0))
def test_what_is_printed_reads_back_as_the_same_limit(a: float, k: float, length: float) -> None:
    mpe = parse_mpe(f"{a:.4f} + L/{k:.4f}")
    again = parse_mpe(str(mpe).removesuffix(" µm, L in mm"))
    assert float(again.at(length)) == pytest.approx(float(mpe.at(length)), rel=2e-5)


@pytest.mark.parametrize(
    ("error", "outcome"),
    [
        (1.5, "conforms"),
        (-1.5, "conforms"),
        (1.500001, "not decidable"),
        (2.5, "not decidable"),
        (-2.500001, "does not conform"),
        (9.0, "does not conform"),
    ],
)
def test_the_zones_of_iso_14253_1(error: float, outcome: str) -> None:
    """A limit of 2 um with U = 0.5 um: conformity up to 1.5, nonconformity above 2.5."""
    assert decide(error, 2.0, 0.5) == outcome


@given(error=st.floats(-10, 10), limit=POSITIVE, u=POSITIVE)
def test_more_uncertainty_never_decides_what_less_did_not(error: float, limit: float, u: float) -> None:
    sure, unsure = decide(error, limit, 0.0), decide(error, limit, u)
    assert sure != "not decidable"
    assert unsure in (sure, "not decidable")


def test_one_that_does_not_conform_decides() -> None:
    assert together(["conforms", "not decidable", "does not conform"]) == "does not conform"
    assert together(["conforms", "not decidable"]) == "not decidable"
    assert together(["conforms", "conforms"]) == "conforms"


def test_a_limit_of_many_lengths_keeps_its_shape() -> None:
    assert parse_mpe("1 + L/100").at(np.zeros((2, 3))).shape == (2, 3)
