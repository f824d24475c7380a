"""What a probe does over a grid of directions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stepgauge.files.tables import write_table
from stepgauge.physics.directions import unit_vectors
from stepgauge.probes.base import Probe

Array = NDArray[np.float64]
COLUMNS = ("polar_deg", "azimuth_deg", "trigger_force_N", "deflection_um", "pretravel_um")


@dataclass(frozen=True)
class DirectionMap:
    """Values over polar angle and azimuth of the contact normal in the probe's frame; arrays (polars, azimuths)."""

    polar_deg: Array
    azimuth_deg: Array
    trigger_force_N: Array
    deflection_um: Array
    pretravel_um: Array

    def columns(self) -> tuple[Array, ...]:
        """Angles and values, all of the shape of the grid."""
        polar, azimuth = np.meshgrid(self.polar_deg, self.azimuth_deg, indexing="ij")
        return polar, azimuth, self.trigger_force_N, self.deflection_um, self.pretravel_um


def normals_of(polar_deg: Sequence[float] | Array, azimuth_deg: Sequence[float] | Array) -> Array:
    """Contact normals (polars, azimuths, 3) of all pairs of angles."""
    polar, azimuth = np.meshgrid(np.radians(polar_deg), np.radians(azimuth_deg), indexing="ij")
    return unit_vectors(azimuth, np.pi / 2.0 - polar)


def map_directions(
    probe: Probe, polar_deg: Sequence[float] | Array, azimuth_deg: Sequence[float] | Array
) -> DirectionMap:
    """Ask the probe for every pair of angles of the contact normal."""
    approach = probe.approaches(normals_of(polar_deg, azimuth_deg))
    return DirectionMap(
        np.asarray(polar_deg, dtype=float),
        np.asarray(azimuth_deg, dtype=float),
        probe.trigger_force_N(approach),
        probe.deflection_um(approach),
        probe.pretravel_um(approach),
    )


def write_map(path: str | Path, found: DirectionMap) -> None:
    """The map as CSV with :data:`COLUMNS`; cells are empty where a model knows nothing, or never triggers."""
    columns = [column.ravel() for column in found.columns()]
    rows = [[f"{cell:.6g}" if np.isfinite(cell) else "" for cell in row] for row in zip(*columns, strict=True)]
    write_table(path, COLUMNS, rows)
