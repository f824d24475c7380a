"""Conditions: what prevents a statement prevents it, and everything comes back from JSON."""

from __future__ import annotations

import json

import pytest

from stepgauge.conditions import STATES, Condition, Conditions, gate, require_statement, stored_conditions
from stepgauge.errors import InputError

MET = Condition("resolution", "met", "the step is 0.1 um")
TILT = Condition("alignment", "prevents", "the readings lie 5 mrad off the axis", "5 mrad", "0.5 mrad", 5.1)
DRIFT = Condition("drift", "contribution", "1 um of drift", size_um=1.0)


def test_only_what_prevents_takes_the_decision() -> None:
    for state in STATES:
        one = Conditions((Condition("drift", state, "words"),))
        assert gate(one, "conforms") == ("no statement" if state == "prevents" else "conforms")
        assert bool(one.no_statement) == (state == "prevents")
    assert gate(Conditions(), "conforms") == "conforms"


def test_notes_are_of_all_that_is_not_met() -> None:
    assert Conditions((MET, TILT, DRIFT)).notes == (TILT.sentence, DRIFT.sentence)


def test_what_needs_a_statement_is_refused_with_what_was_found() -> None:
    require_statement(Conditions((MET, DRIFT)), "recording.csv")
    with pytest.raises(InputError, match=r"recording.csv: the readings lie 5 mrad off the axis.*0\.5 mrad"):
        require_statement(Conditions((MET, TILT)), "recording.csv")


def test_what_moves_a_result_by_more_than_its_uncertainty_prevents_a_statement() -> None:
    small, large = Conditions((DRIFT,)).weighed(1.2), Conditions((DRIFT, MET)).weighed(0.8)
    assert gate(small, "conforms") == "conforms"
    assert gate(large, "conforms") == "no statement"
    assert "more than U = 0.8" in large.no_statement
    assert gate(Conditions((DRIFT,)).weighed(None), "conforms") == "conforms"


def test_conditions_come_back_from_json_of_a_result_and_of_its_placements() -> None:
    result = {"conditions": [DRIFT.to_dict()], "placements": [{"conditions": [TILT.to_dict(), DRIFT.to_dict()]}, {}]}
    assert stored_conditions(json.loads(json.dumps(result))) == Conditions((DRIFT, TILT))
