"""Sources that no file of the machine alone has: drift of the standard, what the readings show, one's own."""

from __future__ import annotations

import datetime
import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from stepgauge.files.dates import YEAR_DAYS, moments, parse_moment
from stepgauge.gauge.certified import Gauge
from stepgauge.machine.contribution import Contribution
from stepgauge.montecarlo.model import MonteCarloModel, PlacementReadings
from stepgauge.recording.simulated import is_simulated
from stepgauge.standards.budget_terms import BudgetTerm, UncertaintySource, independent

GAUGE_DRIFT, DRIFT_CORRECTION = "drift of the gauge", "correction of the drift"
SHOWN = {"drift": "drift of the readings", "temperature convention": "temperature convention of the readings"}
"""Conditions of readings that grow along the gauge, and the sources that they are while they are not corrected."""
DRIFT_STATED_BY = "gauge file: drift_um_per_m_per_year of [certificate], or [[certificate.earlier]]"


def common_by_position(
    model: MonteCarloModel, part: PlacementReadings, um_per_m: float, source: UncertaintySource
) -> BudgetTerm:
    """A source that moves all faces together, in proportion to their position."""
    from GTC import ureal

    one = ureal(0.0, 1.0, source.dof, label=source.name)
    position_m = model.gauge.position_mm[part.readings.faces - 1] * 1e-3
    return BudgetTerm(source, [float(v) * um_per_m * one for v in position_m])


def measured_on(model: MonteCarloModel, measured_at: str | None) -> datetime.date | None:
    """The last day of the measurement as stated, else as recorded; None where nobody says."""
    said = measured_at or model.nominal.comments.get("measured_at")
    return max(parse_moment(one, model.nominal.path) for one in moments(said)).date() if said else None


def gauge_ages(model: MonteCarloModel) -> bool:
    """Whether a real gauge was measured: a virtual one, and that of a program, does not change its length."""
    return model.sign < 0 and not is_simulated(model.nominal.comments)


def drift_um_per_m_per_year(gauge: Gauge) -> float | None:
    """Standard uncertainty of the change of length in a year: stated, or from earlier certificates; else None.

    From these it is the root mean square of the changes a year from each to the present certificate.
    """
    certificate = gauge.certificate
    if certificate.drift_um_per_m_per_year is not None:
        return certificate.drift_um_per_m_per_year
    rates = [
        one.length_um_per_m / ((certificate.date - one.date).days / YEAR_DAYS)
        for one in certificate.earlier
        if one.date < certificate.date
    ]
    return math.sqrt(sum(rate**2 for rate in rates) / len(rates)) if rates else None


def gauge_drift(model: MonteCarloModel, part: PlacementReadings, measured_at: str | None) -> BudgetTerm | None:
    """Of the standard since its calibration: the stated rate times its age."""
    rate, day = drift_um_per_m_per_year(model.gauge), measured_on(model, measured_at)
    if not gauge_ages(model) or rate is None or day is None:
        return None
    years = max((day - model.gauge.certificate.date).days, 0) / YEAR_DAYS
    u = rate * years
    said = f"gauge file: {rate:.3g} um/m a year, {years:.2f} years"
    source = UncertaintySource(
        GAUGE_DRIFT, "drift of the gauge since its calibration", "B", (u, u), "um/m", math.inf, said
    )
    return common_by_position(model, part, u, source)


def shown_by_readings(model: MonteCarloModel, part: PlacementReadings) -> Iterator[BudgetTerm]:
    """What the readings show and nobody corrected or stated: up to its size at the far end, rectangular."""
    span_m = float(np.ptp(model.gauge.position_mm[part.readings.faces - 1])) * 1e-3
    for condition, name in SHOWN.items():
        size_um = condition_um(model, part, condition)
        if size_um and span_m:
            u = size_um / math.sqrt(3.0) / span_m
            source = UncertaintySource(name, name, "B", (u, u), "um/m", math.inf, f"recording: up to {size_um:.3g} um")
            yield common_by_position(model, part, u, source)


def drift_correction(model: MonteCarloModel, part: PlacementReadings) -> BudgetTerm | None:
    """Of the rate that was taken off: it moves every face by its mean time of reading, all together."""
    from GTC import ureal

    readings = part.readings
    if readings.drift_u_mm is None:
        return None
    by_face = np.bincount(readings.face, readings.drift_u_mm * 1e3, int(readings.faces[-1]) + 1)[readings.faces]
    count = np.bincount(readings.face, minlength=int(readings.faces[-1]) + 1)[readings.faces]
    um = by_face / np.maximum(count, 1)
    said = f"recording: {readings.drift_corrected}"
    u = (float(np.abs(um).min()), float(np.abs(um).max()))
    one = ureal(0.0, 1.0, math.inf, label=DRIFT_CORRECTION)
    return BudgetTerm(
        UncertaintySource(DRIFT_CORRECTION, DRIFT_CORRECTION, "A", u, "um", math.inf, said),
        [float(v) * one for v in um],
    )


def condition_um(model: MonteCarloModel, part: PlacementReadings, name: Any) -> float:
    """How far a condition of the readings moves the errors, um; 0 where it does not, or was corrected."""
    result = next(r for r in model.nominal.results if r.placement == part.placement)
    sizes = [one.size_um or 0.0 for one in result.conditions.of(name) if one.state in ("contribution", "prevents")]
    return max(sizes, default=0.0) if model.sign < 0 else 0.0


def own_contributions(
    model: MonteCarloModel, part: PlacementReadings, stated: Sequence[Contribution]
) -> list[BudgetTerm]:
    """Those of the machine file, then those that were stated besides."""
    found = []
    for one in (*model.machine.contributions, *stated):
        dof, said = one.dof or math.inf, f"stated, {one.distribution}"
        name = f"own: {one.name}"
        if one.u_face_um:
            u = np.full(len(part.readings.faces), one.u_face_um)
            source = UncertaintySource(name, one.name, "B", (one.u_face_um, one.u_face_um), "um", dof, said)
            found.append(BudgetTerm(source, independent(u, dof, name)))
        if one.u_um_per_m:
            along = f"{name}, along the gauge" if one.u_face_um else name
            u_per_m = (one.u_um_per_m, one.u_um_per_m)
            source = UncertaintySource(along, one.name, "B", u_per_m, "um/m", dof, said)
            found.append(common_by_position(model, part, one.u_um_per_m, source))
    return found
