"""The benchmark of probe maps, in small: false alarms, structure without a name, changes left out of the candidates."""

import numpy as np
import pytest

from benchmarks import probe_maps as maps


def test_hardly_any_map_in_which_nothing_is_concealed_raises_an_alarm():
    alarms = maps.false_alarms(25, seed=77)
    assert sum(map(len, alarms.values())) <= 1


def test_what_is_concealed_has_the_size_asked_for():
    for plan in maps.PLANS:
        for name in maps.OUTSIDERS:
            off = maps.outsider(plan, name, 0.7)[plan.quantities[-1]]
            assert np.sqrt(np.mean(off**2)) == pytest.approx(0.7 * maps.NOISE[plan.quantities[-1]])
        for truth, off in maps.changes(plan, 1.5):
            largest = max(np.sqrt(np.mean(values**2)) / maps.NOISE[name] for name, values in off.items())
            assert largest == pytest.approx(1.5, rel=1e-6), truth.candidate.label


@pytest.mark.parametrize("number", range(5))
def test_structure_outside_the_vocabulary_is_called_unknown(number):
    """Two structures for each plan: every one is asked for once."""
    plan = maps.PLANS[number]
    for name in list(maps.OUTSIDERS)[number::5]:
        data = maps.made(plan, np.random.default_rng(9), maps.outsider(plan, name, 3.0))
        assert maps.diagnosed(plan, data).verdict == "unknown", name


@pytest.mark.parametrize("kind", ["lobing_phase", "probe_lobing"])
def test_a_change_left_out_of_the_candidates_is_unknown_and_not_another_one(kind):
    plan = maps.PLANS[3 if kind == "probe_lobing" else 0]
    truth, off = next((t, o) for t, o in maps.changes(plan, 3.0) if t.candidate.kind == kind)
    others = [c for c in maps.candidates_for(plan.table, plan.quantities) if c.kind != truth.candidate.kind]
    found = maps.diagnosed(plan, maps.made(plan, np.random.default_rng(3), off), others)
    assert found.verdict == "unknown"
    assert any(one.covariate in ("azimuth", "direction") for one in found.unexplained)
