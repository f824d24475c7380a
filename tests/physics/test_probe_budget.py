"""Ren's Table 2 and Eq 18 from the components."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepgauge.physics import probe_budget
from stepgauge.physics.probe_budget import Component, ProbeBudget


def test_both_parts_of_equation_18():
    budget = probe_budget.ren_budget()
    assert budget.fixed_um == pytest.approx(0.0999, abs=5e-5)
    assert budget.per_m_um == pytest.approx(0.129, abs=5e-4)


@pytest.mark.parametrize("length_m", [0.0, 0.1, 0.5, 1.0])
def test_expanded_uncertainty_agrees_with_the_rounded_formula(length_m):
    printed = 2.0 * np.sqrt(0.10**2 + (0.13 * length_m) ** 2)
    assert probe_budget.ren_budget().expanded_um(length_m) == pytest.approx(printed, rel=0.01)


def test_length_components_follow_from_their_causes():
    """Table 2 rows 7-9: 5 mK, 10 mK and 1e-6/K give 0.058, 0.115 and 0.010 um/m with a steel-like ruler."""
    printed = {"temperature measurement": 0.058, "temperature distribution": 0.115, "expansion coefficient": 0.010}
    rows = {part.name.split(",")[0]: part.per_m_um for part in probe_budget.ren_budget().components}
    for name, value in printed.items():
        assert abs(rows[name] - value) <= 5.001e-4


def test_the_printed_cosine_error_does_not_follow_from_its_cause():
    """0.1 mm in 100 mm is 1 mrad, whose cosine takes away 0.5 um per metre; the table prints 0.001."""
    assert probe_budget.cosine_um_per_m(1e-3) == pytest.approx(0.5, rel=1e-6)
    with_it = probe_budget.ren_budget(cosine_per_m_um=probe_budget.cosine_um_per_m(1e-3))
    assert with_it.per_m_um == pytest.approx(0.516, abs=5e-4)


def test_cosine_error_is_one_minus_cosine():
    assert probe_budget.cosine_um_per_m(0.3) == pytest.approx(1e6 * (1.0 - np.cos(0.3)))
    assert probe_budget.cosine_um_per_m(0.0) == 0.0


@given(length=st.floats(0.0, 10.0), coverage=st.floats(1.0, 3.0))
def test_expanded_uncertainty_has_its_limits(length, coverage):
    budget = probe_budget.ren_budget()
    value = float(budget.expanded_um(length, coverage))
    assert value >= coverage * max(budget.fixed_um, budget.per_m_um * length) * (1 - 1e-12)
    assert value <= coverage * (budget.fixed_um + budget.per_m_um * length) * (1 + 1e-12)


@given(parts=st.lists(st.tuples(st.floats(0.0, 5.0), st.floats(0.0, 5.0)), min_size=1, max_size=6))
def test_order_and_splitting_do_not_matter(parts):
    whole = ProbeBudget(tuple(Component(str(i), "B", a, b) for i, (a, b) in enumerate(parts)))
    split = ProbeBudget(
        tuple(Component(str(i), "B", *p) for i, (a, b) in enumerate(parts[::-1]) for p in ((a, 0), (0, b)))
    )
    assert whole.expanded_um(0.7) == pytest.approx(float(split.expanded_um(0.7)))


def test_shares_add_to_one_and_move_to_temperature_with_length():
    budget = probe_budget.ren_budget()
    near, far = budget.shares(0.01), budget.shares(10.0)
    assert near.sum() == pytest.approx(1.0)
    assert budget.components[int(np.argmax(near))].name == "repeatability at the trigger position"
    assert budget.components[int(np.argmax(far))].name.startswith("temperature distribution")


def test_repeatability_component_is_the_standard_deviation():
    part = probe_budget.repeatability_component("trigger", [1.0, 2.0, 3.0, 4.0])
    assert part.fixed_um == pytest.approx(np.sqrt(5.0 / 3.0))
    assert part.kind == "A"
    with pytest.raises(ValueError, match="two readings"):
        probe_budget.repeatability_component("trigger", [1.0])
