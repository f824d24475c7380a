"""Tolerances of positioning: the decision of ISO 14253-1, and nothing proven without an uncertainty."""

from __future__ import annotations

import numpy as np
import pytest

from stepgauge.errors import InputError
from stepgauge.standards.iso230 import axis_parameters
from stepgauge.standards.iso230_decision import PARAMETERS, Requirement, parameters_um

FOUND = axis_parameters(np.array([[0.0, 2.0], [4.0, 6.0]]), np.array([[-1.0, 1.0], [3.0, 5.0]]))
"""Means 1, 5 up and 0, 4 down, s = sqrt 2: B = 1, E = 5, R = 4 sqrt 2 + 1, A = 5 + 4 sqrt 2."""

VALUES = parameters_um(FOUND)


def test_parameters_by_name() -> None:
    found = VALUES
    assert tuple(found) == PARAMETERS
    root = float(np.sqrt(2.0))
    assert found["B"] == pytest.approx(1.0)
    assert found["E"] == pytest.approx(5.0)
    assert found["M"] == pytest.approx(4.0)
    assert found["R"] == pytest.approx(4.0 * root + 1.0)
    assert found["A"] == pytest.approx(5.0 + 4.0 * root)


@pytest.mark.parametrize(
    ("tolerance", "outcome", "words"),
    [("E=6.1", "conforms", "The parameters conform"), ("E=5.5", "not decidable", "Neither"),
     ("E=3.9", "does not conform", "do not conform")],
)  # fmt: skip
def test_the_uncertainty_narrows_both_zones(tolerance: str, outcome: str, words: str) -> None:
    asked = Requirement.parse([tolerance], 1.0)
    assert asked.outcomes(VALUES) == {"E": outcome}
    text = asked.decision([("axis x", VALUES)]).text
    assert words in text
    assert "Decision rule: ISO 14253-1" in text


def test_without_tolerance_or_uncertainty_nothing_is_claimed() -> None:
    assert "No statement of conformity" in Requirement().decision([("axis x", VALUES)]).text
    asked = Requirement.parse(["E=100"])
    assert asked.outcomes(VALUES) == {}
    assert "Conformity is not proven" in asked.decision([("axis x", VALUES)]).text


@pytest.mark.parametrize("text", ["A", "A=", "Q=3", "A=-1", "A=nan", "A=inf", "=3"])
def test_no_tolerance(text: str) -> None:
    with pytest.raises(InputError, match="tolerances: this is no tolerance"):
        Requirement.parse([text])
