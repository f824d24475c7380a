"""What a fleet keeps of one placement of one recording: departures by face, their weights, the scatter and the drift.

Everything that a crossed inference asks of a recording is linear in these numbers, so that a recording is read once.
Readings count by Student's distribution: one that is millimetres off moves nothing.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.residuals import Residuals, unchecked_residuals
from stepgauge.files.arrays import Array
from stepgauge.gauge.certified import MAX_DEVIATION_MM, Gauge
from stepgauge.machine.file import Machine
from stepgauge.physics.robust import mad_sigma
from stepgauge.recording import Recording
from stepgauge.recording.identity import check_gauge

FREEDOMS = 4.0
"""Degrees of freedom of Student's distribution of the readings: heavier tails than normal, with a variance."""
SWEEPS = 6
FACE_UM = 20.0
"""Where a face was read once, departures of other faces count as its repeats, with this scatter beside that of the
readings: a face may be off by micrometres, not by a millimetre."""
GROSS_UM = MAX_DEVIATION_MM * 1e3
"""A face farther from the others is no face of this certificate: a slip."""


@dataclass(frozen=True)
class PlacementStatistics:
    """One placement of a gauge in one recording.

    ``faces (f,)``: numbers of the faces; ``um (f,)``: recorded minus simulated position along the gauge, of any
    origin; ``count (f,)``: readings, each by its weight; ``at_mm (f, 3)``: simulated tip centres; ``axis (3,)``: from
    the first to the last block; ``sigma_um``: standard deviation of one reading, with ``freedoms``; ``drift_um_h``:
    along the gauge, which has been taken off; temperature in deg C, NaN where none was recorded.
    """

    placement: int
    faces: NDArray[np.int64]
    um: Array
    count: Array
    at_mm: Array
    axis: Array
    sigma_um: float
    freedoms: float
    drift_um_h: float
    u_drift_um_h: float
    temperature_C: float


def placement_statistics(recording: Recording, gauge: Gauge, machine: Machine) -> list[PlacementStatistics]:
    """The statistics of every placement of a recording.

    Raises
    ------
    InputError
        a recording of another gauge
    """
    check_gauge(recording, gauge)
    data = unchecked_residuals(recording, gauge, machine)
    return list(_placement_statistics(data))


def _placement_statistics(data: Residuals) -> Iterator[PlacementStatistics]:
    at_mm = np.column_stack([data.probings.column(f"{axis}_mm") for axis in "xyz"])
    hours = data.frame["time_s"].to_numpy(float) / 3600.0 if data.has_time else np.zeros(len(data))
    stated_um = max(float(data.machine.table.repeatability_um), 1e-3)
    for number, place in enumerate(np.unique(data.frame["placement"].to_numpy())):
        rows = data.placement == number
        yield _statistics(int(place), rows, data, at_mm[rows], hours[rows], stated_um)


def _statistics(
    place: int, rows: NDArray[np.bool_], data: Residuals, at_mm: Array, hours: Array, stated_um: float
) -> PlacementStatistics:
    faces, face = np.unique(data.face[rows], return_inverse=True)
    level = _Levels(data.um[rows] * data.side[rows], face.ravel(), hours - hours.mean(), stated_um)
    for _ in range(SWEEPS):
        level.sweep()
    many = np.maximum(np.bincount(level.face), 1)
    where = np.column_stack([np.bincount(level.face, at_mm[:, k]) / many for k in range(3)])
    temperature = data.frame["gauge_temperature_C"][rows].mean() if "gauge_temperature_C" in data.frame else np.nan
    axis = data.probings.setting.axis[place]
    drift, u_drift = level.drift()
    return PlacementStatistics(
        place,
        faces,
        level.mean,
        level.count,
        np.asarray(where, float),
        axis,
        level.sigma,
        level.freedoms,
        drift,
        u_drift,
        temperature,
    )


class _Levels:
    """Means of faces with a common drift, by iterated weights: departures ``um``, of face ``face``, at ``hours``."""

    def __init__(self, um: Array, face: NDArray[np.intp], hours: Array, stated_um: float) -> None:
        self.um, self.face, self.hours = um, face, hours
        self.many = np.bincount(face)
        self.freedoms = float((self.many - 1).sum())
        self.mean, self.rate = _medians(um, face, len(self.many)), 0.0
        off = np.abs(um - self.mean[face])[self.many[face] > 2]
        self.sigma = max(1.2 * mad_sigma(off), stated_um / 10.0) if len(off) > 8 else stated_um
        self.weight = np.ones(len(um))

    def sweep(self) -> None:
        """Weights from the departures, then rate, means and scatter from the weights."""
        off = self.um - self.mean[self.face] - self.rate * self.hours
        self.weight = _student(off, self.sigma) * self._face_weights()
        self.total = np.bincount(self.face, self.weight)
        self.count = np.asarray(self.total * COUNTED, float)
        self.rate = self._rate()
        straight = self.um - self.rate * self.hours
        self.mean = np.bincount(self.face, self.weight * straight) / np.maximum(self.total, 1e-12)
        if self.freedoms > 8:
            off = straight - self.mean[self.face]
            self.sigma = max(float(np.sqrt((self.weight * off**2).sum() / self.freedoms / SQUARED)), 1e-3)

    def _face_weights(self) -> Array:
        """Weights of the readings of faces that no repeat can speak for, from the other faces."""
        off = _line_distances(self.mean)
        alone = np.where(self.many < 3, _student(off, float(np.hypot(self.sigma, FACE_UM))), 1.0)
        return np.asarray((alone * (np.abs(off) < GROSS_UM))[self.face])

    def _centred(self) -> Array:
        """Hours from the mean of the own face: a drift is seen by repeats, whatever the order of the faces."""
        middle = np.bincount(self.face, self.weight * self.hours) / np.maximum(self.total, 1e-12)
        return np.asarray(self.hours - middle[self.face])

    def _rate(self) -> float:
        centred = self._centred()
        spread = float((self.weight * centred**2).sum())
        return float((self.weight * centred * self.um).sum() / spread) if spread > 1e-9 else 0.0

    def drift(self) -> tuple[float, float]:
        """Rate and its standard uncertainty, um/h; infinite where nothing was repeated."""
        spread = float((self.weight * self._centred() ** 2).sum())
        return self.rate, self.sigma / float(np.sqrt(spread)) if spread > 1e-9 else np.inf


def _student(off: Array, scale: float) -> Array:
    """Weights of Student's distribution, one near the middle."""
    weight = (FREEDOMS + 1.0) / (FREEDOMS + (off / scale) ** 2)
    return np.asarray(np.minimum(weight, 1.0) * (np.abs(off) < GROSS_UM))


def _normal_moments() -> tuple[float, float]:
    """What the weights make of normal readings: the mean of w z^2, and what a weight counts, E[w] / E[w^2]."""
    z = np.linspace(-8.0, 8.0, 1601)
    density = np.exp(-(z**2) / 2.0)
    weight = _student(z, 1.0)
    density /= density.sum()
    return float(density @ (weight * z**2)), float((density @ weight) / (density @ weight**2))


SQUARED, COUNTED = _normal_moments()


def _line_distances(mean: Array) -> Array:
    """Distances of the faces, in their order, from a line that a few of them cannot move."""
    third = max(len(mean) // 3, 1)
    middle = np.arange(len(mean)) - (len(mean) - 1) / 2.0
    rise = (np.median(mean[-third:]) - np.median(mean[:third])) / (len(mean) - third) if len(mean) > third else 0.0
    straight = mean - rise * middle
    return np.asarray(straight - np.median(straight))


def _medians(um: Array, face: NDArray[np.intp], count: int) -> Array:
    order = np.lexsort((um, face))
    first = np.searchsorted(face[order], np.arange(count))
    many = np.bincount(face, minlength=count)
    low, high = order[first + (many - 1) // 2], order[first + many // 2]
    return np.asarray((um[low] + um[high]) / 2.0)
