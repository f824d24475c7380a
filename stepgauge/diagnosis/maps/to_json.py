"""The content of ``diagnosis.json`` of a probe map, with the keys of the diagnosis of a recording."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from stepgauge import __version__
from stepgauge.diagnosis.maps.data import MapData
from stepgauge.diagnosis.maps.result import OUTLIERS, MapDiagnosis, QuantityFit
from stepgauge.diagnosis.maps.rows import UNIT
from stepgauge.diagnosis.output.files import FORMAT, estimate_json, evidence_json, finding_json
from stepgauge.diagnosis.result import Finding, Located, rms
from stepgauge.diagnosis.wording.findings import MAP, meaning
from stepgauge.files.checksum import file_sha256
from stepgauge.files.json_types import json_types

_FLAT = ("noise", "rms_before", "rms_after")


def map_diagnosis_json(found: MapDiagnosis, probe_path: str, folder: str | Path = ".") -> dict[str, Any]:
    """The diagnosis of a map as JSON types; undefined numbers are None.

    ``folder`` is the folder of the diagnosed probe file, for the commands that name it.
    """
    said = {
        "format": FORMAT,
        "stepgauge": __version__,
        "verdict": found.verdict,
        "effects": [_effect(each, found, Path(folder)) for each in found.findings],
        "fit": _fit(found),
        "noise": _noise(found),
        "measured": _measured(found.data, found.kept),
        **evidence_json(found),
        "remarks": list(found.remarks),
        "lacking": list(found.lacking),
        "inputs": {
            "simulated": found.data.simulated,
            "map": {"path": found.data.path, "sha256": file_sha256(found.data.path)},
            "probe": {"path": probe_path, "sha256": file_sha256(probe_path), **_probe(found.table)},
        },
    }
    for one, told in zip(found.unexplained, said["unexplained"], strict=True):
        told |= _form(one, found) if len(one.share_um) else {}
    return dict(json_types(said))


def _effect(finding: Finding, found: MapDiagnosis, folder: Path) -> dict[str, Any]:
    shares = found.shares(finding)
    how = _command_in_folder(finding.separate_by, folder)
    parameters = {name: estimate_json(p) for name, p in finding.parameters.items()}
    said: dict[str, Any] = {
        **finding_json(finding, parameters, [_member(one) for one in finding.members], how),
        "rms": {name: rms(share) for name, share in shares.items()},
        "largest": {name: float(np.abs(share).max(initial=0.0)) for name, share in shares.items()},
    }
    if finding.kind == OUTLIERS:
        said["rows"] = [_outlier(int(row), found) for row in np.flatnonzero(~found.kept)]
    return {**said, "meaning": meaning(said, MAP)}


def _member(one: Finding) -> dict[str, Any]:
    said = {
        "kind": one.kind,
        "label": one.label,
        "conditional_probability": one.probability,
        "parameters": {name: estimate_json(p) for name, p in one.parameters.items()},
    }
    return {**said, "meaning": meaning(said, MAP)}


def _outlier(row: int, found: MapDiagnosis) -> dict[str, Any]:
    data = found.data
    return {
        "row": int(data.row_numbers[row]),
        "polar_deg": data.polar_deg[row],
        "azimuth_deg": data.azimuth_deg[row],
        "off": {fit.name: fit.described[row] for fit in found.fits},
    }


def _command_in_folder(command: str, folder: Path) -> str:
    """The command for the folder in which the diagnosis was started."""
    return command.replace(" probe.diagnosed.toml", f" {(folder / 'probe.diagnosed.toml').as_posix()}")


def _form(form: Located, found: MapDiagnosis) -> dict[str, Any]:
    """Rms of what structure without a law moves, in each quantity, and over the scatter of a reading."""
    shares = found.shares(form)
    over = np.concatenate([shares[fit.name] / (fit.noise or fit.measured.quantum or 1.0) for fit in found.fits])
    return {"rms": {name: rms(share) for name, share in shares.items()}, f"rms_{UNIT}": rms(over)}


def _fit(found: MapDiagnosis) -> dict[str, Any]:
    """Per quantity, and with the unit in the name for the first quantity of each unit."""
    quantities = {fit.name: _quantity(fit) for fit in found.fits}
    flat: dict[str, Any] = {}
    for fit in found.fits:
        for key in _FLAT:
            flat.setdefault(f"{key}_{fit.unit}", quantities[fit.name][key])
    return {
        **flat,
        "chi2_dof_after": found.chi2_dof_after,
        "chi2_dof_before": found.chi2_dof_before,
        "quantities": quantities,
    }


def _quantity(fit: QuantityFit) -> dict[str, Any]:
    return {
        "unit": fit.unit,
        "noise": fit.noise,
        "printed_digit": fit.measured.quantum or None,
        "rms_before": fit.rms("before"),
        "rms_after": fit.rms("after"),
        "rest_rms": fit.rms("described"),
        "worst_before_percent": 100.0 * fit.worst("before"),
        "worst_after_percent": 100.0 * fit.worst("after"),
    }


def _noise(found: MapDiagnosis) -> dict[str, Any]:
    noise = found.noise
    said: dict[str, Any] = {
        "from_repeats": noise.repeats,
        "copies": noise.copies,
        "dof": noise.dof,
        "scatter": "proportional" if noise.grows else "constant",
        "quantities": {},
    }
    for fit in found.fits:
        u = fit.noise / math.sqrt(2.0 * noise.dof) if noise.repeats else math.nan
        said.setdefault(f"sigma_{fit.unit}", fit.noise)
        said["quantities"][fit.name] = {
            "sigma": fit.noise,
            "u": u,
            "unit": fit.unit,
            "printed_digit": fit.measured.quantum or None,
        }
    return said


def _measured(data: MapData, kept: Any) -> dict[str, Any]:
    return {
        "probings": len(data),
        "outliers": int((~kept).sum()),
        "rows_without_values": data.dropped,
        "directions": int(data.direction.max()) + 1,
        "polar_deg": _range(data.polar_deg, int(data.rings.max()) + 1),
        "azimuth_deg": _range(data.azimuth_deg % 360.0, int(data.spokes.max()) + 1),
        "quantities": [m.name for m in data.measured],
    }


def _range(angle: Any, different: int) -> dict[str, Any]:
    return {"from": angle.min(), "to": angle.max(), "different": different}


def _probe(table: Mapping[str, Any]) -> dict[str, Any]:
    return {"name": table.get("name", ""), "model": table.get("model", "constant")}
