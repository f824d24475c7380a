"""The decision rule of ISO 14253-1."""

from __future__ import annotations

import copy

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepgauge.conditions.decision import conformity_probability, decide, together
from stepgauge.standards.conformity import conformity
from stepgauge.standards.mpe import Mpe
from tests.dcc.made import evaluated

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


def test_nothing_would_decide_what_has_failed() -> None:
    """Other faces lie within U of the limit; no smaller U makes the gauge pass."""
    evaluation, budget = evaluated(1)
    budget = budget.model_copy(update={"not_included": []})
    evaluation = copy.deepcopy(evaluation)
    evaluation["placements"][0]["faces"][-1].update(xf_um=1000.0, xb_um=1000.0)
    judged = conformity(evaluation, budget, Mpe.parse("0.6"))
    assert judged.outcome == "does not conform"
    assert any(one.outcome == "not decidable" for one in judged.faces)
    assert judged.needed is None


@pytest.mark.parametrize("mpe_um", [0.6, 0.8, 1.0, 1.2])
def test_what_decides_is_what_the_largest_source_must_become(mpe_um: float) -> None:
    """More cycles were advised, whatever the largest source was."""
    evaluation, budget = evaluated(1)
    budget = budget.model_copy(update={"not_included": []})
    judged = conformity(evaluation, budget, Mpe.parse(str(mpe_um)))
    needed = judged.needed
    assert judged.outcome == "not decidable"
    assert needed is not None
    assert needed.text in judged.decision.reason
    face = judged.of(1, needed.face)
    line = budget.find("xf" if needed.face % 2 else "xb", 1, needed.face)
    assert face is not None
    assert line is not None
    assert needed.u_um == max(line.contributions_um.values())
    others = line.u_um**2 - needed.u_um**2
    if needed.allowed_um is None:
        assert decide(face.error_um, face.limit_um, line.k * np.sqrt(others)) == "not decidable"
    else:
        for share, decided in ((0.99, True), (1.01, False)):
            expanded_um = line.k * np.sqrt(others + (share * needed.allowed_um) ** 2)
            assert (decide(face.error_um, face.limit_um, expanded_um) != "not decidable") is decided
