"""The decision rule of ISO 14253-1."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepgauge.standards.decision import decide, together

POSITIVE = st.floats(0.01, 100.0)


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
