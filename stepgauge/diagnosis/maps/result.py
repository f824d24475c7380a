"""The result of the diagnosis of a probe map, and what is written of it.

That is the JSON, the table of residuals, and the changed probe file.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import pandas as pd
import tomli_w
from numpy.typing import NDArray

from stepgauge.diagnosis.maps.candidates import GAUGE_KINDS
from stepgauge.diagnosis.maps.data import ANGLES, MapData, MapScatter, Measured
from stepgauge.diagnosis.maps.model import Terms, build_probe
from stepgauge.diagnosis.output.files import common_json
from stepgauge.diagnosis.output.machine_text import toml_types
from stepgauge.diagnosis.output.rows import FINDING, FORM, ROWS_FILE, rows_csv
from stepgauge.diagnosis.result import OUTLIERS, Finding, Located, StatedDiagnosis, rms
from stepgauge.diagnosis.wording.findings import MAP
from stepgauge.files.arrays import Array
from stepgauge.files.checksum import file_sha256
from stepgauge.files.json_types import json_types
from stepgauge.files.tables import csv_text
from stepgauge.probes.directions_map import map_directions, map_rows

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PROBE_FILE = "probe.diagnosed.toml"
PRETRAVEL_FILE = "probe.diagnosed.csv"
OF_LAWS = ("constant_um", "lobe_azimuth_deg", "more_um", "pretravel_um", "amplitude_um", "phase_deg")
UNIT = "sd"
"""Residuals of forces and lengths beside each other: over the standard deviation of one reading."""


@dataclass(frozen=True)
class QuantityFit:
    """One quantity of a map: its residuals, and what they are without outliers.

    ``noise``: rms of the scatter of the rows; ``before``: residuals ``(n,)``; ``after``: with the named changes;
    ``described``: also without structure; ``kept (n,)``: rows that are no outliers.
    """

    measured: Measured
    noise: float
    before: Array
    after: Array
    described: Array
    kept: NDArray[np.bool_]

    @property
    def name(self) -> str:
        """Of the quantity, with its unit."""
        return self.measured.name

    @property
    def unit(self) -> str:
        """Of the quantity."""
        return self.measured.unit

    @property
    def scale(self) -> float:
        """What residuals are measured by: the noise, or the last digit where that is not known."""
        return self.noise or self.measured.quantum or 1.0

    @property
    def stages(self) -> dict[str, Array]:
        """The residuals without outliers, by stage."""
        stages = {"before": self.before, "after": self.after, "described": self.described}
        return {name: values[self.kept] for name, values in stages.items()}

    def rms(self, stage: str) -> float:
        """Rms of the residuals ``before``, ``after`` or ``described``."""
        return rms(self.stages[stage])

    def worst(self, stage: str) -> float:
        """Largest residual as a share of the measured value."""
        values = self.measured.values[self.kept]
        positive = values > 0.0
        return float(np.max(np.abs(self.stages[stage][positive]) / values[positive], initial=0.0))


@dataclass(frozen=True, repr=False, kw_only=True)
class MapDiagnosis(StatedDiagnosis):
    """The diagnosis of the map of a probe.

    ``share_um`` of the findings has all quantities one after the other, each in its own unit. ``data`` has all rows,
    ``kept (n,)`` marks those that are not outliers; ``terms`` are the changes found, ``probe``
    is the original ``[probe]`` table, ``table`` that with the changes, ``probe_path`` the file that was judged.
    """

    drawn_by: ClassVar[str] = "probe_diagnosis.draw_residuals"
    fits: tuple[QuantityFit, ...]
    chi2_dof_before: float
    chi2_dof_after: float
    noise: MapScatter
    data: MapData
    kept: NDArray[np.bool_]
    probe: dict[str, Any]
    table: dict[str, Any]
    terms: Terms = ()
    lacking: tuple[str, ...] = ()
    probe_path: str = ""

    def shares(self, finding: Finding | Located) -> dict[str, Array]:
        """What a finding or a form adds to each quantity, ``(n,)`` by name, in the unit of the quantity."""
        names = [fit.name for fit in self.fits]
        return dict(zip(names, np.split(finding.share_um, len(names)), strict=True))

    @cached_property
    def contents(self) -> dict[str, Any]:
        """All that is stated, in JSON types."""
        return map_to_dict(self)

    def figures(self) -> dict[str, Figure]:
        """Residuals, directions and effects, by the names of their files."""
        from stepgauge.figures.probe_diagnosis import figures_of

        return figures_of(self)

    def outputs(self, folder: Path) -> tuple[Mapping[str, Any], Mapping[str, str]]:
        return map_outputs(self, folder)


def map_outputs(found: MapDiagnosis, folder: Path) -> tuple[dict[str, Any], dict[str, str]]:
    """See :meth:`.ComputedDiagnosis.outputs`: the changed probe file, and a map file if it needs one."""
    table, beside = toml_types(found.table), {}
    if table.get("model") == "triangular":
        table, beside[PRETRAVEL_FILE] = _map_table(table)
    probe = _head(found) + tomli_w.dumps({"probe": table})
    return map_to_dict(found, folder), {ROWS_FILE: rows_csv(map_row_table(found)), PROBE_FILE: probe, **beside}


def map_to_dict(found: MapDiagnosis, folder: str | Path = ".") -> dict[str, Any]:
    """The diagnosis of a map as JSON types, with the keys of that of a recording; undefined numbers are None.

    ``folder`` is the folder of the diagnosed probe file, for the commands that name it.
    """
    data, noise = found.data, found.noise

    def renamed(text: str) -> str:
        return text.replace(f" {PROBE_FILE}", f" {(Path(folder) / PROBE_FILE).as_posix()}")

    probe = {"name": found.table.get("name", ""), "model": found.table.get("model", "constant")}
    said = {
        **common_json(found, lambda one: _details(one, found), renamed, MAP),
        "fit": {
            "chi2_dof_after": found.chi2_dof_after,
            "chi2_dof_before": found.chi2_dof_before,
            "quantities": {fit.name: _quantity(fit) for fit in found.fits},
        },
        "noise": {
            "from_repeats": noise.repeats,
            "copies": noise.copies,
            "dof": noise.dof,
            "scatter": "proportional" if noise.grows else "constant",
            "quantities": {
                fit.name: {
                    "sigma": fit.noise,
                    "u": fit.noise / math.sqrt(2.0 * noise.dof) if noise.repeats else math.nan,
                    "unit": fit.unit,
                    "printed_digit": fit.measured.quantum or None,
                }
                for fit in found.fits
            },
        },
        "measured": {
            "probings": len(data),
            "outliers": int((~found.kept).sum()),
            "rows_without_values": data.dropped,
            "directions": int(data.direction.max()) + 1,
            "polar_deg": _range(data.polar_deg, int(data.rings.max()) + 1),
            "azimuth_deg": _range(data.azimuth_deg % 360.0, int(data.spokes.max()) + 1),
            "quantities": [m.name for m in data.measured],
        },
        "remarks": list(found.remarks),
        "lacking": list(found.lacking),
        "inputs": {
            "simulated": data.simulated,
            "map": {"path": data.path, "sha256": file_sha256(data.path)},
            "probe": {"path": found.probe_path, "sha256": file_sha256(found.probe_path), **probe},
        },
    }
    return dict(json_types(said))


def _details(one: Finding | Located, found: MapDiagnosis) -> dict[str, Any]:
    """How large what is found is in each quantity, and in all over the scatter of a reading."""
    if not len(one.share_um):
        return {}
    shares = found.shares(one)
    over = np.concatenate([shares[fit.name] / fit.scale for fit in found.fits])
    rows = np.flatnonzero(~found.kept) if isinstance(one, Finding) and one.kind == OUTLIERS else ()
    return {
        "rms": {name: rms(share) for name, share in shares.items()},
        "largest": {name: float(np.abs(share).max(initial=0.0)) for name, share in shares.items()},
        f"rms_{UNIT}": rms(over),
        **({"rows": [_outlier(int(row), found) for row in rows]} if len(rows) else {}),
    }


def _outlier(row: int, found: MapDiagnosis) -> dict[str, Any]:
    data = found.data
    return {
        "row": int(data.row_numbers[row]),
        "polar_deg": data.polar_deg[row],
        "azimuth_deg": data.azimuth_deg[row],
        "off": {fit.name: fit.described[row] for fit in found.fits},
    }


def _quantity(fit: QuantityFit) -> dict[str, Any]:
    return {
        "unit": fit.unit,
        "rms_before": fit.rms("before"),
        "rms_after": fit.rms("after"),
        "rest_rms": fit.rms("described"),
        "worst_before_percent": 100.0 * fit.worst("before"),
        "worst_after_percent": 100.0 * fit.worst("after"),
    }


def _range(angle: Any, different: int) -> dict[str, Any]:
    return {"from": angle.min(), "to": angle.max(), "different": different}


def map_row_table(found: MapDiagnosis) -> pd.DataFrame:
    """One row per value of the map, quantity by quantity.

    Columns as :func:`stepgauge.diagnosis.output.rows.row_table` has them, with these meanings: ``placement`` is the
    number of the quantity, in the order of the fits; ``face`` that of the direction; ``cycle`` counts its repeats;
    ``position_deg`` is the azimuth, ``polar_deg`` the polar angle.
    """
    return pd.concat([_rows(fit, number, found) for number, fit in enumerate(found.fits, 1)], ignore_index=True)


def _rows(fit: QuantityFit, number: int, found: MapDiagnosis) -> pd.DataFrame:
    data = found.data
    frame = pd.DataFrame({"recording": Path(data.path).name, "row": data.row_numbers, "placement": number}, copy=True)
    frame["cycle"] = pd.Series(data.direction).groupby(data.direction).cumcount().to_numpy() + 1
    frame["face"] = data.direction + 1
    frame["position_deg"], frame["polar_deg"] = data.azimuth_deg, data.polar_deg
    frame["used"] = found.kept.astype(int)
    frame[f"before_{UNIT}"], frame[f"after_{UNIT}"] = fit.before / fit.scale, fit.described / fit.scale
    told = {f"{FINDING}_{place}": one.share_um for place, one in enumerate(found.findings, 1)}
    told |= {f"{FORM}_{place}": one.share_um for place, one in enumerate(found.forms, 1)}
    for name, share in told.items():
        frame[f"{name}_{UNIT}"] = np.split(share, len(found.fits))[number - 1] / fit.scale
    return frame


def _head(found: MapDiagnosis) -> str:
    lines = ["# The probe with what its map says of it; see diagnosis.md."]
    for finding in found.findings:
        values = ", ".join(
            f"{name} = {p.value:.4g} {p.unit}".removesuffix(" 1") for name, p in finding.parameters.items()
        )
        if finding.kind == OUTLIERS:
            lines.append(f"# rows of the map left out as outliers: {int((~found.kept).sum())}")
            continue
        where = "the force gauge's, not in this file" if finding.kind in GAUGE_KINDS else "changed here"
        lines.append(f"# {finding.label.replace('_', ' ')}: {values} ({where})")
    lines += [f"# without a law, and not in this file: {form.where}" for form in found.forms]
    return "\n".join(lines) + "\n"


def _map_table(table: dict[str, Any]) -> tuple[dict[str, Any], str]:
    """A law that probe files do not have, as a map file; empirical laws stay formulas."""
    named = {key: value for key, value in table.items() if key != "empirical"}
    found = map_directions(build_probe(named, ""), np.arange(0.0, 181.0, 5.0), np.arange(0.0, 360.0, 3.0))
    kept = {key: value for key, value in table.items() if key not in OF_LAWS}
    rows = [(polar, azimuth, pretravel) for polar, azimuth, _, _, pretravel in map_rows(found)]
    return {**kept, "model": "table", "map": PRETRAVEL_FILE}, csv_text((*ANGLES, "pretravel_um"), rows)
