"""What a fleet consists of: model lines, machines, gauges, and their small errors that are nothing wrong.

Own code throughout: nothing of the package under test may be imported here or in any module of the generator.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Random = np.random.Generator
HALLS = ("H1", "H2", "H3")
LINES = ("T1", "T2", "T3", "T4", "T5", "T6")
TRAVEL_MM = ((700.0, 1000.0, 500.0), (900.0, 1200.0, 600.0), (1200.0, 2000.0, 800.0))
"""Travels along x, y, z of the model lines, in turn."""
PITCHES_MM = ((10.0, 4.0), (16.0, 8.0), (20.0, 10.0), (40.0, 20.0), (25.0, 10.0))
"""Pitch and width of blocks; of the last a local error of a scale reaches one block and no neighbour."""
TIP_RADIUS_MM, PRETRAVEL_UM = 1.0, 3.0
EXPANSION_PER_K, U_EXPANSION_PER_K = 11.5e-6, 0.3e-6
# What is usual, as standard deviations: nobody would call it a cause.
MACHINE_SCALE_PPM, MACHINE_SQUARENESS_URAD, MACHINE_REVERSAL_UM = 0.4, 0.8, 0.15
PROBE_UM, QUALIFICATION_UM = 0.15, 0.15
THERMOMETER_K = 0.03
FACE_UM, CERTIFICATE_PPM = 0.05, 0.2
"""Standard uncertainties of a certified position: of each face by itself, and of all in proportion to the distance."""


@dataclass(frozen=True)
class Gauge:
    """A gauge as certified and as it was on that day; positions from face 1 in mm, expansions per K."""

    name: str
    width_mm: float
    pitch_mm: float
    nominal_mm: Array
    certified_mm: Array
    u_um: Array
    true_mm: Array
    true_expansion_per_K: float

    @property
    def length_mm(self) -> float:
        return float(self.nominal_mm[-1])

    @property
    def blocks(self) -> int:
        return len(self.nominal_mm) // 2


@dataclass(frozen=True)
class Machine:
    """A machine of a line in its hall; its usual errors by axis x, y; where its fixture has the gauge's middle, mm."""

    name: str
    line: str
    hall: str
    travel_mm: tuple[float, float, float]
    repeatability_um: float
    scale_ppm: tuple[float, float]
    squareness_urad: float
    reversal_um: tuple[float, float]
    fixture_mm: tuple[float, float, float]
    warmth_K: float


def make_gauge(number: int, random: Random, longest_mm: float = 1000.0, wide: bool = False) -> Gauge:
    """10 to 100 blocks on 400 mm to 1000 mm; gaps wide enough for the ball; ``wide`` those with the widest gaps."""
    pitch_mm, width_mm = PITCHES_MM[-1 if wide else random.integers(len(PITCHES_MM))]
    length_mm = float(random.uniform(400.0, longest_mm))
    blocks = int(np.clip(length_mm // pitch_mm, 10, 100))
    fronts = pitch_mm * np.arange(blocks)
    nominal = np.column_stack([fronts, fronts + width_mm]).ravel()
    certified = np.round(nominal + np.r_[0.0, random.normal(0.0, 0.6e-3, 2 * blocks - 1)], 5)
    face_um, ppm = FACE_UM * random.standard_normal(2 * blocks), CERTIFICATE_PPM * random.standard_normal()
    return Gauge(
        name=f"G{number:02d}",
        width_mm=width_mm,
        pitch_mm=pitch_mm,
        nominal_mm=nominal,
        certified_mm=certified,
        u_um=np.hypot(FACE_UM, CERTIFICATE_PPM * 1e-3 * nominal),
        true_mm=certified + 1e-3 * face_um + 1e-6 * ppm * certified,
        true_expansion_per_K=EXPANSION_PER_K + U_EXPANSION_PER_K * float(random.standard_normal()),
    )


def make_machine(number: int, random: Random) -> Machine:
    """A machine of a line drawn at random; every third one has been compensated and has no error of its own."""
    line = int(random.integers(len(LINES)))
    share = 0.0 if random.random() < 1.0 / 3.0 else 1.0
    x_ppm, y_ppm = share * MACHINE_SCALE_PPM * random.standard_normal(2)
    x_um, y_um = share * MACHINE_REVERSAL_UM * random.standard_normal(2)
    travel_mm = TRAVEL_MM[line % len(TRAVEL_MM)]
    return Machine(
        name=f"M{number:03d}",
        line=LINES[line],
        hall=str(random.choice(HALLS)),
        travel_mm=travel_mm,
        repeatability_um=round(float(random.uniform(0.3, 1.0)), 2),
        scale_ppm=(float(x_ppm), float(y_ppm)),
        squareness_urad=share * MACHINE_SQUARENESS_URAD * float(random.standard_normal()),
        reversal_um=(float(x_um), float(y_um)),
        fixture_mm=(
            travel_mm[0] / 2.0,
            travel_mm[1] * float(random.uniform(0.4, 0.6)),
            float(random.uniform(120, 250)),
        ),
        warmth_K=float(random.normal(0.0, 0.08)),
    )
