"""The entries of one evaluation in the history: one per placement, with the scale error and its repeatability."""

from __future__ import annotations

import datetime
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from stepgauge.conditions import require_statement, stored_conditions
from stepgauge.errors import InputError, naming
from stepgauge.evaluation.files import read_evaluation, stored_reversal_of_scale_um
from stepgauge.files.arrays import Array
from stepgauge.files.dates import moment_in_path, parse_moment
from stepgauge.recording.simulated import is_simulated

DateFrom = Literal["record", "file"]
UNNAMED = "(unnamed)"
ALONG_DEG = 10.0
"""A gauge closer than this to a machine axis measures that axis."""


@dataclass(frozen=True)
class HistoryColumn:
    """A column of the history: what it is and how it is printed; ``signed``: a limit holds for its size, and it drifts
    both ways; ``weight``: its share of the false warnings of drifts, the larger the sooner its drift is found."""

    name: str
    title: str
    unit: str
    signed: bool
    weight: float


QUANTITIES = {
    quantity.name: quantity
    for quantity in (
        HistoryColumn("scale_ppm", "scale error: slope of XM", "um/m", True, 0.5),
        HistoryColumn("reversal_um", "mean reversal XR", "um", True, 0.2),
        HistoryColumn("r_eff_change_um", "R_eff minus the first", "um", True, 0.1),
        HistoryColumn("band_um", "range of XM", "um", False, 0.1),
        HistoryColumn("worst_two_sigma_um", "largest 2s", "um", False, 0.1),
    )
}


@dataclass(frozen=True)
class HistoryEntry:
    """One placement of one evaluation.

    ``direction``: x, y, z, or the gauge axis as numbers where it lies along none; ``date_source``: ``evaluation``,
    ``path`` or ``file``; values are NaN where the evaluation has none. ``u_...``: standard uncertainties from
    repeatability alone (the certificate is common to all entries of a gauge and cancels in a trend).
    ``reversal_of_scale_um``: what of ``reversal_um`` the scale error shows of itself; ``s_um``: standard deviation of a
    probing, pooled over the ``s_faces`` faces with repeats, with its degrees of freedom ``s_dof``; ``simulated``: 1
    where no machine was measured; ``recording_sha256``: of what was measured.
    """

    path: str
    sha256: str
    measured_at: datetime.datetime
    date_source: str
    machine: str
    gauge_serial: str
    certificate: str
    placement: int
    direction: str
    cycles: int
    gauge_temperature_C: float
    span_mm: float
    scale_ppm: float
    u_scale_ppm: float
    reversal_um: float
    u_reversal_um: float
    r_eff_mm: float
    u_r_eff_change_um: float
    band_um: float
    worst_two_sigma_um: float
    reversal_of_scale_um: float = math.nan
    s_um: float = math.nan
    s_dof: float = math.nan
    s_faces: float = math.nan
    simulated: int = 0
    recording_sha256: str = ""


def read_entries(path: Path, root: Path, sha256: str, date_from: DateFrom = "record") -> list[HistoryEntry]:
    """The entries of an ``evaluation.json`` below ``root``.

    The date is that of the evaluation (``measured_at``, from the recording or ``evaluate --measured-at``), else one in
    the names of its folders (2026-03-02); ``date_from="file"``: else that of the file.

    Raises
    ------
    InputError
        no evaluation, nothing says when it was measured, or a condition of the readings prevents a statement
    """
    data = read_evaluation(path, with_inputs=False)
    require_statement(stored_conditions(data).without("dates"), path)
    name = path.relative_to(root).as_posix()
    moment, source = _moment(data, path, Path(name), date_from)
    try:
        return [make_entry(data, one, name, sha256, moment, source) for one in data["placements"]]
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(path, "not a complete evaluation", found=f"{type(error).__name__}: {error}") from None


def _moment(data: Mapping[str, Any], path: Path, name: Path, date_from: DateFrom) -> tuple[datetime.datetime, str]:
    written = data.get("measured_at") or (data.get("comments") or {}).get("measured_at")
    if written:
        return parse_moment(str(written), path), "evaluation"
    if (found := moment_in_path(name)) is not None:
        return found, "path"
    if date_from == "file":
        return datetime.datetime.fromtimestamp(path.stat().st_mtime).replace(microsecond=0), "file"
    raise InputError(
        path,
        "nothing says when this was measured",
        expected=naming(
            "measured_at",
            "date_from",
            words="evaluated with {}, a date in the folder's name, or {} file",
        ),
    )


def make_entry(
    data: Mapping[str, Any],
    one: Mapping[str, Any],
    name: str,
    sha256: str,
    moment: datetime.datetime,
    source: str,
) -> HistoryEntry:
    """The entry of a placement ``one`` of an evaluation, both as JSON types; ``source``: of the date."""
    faces = _Faces.of(one["faces"], one["r_eff_blocks"])
    (slope, u_slope), (reversal, u_reversal) = faces.slope_ppm(), faces.reversal_um()
    temperature = one["gauge_temperature_C"]
    return HistoryEntry(
        name,
        sha256,
        moment,
        source,
        str(data.get("machine") or (data.get("comments") or {}).get("machine") or UNNAMED),
        data["gauge"]["serial"],
        data["gauge"]["certificate"],
        int(one["placement"]),
        _direction(one["axis"]),
        int(one["cycles"][0]),
        _number(temperature),
        float(one["span_mm"]),
        slope,
        u_slope,
        reversal,
        u_reversal,
        float(one["r_eff_mm"]),
        faces.u_r_eff_um(),
        _number(one["band_um"]),
        _number(one["worst_two_sigma_um"]),
        stored_reversal_of_scale_um(one, data["r_eff_origin"]),
        *faces.repeats(),
        int(is_simulated(data.get("comments") or {})),
        _recordings(data),
    )


def _recordings(data: Mapping[str, Any]) -> str:
    """Checksums of the recordings that an evaluation was made from; empty where it does not say them."""
    names = {Path(one).name for one in str(data.get("recording", "")).split(", ")}
    made_from = [one for one in data.get("inputs", []) if isinstance(one, dict)]
    return " ".join(str(one.get("sha256", "")) for one in made_from if Path(str(one.get("file", ""))).name in names)


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)


def _direction(axis: list[float]) -> str:
    shares = np.abs(axis)
    best = int(shares.argmax())
    if shares[best] >= math.cos(math.radians(ALONG_DEG)):
        return "xyz"[best]
    sign = 1.0 if axis[best] > 0 else -1.0
    return "(" + " ".join(f"{round(sign * share, 2) + 0.0:.2f}" for share in axis) + ")"


@dataclass(frozen=True)
class _Faces:
    """The errors of the faces as they were probed, of which XM, XR and R_eff are weighted sums (Pahk & Kim, Eqs 1-13).

    So their uncertainties follow from the standard deviations of the faces. ``own_um``: XF of fronts, XB of backs;
    ``variance_um2``: of their means, from repeatability; ``tip``: weights of the tip diameter that was taken off backs.
    """

    position_mm: Array
    own_um: Array
    variance_um2: Array
    mean: Array
    reversal: Array
    tip: Array
    count: Array
    defined: NDArray[np.bool_]

    @classmethod
    def of(cls, rows: list[dict[str, Any]], r_eff_blocks: list[int]) -> _Faces:
        """From the rows of an evaluation and the numbers of the blocks that R_eff comes from."""
        front = np.array([row["face"] % 2 == 1 for row in rows])
        own = np.array([_number(row["xf_um" if row["face"] % 2 else "xb_um"]) for row in rows])
        sigma = np.array([_number(row["sf_um" if row["face"] % 2 else "sb_um"]) for row in rows])
        count = np.array([row["count"] for row in rows], float)
        mean, reversal = _mean_and_reversal(front)
        of_r_eff = np.isin([row["block"] for row in rows], r_eff_blocks)
        return cls(
            np.array([row["position_mm"] for row in rows], float),
            np.nan_to_num(own),
            np.where(count > 0, sigma**2 / np.maximum(count, 1.0), 0.0),
            mean,
            reversal,
            np.where(of_r_eff, np.where(front, -1.0, 1.0), 0.0) / max(1, len(r_eff_blocks)),
            count,
            np.isfinite([_number(row["xm_um"]) for row in rows]),
        )

    def slope_ppm(self) -> tuple[float, float]:
        """Slope of XM by least squares, um/m, and its standard uncertainty; NaN with fewer than two means."""
        if self.defined.sum() < 2:
            return math.nan, math.nan
        from_middle = np.where(self.defined, self.position_mm - self.position_mm[self.defined].mean(), 0.0)
        return self._sum(from_middle / (from_middle**2).sum() @ self.mean * 1e3)

    def reversal_um(self) -> tuple[float, float]:
        """Mean of XR, um, and its standard uncertainty; the tip diameter in it is that of the blocks of R_eff."""
        if not self.defined.any():
            return math.nan, math.nan
        return self._sum(self.defined / self.defined.sum() @ self.reversal - self.tip)

    def u_r_eff_um(self) -> float:
        """Standard uncertainty of R_eff from repeatability, um."""
        return self._sum(self.tip / 2.0)[1]

    def repeats(self) -> tuple[float, float, float]:
        """Standard deviation of a probing, um, its degrees of freedom, and the faces with repeats; NaN without any."""
        dof = np.where(np.isfinite(self.variance_um2), np.maximum(self.count - 1.0, 0.0), 0.0)
        if not dof.any():
            return math.nan, math.nan, math.nan
        variance = float((np.nan_to_num(self.variance_um2) * self.count * dof).sum() / dof.sum())
        return math.sqrt(variance), float(dof.sum()), float((dof > 0).sum())

    def _sum(self, weights: Array) -> tuple[float, float]:
        used = weights != 0.0
        variance = weights[used] ** 2 @ self.variance_um2[used]
        return float(weights @ self.own_um), float(np.sqrt(variance))


def _mean_and_reversal(front: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Matrices from the faces as probed to XM and to XR; rows without both neighbours are not used."""
    n = len(front)
    neighbours = np.zeros((n, n))
    inner = np.arange(1, n - 1)
    neighbours[inner, inner - 1] = neighbours[inner, inner + 1] = 0.5
    own = np.eye(n)
    side = np.where(front, 1.0, -1.0)[:, None]
    return (own + neighbours) / 2.0, side * (neighbours - own)


def select_machine(
    entries: Sequence[HistoryEntry],
    folder: str | Path,
    machine_name: str | None = None,
    gauge_serial: str | None = None,
) -> list[HistoryEntry]:
    """The entries of one machine (its name) measured with one gauge (its serial number).

    :class:`InputError` in the name of ``folder`` where there are none, or several and nobody said which.
    """
    if not entries:
        expected = naming("measured_at", "date_from", words="evaluated with {}, or {} file")
        raise InputError(folder, "no evaluation with a date", expected=expected)
    kept = list(entries)
    asked = (("machine_name", machine_name, "machine"), ("gauge_serial", gauge_serial, "gauge_serial"))
    for argument, value, name in asked:
        there = sorted({getattr(entry, name) for entry in kept})
        what = name.replace("_serial", "")
        if value is not None and value not in there:
            raise InputError(folder, f"no evaluation of {what} {value!r}", expected=", ".join(there))
        kept = [entry for entry in kept if value is None or getattr(entry, name) == value]
        if value is None and len(there) > 1:
            found, expected = ", ".join(there), naming(argument, words="one: {}")
            raise InputError(folder, f"evaluations of several {what}s", found=found, expected=expected)
    return kept
