"""Parameters of the changes found, in the terms of the field and with their uncertainties."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from stepgauge.diagnosis.fits.solve import Estimate
from stepgauge.diagnosis.maps.candidates import Table
from stepgauge.diagnosis.maps.model import ChangeTerm, changed_table
from stepgauge.diagnosis.maps.stated_map import FittedChanges
from stepgauge.files.arrays import Array
from stepgauge.physics import stylus
from stepgauge.probes.schema import SectionTable


def estimates(table: Table, fitted: FittedChanges) -> list[dict[str, Estimate]]:
    """One dictionary per term, with the standard uncertainties of the fit."""
    return [_of_term(table, term, fitted.covariance_of(place)) for place, term in enumerate(fitted.terms)]


def _of_term(table: Table, term: ChangeTerm, covariance: Array) -> dict[str, Estimate]:
    names = [knob.name for knob in term.candidate.knobs]
    if names == ["x_mm", "y_mm"]:
        return _polar(term.values, covariance, "mm", "azimuth_deg", "mm", 1.0)
    if names == ["cos_um", "sin_um"]:
        return _polar(term.values, covariance, "amplitude_um", "phase_deg", "um", 3.0)
    found = {
        knob.name: Estimate(value, _root(covariance[i, i]), knob.unit)
        for i, (knob, value) in enumerate(zip(term.candidate.knobs, term.values, strict=True))
    }
    if "more_um" in found:
        found["offset_um"] = _offset(table, found.pop("more_um"))
    derive = _DERIVED.get(term.candidate.kind)
    return found | derive(table, term, _root(covariance[0, 0])) if derive else found


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


def _offset(table: Table, more: Estimate) -> Estimate:
    """Constant beside triangular lobes: 0 for Wozniak's law alone."""
    return Estimate(float(table.get("pretravel_um", 0.0)) + more.value, more.u, more.unit)


def _compliance(table: Table, term: ChangeTerm, u: float | None) -> dict[str, Estimate]:
    sections = [stylus.StylusSection(**SectionTable.model_validate(each).model_dump()) for each in table["stylus"]]
    lateral = 1e3 * stylus.lateral_compliance_mm_per_N(sections)
    return {"lateral_um_per_N": Estimate(lateral * term.values[0], None if u is None else lateral * u, "um/N")}


def _stylus_length(table: Table, term: ChangeTerm, u: float | None) -> dict[str, Estimate]:
    sections = changed_table(table, [term])["stylus"]
    return {"stylus_length_mm": Estimate(sum(float(one["length_mm"]) for one in sections), u, "mm")}


def _total(key: str, name: str, unit: str) -> Callable[[Table, ChangeTerm, float | None], dict[str, Estimate]]:
    """The value in the changed file."""

    def derive(table: Table, term: ChangeTerm, u: float | None) -> dict[str, Estimate]:
        return {name: Estimate(float(changed_table(table, [term])["seat"][key]), u, unit)}

    return derive


_DERIVED = {
    "compliance": _compliance,
    "stylus_length": _stylus_length,
    "preload": _total("preload_N", "preload_N", "N"),
    "contact_radius": _total("contact_radius_mm", "contact_radius_mm", "mm"),
    "contact_angle": _total("contact_angle_deg", "contact_angle_deg", "deg"),
    "lobing_phase": _total("arm_azimuth_deg", "arm_azimuth_deg", "deg"),
    "lever_arm": _total("carrier_mm", "carrier_mm", "mm"),
}


def _root(variance: Any) -> float | None:
    """Square root of a variance; None if there is none."""
    return float(np.sqrt(variance)) if np.isfinite(variance) and variance >= 0.0 else None
