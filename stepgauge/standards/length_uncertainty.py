"""Test value uncertainty of a length error, by the contributions of ISO/TS 23165.

The errors of the machine are tested and are not part of it. Contributions not stated are left out and listed.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from stepgauge.gauge.certified import Gauge

SOURCE = "ISO/TS 23165:2006, test uncertainty of the error of indication"


@dataclass(frozen=True)
class TestConditions:
    """Statements of the tester; None if not stated. All are standard uncertainties.

    ``temperature_u_K``: of the gauge temperature; ``alignment_mrad``: of the angle between gauge axis and evaluated
    axis, in each of the two directions across it; ``fixture_um``: of the length, by how the gauge is held;
    ``tip_diameter_u_um``: of a stated tip diameter that does not come from the machine's own qualification (which is
    part of what is tested).
    """

    __test__ = False

    temperature_u_K: float | None = None
    alignment_mrad: float | None = None
    fixture_um: float | None = None
    tip_diameter_u_um: float | None = None
    coverage_factor: float = 2.0


@dataclass(frozen=True)
class TestUncertainty:
    """Standard uncertainties of one test value by contribution, um, and what was not stated."""

    __test__ = False

    parts_um: dict[str, float] = field(default_factory=dict)
    missing: tuple[str, ...] = ()

    @property
    def standard_um(self) -> float:
        """The contributions in quadrature: they are taken as independent."""
        return float(np.sqrt(sum(part**2 for part in self.parts_um.values())))


def length_uncertainty(
    gauge: Gauge,
    faces: tuple[int, int],
    gauge_temperature_C: float | None,
    stated: TestConditions,
    tip_u_um: float | None,
) -> TestUncertainty:
    """The test value uncertainty of a length error between two faces.

    Parameters
    ----------
    gauge, faces : the certificate, and the two faces of the length
    gauge_temperature_C : mean recorded temperature of the gauge; None where it was not recorded
    stated : what the tester states
    tip_u_um : standard uncertainty of the tip diameter that was taken off; None where the length needs no diameter

    Notes
    -----
    Certificate: both faces' uncertainties as if uncorrelated, which is rather too large where they grow together along
    the gauge. Expansion: L (T - T_ref) u(alpha). Temperature: L alpha u(T). Alignment: a tilt with standard uncertainty
    u in each of the two directions across the axis shortens L by L u^2 on average, with a standard deviation of L u^2;
    both together give sqrt(2) L u^2. Fixture and tip as stated.
    """
    first, second = sorted(faces)
    length_mm = float(gauge.position_mm[second - 1] - gauge.position_mm[first - 1])
    table = gauge.table
    warmer_K = None if gauge_temperature_C is None else gauge_temperature_C - table.reference_temperature_C
    parts = {
        "certificate": float(np.hypot(gauge.u_um[first - 1], gauge.u_um[second - 1])),
        "expansion": None if warmer_K is None else length_mm * 1e3 * abs(warmer_K) * table.expansion_uncertainty_per_K,
        "temperature": _times(stated.temperature_u_K, length_mm * 1e3 * table.expansion_per_K),
        "alignment": _times(_square(stated.alignment_mrad), np.sqrt(2.0) * length_mm * 1e-3),
        "fixture": stated.fixture_um,
    }
    if tip_u_um is not None:
        parts["tip diameter"] = tip_u_um
    known = {name: float(value) for name, value in parts.items() if value is not None}
    return TestUncertainty(known, tuple(MISSING[name] for name, value in parts.items() if value is None))


MISSING = {
    "expansion": "expansion of the gauge: its temperature was not recorded",
    "temperature": "uncertainty of the gauge temperature",
    "alignment": "alignment of the gauge",
    "fixture": "fixture of the gauge",
}


def _times(value: float | None, factor: float) -> float | None:
    return None if value is None else value * factor


def _square(value: float | None) -> float | None:
    return None if value is None else value**2
