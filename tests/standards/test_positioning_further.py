"""VDI/DGQ 3441 and ASME B5.54 from the deviations of a positioning test, computed by hand and by other code."""

from __future__ import annotations

import statistics

import numpy as np
import pytest

from stepgauge.standards.iso230 import Direction, OneWay, axis_parameters
from stepgauge.standards.iso230_files import FURTHER, further_um
from stepgauge.verbs.catalogue import find_verb

UP = [[1.0, 3.0], [4.0, 4.0], [10.0, 12.0]]
DOWN = [[-1.0, 1.0], [3.0, 5.0], [9.0, 9.0]]


def test_vdi_3441_by_hand() -> None:
    """Means up 2, 4, 11 and down 0, 4, 9; s is sqrt 2 or 0.

    m = 1, 4, 10; U = 2, 0, 2; Ps = 6 sqrt 2, 3 sqrt 2, 3 sqrt 2: P = (10 + 1 + 1.5 sqrt 2) - (1 - 1 - 3 sqrt 2).
    """
    root = 2.0**0.5
    found = FURTHER["vdi3441"](axis_parameters(np.array(UP), np.array(DOWN)))
    expected = {"P": 11.0 + 4.5 * root, "Pa": 9.0, "Ps_max": 6 * root, "Ps_mean": 4 * root, "U_max": 2.0}
    assert {name: found[name] for name in expected} == pytest.approx(expected)
    assert found["U_mean"] == pytest.approx(4.0 / 3.0)


def test_vdi_3441_by_other_code() -> None:
    """Target by target with the standard library, in random deviations."""
    random = np.random.default_rng(3)
    up, down = (random.normal(size=(7, 5)) + random.normal(size=(7, 1)) for _ in range(2))
    ends = []
    for one, other in zip(up.tolist(), down.tolist(), strict=True):
        mean = (statistics.fmean(one) + statistics.fmean(other)) / 2
        reversal = abs(statistics.fmean(one) - statistics.fmean(other))
        scatter = 3 * (statistics.stdev(one) + statistics.stdev(other))
        ends.append((mean - (reversal + scatter) / 2, mean + (reversal + scatter) / 2))
    found = FURTHER["vdi3441"](axis_parameters(up, down))
    assert found["P"] == pytest.approx(max(high for _, high in ends) - min(low for low, _ in ends))


def test_b5_54_follows_iso_230_and_says_that_it_is_unconfirmed() -> None:
    parameters = axis_parameters(np.array(UP), np.array(DOWN))
    found = further_um(parameters, ("b5.54",))["b5.54"]
    assert found["parameters_um"]["accuracy"] == parameters.A_um
    assert found["parameters_um"]["lost_motion"] == pytest.approx(4.0 / 3.0)
    assert "unconfirmed" in found["note"]
    assert further_um(OneWay("up", Direction(np.array(UP))), ("b5.54",)) == {}


def test_the_option_names_the_standards_that_there_are() -> None:
    (option,) = [one for one in find_verb("test iso230").parameters if one.name == "also"]
    assert set(option.field["choices"]) == set(FURTHER)
