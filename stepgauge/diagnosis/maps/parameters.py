"""Parameters of the changes found, in the terms of the field and with their uncertainties."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from stepgauge.diagnosis.fits.solve import Estimate
from stepgauge.diagnosis.maps.candidates import Table
from stepgauge.diagnosis.maps.model import ChangeTerm
from stepgauge.diagnosis.maps.stated_map import FittedChanges
from stepgauge.files.arrays import Array

COMPONENTS = {"x_mm": ("mm", "azimuth_deg", "mm", 1.0), "cos_um": ("amplitude_um", "phase_deg", "um", 3.0)}
"""First of two components -> names of size and direction, unit of the size, and number of lobes in a turn."""


def estimates(table: Table, fitted: FittedChanges) -> list[dict[str, Estimate]]:
    """One dictionary per term, with the standard uncertainties of the fit."""
    return [_term_parameters(table, term, fitted.covariance_of(place)) for place, term in enumerate(fitted.terms)]


def _term_parameters(table: Table, term: ChangeTerm, covariance: Array) -> dict[str, Estimate]:
    knobs = term.candidate.knobs
    if knobs[0].name in COMPONENTS:
        return _polar(term.values, covariance, *COMPONENTS[knobs[0].name])
    found = {
        knob.name: Estimate(value, _root(covariance[i, i]), knob.unit)
        for i, (knob, value) in enumerate(zip(knobs, term.values, strict=True))
    }
    if "more_um" in found:  # the constant beside triangular lobes: 0 for Wozniak's law alone
        more = found.pop("more_um")
        found["offset_um"] = Estimate(float(table.get("pretravel_um", 0.0)) + more.value, more.u, more.unit)
    if (total := term.candidate.total) is not None:
        u = _root(covariance[0, 0] * total.slope**2)
        found[total.name] = Estimate(total.value(term.values[0]), u, total.unit)
    return found


def _polar(
    values: Sequence[float], covariance: Array, size: str, angle: str, unit: str, lobes: float
) -> dict[str, Estimate]:
    """Size and direction of two components, uncertainties by linear propagation."""
    x, y = values
    r = max(float(np.hypot(x, y)), 1e-12)
    along, across = np.array([x, y]) / r, np.array([-y, x]) / r**2
    degrees = float(np.degrees(np.arctan2(y, x)) / lobes)
    return {
        size: Estimate(r, _root(along @ covariance @ along), unit),
        angle: Estimate(degrees, _root(np.degrees(1.0) ** 2 * across @ covariance @ across / lobes**2), "deg"),
    }


def _root(variance: Any) -> float | None:
    """Square root of a variance; None if there is none."""
    return float(np.sqrt(variance)) if np.isfinite(variance) and variance >= 0.0 else None
