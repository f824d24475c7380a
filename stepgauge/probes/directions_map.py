"""Pre-travel and forces of a probe over a grid of directions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.files.display import Plotted
from stepgauge.files.tables import Rows, csv_text, read_rows
from stepgauge.files.text import write_text
from stepgauge.physics.directions import unit_vectors
from stepgauge.probes.base import Probe
from stepgauge.recording.simulated import SIMULATED_LINE, table_is_simulated

if TYPE_CHECKING:
    import pandas as pd

COLUMNS = ("polar_deg", "azimuth_deg", "trigger_force_N", "deflection_um", "pretravel_um")


@dataclass(frozen=True, repr=False)
class DirectionMap(Plotted):
    """Values over polar angle and azimuth of the contact normal in the probe's frame; arrays (polars, azimuths).

    ``simulated``: computed from a model, no probe was measured.
    """

    drawn_by: ClassVar[str] = "probe.draw_pretravel"
    polar_deg: Array
    azimuth_deg: Array
    trigger_force_N: Array
    deflection_um: Array
    pretravel_um: Array
    name: str = "probe"
    simulated: bool = True
    probe: Any = field(default=None, compare=False, repr=False)

    def summary(self) -> str:
        """Range and mean of force, deflection and pre-travel, and in how many directions the probe never triggers."""
        return "\n".join(_lines(self))

    def to_frame(self) -> pd.DataFrame:
        """One row per direction: angles in deg, force in N, deflection and pre-travel in um; infinite: no trigger."""
        import pandas as pd

        return pd.DataFrame({name: column.ravel() for name, column in zip(COLUMNS, self.columns(), strict=True)})

    def write(self, path: str | Path) -> None:
        """Write the table (CSV), numbers to 6 significant digits; cells are empty where nothing is known."""
        write_map(path, self)

    def _stated(self) -> Any:
        return map_rows(self), self.simulated

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
    """Values of the probe for every pair of angles of the contact normal."""
    approach = probe.approaches(normals_of(polar_deg, azimuth_deg))
    return DirectionMap(
        np.asarray(polar_deg, dtype=float),
        np.asarray(azimuth_deg, dtype=float),
        probe.trigger_force_N(approach),
        probe.deflection_um(approach),
        probe.pretravel_um(approach),
        probe.name or "probe",
    )


def _lines(found: DirectionMap) -> Iterator[str]:
    yield f"{found.name}: {found.pretravel_um.size} directions"
    for label, values, unit in (
        ("trigger force", found.trigger_force_N, "N"),
        ("deflection", found.deflection_um, "um"),
        ("pre-travel", found.pretravel_um, "um"),
    ):
        known = values[np.isfinite(values)]
        if known.size:
            yield f"  {label:<14}{known.min():8.3f} to {known.max():.3f} {unit}, mean {known.mean():.3f}"
    never = int(np.sum(np.isinf(found.pretravel_um)))
    if never:
        yield f"  in {never} directions the probe never triggers: the surface pulls the stylus out of the probe"


def read_probe_map(path: str | Path) -> DirectionMap:
    """Read a map as :func:`write_map` writes it; empty cells are NaN.

    :class:`InputError` for missing columns, cells that are no numbers, and rows that are not a grid of directions.
    """
    rows = read_rows(path, COLUMNS)
    angles = rows.numbers(COLUMNS[:2])
    polar, azimuth = (np.array(list(dict.fromkeys(column))) for column in angles.T)
    grid = np.stack(np.meshgrid(polar, azimuth, indexing="ij"), axis=-1).reshape(-1, 2)
    if grid.shape != angles.shape or not (grid == angles).all():
        expected = "every azimuth at every polar angle, once"
        raise InputError(path, "the directions are not a grid", found=f"{len(angles)} rows", expected=expected)
    shape = (len(polar), len(azimuth))
    force_N, deflection_um, pretravel_um = (_cells(rows, name).reshape(shape) for name in COLUMNS[2:])
    return DirectionMap(polar, azimuth, force_N, deflection_um, pretravel_um, Path(path).stem, table_is_simulated(path))


def _cells(rows: Rows, name: str) -> Array:
    """A column whose cells may be empty."""
    place = rows.header.index(name)
    empty = np.array([not row[place] for row in rows.cells])
    kept = [i for i, nothing in enumerate(empty) if not nothing]
    some = Rows(rows.path, rows.header, [rows.cells[i] for i in kept], [rows.lines[i] for i in kept])
    found = np.full(len(empty), np.nan)
    if kept:
        found[~empty] = some.numbers([name])[:, 0]
    return found


def write_map(path: str | Path, found: DirectionMap) -> None:
    """The map as CSV with :data:`COLUMNS`; cells are empty if a model has no value, or never triggers."""
    write_text(path, (SIMULATED_LINE if found.simulated else "") + csv_text(COLUMNS, map_rows(found)))


def map_rows(found: DirectionMap) -> list[list[str]]:
    """The cells of a map, row by row, to six significant digits."""
    columns = [column.ravel() for column in found.columns()]
    return [[f"{cell:.6g}" if np.isfinite(cell) else "" for cell in row] for row in zip(*columns, strict=True)]
