"""Laws that stand together: each is judged beside what the others are, not beside what they would be without it."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from stepgauge.diagnose.explain import explain
from stepgauge.diagnose.noise import estimate_noise
from stepgauge.diagnose.select import Selector, Term
from stepgauge.diagnose.simpler import without_shadows

from stepgauge.diagnose.residuals import make_residuals
from stepgauge.recording import APPROACH, Recording
from tests.diagnose.made import gauge, machine
from tests.diagnose.test_selection import NOISE_UM, bent, lies_on, names, side, told

Array = NDArray[np.float64]
SETTLED_FOR = 20.0
"""Chi-square that the size a law needs, and how common it is, may weigh against its fit."""


def long_scale_um(recording: Recording, ppm: float) -> Array:
    return ppm * 1e-3 * (recording.frame["x_mm"].to_numpy() - 350.0) * side(recording) * lies_on(recording)


def swing_um(recording: Recording, period_s: float, um: float) -> Array:
    angle = 2.0 * np.pi * recording.frame["time_s"].to_numpy() / period_s
    return um * np.sin(angle) * (recording.frame[APPROACH].to_numpy() @ np.array([0.8, 0.6, 0.0]))


def warming_um(recording: Recording, hours: tuple[float, ...], um: float) -> Array:
    t = recording.frame["time_s"].to_numpy() / 3600.0
    rise = sum(1.0 - np.exp(-t / constant) for constant in hours) / len(hours)
    return um * rise * (recording.frame[APPROACH].to_numpy() @ np.array([0.95, 0.3, 0.0]))


def searched(recording: Recording) -> tuple[Selector, tuple[Term, ...]]:
    data = make_residuals(recording, gauge(), machine(noise_um=NOISE_UM))
    found = explain(data, estimate_noise(data), ())
    return found.selector, found.terms


@pytest.mark.parametrize("period_s", [170.0, 200.0, 230.0, 260.0])
def test_a_large_scale_error_and_a_large_swing_are_both_named(period_s: float) -> None:
    found = told(bent(lambda r: long_scale_um(r, 35.0) + swing_um(r, period_s, 2.5)))
    assert found.verdict == "effects"
    assert len(found.findings) == 2
    assert "temperature_cycle" in names(found)
    assert any("scale_error" in (one.kind, *one.confounded_with) for one in found.findings)
    (swing,) = (one for one in found.findings if one.kind == "temperature_cycle")
    told_s = swing.parameters["period_s"]
    assert told_s.u is not None
    assert abs(told_s.value - period_s) < 4.0 * told_s.u


def test_what_is_left_in_the_place_of_a_law_is_that_law_and_the_scatter() -> None:
    selector, terms = searched(bent(lambda r: long_scale_um(r, 35.0) + swing_um(r, 310.0, 2.5)))
    assert len(terms) == 2
    whole = selector.fit(terms)
    for place in range(2):
        left, others = selector.residual_in_place(terms, place)
        own = selector.whitening(whole.solved[place].displacement_um(selector.residuals))
        np.testing.assert_allclose(others.T @ left, 0.0, atol=1e-8)
        beyond = left - (own - others @ (others.T @ own))
        assert float(beyond @ beyond) <= selector.sum_of_squares(terms) * 1.001
        first = selector.looks_in_place(terms, place)[0]
        exchanged = selector.exchanged(terms, place, selector.fitted(first, terms, place))
        assert selector.sum_of_squares(exchanged) <= selector.sum_of_squares(terms) + SETTLED_FOR


def test_the_warming_of_two_bodies_is_one_drift() -> None:
    """Two time constants near each other are one within a few per cent: no second drift, and nothing unknown."""
    found = told(bent(lambda r: warming_um(r, (0.04, 0.06), 6.0)))
    assert found.verdict == "effects"
    assert names(found) == ["thermal_drift"]


def test_a_shadow_goes_and_the_law_that_throws_it_stays() -> None:
    selector, _ = searched(bent(lambda r: warming_um(r, (0.05,), 6.0)))
    labels = [family.label for family in selector.library.families]
    drifts = [
        Term(i, int(selector.library.gains(i, *selector.residual(())).argmax()))
        for i in (labels.index("thermal_drift"), labels.index("thermal_drift_x"))
    ]
    assert without_shadows(selector, tuple(drifts)) == (drifts[0],)
    step = Term(labels.index("reversal_error_x"), 0)
    assert set(without_shadows(selector, (*drifts, step))) == {drifts[0], step}
