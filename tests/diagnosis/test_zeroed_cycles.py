"""A table of a CMM that was set to zero at the first face in every cycle: no drift, and no cause that goes by cycle."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import stepgauge as sg
from stepgauge.evaluation.evaluate import evaluate
from stepgauge.recording import APPROACH, POSITION, Recording
from stepgauge.recording.columns import CORRECTED
from stepgauge.recording.corrected import zeroed_face
from tests.measured import lay, shipped

GAUGE, MACHINE = shipped()
BLOCKS, CYCLES, SCATTER_UM, SCALE_UM_PER_M = 12, 3, 0.4, 12.0


def table(seed: int, zero: bool) -> Recording:
    """Surface points along the gauge on a machine with a scale error; ``zero``: from face 1 of the same cycle."""
    face = np.tile(np.arange(1, 2 * BLOCKS + 1), CYCLES)
    cycle = np.repeat(np.arange(1, CYCLES + 1), 2 * BLOCKS)
    true_mm = GAUGE.position_mm[face - 1] - GAUGE.position_mm[0]
    noise_um = np.random.default_rng(seed).normal(0.0, SCATTER_UM, len(face))
    read_mm = true_mm * (1.0 + SCALE_UM_PER_M * 1e-6) + noise_um * 1e-3
    if zero:
        read_mm = read_mm - read_mm[face == 1][cycle - 1]
    read_mm = np.round(read_mm, 4)
    approach, axis = np.where(face % 2 == 1, 1.0, -1.0), lay(GAUGE).axis
    frame = pd.DataFrame({"placement": 1, "cycle": cycle, "face": face, "gauge_temperature_C": 20.0})
    frame[POSITION] = np.array([150.0, 150.0, 200.0]) + (read_mm - 1.5 * approach)[:, None] * axis
    frame[APPROACH] = approach[:, None] * axis
    return Recording(frame, {CORRECTED: "1.5"}, "table.csv")


@pytest.mark.parametrize("zero", [True, False])
def test_it_is_recognised_and_told(zero: bool) -> None:
    result = evaluate(table(1, zero), GAUGE).results[0]
    said = "every cycle was set to zero at face 1" in " ".join(result.notes)
    assert said is zero
    assert not [one for one in result.conditions if one.name == "drift" and "drift by" in one.sentence]


def test_no_seed_shows_a_drift_that_is_not_there() -> None:
    """5 standard uncertainties of a drift were told where the first face's scatter moved whole cycles."""
    for seed in range(40):
        result = evaluate(table(seed, True), GAUGE).results[0]
        assert not any("drift by" in note for note in result.notes), seed


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_diagnosis_has_an_origin_for_every_cycle_and_finds_the_scale_error_alone(seed: int) -> None:
    found = sg.diagnose(table(seed, True), GAUGE, MACHINE)
    assert found.verdict == "effects", found.summary()
    assert len(found.findings) == 1, found.summary()
    (one,) = found.findings  # on one line a long scale and a cold gauge look alike
    scale = next(member for member in (one, *one.members) if member.kind == "scale_error")
    assert scale.parameters["ppm"].value == pytest.approx(SCALE_UM_PER_M, abs=3.0)


def test_a_face_without_scatter_among_others_without_is_no_zero() -> None:
    face, cycle = np.tile(np.arange(1, 9), 3), np.repeat([1, 2, 3], 8)
    along = np.tile(np.arange(8.0), 3)
    assert zeroed_face(along, face, cycle) is None  # nothing scatters: a simulation, or a coarse display
    along[5::8] += [0.001, 0.0, 0.002]
    assert zeroed_face(along, face, cycle) is None  # only one does
    noisy = along + np.where(face == 1, 0.0, np.random.default_rng(1).normal(0.0, 1e-3, len(face)))
    assert zeroed_face(noisy, face, cycle) == 1
    assert zeroed_face(noisy[:8], face[:8], cycle[:8]) is None
