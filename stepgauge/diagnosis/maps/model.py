"""Predictions of a probe file, with changes, for the directions of a map."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from stepgauge.diagnosis.fits.solve import Estimate
from stepgauge.diagnosis.maps.candidates import FORCE_GAUGE, ProbeChange, Table
from stepgauge.diagnosis.maps.data import MapData
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.physics.wozniak import LobeModel
from stepgauge.probes import Probe, probe_from_table
from stepgauge.probes.base import head_frame
from stepgauge.probes.empirical import EmpiricalTable, add_laws

NOTHING = 1e-9
"""Share of the range of a knob that is as good as no change, and a step for a derivative."""


@dataclass(frozen=True, kw_only=True)
class TriangularProbe(Probe):
    """Pre-travel of three contacts that open, w = A g (Wozniak Eq 4), plus a constant."""

    constant_um: float
    added_um: float
    lobe_azimuth_rad: float

    def pretravel_um(self, approach: ArrayLike) -> Array:
        law = LobeModel(lobe_azimuth_rad=self.lobe_azimuth_rad)
        return law.pretravel_um(self.normals(approach), self.constant_um) + self.added_um


@dataclass(frozen=True)
class ChangeTerm:
    """A candidate in the model, with the values of its knobs; ``covariance (k, k)``: theirs, where they were fitted."""

    candidate: ProbeChange
    values: tuple[float, ...]
    covariance: Array = field(default_factory=lambda: np.zeros((0, 0)), compare=False)

    @property
    def has_size(self) -> bool:
        """Whether it changes anything of its own, by the first knob."""
        knob = self.candidate.knobs[0]
        return abs(self.values[0] - knob.none) > NOTHING * (knob.high - knob.low)

    @property
    def significance(self) -> float:
        """What the sum of squares rises by without it, to first order."""
        off = np.subtract(self.values, self.candidate.none)
        return float(off @ np.linalg.pinv(self.covariance) @ off)

    @property
    def estimates(self) -> dict[str, Estimate]:
        """Parameters in the terms of the field, with standard uncertainties by linear propagation (GUM 5.1.2)."""
        told, steps = self.candidate.parameters, [NOTHING * (k.high - k.low) for k in self.candidate.knobs]
        here, beside = told(self.values), [told(np.add(self.values, one).tolist()) for one in np.diag(steps)]
        found = {}
        for name, (value, unit) in here.items():
            slope = np.array([one[name][0] - value for one in beside]) / steps
            variance = float(slope @ self.covariance @ slope)
            found[name] = Estimate(value, float(np.sqrt(variance)) if 0.0 <= variance < np.inf else None, unit)
        return found


Terms = tuple[ChangeTerm, ...]


def changed_table(table: Mapping[str, Any], terms: Sequence[ChangeTerm]) -> Table:
    """The ``[probe]`` table with all terms in it."""
    changed = dict(table)
    for term in terms:
        changed = term.candidate.applied(changed, term.values)
    return changed


def without_force_gauge(table: Mapping[str, Any]) -> Table:
    """What of a changed table is of the probe."""
    return {key: value for key, value in table.items() if key != FORCE_GAUGE}


def build_probe(table: Mapping[str, Any], where: str) -> Probe:
    """The probe of a table, which may be of the model ``triangular`` that probe files do not have.

    Raises :class:`InputError` for an impossible construction.
    """
    if table.get("model") != "triangular":
        return probe_from_table(without_force_gauge(table), where)
    return add_laws(_triangular(table), [EmpiricalTable.model_validate(law) for law in table.get("empirical", [])])


def _triangular(table: Mapping[str, Any]) -> TriangularProbe:
    roll = float(np.radians(table.get("roll_deg", 0.0)))
    return TriangularProbe(
        name=table.get("name", ""),
        tip_radius_mm=table["tip_radius_mm"],
        frame=head_frame(table.get("stylus_direction", (0.0, 0.0, -1.0)), roll),
        constant_um=table["constant_um"],
        added_um=table.get("pretravel_um", 0.0) + table["more_um"],
        lobe_azimuth_rad=float(np.radians(table["lobe_azimuth_deg"])),
    )


def read_force_gauge(table: Mapping[str, Any], force_N: Array) -> Array:
    """Indication of the force gauge for forces."""
    errors = table.get(FORCE_GAUGE, {})
    return np.asarray(force_N * errors.get("factor", 1.0) + errors.get("N", 0.0))


class MapModel:
    """The table of a probe file, evaluated for the quantities and directions of a map."""

    def __init__(self, table: Table, where: str, data: MapData) -> None:
        self.table, self.where, self.data = table, where, data
        self._direction = data.direction
        # repeats of a direction are computed once
        self._normals = data.normals[np.unique(self._direction, return_index=True)[1]]
        # sizes are tried anew when the others have changed
        self._lately = lru_cache(maxsize=512)(self._predict)

    def predict(self, terms: Sequence[ChangeTerm]) -> list[Array]:
        """Values (n,) of each quantity; :class:`InputError` for an impossible construction."""
        return self._lately(tuple(terms))

    def _predict(self, terms: Terms) -> list[Array]:
        table, quantities = changed_table(self.table, terms), [m.name for m in self.data.measured]
        return [one[self._direction] for one in predict(table, self.where, self._normals, quantities)]

    def residuals(self, terms: Sequence[ChangeTerm]) -> list[Array]:
        """Recorded minus simulated, (n,) for each quantity, in its unit."""
        predicted = self.predict(terms)
        return [m.values - p for m, p in zip(self.data.measured, predicted, strict=True)]


def predict(table: Mapping[str, Any], where: str, normals: Array, quantities: Sequence[str]) -> list[Array]:
    """Values of quantities for contact normals (n, 3) in the probe's frame; errors as :func:`build_probe`."""
    probe = build_probe(table, where)
    approach = probe.approaches(normals)
    asked = {
        "trigger_force_N": lambda: read_force_gauge(table, probe.trigger_force_N(approach)),
        "deflection_um": lambda: probe.deflection_um(approach),
        "pretravel_um": lambda: probe.pretravel_um(approach),
    }
    return [asked[name]() for name in quantities]


def check_model(model: MapModel) -> None:
    """:class:`InputError` if the probe file does not give a quantity of the map."""
    for measured, values in zip(model.data.measured, model.predict(()), strict=True):
        if np.isnan(values).all():
            expected = "a probe file of the model kinematic or piezo"
            raise InputError(model.where, f"this probe says nothing of {measured.name}", expected=expected)
        never = np.flatnonzero(~np.isfinite(values))
        if never.size:
            row, data = int(never[0]), model.data
            found = f"polar {data.polar_deg[row]:g}, azimuth {data.azimuth_deg[row]:g} deg"
            raise InputError(data.path, "here this probe never triggers, yet the map has a value", found=found)
