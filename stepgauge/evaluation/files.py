"""The files of an evaluation: ``evaluation.json`` and ``evaluation.csv``."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stepgauge import __version__
from stepgauge.evaluation.evaluate import Evaluation, PlacementResult
from stepgauge.evaluation.face_errors import REffOrigin, reversal_of_scale_um
from stepgauge.files.dates import first_moment
from stepgauge.files.json_types import defined
from stepgauge.files.tables import csv_text, result_cell
from stepgauge.files.text import read_result, write_files
from stepgauge.gauge.certified import Gauge
from stepgauge.recording.conventions import convention_words

if TYPE_CHECKING:
    import pandas as pd

CSV_COLUMNS = (
    "face",
    "block",
    "side",
    "nominal_mm",
    "position_mm",
    "xf_um",
    "sf_um",
    "xb_um",
    "sb_um",
    "xm_um",
    "xr_um",
    "interpolated",
)
UM = ("xf_um", "sf_um", "xb_um", "sb_um", "xm_um", "xr_um")
R_EFF_ORIGIN = {
    "first": "from the size of the first used block; XB of that block is zero by construction",
    "all": "mean over all used blocks",
    "corrected": "that by which the readings had been corrected: the errors are those which the machine indicated",
}


def evaluation_to_dict(evaluation: Evaluation) -> dict[str, Any]:
    """An evaluation as JSON types (undefined values are None).

    The top level summarises: for a single placement its own values; for several the mean effective radius with the
    standard uncertainty of that mean, the longest span, the largest range of the mean error and the largest 2s.
    """
    gauge, results = evaluation.gauge, evaluation.results
    radii = np.array([result.radius.r_eff_mm for result in results])
    u = np.array([result.radius.u_mm for result in results])
    certificate = gauge.certificate
    return {
        "format": "stepgauge evaluation 1",
        "stepgauge": __version__,
        "recording": evaluation.path,
        "comments": dict(evaluation.comments),
        "machine": evaluation.comments.get("machine"),
        "measured_at": first_moment(evaluation.comments.get("measured_at"), evaluation.path),
        "gauge": {
            "name": gauge.table.name,
            "serial": gauge.table.serial,
            "material": gauge.table.material,
            "expansion_per_K": gauge.table.expansion_per_K,
            "expansion_uncertainty_per_K": gauge.table.expansion_uncertainty_per_K,
            "reference_temperature_C": gauge.table.reference_temperature_C,
            "certificate": certificate.number,
            "laboratory": certificate.laboratory,
            "date": certificate.date.isoformat(),
            "coverage_factor": certificate.coverage_factor,
            "example": certificate.example,
        },
        "certified": gauge.to_dict(),
        "blocks": list(evaluation.blocks),
        "mpe": None if evaluation.limit is None else str(evaluation.limit),
        "decision": evaluation.decision.to_dict(),
        "r_eff_mm": float(radii.mean()),
        "u_r_eff_mm": defined(float(np.sqrt((u**2).sum()) / len(u))),
        "r_eff_origin": evaluation.r_eff_origin,
        "r_eff_meaning": R_EFF_ORIGIN[evaluation.r_eff_origin],
        "span_mm": max(result.span_mm for result in results),
        "band_um": defined(_largest([result.band_um for result in results])),
        "worst_two_sigma_um": defined(_largest([result.worst_two_sigma_um for result in results])),
        "temperature_convention": convention_words(
            evaluation.comments, all(one.gauge_temperature_C is not None for one in results)
        ),
        "placements": [_placement_to_dict(result, gauge) for result in results],
    }


def _placement_to_dict(result: PlacementResult, gauge: Gauge) -> dict[str, Any]:
    certified = [{"u_certificate_um": float(gauge.u_um[face - 1])} for face in result.face]
    return {
        "placement": result.placement,
        "axis": [float(v) for v in result.axis],
        "origin_mm": [float(v) for v in result.origin_mm],
        "cycles": list(result.cycles),
        "gauge_temperature_C": result.gauge_temperature_C,
        "scale_temperature_C": result.scale_temperature_C,
        "r_eff_mm": result.radius.r_eff_mm,
        "u_r_eff_mm": defined(result.radius.u_mm),
        "r_eff_blocks": list(result.radius.blocks),
        "span_mm": result.span_mm,
        "band_um": defined(result.band_um),
        "worst_two_sigma_um": defined(result.worst_two_sigma_um),
        "notes": list(result.notes),
        "conditions": result.conditions.to_dicts(),
        "left_out": [one.to_dict() for one in result.left_out],
        "faces": [row | more for row, more in zip(face_rows(result), certified, strict=True)],
    }


def face_rows(result: PlacementResult) -> list[dict[str, Any]]:
    """One dictionary per face with the columns of ``evaluation.csv``, plus ``count``, the probings of that face."""
    columns = {name: getattr(result, name) for name in UM}
    return [
        {
            "face": int(face),
            "block": (int(face) + 1) // 2,
            "side": "front" if face % 2 else "back",
            "nominal_mm": float(result.nominal_mm[i]),
            "position_mm": float(result.position_mm[i]),
            **{name: defined(float(values[i])) for name, values in columns.items()},
            "interpolated": "xb" if face % 2 else "xf",
            "count": int(result.count[i]),
        }
        for i, face in enumerate(result.face)
    ]


def mean_error_extent(rows: Sequence[Mapping[str, Any]]) -> tuple[tuple[int, int] | None, float]:
    """First and last of the faces (:func:`face_rows`) with a mean error XM, None without any; their distance in mm."""
    found = [(int(row["face"]), float(row["nominal_mm"])) for row in rows if row["xm_um"] is not None]
    return ((found[0][0], found[-1][0]), found[-1][1] - found[0][1]) if found else (None, 0.0)


def face_frame(evaluation: Evaluation) -> pd.DataFrame:
    """The faces of all placements: the columns of :func:`face_rows` after the placement, NaN where undefined."""
    import pandas as pd

    rows = [{"placement": one.placement, **row} for one in evaluation.results for row in face_rows(one)]
    return pd.DataFrame(rows).astype(dict.fromkeys(UM, float))


def stored_reversal_of_scale_um(stored: Mapping[str, Any], origin: REffOrigin) -> float:
    """:func:`~stepgauge.evaluation.face_errors.reversal_of_scale_um` of a placement of an ``evaluation.json``."""
    rows = stored["faces"]
    face, count = (np.array([row[name] for row in rows], np.int64) for name in ("face", "count"))
    position, xm = (np.array([row[name] for row in rows], float) for name in ("position_mm", "xm_um"))
    return reversal_of_scale_um(face, count, position, xm, origin)


def _largest(values: list[float]) -> float:
    known = [value for value in values if not math.isnan(value)]
    return max(known, default=math.nan)


def write_evaluation(folder: str | Path, evaluation: Evaluation) -> list[Path]:
    """Write ``evaluation.json`` and ``evaluation.csv`` into a folder (made if missing); returns their paths."""
    said = {"evaluation.json": evaluation_to_dict(evaluation), "evaluation.csv": evaluation_csv(evaluation)}
    return write_files(folder, said)


def evaluation_csv(evaluation: Evaluation) -> str:
    """The table of all faces; a column ``placement`` is added where there are several."""
    several = len(evaluation.results) > 1
    rows = []
    for result in evaluation.results:
        for row in face_rows(result):
            cells = [result_cell(row[name], 12) for name in CSV_COLUMNS]
            rows.append([*cells, str(result.placement)] if several else cells)
    return csv_text([*CSV_COLUMNS, "placement"] if several else CSV_COLUMNS, rows)


def read_evaluation(path: str | Path, with_inputs: bool = True) -> dict[str, Any]:
    """The content of an ``evaluation.json`` (:class:`InputError` where it is not one, or was changed).

    ``with_inputs``: refuse one whose recording, gauge or placement has changed since; a history keeps those.
    """
    return read_result(path, "evaluation", with_inputs)
