"""A reading that its repeats contradict: the right one is named with three repeats and with two, nothing else is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stepgauge.conditions.gauge import _exceeds, _fisher_limit
from stepgauge.evaluation.evaluate import Evaluation, evaluate
from stepgauge.gauge.certified import Gauge, read_gauge
from stepgauge.machine.file import read_machine
from stepgauge.montecarlo import recording_model
from stepgauge.physics.robust import group_medians
from stepgauge.recording import Recording
from stepgauge.standards.budget import make_budget
from tests.standards.made import made

GAUGE = read_gauge("step-gauge-420")
NOISE_UM = 0.4


def measured(seed: int, cycles: int = 3, noise_um: float = NOISE_UM, gauge: Gauge = GAUGE) -> Recording:
    """A machine of 3 um/m that repeats to 0.4 um."""
    noise = np.random.default_rng(seed).normal(0.0, noise_um, (cycles + 1, gauge.n_faces + 1))
    return made(gauge, lambda c, f: 3e-3 * gauge.position_mm[f - 1] + noise[c, f], cycles=cycles)


def blundered(recording: Recording, row: int, um: float) -> Recording:
    frame = recording.frame.copy()
    frame.loc[row, "x_mm"] += um * 1e-3
    return replace(recording, frame=frame)


def named(evaluation: Evaluation) -> list[tuple[int, int]]:
    return [(one.cycle, one.face) for one in evaluation.results[0].left_out]


@pytest.mark.parametrize("cycles", [3, 2])
def test_the_right_reading_is_named_and_the_rest_is_what_was_measured(cycles: int) -> None:
    random = np.random.default_rng(47 + cycles)
    wrong = 0
    for seed in range(25):
        good = measured(seed, cycles)
        row, um = int(random.integers(len(good))), float(random.uniform(20.0, 200.0) * random.choice([-1, 1]))
        found = evaluate(blundered(good, row, um), GAUGE)
        wanted = [tuple(good.frame.loc[row, ["cycle", "face"]])]
        wrong += named(found) != wanted
        without = evaluate(replace(good, frame=good.frame.drop(index=row)), GAUGE)
        if named(found) == wanted:
            np.testing.assert_allclose(found.results[0].xm_um, without.results[0].xm_um, atol=1e-9)
            assert found.results[0].radius == without.results[0].radius
    assert wrong <= (0 if cycles == 3 else 2)


@pytest.mark.parametrize("cycles", [2, 3, 5])
def test_without_a_blunder_nothing_is_left_out(cycles: int) -> None:
    for seed in range(40):
        found = evaluate(measured(seed, cycles), GAUGE)
        assert named(found) == []
        assert not found.conditions.preventing


def test_two_repeats_that_contradict_each_other_beside_a_rough_machine_are_a_question() -> None:
    """Faces that lie 30 um off their neighbours do not tell which of two readings is right."""
    rough = np.random.default_rng(5).normal(0.0, 40.0, GAUGE.n_faces + 1)
    noise = np.random.default_rng(6).normal(0.0, NOISE_UM, (3, GAUGE.n_faces + 1))
    recording = made(GAUGE, lambda c, f: rough[f] + noise[c, f], cycles=2)
    found = [evaluate(blundered(recording, row, 60.0), GAUGE) for row in (14, 15, 24, 25)]
    unclear = [one for one in found if not named(one)]
    assert unclear
    assert all("contradict each other" in one.conditions.preventing[0].sentence for one in unclear)


def test_one_u_of_the_effective_radius() -> None:
    """A bad reading of the first block is in neither; evaluation and budget state the same of what both know."""
    recording = blundered(measured(1), 1, 50.0)
    found = evaluate(recording, GAUGE)
    assert named(found) == [(1, 2)]
    model = recording_model(recording, read_machine("bridge-cmm"), GAUGE)
    line = next(one for one in make_budget(model).lines if one.name == "r_eff_mm")
    both = [line.contribution[name] for name in ("certificate", "repeatability")]
    assert 1e3 * found.results[0].radius.u_mm == pytest.approx(np.hypot(*both), rel=1e-9)
    assert found.results[0].radius.r_eff_mm == pytest.approx(1.997, abs=0.0006)


def test_the_medians_of_groups_are_those_of_each_group() -> None:
    random = np.random.default_rng(3)
    group, values = random.integers(0, 40, 500), random.normal(size=500)
    found = group_medians(values, group)
    for one in np.unique(group):
        assert np.all(found[group == one] == np.median(values[group == one]))
    assert np.array_equal(group_medians(values, group + 10**8), found)


def test_the_near_score_leaves_no_variance_out_that_the_exact_limit_names() -> None:
    """Whatever the freedoms: where the F limit is passed, the score that is asked first is above its share of it.

    Of n faces every one has a chance of 1e-3 / n, and the others at least n - 1 degrees of freedom.
    """
    for above in (1.0, 2.0, 4.0, 9.0, 30.0):
        for faces in (3, 6, 20, 100, 400):
            for below in (faces - 1.0, 4.0 * faces, 40.0 * faces):
                chance = 1e-3 / faces
                limit = float(_fisher_limit(chance, np.array([above]), np.array([below]))[0])
                one = [np.array([value]) for value in (1.001 * limit, 1.0, above, below)]
                assert _exceeds(*one, chance)[0], (above, below, chance)
                one[0] = np.array([0.999 * limit])
                assert not _exceeds(*one, chance)[0]
