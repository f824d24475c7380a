"""What the crossing of a fleet can tell: an ideal observer of each recording's rate and trigger distance.

A recording is reduced to two numbers: how much longer than certified the gauge reads (ppm), and how much later than
stated the probe triggers (um). Each is a sum of its owners' terms, of which the usual ones are Gaussian with known
standard deviations, and of noise. For a cause, the part of its pattern over all recordings that another owner's terms
cannot imitate, squared in units of what is left of usual errors and noise, is what the crossing has against that owner.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from benchmarks.fleet import parts
from benchmarks.fleet.design import Fleet
from benchmarks.fleet.parts import Array

KELVIN_PPM = parts.EXPANSION_PER_K * 1e6
RATE_TERMS = {
    "machine": (("scale", "x"), ("scale", "y"), ("squareness", "xy")),
    "type": (("scale", "x"), ("scale", "y")),
    "gauge": (("certificate_scale", ""), ("gauge_expansion", "")),
}
"""Kinds and places of what an owner may do to the rate along the gauge."""
TRIGGER_TERMS = {
    "machine": (("reversal", "x"), ("reversal", "y")),
    "probe": (("radius", ""),),
    "gauge": (("wear", "fronts"), ("radius", "")),
}
"""The same of the trigger distance; a gauge may have been worn before."""


class Patterns:
    """What one unit of a cause does to the rate or the trigger distance of every recording of a fleet."""

    def __init__(self, fleet: Fleet) -> None:
        self.fleet = fleet
        self.axis = np.array([recording.axis for recording in fleet.recordings])
        self.warm_K = np.array([recording.temperature_C for recording in fleet.recordings]) - 20.0
        self.years = (fleet.day_of + 1.0) / 365.25

    def unit(self, kind: str, where: str) -> Array:
        """The pattern on every recording, whoever its owner: ppm or um per unit of the kind."""
        x, y = self.axis[:, 0], self.axis[:, 1]
        if kind == "scale":
            return np.asarray((x if where == "x" else y) ** 2)
        if kind == "reversal":
            return np.asarray(np.abs(x if where == "x" else y) / 2.0)
        constant = np.ones(len(x))
        others = {"squareness": x * y, "gauge_expansion": self.warm_K, "wear": self.years / 2.0}
        return np.asarray(others.get(kind, constant))

    def of(self, owner_kind: str, owner: str, kind: str, where: str = "", since: int = 0) -> Array:
        """The pattern of one owner from a day on."""
        acts = self.fleet.owned(owner_kind, owner) & (self.fleet.day_of >= since)
        return np.where(acts, self.unit(kind, where), 0.0)

    def days(self, hall: str, days: Iterable[int]) -> Array:
        """One column for each day of a hall, ppm per kelvin."""
        here = self.fleet.hall_of == hall
        return np.stack([np.where(here & (self.fleet.day_of == day), KELVIN_PPM, 0.0) for day in days], axis=1)


class Observer:
    """Squared patterns in the metric of noise and usual errors; ``expect`` adds a term that may be there."""

    def __init__(self, variance: Array, columns: Array, sd: Array) -> None:
        self._variance, self._columns = variance, columns * sd
        self._gram = self._columns.T @ (self._columns / variance[:, None])
        self._inverse = np.linalg.inv(np.eye(len(self._gram)) + self._gram)

    def expect(self, columns: Array, sd: float) -> None:
        """Terms of unknown size with this standard deviation, columns ``(n, k)``."""
        added = columns * sd
        weighted = added / self._variance[:, None]
        cross = self._columns.T @ weighted
        self._gram = np.block([[self._gram, cross], [cross.T, added.T @ weighted]])
        self._inverse = np.linalg.inv(np.eye(len(self._gram)) + self._gram)
        self._columns = np.column_stack([self._columns, added])

    def whiten(self, columns: Array) -> Array:
        """The inverse covariance times the columns ``(n, k)``, by the formula of Woodbury."""
        plain = columns / self._variance[:, None]
        shared = self._columns @ (self._inverse @ (self._columns.T @ plain))
        return np.asarray(plain - shared / self._variance[:, None])

    def leftover(self, pattern: Array, rival: Array) -> float:
        """Chi2 that the best fit of the rival's columns ``(n, k)`` leaves of a pattern ``(n,)``."""
        both = np.column_stack([pattern, rival])
        gram = both.T @ self.whiten(both)
        imitated = np.linalg.lstsq(gram[1:, 1:], gram[1:, 0], rcond=1e-9)[0] @ gram[1:, 0]
        return float(gram[0, 0] - imitated)


def _noise_um(fleet: Fleet) -> Array:
    """Standard deviation of the mean of all touches of each recording."""
    sigma = np.array([fleet.machines[machine].repeatability_um for machine in fleet.machine_of])
    touches = [2 * fleet.gauges[r.gauge].blocks * r.cycles for r in fleet.recordings]
    return np.asarray(sigma / np.sqrt(touches))


def _columns(patterns: Patterns, terms: Iterable[tuple[str, str, str, str, float]]) -> tuple[Array, Array]:
    terms = list(terms)
    return np.stack([patterns.of(*term[:4]) for term in terms], axis=1), np.array([term[4] for term in terms])


def rate_observer(patterns: Patterns) -> Observer:
    """Usual scale errors and squareness of every machine, certificate and expansion of every gauge, thermometers."""
    fleet = patterns.fleet
    spread_mm = np.array([fleet.gauges[gauge].length_mm for gauge in fleet.gauge_of]) / np.sqrt(12.0)
    variance = (_noise_um(fleet) / spread_mm * 1e3) ** 2 + (parts.THERMOMETER_K * KELVIN_PPM) ** 2
    seen = [fleet.machines[k].name for k in np.unique(fleet.machine_of)]
    terms = [("machine", name, "scale", axis, parts.MACHINE_SCALE_PPM) for name in seen for axis in "xy"]
    terms += [("machine", name, "squareness", "xy", parts.MACHINE_SQUARENESS_URAD) for name in seen]
    for name in [fleet.gauges[k].name for k in np.unique(fleet.gauge_of)]:
        terms.append(("gauge", name, "certificate_scale", "", parts.CERTIFICATE_PPM))
        terms.append(("gauge", name, "gauge_expansion", "", parts.U_EXPANSION_PER_K * 1e6))
    return Observer(variance, *_columns(patterns, terms))


def trigger_observer(patterns: Patterns) -> Observer:
    """Usual reversals of every machine, radii of every probe, and the qualification before each visit."""
    fleet = patterns.fleet
    faces = np.array([2 * fleet.gauges[gauge].blocks for gauge in fleet.gauge_of])
    variance = _noise_um(fleet) ** 2 + parts.QUALIFICATION_UM**2 + parts.FACE_UM**2 / faces
    seen = [fleet.machines[k].name for k in np.unique(fleet.machine_of)]
    terms = [("machine", name, "reversal", axis, parts.MACHINE_REVERSAL_UM) for name in seen for axis in "xy"]
    terms += [("probe", str(name), "radius", "", parts.PROBE_UM) for name in np.unique(fleet.probe_of)]
    return Observer(variance, *_columns(patterns, terms))
