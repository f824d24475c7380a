"""What is written of the diagnosis of a map: the JSON, the table of residuals, the changed probe file."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import tomli_w

from stepgauge.diagnosis.fits.solve import Estimate
from stepgauge.diagnosis.maps.candidates import GAUGE_KINDS
from stepgauge.diagnosis.maps.data import ANGLES
from stepgauge.diagnosis.maps.model import build_probe
from stepgauge.diagnosis.maps.result import MapDiagnosis, QuantityFit
from stepgauge.diagnosis.output.files import common_json
from stepgauge.diagnosis.output.machine_text import toml_types
from stepgauge.diagnosis.output.rows import FINDING, FORM, ROWS_FILE, rows_csv
from stepgauge.diagnosis.result import OUTLIERS, Finding, Located, rms
from stepgauge.diagnosis.wording.findings import MAP
from stepgauge.files.checksum import file_sha256
from stepgauge.files.json_types import json_types
from stepgauge.files.tables import csv_text
from stepgauge.probes.directions_map import map_directions, map_rows

PROBE_FILE = "probe.diagnosed.toml"
PRETRAVEL_FILE = "probe.diagnosed.csv"
OF_LAWS = ("constant_um", "lobe_azimuth_deg", "more_um", "pretravel_um", "amplitude_um", "phase_deg")
UNIT = "sd"
"""Residuals of forces and lengths beside each other: over the standard deviation of one reading."""


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
            "quantities": {fit.name: _noise(fit, noise.dof if noise.repeats else 0) for fit in found.fits},
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


def _noise(fit: QuantityFit, dof: int) -> dict[str, Any]:
    u, digit = fit.noise / math.sqrt(2.0 * dof) if dof else math.nan, fit.measured.quantum or None
    return {"sigma": fit.noise, "u": u, "unit": fit.unit, "printed_digit": digit}


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
        values = ", ".join(f"{name} = {_short(p)}" for name, p in finding.parameters.items())
        if finding.kind == OUTLIERS:
            lines.append(f"# rows of the map left out as outliers: {int((~found.kept).sum())}")
            continue
        where = "the force gauge's, not in this file" if finding.kind in GAUGE_KINDS else "changed here"
        lines.append(f"# {finding.label.replace('_', ' ')}: {values} ({where})")
    lines += [f"# without a law, and not in this file: {form.where}" for form in found.forms]
    return "\n".join(lines) + "\n"


def _short(parameter: Estimate) -> str:
    return f"{parameter.value:.4g}" + ("" if parameter.unit == "1" else f" {parameter.unit}")


def _map_table(table: dict[str, Any]) -> tuple[dict[str, Any], str]:
    """A law that probe files do not have, as a map file; empirical laws stay formulas."""
    named = {key: value for key, value in table.items() if key != "empirical"}
    found = map_directions(build_probe(named, ""), np.arange(0.0, 181.0, 5.0), np.arange(0.0, 360.0, 3.0))
    kept = {key: value for key, value in table.items() if key not in OF_LAWS}
    rows = [(polar, azimuth, pretravel) for polar, azimuth, _, _, pretravel in map_rows(found)]
    return {**kept, "model": "table", "map": PRETRAVEL_FILE}, csv_text((*ANGLES, "pretravel_um"), rows)
