"""The step gauge and its certificate: face positions along the gauge axis at the reference temperature."""

from __future__ import annotations

import datetime
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from stepgauge.errors import InputError, naming, reader
from stepgauge.files.config import TomlTable, check_table, file_beside, read_toml
from stepgauge.files.dates import check_past
from stepgauge.files.display import Plotted, join_lines
from stepgauge.files.resources import find_data
from stepgauge.files.tables import CsvTable, read_numbers

if TYPE_CHECKING:
    import pandas as pd

FACE_COLUMNS = ("face", "nominal_mm", "position_mm", "uncertainty_um")
MAX_DEVIATION_MM = 0.2
"""A certified position farther than this from its nominal value is a typing or unit error, not a gauge."""
LONGEST_MM = 10_000.0
"""Of a step gauge; larger numbers are um."""


class GaugeTable(TomlTable):
    """The ``[gauge]`` table."""

    name: str = Field(min_length=1, description="what the gauge is called")
    serial: str = Field(min_length=1, description="serial number")
    material: str = Field(min_length=1, description="material, e.g. steel")
    expansion_per_K: float = Field(ge=0, le=40e-6, description="linear expansion in 1/K, e.g. 11.5e-6")
    expansion_uncertainty_per_K: float = Field(
        ge=0, le=10e-6, description="standard uncertainty of the expansion in 1/K, e.g. 0.5e-6"
    )
    reference_temperature_C: float = Field(ge=15, le=30, description="deg C, 20 by ISO 1")
    block_width_mm: float = Field(gt=0, le=200, description="width of a block along the side direction, mm")
    block_height_mm: float = Field(gt=0, le=200, description="height of a block above the rail, mm")
    rail_width_mm: float | None = Field(None, gt=0, le=500, description="width of the rail, mm; block width + 20")
    rail_height_mm: float = Field(30.0, gt=0, le=500, description="height of the rail below the blocks, mm")
    faces: str = Field(
        min_length=1,
        description="CSV file beside this one: face, position_mm, uncertainty_um, and nominal_mm, of blocks at any"
        " distances position_mm rounded to 0.1 mm",
    )


class EarlierCalibration(TomlTable):
    """A ``[[certificate.earlier]]``: what an earlier certificate of the same gauge says of its length."""

    date: datetime.date = Field(description="date of that calibration")
    length_um_per_m: float = Field(
        ge=-1000, le=1000, allow_inf_nan=False, description="its lengths minus those of the present one, um per m"
    )


class CertificateTable(TomlTable):
    """The ``[certificate]`` table."""

    number: str = Field(min_length=1, description="certificate number")
    laboratory: str = Field(min_length=1, description="laboratory that calibrated the gauge")
    date: datetime.date = Field(description="date of calibration, e.g. 2026-03-02")
    coverage_factor: float = Field(ge=1, le=4, description="coverage factor k of uncertainty_um")
    degrees_of_freedom: float | None = Field(
        None, ge=1, description="effective degrees of freedom of uncertainty_um; without it infinite"
    )
    correlation: float | None = Field(
        None, ge=0, le=1, description="correlation coefficient between the positions of any two faces; without it 0"
    )
    proportional_um_per_m: float | None = Field(
        None,
        ge=0,
        le=50,
        description="part of uncertainty_um that grows with the position and is common to all faces, um per m",
    )
    drift_um_per_m_per_year: float | None = Field(
        None, ge=0, le=50, description="standard uncertainty of the change of the gauge's length in a year, um per m"
    )
    earlier: list[EarlierCalibration] = Field(default_factory=list, description="[[certificate.earlier]]")
    recall: datetime.date | None = Field(None, description="day on which the gauge is due for calibration")
    example: bool = Field(False, description="true when the certificate is invented for demonstration")


LEAST_UNCERTAINTY_UM = 0.01
"""No gauge is certified better than this; smaller numbers are mm."""


@dataclass(frozen=True, repr=False)
class Gauge(Plotted):
    """A step gauge as certified.

    ``nominal_mm``, ``position_mm`` and ``u_um`` (standard uncertainty) have one entry per face; face ``k`` is entry
    ``k - 1``. Positions are along the axis from face 1 at the reference temperature. Odd faces are fronts (outward
    normal ``-a``), even ones backs; block ``b`` has faces ``2b-1`` and ``2b``.
    """

    drawn_by: ClassVar[str] = "placement.draw_certificate"
    table: GaugeTable
    certificate: CertificateTable
    nominal_mm: NDArray[np.float64]
    position_mm: NDArray[np.float64]
    u_um: NDArray[np.float64]
    path: str = ""

    @cached_property
    def correlation(self) -> NDArray[np.float64] | None:
        """Correlation matrix of the certified positions, ``(n_faces, n_faces)``; None where they are independent.

        The part that is proportional to the position is common to all faces; the rest has one coefficient.
        """
        common = self.u_common_um
        if not common.any():
            return None
        share = np.divide(common, self.u_um, out=np.zeros(common.shape), where=self.u_um > 0)
        matrix = share.T @ share
        np.fill_diagonal(matrix, 1.0)
        return matrix

    @cached_property
    def u_common_um(self) -> NDArray[np.float64]:
        """Parts of the standard uncertainty, um, that all faces have in common, ``(2, n_faces)``.

        The one that is proportional to the position, and the one of the correlation coefficient.
        """
        proportional = np.minimum(proportional_u_um(self.certificate, self.position_mm), self.u_um)
        rest = np.sqrt(self.u_um**2 - proportional**2)
        return np.array([proportional, np.sqrt(self.certificate.correlation or 0.0) * rest])

    @property
    def u_own_um(self) -> NDArray[np.float64]:
        """The part that each face has by itself, um, ``(n_faces,)``."""
        return np.sqrt(np.maximum(self.u_um**2 - (self.u_common_um**2).sum(axis=0), 0.0))

    def correlation_of(self, faces: NDArray[np.int64]) -> NDArray[np.float64] | None:
        """That of some faces by number, ``(k, k)``; None where they are independent."""
        return None if self.correlation is None else self.correlation[np.ix_(faces - 1, faces - 1)]

    def summary(self) -> str:
        """Name, certificate, size and uncertainty in a line."""
        certificate, largest = self.certificate, float(self.u_um.max())
        named = f"{self.table.name} (serial number {self.table.serial}), {self.n_blocks} blocks"
        length = f"{self.nominal_mm[-1]:g} mm, u up to {largest:.3g} um"
        number = f"certificate {certificate.number} of {certificate.date.isoformat()}, {certificate.laboratory}"
        return join_lines(f"{named}, {length}; {number}{'; EXAMPLE' if certificate.example else ''}")

    def to_frame(self) -> pd.DataFrame:
        """One row per face: nominal and certified position in mm, standard uncertainty in um."""
        import pandas as pd

        face = np.arange(1, self.n_faces + 1)
        side = np.where(face % 2 == 1, "front", "back")
        columns = {"face": face, "block": (face + 1) // 2, "side": side, "nominal_mm": self.nominal_mm}
        return pd.DataFrame({**columns, "position_mm": self.position_mm, "u_um": self.u_um})

    def to_dict(self) -> dict[str, Any]:
        """All that its files state, as JSON types; :meth:`read_dict` reads it back."""
        tables = {"gauge": self.table.model_dump(mode="json"), "certificate": self.certificate.model_dump(mode="json")}
        return {**tables, **{name: getattr(self, name).tolist() for name in ("nominal_mm", "position_mm", "u_um")}}

    @classmethod
    def read_dict(cls, stored: Mapping[str, Any], path: str = "") -> Gauge:
        """The gauge that :meth:`to_dict` wrote."""
        table, certificate = (
            kind.model_validate_json(json.dumps(stored[key]))
            for kind, key in ((GaugeTable, "gauge"), (CertificateTable, "certificate"))
        )
        nominal, position, u = (np.array(stored[name], float) for name in ("nominal_mm", "position_mm", "u_um"))
        return cls(cast("GaugeTable", table), cast("CertificateTable", certificate), nominal, position, u, path)

    @property
    def n_faces(self) -> int:
        """Number of faces, two per block."""
        return len(self.position_mm)

    @property
    def n_blocks(self) -> int:
        """Number of blocks."""
        return self.n_faces // 2

    @property
    def rail_width_mm(self) -> float:
        """Width of the rail, mm; 10 mm beyond the block on each side where the file does not state it."""
        return self.table.rail_width_mm or self.table.block_width_mm + 20.0

    def temperature_C(self, measured: float | None) -> float:
        """The temperature as measured, or that of the certificate where it was not, deg C."""
        return self.table.reference_temperature_C if measured is None else measured

    def position_at(self, temperature_C: ArrayLike) -> NDArray[np.float64]:
        """Face positions in mm at a gauge temperature: S (1 + alpha (T - T_ref)).

        A scalar temperature gives shape ``(n_faces,)``; temperatures of shape ``(n, 1)`` give ``(n, n_faces)``.
        """
        warmer_K = np.asarray(temperature_C, float) - self.table.reference_temperature_C
        return self.position_mm * (1.0 + self.table.expansion_per_K * warmer_K)

    @cached_property
    def block_centre_mm(self) -> NDArray[np.float64]:
        """Position of the middle of each block, shape ``(n_blocks,)``."""
        return (self.position_mm[0::2] + self.position_mm[1::2]) / 2.0

    @cached_property
    def block_size_mm(self) -> NDArray[np.float64]:
        """Distance from the front to the back face of each block, shape ``(n_blocks,)``."""
        return self.position_mm[1::2] - self.position_mm[0::2]

    def check_block(self, block: int, what: str = "block", argument: str = "") -> int:
        """``block`` if the gauge has it, else :class:`InputError`, with the argument that stated it."""
        if not 1 <= block <= self.n_blocks:
            words = f"{what} is not on this gauge"
            said = naming(argument, words=f"{{}}: {words}") if argument else words
            raise InputError(self.path, said, found=block, expected=f"1 to {self.n_blocks}")
        return block


@reader("gauge file")
def read_gauge(name: str | Path) -> Gauge:
    """Read and check a gauge file, given by its path or by the name of a shipped one.

    :class:`InputError` names the key or row of: unknown or missing keys, values out of bounds, faces out of order,
    repeated or missing, positions not rising from 0, positions that disagree with the nominal ones (with the unit they
    look like), block sizes off nominal, uncertainties in another unit, a calibration dated in the future.
    """
    path = find_data(name, "gauge")
    data = read_toml(path)
    for key in data:
        if key not in ("gauge", "certificate"):
            raise InputError(path, f"table [{key}] is not known", expected="[gauge] and [certificate]")
    table = check_table(GaugeTable, data.get("gauge"), path, "gauge")
    certificate = check_table(CertificateTable, data.get("certificate"), path, "certificate")
    check_past(certificate.date, path, "key certificate.date")
    faces = read_numbers(file_beside(path, "gauge.faces", table.faces), FACE_COLUMNS)
    _check_faces(faces)
    u_um = faces["uncertainty_um"] / certificate.coverage_factor
    _check_proportional(faces, certificate)
    return Gauge(table, certificate, faces["nominal_mm"], faces["position_mm"], u_um, str(path))


def proportional_u_um(certificate: CertificateTable, position_mm: NDArray[np.float64]) -> NDArray[np.float64]:
    """Standard uncertainty of the part that is proportional to the position, um, shape ``(n_faces,)``."""
    per_m = certificate.proportional_um_per_m or 0.0
    return per_m * np.abs(position_mm) * 1e-3 / certificate.coverage_factor


def _check_proportional(faces: CsvTable, certificate: CertificateTable) -> None:
    """A part cannot be larger than the whole."""
    part = proportional_u_um(certificate, faces["position_mm"]) * certificate.coverage_factor
    over = np.flatnonzero(part > faces["uncertainty_um"] * (1.0 + 1e-9))
    if over.size:
        row = int(over[0])
        raise InputError(
            faces.at(row),
            "uncertainty_um is smaller than its part certificate.proportional_um_per_m",
            found=f"{faces['uncertainty_um'][row]:g} um at {faces['position_mm'][row]:g} mm",
            expected=f"at least {part[row]:.4g} um",
        )


def _check_faces(faces: CsvTable) -> None:
    _check_order(faces)
    _check_units(faces)
    _check_spacing(faces)
    _check_uncertainties(faces)


def _check_order(faces: CsvTable) -> None:
    seen: set[float] = set()
    for row, face in enumerate(faces["face"]):
        if face in seen:
            raise InputError(faces.at(row), "face appears twice", found=f"face {face:g}", expected=f"face {row + 1}")
        if face != row + 1:
            raise InputError(
                faces.at(row), "faces are out of order", found=f"face {face:g}", expected=f"face {row + 1}"
            )
        seen.add(face)
    if len(seen) % 2 or len(seen) < 4:
        raise InputError(
            faces.path, "every block has two faces", found=f"{len(seen)} faces", expected="an even number, at least 4"
        )


def _check_units(faces: CsvTable) -> None:
    nominal, position = faces["nominal_mm"], faces["position_mm"]
    if nominal[0] != 0.0 or position[0] != 0.0:
        raise InputError(
            faces.at(0),
            "positions are counted from face 1",
            found=f"nominal_mm {nominal[0]:g}, position_mm {position[0]:g} at face 1",
            expected="0 and 0",
        )
    if nominal[-1] > LONGEST_MM:
        what, found = "no step gauge is so long: positions look like um", f"nominal_mm {nominal[-1]:g} at the last face"
        raise InputError(faces.at(len(nominal) - 1), what, found=found, expected=f"mm, at most {LONGEST_MM:g}")
    for name in ("nominal_mm", "position_mm"):
        steps = np.flatnonzero(np.diff(faces[name]) <= 0)
        if steps.size:
            row = int(steps[0]) + 1
            raise InputError(
                faces.at(row),
                f"{name} must rise from face to face",
                found=f"{faces[name][row]:g} after {faces[name][row - 1]:g}",
            )
    off = np.abs(position - nominal) > MAX_DEVIATION_MM
    if off.any():
        row = int(np.flatnonzero(off)[0])
        raise InputError(
            faces.at(row),
            "position_mm and nominal_mm disagree" + _unit_hint(float(np.median(position[1:] / nominal[1:]))),
            found=f"{position[row]:g} for nominal {nominal[row]:g}",
            expected=f"a difference of at most {MAX_DEVIATION_MM} mm; of blocks at any distances, nominal_mm is"
            " position_mm rounded to 0.1 mm",
        )


def _unit_hint(ratio: float) -> str:
    for factor, unit in (
        (1 / 25.4, "inches"),
        (1e3, "um"),
        (1e-3, "m"),
        (0.1, "cm"),
        (25.4, "mm against nominal inches"),
    ):
        if abs(ratio / factor - 1.0) < 0.01:
            return f" (positions look like {unit})"
    return ""


def _check_spacing(faces: CsvTable) -> None:
    size, nominal_size = (np.diff(faces[name])[0::2] for name in ("position_mm", "nominal_mm"))
    typical = float(np.median(nominal_size))
    for block, (found, nominal) in enumerate(zip(size, nominal_size, strict=True), 1):
        alike = 0.5 < nominal / typical < 2.0
        if abs(found - nominal) > MAX_DEVIATION_MM / 2 or not alike:
            one = f"about {typical:g} mm, as the others: the blocks of a gauge are about equally wide, gaps need not be"
            raise InputError(
                faces.at(2 * block - 1),
                f"front and back of block {block} are not a block apart",
                found=f"{found:.4f} mm between faces {2 * block - 1} and {2 * block}",
                expected=f"about {nominal:g} mm" if alike else one,
            )


def _check_uncertainties(faces: CsvTable) -> None:
    u = faces["uncertainty_um"]
    negative, large = np.flatnonzero(u < 0), np.flatnonzero(u > 50)
    if negative.size:
        raise InputError(faces.at(int(negative[0])), "uncertainty_um is negative", found=f"{u[negative[0]]:g}")
    if large.size:
        raise InputError(
            faces.at(int(large[0])),
            "uncertainty_um is too large (nm?)",
            found=f"{u[large[0]]:g}",
            expected="0 to 50 um",
        )
    small = np.flatnonzero((u > 0) & (u < LEAST_UNCERTAINTY_UM))
    if small.size:
        found, expected = f"{u[small[0]]:g}", f"{LEAST_UNCERTAINTY_UM:g} to 50 um, or 0"
        raise InputError(faces.at(int(small[0])), "uncertainty_um looks like mm", found=found, expected=expected)
