"""The decision rule of ISO 14253-1."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepgauge.conditions.decision import conformity_probability, decide, together

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


@pytest.mark.parametrize("error", [0.0, 100.0])
def test_an_incomplete_uncertainty_proves_nothing(error: float) -> None:
    assert decide(error, 2.0, 0.5, ["alignment"]) == "not decidable"


@given(error=st.floats(-5, 5), limit=POSITIVE, u=st.floats(0.05, 3.0))
def test_the_probability_of_conformity_is_that_of_draws(error: float, limit: float, u: float) -> None:
    """JCGM 106:2012, 7.4; at a guard band of 2 u below the limit it is 95.4 % at least."""
    draws = error + u * np.random.default_rng(1).standard_normal(4000)
    found = conformity_probability(error, limit, u)
    assert found == pytest.approx(float((np.abs(draws) <= limit).mean()), abs=0.04)
    if decide(error, limit, 2.0 * u) == "conforms":
        assert found > 0.954


def test_one_that_does_not_conform_decides() -> None:
    assert together(["conforms", "not decidable", "does not conform"]) == "does not conform"
    assert together(["conforms", "not decidable"]) == "not decidable"
    assert together(["conforms", "conforms"]) == "conforms"
