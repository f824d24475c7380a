"""Input of a report: an ``evaluation.json`` checked key by key, and files that must belong to it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import ConfigDict, Field

from stepgauge.errors import InputError, naming
from stepgauge.evaluation.files import read_evaluation
from stepgauge.files.config import TomlTable, check_table
from stepgauge.files.text import result_file
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.machine.file import Machine, check_recorded
from stepgauge.standards.budget_given import stated_gauge

GAUGE_KEYS = ("name", "material", "expansion_per_K", "expansion_uncertainty_per_K", "reference_temperature_C")
CERTIFICATE_KEYS = ("laboratory", "coverage_factor", "example")
"""What an evaluation repeats of the gauge file and its certificate, beside what identifies them."""
SAME_POSITION_MM = 1e-6
SAME_U_UM = 1e-6
SAME_AXIS_RAD = 0.01
"""A placement file turned farther than this from the evaluated axis describes another placement."""


class _Stored(TomlTable):
    """A table of the JSON file; keys that later versions add are left alone."""

    model_config = ConfigDict(extra="ignore")


class FaceRow(_Stored):
    """One face; undefined values are null."""

    face: int = Field(ge=1, description="face number")
    block: int = Field(ge=1, description="block number")
    side: Literal["front", "back"] = Field(description="side of the block")
    nominal_mm: float
    position_mm: float
    xf_um: float | None
    sf_um: float | None
    xb_um: float | None
    sb_um: float | None
    xm_um: float | None
    xr_um: float | None
    count: int = Field(ge=0, description="probings of the face")


class PlacementRow(_Stored):
    """One placement of the gauge."""

    placement: int
    axis: list[float] = Field(min_length=3, max_length=3)
    origin_mm: list[float] = Field(min_length=3, max_length=3)
    cycles: list[int] = Field(min_length=2, max_length=2)
    gauge_temperature_C: float | None
    scale_temperature_C: float | None = None
    r_eff_mm: float
    u_r_eff_mm: float | None
    r_eff_blocks: list[int]
    span_mm: float
    band_um: float | None
    worst_two_sigma_um: float | None
    notes: list[str]
    faces: list[FaceRow] = Field(min_length=2)


class GaugeRow(_Stored):
    """The gauge as the evaluation names it."""

    name: str
    serial: str
    material: str
    expansion_per_K: float
    reference_temperature_C: float
    certificate: str
    laboratory: str
    date: str
    coverage_factor: float
    example: bool


class EvaluationTable(_Stored):
    """The whole file."""

    recording: str = Field(description="path of the recording")
    comments: dict[str, str] = Field(description="what the recording says of itself")
    gauge: GaugeRow = Field(description="the gauge and its certificate")
    blocks: list[int] = Field(min_length=2, max_length=2, description="first and last used block")
    mpe: str | None = Field(None, description="limit that it was compared with")
    r_eff_mm: float = Field(description="effective radius")
    u_r_eff_mm: float | None = Field(description="its standard uncertainty; none without repeats")
    r_eff_origin: str = Field(description="first, all or corrected")
    r_eff_meaning: str = Field(description="where the effective radius comes from")
    span_mm: float = Field(description="longest span")
    band_um: float | None = Field(description="largest range of the mean error")
    worst_two_sigma_um: float | None = Field(description="largest 2s")
    temperature_convention: str = Field(description="what was corrected to which temperature")
    placements: list[PlacementRow] = Field(min_length=1, description="results by placement")


def find_evaluation(path: str | Path) -> Path:
    """The ``evaluation.json`` of a folder, or the file itself."""
    return result_file(path, "evaluation.json")


def read_checked_evaluation(path: str | Path, with_inputs: bool = True) -> dict[str, Any]:
    """The content of an ``evaluation.json``, given by its path or its folder.

    ``with_inputs``: refuse one whose recording or gauge has changed since; what is compared with a later one may be.
    :class:`InputError` where the file is not an evaluation, or a key is missing or of the wrong kind.
    """
    file = find_evaluation(path)
    data = read_evaluation(file, with_inputs)
    check_table(EvaluationTable, data, file)
    return data


def check_gauge(evaluation: dict[str, Any], gauge: Gauge) -> None:
    """:class:`InputError` where a gauge file is not the one that was evaluated against."""
    stated = stated_gauge(gauge)
    check_certificate(evaluation, stated, gauge.path)
    for row in evaluation["placements"][0]["faces"]:
        face, expected_mm = row["face"], row["position_mm"]
        found_mm = gauge.position_mm[face - 1] if face <= gauge.n_faces else np.nan
        if not abs(found_mm - expected_mm) <= SAME_POSITION_MM:
            raise InputError(
                gauge.path,
                f"not the certificate of this evaluation: position of face {face}",
                found=f"{found_mm:.5f} mm",
                expected=f"{expected_mm:.5f} mm",
            )
    check_u_certificate(evaluation, stated, gauge.path)


def check_certificate(evaluation: dict[str, Any], stated: dict[str, Any], where: str | Path) -> None:
    """:class:`InputError` where what a gauge file states (:func:`stated_gauge`) is not what was evaluated with."""
    table, certificate, stored = stated["gauge"], stated["certificate"], evaluation["gauge"]
    for what, found, key in (
        ("serial number", table["serial"], "serial"),
        ("certificate", certificate["number"], "certificate"),
        ("date of calibration", certificate["date"], "date"),
        *((f"gauge.{key}", table[key], key) for key in GAUGE_KEYS),
        *((f"certificate.{key}", certificate[key], key) for key in CERTIFICATE_KEYS),
    ):
        if found != stored.get(key, found):
            what = f"not the gauge of this evaluation: its {what}"
            raise InputError(where, what, found=found, expected=stored[key])


def check_u_certificate(evaluation: dict[str, Any], stated: dict[str, Any], where: str | Path) -> None:
    """:class:`InputError` where the certified uncertainty of a face is not that of the evaluation."""
    for row in evaluation["placements"][0]["faces"]:
        face, expected_um = row["face"], row.get("u_certificate_um")
        found_um = stated["u_um"][face - 1] if face <= len(stated["u_um"]) else np.nan
        if expected_um is not None and not abs(found_um - expected_um) <= SAME_U_UM:
            what = f"not the certificate of this evaluation: standard uncertainty of face {face}"
            raise InputError(where, what, found=f"{found_um:.4g} um", expected=f"{expected_um:.4g} um")


def check_placements(evaluation: dict[str, Any], placements: Sequence[Placement], files: Sequence[str]) -> None:
    """:class:`InputError` where placement files are not those of the evaluation, in its order."""
    results = evaluation["placements"]
    if placements and len(placements) != len(results):
        raise InputError(
            naming("placements"),
            "one placement file per placement",
            found=len(placements),
            expected=f"{len(results)} or none",
        )
    for placement, file, result in zip(placements, files, results, strict=False):
        _check_details(placement, file)
        turned = float(np.linalg.norm(np.cross(placement.axis, result["axis"])))
        if turned > SAME_AXIS_RAD or placement.axis @ np.asarray(result["axis"]) < 0:
            raise InputError(
                file,
                f"this placement lies along another axis than placement {result['placement']} of the evaluation",
                found=np.round(placement.axis, 4).tolist(),
                expected=np.round(result["axis"], 4).tolist(),
            )


def _check_details(placement: Placement, file: str) -> None:
    """What a report prints of the angles and uncertainties must be numbers, for people may edit the file."""
    for table, keys in _PRINTED.items():
        stored = placement.details.get(table, {})
        for key in keys & stored.keys():
            values = stored[key] if isinstance(stored[key], list) else [stored[key]]
            if not all(isinstance(v, int | float) and not isinstance(v, bool) for v in values):
                raise InputError(file, f"key {table}.{key} is wrong", found=repr(stored[key]), expected="numbers")


_PRINTED = {
    "angles": {"n1_to_axis_mrad", "n2_to_axis_mrad"},
    "uncertainty": {"c1_um", "c2_um", "yaw_urad", "pitch_urad", "n1_urad", "n2_urad"},
}


def check_machine(evaluation: dict[str, Any], machine: Machine) -> None:
    """:class:`InputError` where the recording names another machine or tip."""
    check_recorded(evaluation["comments"], machine)
