"""The fleet as arrays: every visit of a gauge to a machine, and by gauge the departures of all its faces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from stepgauge.effects import Probings, Setting
from stepgauge.files.arrays import Array
from stepgauge.fleet.hierarchical.statistics import PlacementStatistics
from stepgauge.gauge.certified import Gauge

OWNERS = ("machine", "type", "hall", "gauge", "probe")
"""Whom a cause may belong to. A type is a model line."""


@dataclass(frozen=True)
class Visit:
    """One placement of a gauge on a machine: whose it was, when (days, of any origin), and its statistics."""

    recording: str
    machine: str
    type: str
    hall: str
    gauge: str
    probe: str
    day: float
    statistics: PlacementStatistics


@dataclass(frozen=True)
class GaugeVisits:
    """All visits of one gauge.

    ``visits (n,)``: their numbers in the fleet; ``um (n, f)``: departures along the gauge; ``weight (n, f)``: 1 / um^2,
    zero for a face that was not read; ``at_mm (n, f, 3)``: tip centres.
    """

    gauge: Gauge
    visits: NDArray[np.intp]
    um: Array
    variance: Array
    weight: Array
    at_mm: Array
    axis: Array

    @cached_property
    def frame(self) -> Array:
        """What every visit fits: origin, slope in um/m and half the size of a block in um, columns ``(f, 3)``."""
        from_middle = self.gauge.position_mm - self.gauge.position_mm.mean()
        return np.column_stack([np.ones(self.gauge.n_faces), from_middle * 1e-3, self.side])

    @property
    def side(self) -> Array:
        """+1 for fronts, -1 for backs."""
        return np.where(np.arange(self.gauge.n_faces) % 2 == 0, 1.0, -1.0)

    @cached_property
    def normal(self) -> Array:
        """Inverse of C' W C of every visit, ``(n, 3, 3)``."""
        crossed = np.einsum("nf,fi,fj->nij", self.weight, self.frame, self.frame)
        return np.linalg.inv(crossed + 1e-12 * np.eye(3))

    def coefficients(self, um: Array) -> Array:
        """Origin, slope and size of every visit, ``(n, 3)``."""
        return np.einsum("nij,fj,nf->ni", self.normal, self.frame, self.weight * um)

    def weighted(self, um: Array) -> Array:
        """P e: departures times their weights, without what origin, slope and size fit, ``(n, f)``."""
        return np.asarray(self.weight * (um - self.coefficients(um) @ self.frame.T))

    def part(self, rows: NDArray[np.intp]) -> GaugeVisits:
        """Some of the visits."""
        return GaugeVisits(
            self.gauge,
            self.visits[rows],
            self.um[rows],
            self.variance[rows],
            self.weight[rows],
            self.at_mm[rows],
            self.axis[rows],
        )

    def add_shape(self, shape_um: float) -> GaugeVisits:
        """The same where faces have errors of their own, of this standard deviation, beside the scatter."""
        weight = np.where(self.variance < np.inf, 1.0 / (self.variance + shape_um**2), 0.0)
        return GaugeVisits(self.gauge, self.visits, self.um, self.variance, weight, self.at_mm, self.axis)

    def probings(self, setting: Setting) -> Probings:
        """All faces of all visits as rows that effects know, visit by visit; a visit's number here is its placement."""
        count, faces = self.um.shape
        approach = (self.side[None, :, None] * self.axis[:, None, :]).reshape(-1, 3)
        columns: dict[str, Array] = {f"{axis}_mm": self.at_mm[:, :, k].ravel() for k, axis in enumerate("xyz")}
        columns |= {f"approach_{name}": approach[:, k] for k, name in enumerate("ijk")}
        columns["face"] = np.tile(np.arange(1, faces + 1), count)
        columns["placement"] = np.repeat(np.arange(count), faces)
        return Probings(columns, setting)

    def setting(self) -> Setting:
        """Gauge and axes; the travel is not known to a fleet."""
        return Setting(np.zeros((3, 2)), gauge=self.gauge, axis=dict(enumerate(self.axis)))


@dataclass(frozen=True)
class Crossing:
    """All visits; ``owner[kind]``: number of the owner of every visit, of ``names[kind]``; ``ladders`` by gauge."""

    visits: Sequence[Visit]
    ladders: Sequence[GaugeVisits]
    owner: Mapping[str, NDArray[np.intp]]
    names: Mapping[str, list[str]]
    day: Array
    temperature_K: Array = field(repr=False)

    def __len__(self) -> int:
        return len(self.visits)

    def of(self, kind: str, name: str) -> NDArray[np.intp]:
        """The visits of an owner; a visit is its own."""
        if kind == "visit":
            return np.array([int(name)])
        return np.flatnonzero(self.owner[kind] == self.names[kind].index(name))


def split_by_ladder(ladders: Sequence[GaugeVisits], flat: Array) -> list[Array]:
    """Values of all faces of all visits, in one row, as ``(n, f)`` of each ladder."""
    ends = np.cumsum([0, *(ladder.um.size for ladder in ladders)])
    return [flat[low:high].reshape(one.um.shape) for one, low, high in zip(ladders, ends[:-1], ends[1:], strict=True)]


def make_crossing(visits: Sequence[Visit], gauges: Mapping[str, Gauge]) -> Crossing:
    """From visits and the certificates of their gauges (by the gauge's name in the visits)."""
    names, owner = dict[str, list[str]](), dict[str, NDArray[np.intp]]()
    for kind in OWNERS:
        known, number = np.unique([getattr(visit, kind) for visit in visits], return_inverse=True)
        names[kind], owner[kind] = known.tolist(), number.ravel()
    ladders = [
        _ladder(gauges[name], np.flatnonzero(owner["gauge"] == number), visits)
        for number, name in enumerate(names["gauge"])
    ]
    return Crossing(visits, ladders, owner, names, np.array([v.day for v in visits]), _difference_K(visits, gauges))


def _difference_K(visits: Sequence[Visit], gauges: Mapping[str, Gauge]) -> Array:
    """Gauge temperature minus that of the certificate; zero where it was not recorded."""
    warmer = [visit.statistics.temperature_C - gauges[visit.gauge].table.reference_temperature_C for visit in visits]
    return np.nan_to_num(np.array(warmer, float))


def _ladder(gauge: Gauge, numbers: NDArray[np.intp], visits: Sequence[Visit]) -> GaugeVisits:
    count, faces = len(numbers), gauge.n_faces
    um, variance = np.zeros((count, faces)), np.full((count, faces), np.inf)
    at_mm, axis = np.zeros((count, faces, 3)), np.zeros((count, 3))
    for row, number in enumerate(numbers):
        one = visits[number].statistics
        column = one.faces - 1
        axis[row] = one.axis
        origin = (one.at_mm - gauge.position_mm[column, None] * one.axis).mean(axis=0)
        at_mm[row] = origin + gauge.position_mm[:, None] * one.axis
        um[row, column], at_mm[row, column] = one.um, one.at_mm
        read = one.count > 1e-3
        variance[row, column[read]] = one.sigma_um**2 / one.count[read]
        um[row] -= np.average(one.um, weights=one.count + 1e-12)
        um[row, np.isinf(variance[row])] = 0.0
    weight = np.where(np.isfinite(variance), 1.0 / variance, 0.0)
    return GaugeVisits(gauge, numbers, um, variance, weight, at_mm, axis)
