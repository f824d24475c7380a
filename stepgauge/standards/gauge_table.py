"""The gauge and its certificate as the results of a standard name them."""

from __future__ import annotations

from typing import Any

from stepgauge.gauge.certified import Gauge


def gauge_to_dict(gauge: Gauge) -> dict[str, Any]:
    """Name, serial, certificate, expansion and the range of the expanded uncertainties, as JSON types."""
    certificate, table = gauge.certificate, gauge.table
    k = certificate.coverage_factor
    return {
        "name": table.name,
        "serial": table.serial,
        "material": table.material,
        "expansion_per_K": table.expansion_per_K,
        "expansion_uncertainty_per_K": table.expansion_uncertainty_per_K,
        "reference_temperature_C": table.reference_temperature_C,
        "certificate": certificate.number,
        "laboratory": certificate.laboratory,
        "date": certificate.date.isoformat(),
        "coverage_factor": k,
        "expanded_uncertainty_um": [float(gauge.u_um.min()) * k, float(gauge.u_um.max()) * k],
        "example": certificate.example,
    }
