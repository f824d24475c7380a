"""A probe map as the data of a diagnosis: directions, measured values, their resolution, and their scatter.

The scatter of a reading is that between repeats, or that about a smooth function of the direction."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.files.tables import Rows, read_rows
from stepgauge.physics.directions import unit_vectors
from stepgauge.physics.robust import TO_SIGMA, mad_sigma
from stepgauge.probes.directions_map import COLUMNS, DirectionMap, map_rows
from stepgauge.recording.simulated import table_is_simulated

QUANTITIES = {"trigger_force_N": "N", "deflection_um": "um", "pretravel_um": "um"}
ANGLES = ("polar_deg", "azimuth_deg")
_FACTORS = {"N": {"N": 1.0, "mN": 1e-3, "cN": 1e-2}, "um": {"um": 1.0, "mm": 1e3, "nm": 1e-3}}
FINEST_SHARE = 1e-6
_FINEST_DECIMALS = 6
_COARSEST_DECIMALS = -1


FEWEST_ROWS, FEWEST_DIRECTIONS, FEWEST_AZIMUTHS = 8, 6, 3
"""Least numbers from which a map is judged."""
FEWEST_DOF = 6
"""Least degrees of freedom at which the scatter between repeats is used."""
FAR = 6.0
"""Standard deviations from which a reading is left out of the scatter."""
ROUNDS, ROBUST = 20, 3


@dataclass(frozen=True)
class Measured:
    """One quantity of a map: name, unit, values (n,), and the resolution of the printed values (0 = not seen)."""

    name: str
    unit: str
    values: Array
    quantum: float

    @property
    def rounding(self) -> float:
        """Standard deviation that the rounding alone gives; at least a millionth of the values."""
        return max(self.quantum / math.sqrt(12.0), FINEST_SHARE * float(np.abs(self.values).max(initial=0.0)))


@dataclass(frozen=True)
class MapData:
    """Rows of a map whose probe triggered: angles (n,) of the contact normal in deg, and the quantities measured.

    ``dropped`` counts the rows without values; ``numbers (n,)``: of the rows in the file, from 1, if some are left out;
    ``simulated``: no probe was measured.
    """

    path: str
    polar_deg: Array
    azimuth_deg: Array
    measured: tuple[Measured, ...]
    dropped: int
    numbers: NDArray[np.intp] | None = None
    simulated: bool = False

    def __len__(self) -> int:
        return len(self.polar_deg)

    @property
    def row_numbers(self) -> NDArray[np.intp]:
        """Number of each row among the rows of the file, from 1, (n,)."""
        return np.arange(1, len(self) + 1) if self.numbers is None else self.numbers

    @property
    def normals(self) -> Array:
        """Contact normals in the probe's frame, (n, 3)."""
        return unit_vectors(np.radians(self.azimuth_deg), np.pi / 2.0 - np.radians(self.polar_deg))

    @property
    def direction(self) -> NDArray[np.intp]:
        """Index of the direction of each row; equal directions are repeats; on the axis at any azimuth."""
        on_axis = (self.polar_deg == 0.0) | (self.polar_deg == 180.0)
        return _index(np.column_stack([self.polar_deg, np.where(on_axis, 0.0, self.azimuth_deg % 360.0)]))

    @property
    def rings(self) -> NDArray[np.intp]:
        """Index of the polar angle of each row."""
        return _index(self.polar_deg[:, None])

    @property
    def spokes(self) -> NDArray[np.intp]:
        """Index of the azimuth of each row."""
        return _index(self.azimuth_deg[:, None] % 360.0)


def read_map_data(path: str | Path, columns: Mapping[str, str] | None = None) -> MapData:
    """A map CSV: ``polar_deg,azimuth_deg`` and one or more of the quantities.

    Parameters
    ----------
    path : the map; rows in which the probe never triggered have empty cells
    columns : name here -> name in the file for files with other names, e.g. ``{"deflection_um": "sensing_fea_mm"}``;
        a ``_mm``, ``_nm``, ``_mN`` or ``_cN`` at the end of the file's name is converted. With it, only the
        quantities named are read.

    Raises
    ------
    InputError : missing columns, cells that are no numbers, negative values, no quantity
    """
    chosen, every = dict(columns or {}), (*QUANTITIES, *ANGLES)
    if unknown := [key for key in chosen if key not in every]:
        raise InputError(path, f"no quantity of a map is called {unknown[0]}", expected=", ".join(every))
    angles = [chosen.get(name, name) for name in ANGLES]
    rows = read_rows(path, [*angles, *(name for key, name in chosen.items() if key not in ANGLES)])
    return replace(_data(rows, chosen), simulated=table_is_simulated(path))


def data_of_map(found: DirectionMap) -> MapData:
    """A map that was computed or read, as the data of a diagnosis: with the digits of its file."""
    rows = map_rows(found)
    made = _data(Rows(found.name, list(COLUMNS), rows, list(range(2, len(rows) + 2))), {})
    return replace(made, simulated=found.simulated)


def _data(rows: Rows, chosen: Mapping[str, str]) -> MapData:
    names = chosen or {name: name for name in QUANTITIES if name in rows.header}
    places = {key: rows.header.index(name) for key, name in names.items() if key in QUANTITIES}
    filled = {key: np.array([bool(cells[place]) for cells in rows.cells]) for key, place in places.items()}
    found = {key: names[key] for key, seen in filled.items() if seen.any()}
    if not found:
        raise InputError(
            rows.path, "the map has no values", found=",".join(rows.header), expected=", ".join(QUANTITIES)
        )
    kept = np.logical_and.reduce([filled[key] for key in found])
    if not kept.any():
        raise InputError(rows.path, "no row has all its values")
    index = np.flatnonzero(kept)
    part = Rows(rows.path, rows.header, [rows.cells[i] for i in index], [rows.lines[i] for i in index])
    polar, azimuth = part.numbers([chosen.get(name, name) for name in ANGLES]).T
    wrong = np.flatnonzero((polar < 0.0) | (polar > 180.0))
    if wrong.size:
        angle = f"{polar[wrong[0]]:g}"
        raise InputError(part.at(int(wrong[0])), "polar_deg is out of range", found=angle, expected="0 to 180")
    measured = tuple(_measured(part, key, name) for key, name in found.items())
    return MapData(str(rows.path), polar, azimuth, measured, int((~kept).sum()), index + 1)


def _measured(rows: Rows, key: str, name: str) -> Measured:
    raw, factors = rows.numbers([name])[:, 0], _FACTORS[QUANTITIES[key]]
    factor = factors.get(name.rsplit("_", 1)[-1])
    if factor is None:
        raise InputError(rows.path, f"column {name} does not end in its unit", expected=" or ".join(factors))
    negative = np.flatnonzero(raw < 0.0)
    if negative.size:
        row = int(negative[0])
        raise InputError(rows.at(row), f"{name} is negative", found=f"{raw[row]:g}", expected="a size")
    return Measured(key, QUANTITIES[key], raw * factor, quantum_of(raw) * factor)


def quantum_of(values: Array) -> float:
    """Resolution of printed values: the largest power of ten of which all are multiples.

    0 if they have more than six decimals.
    """
    for decimals in range(_COARSEST_DECIMALS, _FINEST_DECIMALS + 1):
        step = 10.0**-decimals
        if np.all(np.abs(values / step - np.round(values / step)) < 1e-6):
            return step
    return 0.0


def _index(keys: Array) -> NDArray[np.intp]:
    return np.unique(np.round(keys, 6), axis=0, return_inverse=True)[1].ravel()


def lacking(data: MapData) -> tuple[str, ...]:
    """What an insufficient map lacks; empty if nothing is missing."""
    directions, azimuths = int(data.direction.max()) + 1, int(data.spokes.max()) + 1
    found = []
    if len(data) < FEWEST_ROWS or directions < FEWEST_DIRECTIONS:
        found.append(
            f"at least {FEWEST_ROWS} rows in {FEWEST_DIRECTIONS} directions, better several polar angles and azimuths:"
            f" the map has {len(data)} rows in {directions} directions"
        )
    if azimuths < FEWEST_AZIMUTHS:
        found.append(
            f"at least {FEWEST_AZIMUTHS} azimuths, better a full turn: the map has {azimuths}, and what changes about"
            " the stylus (lobes, their phase, eccentricity) passes for what is the same all around"
        )
    if all(np.ptp(m.values) == 0.0 for m in data.measured):
        found.append(
            "values that differ: all are the same to the last digit, so they are printed too coarsely, copied or"
            " simulated, and their scatter cannot be judged"
        )
    return tuple(found)


@dataclass(frozen=True)
class MapScatter:
    """Standard deviation of one reading of each quantity, at least that of rounding.

    ``repeats``: whether it is from repeats of directions, with ``dof`` degrees of freedom; ``copies``: repeats agree to
    the last bit. ``grows``: whether the scatter is stated as proportional to the value.
    """

    sigma: tuple[float, ...]
    dof: int
    repeats: bool
    copies: bool
    grows: bool = False


def estimate_scatter(data: MapData, residuals: Sequence[Array]) -> MapScatter:
    """Scatter between probings of the same direction; without repeats a first estimate from ``residuals``.

    If two probings differ much, it is not known which one is wrong: both are left out.
    """
    among = [_among_repeats(m.values, data.direction) for m in data.measured]
    dof = min(d for _, d in among)
    copies = dof > 0 and any(
        sigma == 0.0 and m.quantum == 0.0 for (sigma, _), m in zip(among, data.measured, strict=True)
    )
    repeats = dof >= FEWEST_DOF and not copies
    found = [sigma for sigma, _ in among]
    if not repeats:
        smooth = [(each, *surface(data, each)) for each in residuals]
        found = [mad_sigma(r - fit) * np.sqrt(len(data) / max(len(data) - count, 1)) for r, fit, count in smooth]
    sigma = tuple(max(float(s), m.rounding, 1e-12) for s, m in zip(found, data.measured, strict=True))
    return MapScatter(sigma, dof, repeats, copies)


def _among_repeats(values: Array, group: NDArray[np.intp]) -> tuple[float, int]:
    """Pooled standard deviation and its degrees of freedom, without outliers."""
    keep = np.bincount(group)[group] > 1
    for _ in range(ROUNDS):
        count = np.bincount(group, keep)
        mean = np.bincount(group, np.where(keep, values, 0.0)) / np.maximum(count, 1.0)
        dof = int(keep.sum() - (count > 0).sum())
        if dof < 1:
            return 0.0, 0
        deviation = np.where(keep, values - mean[group], 0.0)
        pooled, standard = float(np.sqrt((deviation**2).sum() / dof)), np.abs(deviation)
        standard /= np.sqrt(1.0 - 1.0 / np.maximum(count[group], 2.0))
        worst = int(standard.argmax())
        if standard[worst] <= FAR * (TO_SIGMA * float(np.median(standard[keep])) or pooled):
            break
        keep = keep & (np.arange(len(group)) != worst if count[group[worst]] > 2 else group != group[worst])
    return pooled, dof


def surface(data: MapData, values: Array) -> tuple[Array, int]:
    """A robust smooth function of the direction, ``(n,)``, and its number of coefficients.

    Harmonics of the azimuth and of the polar angle, as many as the number of rows allows.
    """
    azimuth, polar = np.radians(data.azimuth_deg), np.radians(data.polar_deg)
    waves = [np.ones(len(data)), *(f(k * azimuth) for k in range(1, 4) for f in (np.cos, np.sin))]
    columns = np.array([wave * np.cos(j * polar) for j in range(3) for wave in waves])[: max(len(data) // 4, 1)]
    weight, fitted = np.ones(len(data)), values
    for _ in range(ROBUST):
        root = np.sqrt(weight)
        fitted = np.linalg.lstsq((columns * root).T, values * root, rcond=None)[0] @ columns
        scale = mad_sigma(values - fitted)
        weight = 1.0 / (1.0 + ((values - fitted) / max(3.0 * scale, 1e-300)) ** 2)
    return fitted, len(columns)
