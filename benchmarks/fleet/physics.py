"""The readings of one recording, from the gauge's true faces to the indicated tip centres."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from benchmarks.fleet import parts
from benchmarks.fleet.design import Recording
from benchmarks.fleet.parts import Array, Gauge, Machine, Random

FOLLOWING_UM = 0.3
"""Deviation of a servoed machine across its line."""
WANDER_K = 0.02
"""Half of what the gauge's temperature changes by, as its thermometer shows, while it is measured."""


@dataclass
class Errors:
    """All that is wrong when a recording is made, from every owner, in the units and signs of ``score.py``.

    ``face_um`` are the shifts of the faces along the gauge. A bump is (axis, place mm, standard deviation mm, height
    um), a wave (axis, period mm, amplitude um, phase rad).
    """

    scale_ppm: Array = field(default_factory=lambda: np.zeros(2))
    squareness_urad: float = 0.0
    reversal_um: Array = field(default_factory=lambda: np.zeros(2))
    bumps: list[tuple[int, float, float, float]] = field(default_factory=list)
    waves: list[tuple[int, float, float, float]] = field(default_factory=list)
    certificate_ppm: float = 0.0
    expansion_per_K: float = 0.0
    face_um: Array | float = 0.0
    gauge_K: float = 0.0
    radius_um: float = 0.0


def usual_errors(machine: Machine, probe_um: float, random: Random) -> Errors:
    """What any sound machine, probe and thermometer has; drawn anew for each recording where it is not kept."""
    return Errors(
        scale_ppm=np.array(machine.scale_ppm),
        squareness_urad=machine.squareness_urad,
        reversal_um=np.array(machine.reversal_um),
        gauge_K=float(random.normal(0.0, parts.THERMOMETER_K)),
        radius_um=probe_um + float(random.normal(0.0, parts.QUALIFICATION_UM)),
    )


def record(recording: Recording, machine: Machine, gauge: Gauge, errors: Errors, random: Random) -> dict[str, Array]:
    """Columns of the recording, one row for each touch: cycle, face, tip centre, approach, time, temperatures."""
    faces = len(gauge.nominal_mm)
    face = np.tile(np.arange(1, faces + 1, dtype=np.int64), recording.cycles)
    side = np.where(face % 2 == 1, 1.0, -1.0)
    time_s = np.cumsum(random.uniform(1.9, 2.3, len(face)))
    shown_C = recording.temperature_C + WANDER_K * np.linspace(-1.0, 1.0, len(face)) * random.choice([-1.0, 1.0])
    along_mm = _face_mm(gauge, errors, shown_C + errors.gauge_K - 20.0, face)
    trigger_um = parts.PRETRAVEL_UM + errors.radius_um + random.normal(0.0, machine.repeatability_um, len(face))
    along_mm = along_mm - side * parts.TIP_RADIUS_MM + side * trigger_um * 1e-3
    axis = np.array(recording.axis)
    tip_mm = np.array(recording.middle_mm) + (along_mm - gauge.length_mm / 2.0)[:, None] * axis
    indicated_mm = tip_mm + 1e-3 * (displacement_um(tip_mm, axis, side, errors) @ axis)[:, None] * axis
    indicated_mm += 1e-3 * _across(axis, random.normal(0.0, FOLLOWING_UM, (len(face), 3)))
    return {
        "cycle": np.repeat(np.arange(1.0, recording.cycles + 1), faces),
        "face": face.astype(float),
        "tip": indicated_mm,
        "approach": side[:, None] * axis,
        "time_s": time_s,
        "gauge_C": shown_C,
        "scale_C": np.full((len(face), 3), recording.temperature_C),
    }


def _face_mm(gauge: Gauge, errors: Errors, warm_K: Array, face: NDArray[np.int64]) -> Array:
    """Where the probed faces truly are along the gauge, from face 1 at 20 deg C, at their true temperatures."""
    at_20C = gauge.true_mm * (1.0 + 1e-6 * errors.certificate_ppm) + 1e-3 * errors.face_um
    return np.asarray(at_20C[face - 1] * (1.0 + (gauge.true_expansion_per_K + errors.expansion_per_K) * warm_K))


def displacement_um(tip_mm: Array, axis: Array, side: Array, errors: Errors) -> Array:
    """What the machine indicates too much at each tip centre, shape ``(n, 3)``; z is without error."""
    shift = np.zeros_like(tip_mm)
    for k in range(2):
        shift[:, k] = 1e-3 * errors.scale_ppm[k] * tip_mm[:, k]
        shift[:, k] += errors.reversal_um[k] / 2.0 * np.sign(side * axis[k])
    shift[:, 0] += 1e-3 * errors.squareness_urad * tip_mm[:, 1]
    for k, at_mm, sd_mm, height_um in errors.bumps:
        shift[:, k] += height_um * np.exp(-0.5 * ((tip_mm[:, k] - at_mm) / sd_mm) ** 2)
    for k, period_mm, amplitude_um, phase in errors.waves:
        shift[:, k] += amplitude_um * np.sin(2.0 * np.pi * tip_mm[:, k] / period_mm + phase)
    return shift


def _across(axis: Array, vectors: Array) -> Array:
    return np.asarray(vectors - (vectors @ axis)[:, None] * axis)
