"""A period with its second harmonic, as encoders have it: amplitudes of both, from signals of an encoder."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from stepgauge.diagnosis.axis.diagnosis import diagnose_axis
from tests.axis.made import axis

PITCH_MM, NOISE_UM = 2.0, 0.010
OFFSET, GAIN = 2.5e-4, 2.5e-4


def targets(seed: int) -> np.ndarray:
    return np.sort(np.random.default_rng(seed).uniform(0.0, 60.0, 120))


def effects(law: Any, seed: int, kind: str = "encoder") -> list[dict[str, Any]]:
    recording = axis(targets(seed), law, noise=NOISE_UM, both=False, seed=seed)
    return list(diagnose_axis(recording, kind=kind).contents["effects"])


def interpolated_um(x_mm: np.ndarray, gain: float) -> np.ndarray:
    """What the arctangent of a sine with an offset and a cosine with another gain is off, um."""
    angle = 2.0 * np.pi * x_mm / PITCH_MM
    read = np.arctan2(np.sin(angle) + OFFSET, (1.0 + gain) * np.cos(angle))
    return np.asarray(((read - angle + np.pi) % (2.0 * np.pi) - np.pi) * PITCH_MM * 1e3 / (2.0 * np.pi))


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("gain", [4.0 * GAIN, 2.0 * GAIN], ids=["equal", "half"])
def test_offset_and_gain_of_the_signals_are_told_by_the_amplitudes_of_two_harmonics(gain: float, seed: int) -> None:
    """An offset o of the sine makes pitch o / (2 pi), a gain g of the cosine pitch g / (4 pi) at half the period.

    It was ``unknown``, or the second harmonic was put down to the shape of the first.
    """
    (one,) = effects(lambda t, way: interpolated_um(t, gain), seed)
    assert one["kind"] == "interpolation_error"
    assert one["probability"] > 0.9
    found, part_um = one["parameters"], PITCH_MM * 1e3 / (2.0 * np.pi)
    for name, truth in {"amplitude_um": OFFSET * part_um, "second_um": gain * part_um / 2.0, "period_mm": 2.0}.items():
        assert abs(found[name]["value"] - truth) < 3.0 * found[name]["u"]
        assert found[name]["u"] < 0.1 * truth


@pytest.mark.parametrize("seed", [1, 2])
def test_one_sine_and_two_of_other_periods_have_no_second_harmonic(seed: int) -> None:
    one = effects(lambda t, way: 0.08 * np.sin(np.pi * t + seed), seed)
    two = effects(lambda t, way: 0.08 * np.sin(np.pi * t + seed) + 0.05 * np.sin(2.0 * np.pi * t / 1.37), seed)
    assert [effect["kind"] for effect in one] == ["periodic_scale_error"]
    assert [effect["kind"] for effect in two] == ["periodic_scale_error"] * 2


def test_of_nothing_no_harmonics_are_told() -> None:
    named = [one for seed in range(6) for one in effects(lambda t, way: 0.0 * t, seed)]
    assert named == []
