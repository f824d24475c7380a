"""Difference of two evaluations of one gauge, with its own uncertainty: before and after a repair.

Errors are linear in the means of the faces. What both evaluations share, the certificate, cancels as far as the same
means enter with the same weights. Left are the repeatability of each (pooled over its faces), the coefficient of
expansion where the gauge had another temperature, and the certificate of faces that only one of them used.
Thermometers, alignment and fixture of the two set-ups are not counted.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError
from stepgauge.evaluation.face_errors import face_errors
from stepgauge.files.arrays import Array
from stepgauge.recording.face_readings import FaceStatistics
from stepgauge.standards.coverage import APPROXIMATELY_95, coverage_factor

ERRORS = ("xf", "xb", "xm", "xr")
SAME_AXIS_RAD = 0.01
"""Axes of the gauge farther apart than this are two axes of the machine."""
SAME_MM = 1e-6
COUNTED = (
    "repeatability of both (standard deviation of a probing, pooled over the faces of each evaluation)",
    "coefficient of expansion of the gauge, for the difference of its two temperatures",
)
CANCELS = (
    "The certificate of the gauge is common to both and cancels in the difference, except at faces that only one"
    " of them used."
)
NOT_COUNTED = "What may differ between two set-ups is not in U: thermometers, alignment and fixture of the gauge."


@dataclass(frozen=True)
class Difference:
    """Later minus earlier errors of one placement, arrays by error (xf, xb, xm, xr) and common face ``(k,)``, um.

    ``u_um``, ``expanded_um`` and ``k`` are NaN where no face of an evaluation was probed twice.
    """

    placement: int
    face: NDArray[np.int64]
    nominal_mm: Array
    before_um: dict[str, Array]
    after_um: dict[str, Array]
    u_um: dict[str, Array]
    expanded_um: dict[str, Array]
    k: dict[str, Array]
    notes: tuple[str, ...]

    def of(self, error: str) -> Array:
        """The difference of an error, um, ``(k,)``."""
        return self.after_um[error] - self.before_um[error]

    def significant(self, error: str) -> NDArray[np.bool_]:
        """Faces at which the difference is larger than its expanded uncertainty."""
        return np.abs(self.of(error)) > self.expanded_um[error]


def differences(
    before: Mapping[str, Any], after: Mapping[str, Any], names: tuple[str, str] = ("before", "after")
) -> list[Difference]:
    """Differences by placement of two evaluations, as ``evaluation.json`` has them.

    Raises
    ------
    InputError
        another gauge or certificate, another axis, reference face, origin of R_eff or number of placements
    """
    check_comparable(before, after, names[1])
    return [
        _difference(before, after, one, other)
        for one, other in zip(before["placements"], after["placements"], strict=True)
    ]


def check_comparable(before: Mapping[str, Any], after: Mapping[str, Any], name: str) -> None:
    """:class:`InputError` where the errors of two evaluations are not comparable; ``name``: of the later one."""
    for what, key in (("gauge: its serial number", "serial"), ("certificate", "certificate")):
        _same(name, f"another {what}", after["gauge"][key], before["gauge"][key])
    _same(
        name, "another origin of the effective radius (--r-eff-origin)", after["r_eff_origin"], before["r_eff_origin"]
    )
    _same(name, "another number of placements", len(after["placements"]), len(before["placements"]))
    for one, other in zip(before["placements"], after["placements"], strict=True):
        _check_placement(one, other, name)


def _same(name: str, what: str, found: object, expected: object) -> None:
    if found != expected:
        raise InputError(name, f"cannot be laid over the first evaluation: {what}", found=found, expected=expected)


def _check_placement(before: Mapping[str, Any], after: Mapping[str, Any], name: str) -> None:
    a, b = (np.asarray(one["axis"], float) for one in (before, after))
    if np.linalg.norm(np.cross(a, b)) > SAME_AXIS_RAD or a @ b < 0.0:
        what = f"the gauge of placement {after['placement']} lay along another axis"
        _same(name, what, np.round(b, 3).tolist(), np.round(a, 3).tolist())
    first, second = (_reference(one) for one in (before, after))
    _same(name, "its errors count from another face", second["face"], first["face"])
    known = {row["face"]: row["position_mm"] for row in before["faces"]}
    for row in after["faces"]:
        if abs(row["position_mm"] - known.get(row["face"], row["position_mm"])) > SAME_MM:
            what = f"another certified position of face {row['face']}, mm"
            _same(name, what, row["position_mm"], known[row["face"]])


def _reference(placement: Mapping[str, Any]) -> Mapping[str, Any]:
    """The first front that was measured."""
    return next(row for row in placement["faces"] if row["face"] % 2 and row["count"])


@dataclass(frozen=True)
class _Side:
    """One evaluation of one placement: faces, errors, weights of the face means ``(k, faces)``, repeatability."""

    rows: Sequence[Mapping[str, Any]]
    face: NDArray[np.int64]
    weights: dict[str, Array]
    sigma_um: float
    dof: int
    warmer_K: float

    def error(self, name: str) -> Array:
        return _column(self.rows, f"{name}_um")

    def repeat_variance(self, name: str) -> Array:
        """Variance of an error from the repeatability of the means that it is made of, um^2, ``(k,)``."""
        count = _column(self.rows, "count")
        each = np.divide(self.sigma_um**2, count, out=np.zeros_like(count), where=count > 0)
        return np.asarray((self.weights[name] ** 2) @ each, dtype=float)

    def expansion_um_K(self, name: str) -> Array:
        """Change of an error with the coefficient of expansion, um per 1/K, ``(k,)``."""
        return np.asarray(-self.weights[name] @ (_column(self.rows, "position_mm") * 1e3) * self.warmer_K, dtype=float)


def _side(evaluation: Mapping[str, Any], placement: Mapping[str, Any]) -> _Side:
    rows = placement["faces"]
    face = np.array([row["face"] for row in rows], np.int64)
    count = np.array([row["count"] for row in rows], np.int64)
    weights = _weights(face, count, evaluation["r_eff_origin"])
    deviation = np.where(face % 2 == 1, _column(rows, "sf_um"), _column(rows, "sb_um"))
    freedom = np.where((count > 1) & np.isfinite(deviation), count - 1, 0)
    dof = int(freedom.sum())
    sigma = math.sqrt(float((freedom * np.nan_to_num(deviation) ** 2).sum()) / dof) if dof else math.nan
    warm = placement["gauge_temperature_C"]
    warmer = 0.0 if warm is None else warm - evaluation["gauge"]["reference_temperature_C"]
    return _Side(rows, face, weights, sigma, dof, warmer)


def _weights(face: NDArray[np.int64], count: NDArray[np.int64], origin: Any) -> dict[str, Array]:
    """How the mean of each face enters each error, ``(k errors, k means)``; NaN where the error is not defined."""
    unit_mm = np.where(count > 0, np.eye(len(face)), np.nan) * 1e-3
    found = face_errors(FaceStatistics(face, count, unit_mm, np.zeros_like(unit_mm)), np.zeros(len(face)), origin)
    by_mean = {"xf": found.xf_um, "xb": found.xb_um, "xm": found.xm_um, "xr": found.xr_um}
    return {name: np.where(count[None, :] > 0, one.T, 0.0) for name, one in by_mean.items()}


def _column(rows: Sequence[Mapping[str, Any]], name: str) -> Array:
    return np.array([np.nan if row.get(name) is None else row[name] for row in rows], float)


def _difference(before: Mapping[str, Any], after: Mapping[str, Any], one: Any, other: Any) -> Difference:
    sides = (_side(before, one), _side(after, other))
    face, *places = np.intersect1d(sides[0].face, sides[1].face, return_indices=True)
    alpha_u = float(before["gauge"].get("expansion_uncertainty_per_K") or 0.0)
    found: dict[str, dict[str, Array]] = {"u": {}, "U": {}, "k": {}, "before": {}, "after": {}}
    for name in ERRORS:
        repeats = [side.repeat_variance(name)[at] for side, at in zip(sides, places, strict=True)]
        expansion = [side.expansion_um_K(name)[at] for side, at in zip(sides, places, strict=True)]
        rest = (alpha_u * (expansion[1] - expansion[0])) ** 2 + _certificate(name, sides, places)
        u, k = _expanded(repeats, [side.dof for side in sides], rest)
        found["u"][name], found["k"][name], found["U"][name] = u, k, k * u
        found["before"][name], found["after"][name] = (s.error(name)[at] for s, at in zip(sides, places, strict=True))
    nominal = _column(sides[0].rows, "nominal_mm")[places[0]]
    notes = tuple(_notes(one, other, sides))
    return Difference(
        one["placement"], face, nominal, found["before"], found["after"], found["u"], found["U"], found["k"], notes
    )


def _certificate(name: str, sides: tuple[_Side, _Side], places: Sequence[NDArray[np.intp]]) -> Array:
    """Variance from certified positions that do not enter both errors with the same weights, um^2, ``(k,)``."""
    every = np.union1d(sides[0].face, sides[1].face)
    weight = np.zeros((2, len(places[0]), len(every)))
    u_um = np.zeros(len(every))
    for i, (side, at) in enumerate(zip(sides, places, strict=True)):
        columns = np.searchsorted(every, side.face)
        weight[i][:, columns] = side.weights[name][at]
        u_um[columns] = np.nan_to_num(_column(side.rows, "u_certificate_um"))
    return np.asarray(((weight[1] - weight[0]) ** 2) @ u_um**2, dtype=float)


def _expanded(repeats: Sequence[Array], dof: Sequence[int], rest: Array) -> tuple[Array, Array]:
    """Standard uncertainty and coverage factor by Welch and Satterthwaite (JCGM 100, G.4)."""
    if min(dof) < 1:
        undefined = np.full(len(rest), np.nan)
        return undefined, undefined
    variance = repeats[0] + repeats[1] + rest
    with np.errstate(divide="ignore", invalid="ignore"):
        freedom = variance**2 / sum(one**2 / n for one, n in zip(repeats, dof, strict=True))
    k = [coverage_factor(float(n) if np.isfinite(n) else math.inf, APPROXIMATELY_95) for n in freedom]
    return np.sqrt(variance), np.array(k)


def _notes(one: Any, other: Any, sides: tuple[_Side, _Side]) -> list[str]:
    notes = []
    moved = np.linalg.norm(np.subtract(other["origin_mm"], one["origin_mm"]))
    if moved > 1.0:
        notes.append(f"placement {one['placement']}: face {sides[0].face[0]} lay {moved:.0f} mm apart in the machine")
    warm = [placement["gauge_temperature_C"] for placement in (one, other)]
    if (warm[0] is None) != (warm[1] is None):
        which = "first" if warm[0] is None else "later"
        notes.append(f"placement {one['placement']}: the {which} evaluation has no temperature of the gauge")
    if min(side.dof for side in sides) < 1:
        notes.append(f"placement {one['placement']}: no face was probed twice in one of them, so that U is not known")
    return notes
