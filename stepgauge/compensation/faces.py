"""The readings of an evaluation as errors of a machine axis at its coordinates."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from stepgauge.compensation.readings import AxisReadings, check_placement
from stepgauge.conditions import require_statement, stored_conditions
from stepgauge.errors import InputError, naming
from stepgauge.files.arrays import Array
from stepgauge.files.notation import percent
from stepgauge.recording.conventions import CONVENTIONS, Convention, convention_of
from stepgauge.recording.simulated import SIMULATED_WARNING, is_simulated

AXES = "xyz"
TIP_FAR_OFF_MM = 0.1
"""A stated radius farther than this from that of the gauge's blocks belongs to another tip: a reversal is some um."""


@dataclass(frozen=True)
class TipRadius:
    """Effective radius known from elsewhere (ring, sphere), mm, and its standard uncertainty, um."""

    r_eff_mm: float
    u_um: float = 0.0


def axis_faces(
    evaluation: Mapping[str, Any],
    path: str | Path,
    axis: str,
    tip: TipRadius | None = None,
    placement: int | None = None,
    offset_mm: float = 0.0,
    angle_limit_deg: float = 1.0,
) -> AxisReadings:
    """The faces of an ``evaluation.json`` as readings of a machine axis.

    Parameters
    ----------
    evaluation, path : content of the file, and its name for messages
    axis : x, y or z
    tip : effective radius from elsewhere; without it the mean reversal cannot be known
    placement : number of the placement; default: the only one that lies along the axis
    offset_mm : machine coordinate minus recorded coordinate of the axis (a work offset)
    angle_limit_deg : largest angle between gauge and axis

    Raises
    ------
    InputError
        no placement along the axis (with its angle), several of them, a face that was not evaluated, a condition of
        the readings that prevents a statement
    """
    one = _choose(evaluation["placements"], str(path), axis, placement, angle_limit_deg)
    conditions = stored_conditions(one)
    require_statement(conditions, path)
    share = float(one["axis"][AXES.index(axis)])
    radius_mm = float(one["r_eff_mm"])
    if tip is None and evaluation["r_eff_origin"] == "corrected":
        tip = TipRadius(radius_mm, 0.0)  # what the machine indicates it has corrected with that
    _check_tip(tip, radius_mm, str(path))
    rows = [row for row in one["faces"] if row["count"] > 0]
    front = np.array([row["side"] == "front" for row in rows])
    position = np.array([row["position_mm"] for row in rows]) + np.where(front, 0.0, 2.0 * radius_mm)
    start = float(one["origin_mm"][AXES.index(axis)])
    error = np.array([_own(row, "x") for row in rows]) + np.where(front, 0.0, 2e3 * radius_mm)
    variance, unknown = _variance(rows)
    warm_K = _warmer_K(evaluation, one)
    expansion_u = evaluation["gauge"].get("expansion_uncertainty_per_K")
    convention = convention_of(evaluation["comments"], str(path))
    made = (SIMULATED_WARNING,) if is_simulated(evaluation["comments"]) else ()
    return AxisReadings(
        str(path),
        axis,
        start + share * (position - position[0]) + offset_mm,
        np.where(front, 1, -1) * int(np.sign(share)),
        ~front,
        error,
        variance,
        share,
        None if tip is None else (2e3 * tip.r_eff_mm, (2.0 * tip.u_um) ** 2),
        abs((expansion_u or 0.0) * warm_K) * 1e3,
        _about(evaluation, one, path, axis, offset_mm, tip),
        (*made, *conditions.notes, *_notes(one, axis, unknown, expansion_u is None and warm_K != 0.0, convention)),
        stored_conditions(evaluation).notes,
        _tip_note(tip),
    )


def _check_tip(tip: TipRadius | None, measured_mm: float, path: str) -> None:
    """A radius from elsewhere differs from that of the blocks by half of the reversal: far more is another tip."""
    if tip is None or abs(tip.r_eff_mm - measured_mm) <= TIP_FAR_OFF_MM:
        return
    hint = " (a diameter?)" if abs(tip.r_eff_mm / 2.0 - measured_mm) <= TIP_FAR_OFF_MM else ""
    raise InputError(
        path,
        naming(
            "tip_radius_mm",
            words=f"{{}} is that of another tip{hint}: the difference would get into the table as reversal",
        ),
        found=f"{tip.r_eff_mm:g} mm",
        expected=f"about {measured_mm:.4f} mm, from the gauge's blocks",
    )


def angle_deg(placement: Mapping[str, Any], axis: str) -> float:
    """Angle between the gauge and a machine axis, 0 to 90 deg."""
    direction = np.array(placement["axis"], float)
    across = np.delete(direction, AXES.index(axis))
    return float(np.degrees(np.arctan2(np.linalg.norm(across), abs(direction[AXES.index(axis)]))))


def _choose(
    placements: list[dict[str, Any]], path: str, axis: str, number: int | None, limit_deg: float
) -> dict[str, Any]:
    numbers = [one["placement"] for one in placements]
    if number is not None:
        check_placement(number, numbers, path)
        placements = [one for one in placements if one["placement"] == number]
    angles = {one["placement"]: angle_deg(one, axis) for one in placements}
    along = [one for one in placements if angles[one["placement"]] <= limit_deg]
    if not along:
        found = ", ".join(f"placement {n}: {angle:.2f} deg" for n, angle in angles.items())
        raise InputError(
            path,
            f"the gauge does not lie along {axis}: other axes would get into its table",
            found=f"{found} off {axis}",
            expected=naming("angle_limit_deg", words=f"at most {limit_deg:g} deg ({{}})"),
        )
    if len(along) > 1:
        found = ", ".join(str(one["placement"]) for one in along)
        expected = naming("placement_number", words="one, with {}")
        raise InputError(path, f"several placements lie along {axis}", found=found, expected=expected)
    return along[0]


def _own(row: Mapping[str, Any], letter: str) -> float:
    """``x``: error of a face in the direction it was probed in; ``s``: its standard deviation; NaN if undefined."""
    value = row[f"{letter}f_um" if row["side"] == "front" else f"{letter}b_um"]
    return np.nan if value is None else float(value)


def _variance(rows: list[dict[str, Any]]) -> tuple[Array, list[str]]:
    """Variance of the mean of every face, with its certificate, um^2; and what is not in it."""
    scatter = np.array([_own(row, "s") for row in rows]) ** 2 / [row["count"] for row in rows]
    certificate = np.array([row.get("u_certificate_um", np.nan) for row in rows], float)
    unknown = []
    if np.isnan(scatter).any():
        unknown.append("repeatability (faces with a single probing)")
    if np.isnan(certificate).any():
        unknown.append("the gauge's certificate (not in this evaluation.json: evaluate again)")
    return np.nan_to_num(scatter) + np.nan_to_num(certificate) ** 2, unknown


def _warmer_K(evaluation: Mapping[str, Any], one: Mapping[str, Any]) -> float:
    temperature, reference = one["gauge_temperature_C"], evaluation["gauge"]["reference_temperature_C"]
    return 0.0 if temperature is None else float(temperature - reference)


def _about(
    evaluation: Mapping[str, Any],
    one: Mapping[str, Any],
    path: str | Path,
    axis: str,
    offset_mm: float,
    tip: TipRadius | None,
) -> dict[str, Any]:
    gauge = evaluation["gauge"]
    return {
        "source": Path(path).name,
        "recording": Path(evaluation["recording"]).name,
        "measured_at": evaluation.get("measured_at"),
        "machine": evaluation.get("machine"),
        "placement": one["placement"],
        "cycles": list(one["cycles"]),
        "measured_with": f"gauge {gauge['serial']}, certificate {gauge['certificate']}",
        "gauge": gauge["name"],
        "gauge_serial": gauge["serial"],
        "certificate": gauge["certificate"],
        "gauge_temperature_C": one["gauge_temperature_C"],
        "angle_deg": angle_deg(one, axis),
        "offset_mm": offset_mm,
        "tip_radius_mm": None if tip is None else tip.r_eff_mm,
        "u_tip_radius_um": None if tip is None else tip.u_um,
    }


def _notes(
    one: Mapping[str, Any], axis: str, unknown: list[str], no_expansion: bool, convention: Convention | None
) -> tuple[str, ...]:
    angle = angle_deg(one, axis)
    share = np.sin(np.radians(angle))
    notes = [f"the gauge lay {angle:.3f} deg off {axis}: {percent(share, 2)} of other axes' errors are in the table"]
    temperature = one["gauge_temperature_C"]
    if convention in ("corrected_to_20", "nominal_expansion"):
        notes.append(CONVENTIONS[convention])
    elif temperature is None:
        notes.append("no gauge temperature was recorded: the certificate's was assumed")
    else:
        notes.append(
            f"gauge at {temperature:.2f} deg C, its length corrected to that; scales as warm as they were then"
        )
    if no_expansion:
        unknown = [*unknown, "the gauge's expansion (not in this evaluation.json: evaluate again)"]
    missing = (*unknown, "temperature measurement", "certificate's correlations")
    return (*notes, *(f"not in the stated uncertainty: {what}" for what in missing))


def _tip_note(tip: TipRadius | None) -> str:
    """Where the reversal of a table with both senses of travel comes from."""
    if tip is not None:
        return f"effective tip radius {tip.r_eff_mm:.6f} mm, u = {tip.u_um:.3g} um, known from elsewhere"
    return (
        "no tip radius was given, and readings cannot tell it from a reversal: the mean reversal is taken as 0, and the"
        " table holds only how it changes along the axis; a stated tip radius shows it"
    )
