"""Positioning by other standards than ISO 230-2, from the same deviations: VDI/DGQ 3441 and ASME B5.54.

The formulas of VDI/DGQ 3441:1977 are those that makers of laser interferometers print; those of ASME B5.54 are taken
from the same kind of source. Neither text was at hand: :data:`UNCONFIRMED` says so wherever the numbers go.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from stepgauge.standards.iso230 import AxisParameters, Parameters

UNCONFIRMED = {
    "vdi3441": "VDI/DGQ 3441:1977: formulas from secondary sources, its text was not at hand: unconfirmed",
    "b5.54": "ASME B5.54 (positioning, with the formulas of its edition of 2005, which follow ISO 230-2): unconfirmed",
}


def vdi3441_um(p: AxisParameters) -> dict[str, float]:
    """Positional uncertainty P, positional deviation Pa, scatter Ps and reversal U, their largest and means, um.

    With the means x and standard deviations s of each direction at a target: mean m = (x_up + x_down) / 2,
    U = |x_up - x_down|, Ps = 6 (s_up + s_down) / 2; P is the largest m + (U + Ps) / 2 minus the smallest
    m - (U + Ps) / 2, Pa the range of m.
    """
    middle = p.mean_um
    reversal = np.abs(p.B_at_um)
    scatter = 6.0 * (p.up.s_um + p.down.s_um) / 2.0
    half = (reversal + scatter) / 2.0
    return {
        "P": float((middle + half).max() - (middle - half).min()),
        "Pa": float(np.ptp(middle)),
        "Ps_max": float(scatter.max()),
        "Ps_mean": float(scatter.mean()),
        "U_max": float(reversal.max()),
        "U_mean": float(reversal.mean()),
    }


def b554_um(p: AxisParameters) -> dict[str, float]:
    """Bidirectional accuracy, repeatability of each direction and of both, systematic deviation and lost motion, um."""
    return {
        "accuracy": p.A_um,
        "repeatability_forward": p.up.R_um,
        "repeatability_reverse": p.down.R_um,
        "repeatability_bidirectional": p.R_um,
        "systematic_deviation": p.E_um,
        "lost_motion": float(np.abs(p.mean_B_um)),
    }


FURTHER: dict[str, Callable[[AxisParameters], dict[str, float]]] = {"vdi3441": vdi3441_um, "b5.54": b554_um}
LABELS = {"vdi3441": "VDI/DGQ 3441", "b5.54": "ASME B5.54"}


def further_um(parameters: Parameters, standards: tuple[str, ...]) -> dict[str, dict[str, Any]]:
    """By standard its parameters in um, and what is unconfirmed; none of an axis approached in one direction."""
    if not isinstance(parameters, AxisParameters):
        return {}
    return {name: {"parameters_um": FURTHER[name](parameters), "note": UNCONFIRMED[name]} for name in standards}
