"""A probe known by its measured map: pre-travel over polar angle and azimuth of the contact normal."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.files.tables import Rows, read_rows
from stepgauge.probes.base import Probe

Symmetry = Literal["none", "three-fold", "mirrored"]

ANGLES = ("polar_deg", "azimuth_deg")
VALUES = ("trigger_force_N", "deflection_um", "pretravel_um")


@dataclass(frozen=True)
class ProbeMap:
    """Values on a grid: polar angles (p,) rising, azimuths (a,) rising within one period, columns (p, a)."""

    polar_deg: Array
    azimuth_deg: Array
    columns: dict[str, Array]
    period_deg: float = 360.0

    def at(self, name: str, normal: ArrayLike) -> Array:
        """A column at normals (..., 3): linear between the grid lines, periodic in azimuth.

        Outside the polar angles of the table the nearest row is used.
        """
        n = np.asarray(normal, dtype=float)
        polar = np.degrees(np.arctan2(np.hypot(n[..., 0], n[..., 1]), n[..., 2]))
        azimuth = np.degrees(np.arctan2(n[..., 1], n[..., 0]))
        closed = np.append(self.azimuth_deg, self.azimuth_deg[0] + self.period_deg)
        i, low = _between(self.polar_deg, np.clip(polar, self.polar_deg[0], self.polar_deg[-1]))
        k, near = _between(closed, closed[0] + (azimuth - closed[0]) % self.period_deg)
        values = self.columns[name]
        values = np.column_stack([values, values[:, :1]])
        up = np.minimum(i + 1, len(self.polar_deg) - 1)
        first = values[i, k] * (1.0 - near) + values[i, k + 1] * near
        second = values[up, k] * (1.0 - near) + values[up, k + 1] * near
        return first * (1.0 - low) + second * low


@dataclass(frozen=True, kw_only=True)
class TableProbe(Probe):
    """A probe with the values of its map; forces and deflections only if the map has them."""

    map: ProbeMap

    def pretravel_um(self, approach: ArrayLike) -> Array:
        return self.map.at("pretravel_um", self.normals(approach))

    def trigger_force_N(self, approach: ArrayLike) -> Array:
        return self._at("trigger_force_N", approach)

    def deflection_um(self, approach: ArrayLike) -> Array:
        return self._at("deflection_um", approach)

    def _at(self, name: str, approach: ArrayLike) -> Array:
        if name not in self.map.columns:
            return np.full(np.shape(approach)[:-1], np.nan)
        return self.map.at(name, self.normals(approach))


def read_map(path: str | Path, symmetry: Symmetry = "none") -> ProbeMap:
    """A map CSV: ``polar_deg,azimuth_deg,pretravel_um`` and, if known, ``trigger_force_N`` and ``deflection_um``.

    Every polar angle needs every azimuth. ``symmetry`` tells which azimuths the rows stand for: all of them as given
    (``"none"``), a third of the circle that repeats (``"three-fold"``), or 0 to 60 deg, mirrored too (``"mirrored"``).
    :class:`InputError` names the row that is missing, double or out of range.
    """
    rows = read_rows(path, (*ANGLES, "pretravel_um"))
    angles = rows.numbers(ANGLES)
    columns = {name: _values(rows, name) for name in VALUES if _has_values(rows, name)}
    period = 360.0 if symmetry == "none" else 120.0
    _check_range(rows, angles, 60.0 if symmetry == "mirrored" else period)
    if symmetry != "mirrored":
        turned = np.where(angles[:, 1] == angles[:, 1].min() + period, np.nan, angles[:, 1])
        return _grid(rows, np.column_stack([angles[:, 0], turned]), columns, period)
    inner = (angles[:, 1] > 0.0) & (angles[:, 1] < 60.0)
    mirrored = np.column_stack([angles[inner, 0], 120.0 - angles[inner, 1]])
    both = {name: np.r_[values, values[inner]] for name, values in columns.items()}
    return _grid(rows, np.vstack([angles, mirrored]), both, period)


def _between(grid: Array, value: Array) -> tuple[NDArray[np.intp], Array]:
    """Index of the grid line before each value and the share of the distance to the next one."""
    if len(grid) == 1:
        return np.zeros(value.shape, dtype=np.intp), np.zeros(value.shape)
    index = np.clip(np.searchsorted(grid, value, side="right") - 1, 0, len(grid) - 2)
    return index, (value - grid[index]) / (grid[index + 1] - grid[index])


def _has_values(rows: Rows, name: str) -> bool:
    """A column is left out if it is missing, or empty in all rows (a map of a model without forces)."""
    return name in rows.header and any(cells[rows.header.index(name)] for cells in rows.cells)


def _values(rows: Rows, name: str) -> Array:
    return rows.numbers([name])[:, 0]


def _check_range(rows: Rows, angles: Array, widest_deg: float) -> None:
    first = float(angles[:, 1].min()) if widest_deg > 60.0 else 0.0
    for column, name, low, high in ((0, "polar_deg", 0.0, 180.0), (1, "azimuth_deg", first, first + widest_deg)):
        wrong = np.flatnonzero((angles[:, column] < low) | (angles[:, column] > high))
        if len(wrong):
            found = f"{angles[wrong[0], column]:g}"
            raise InputError(
                rows.at(int(wrong[0])), f"{name} is out of range", found=found, expected=f"{low:g} to {high:g}"
            )


def _grid(rows: Rows, angles: Array, columns: dict[str, Array], period_deg: float) -> ProbeMap:
    kept = np.isfinite(angles[:, 1])
    used = angles[kept]
    polar, i = np.unique(used[:, 0], return_inverse=True)
    azimuth, k = np.unique(used[:, 1], return_inverse=True)
    count = np.zeros((len(polar), len(azimuth)), dtype=int)
    np.add.at(count, (i, k), 1)
    if np.any(count != 1):
        a, b = np.argwhere(count != 1)[0]
        what = "missing" if count[a, b] == 0 else "there twice"
        raise InputError(rows.path, f"the row of polar {polar[a]:g}, azimuth {azimuth[b]:g} deg is {what}")
    grids = {}
    for name, values in columns.items():
        grids[name] = np.empty(count.shape)
        grids[name][i, k] = values[kept]
    return ProbeMap(polar, azimuth, grids, period_deg)
