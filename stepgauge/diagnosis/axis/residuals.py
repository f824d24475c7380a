"""A recording of an axis as residuals: what the diagnosis of a gauge explains, with targets in place of faces.

Every target is two faces at one place, the first for travel towards +, the second for travel towards -; the line of the
targets is machine x. There is no machine file: the priors were made for CMMs, so the axis is scaled to the size of one
(:class:`Scaling`), and its repeatability is estimated from readings that follow one another. So nothing depends on the
units or the size of an axis. Of distances between stations whose places are not known, what an adjustment may move are
nuisance columns.
"""

from __future__ import annotations

import datetime
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from stepgauge.axis.order import drift_columns, is_order_known
from stepgauge.axis.recording import STATIONS, AxisRecording, places_of
from stepgauge.axis.sensors import recording_of
from stepgauge.diagnosis.priors import MachineKind, shipped_priors
from stepgauge.diagnosis.residuals import FEWEST_ROWS, Residuals
from stepgauge.diagnosis.wording.aliases import even
from stepgauge.effects import Probings, Setting
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.gauge.certified import CertificateTable, Gauge, GaugeTable
from stepgauge.machine.file import Machine, MachineTable, Travel
from stepgauge.physics.robust import mad_sigma
from stepgauge.probes.schema import ConstantTable
from stepgauge.recording import APPROACH, POSITION
from stepgauge.recording.columns import OPTIONAL

TYPICAL_MM, TYPICAL_S = 300.0, 3600.0
"""Span of a step gauge on a CMM and duration of a run, for which the priors are made."""
ROUNDING = 1e-9
"""Share of a reading that is the last digits of the computer."""
FINE = 0.03
"""Resolution over the scatter of a reading that does not show."""
FEWEST_SCANNED, STANDING = 40, 0.1
"""Readings in one pass from which an axis counts as scanned, and the share of them that may be where the last was."""
IN_LINE = 1e-2
"""Share of a distance by which the stations of a line may contradict one another: slopes and offsets, no corners."""


@dataclass(frozen=True)
class Scaling:
    """``position``, ``deviation``, ``time``: what one mm or deg, one um or arcsec, one second is computed as."""

    position: float
    deviation: float
    time: float = 1.0


@dataclass(frozen=True)
class AxisData:
    """A recording with what it is computed as."""

    recording: AxisRecording
    residuals: Residuals
    scaling: Scaling
    repeatability: float


def axis_data(recording: AxisRecording, usual: MachineKind | None = None) -> AxisData:
    """The residuals of a recording; :class:`InputError` where it is too small to say anything.

    ``usual``: what is usual of the kind of axis, where it is stated, which brings sizes of its own.
    """
    if len(recording) < FEWEST_ROWS:
        found, expected = f"{len(recording)} readings", f"at least {FEWEST_ROWS}"
        raise InputError(recording.path, "the recording is too small for a diagnosis", found=found, expected=expected)
    units, frame = recording.units, recording.frame
    target = _targets(recording) * units.base_position
    reading = frame["reading"].to_numpy(float) * units.base_position * _base_deviations(recording)
    origin = _origins(recording) * units.base_position
    away = reading - (target + origin) * _base_deviations(recording)
    way = frame["way"].to_numpy(float)
    index = places_of(target)
    places = np.bincount(index, target) / np.bincount(index)
    face = 2 * index + np.where(way > 0, 1, 2)
    repeatability = scatter_of_neighbours(away, frame["placement"].to_numpy(), face)
    typical_um = shipped_priors().sizes.repeatability_um
    duration = float(np.ptp(frame["time_s"])) if "time_s" in frame else 0.0
    usual = usual or MachineKind()
    scaling = Scaling(
        _scale(TYPICAL_MM, usual.span or float(np.ptp(places))),
        _scale(typical_um, usual.repeatability or repeatability),
        _scale(TYPICAL_S, usual.duration_s or duration),
    )
    u_um = np.zeros(len(places))
    if "u_target" in frame:
        u_um[index] = frame["u_target"].to_numpy(float) * units.base_deviation * scaling.deviation
    gauge = _gauge(recording, places * scaling.position, u_um)
    shift = (placed_targets(recording) * units.base_position - target) * scaling.position
    machine = _machine(recording, places[index] * scaling.position + shift, repeatability * scaling.deviation)
    rows = _rows(recording, face, reading, scaling)
    um = away * scaling.deviation * way
    residuals = _residuals(recording, rows, um, way, gauge, machine, scaling, shift)
    step_um = resolution(reading, repeatability) * scaling.deviation
    ordered = is_order_known(recording)
    drift_um = None if ordered else drift_columns(recording, away) * scaling.deviation * way
    known = replace(residuals, step_um=step_um, ordered=ordered, lengths_um=drift_um)
    return AxisData(recording, known, scaling, repeatability)


def resolution(reading: Array, scatter: float) -> float:
    """The step of which all readings are multiples, in their unit; 0 for none that shows beside their scatter."""
    met = np.unique(reading)
    steps = np.diff(met)
    steps = steps[steps > ROUNDING * max(float(np.abs(met).max()), 1e-300)]
    if not steps.size:
        return 0.0
    step = float(steps.min())
    off = (met - met[0]) / step
    return step if step > FINE * scatter and np.abs(off - np.rint(off)).max() < FINE else 0.0


def _targets(recording: AxisRecording) -> Array:
    """The target of every row; of distances what the fitted places give, of a spot the first reading."""
    if recording.form == "axis":
        return recording.frame["target"].to_numpy(float)
    reading = recording.frame["reading"]
    if recording.form == "spot":
        return np.full(len(reading), float(reading.iloc[0]))
    return fitted_distances(recording)


def _origins(recording: AxisRecording) -> Array:
    """Where every placement of targets begins by its readings, one value per row; nought for what has none.

    Nothing is known of an origin, and what is computed from deviations of um bears none of 100 mm.
    """
    frame = recording.frame
    if recording.form != "axis":
        return np.zeros(len(frame))
    return (frame["reading"] - frame["target"]).groupby(frame["placement"]).transform("median").to_numpy(float)


def placed_targets(recording: AxisRecording) -> Array:
    """Where along the axis the target of every row lies, in units of position, from the targets of the first placement.

    A probe reads the position of its own axis: another placement of targets begins where it reads them. Another sensor
    may begin to count anywhere, and its targets are those of the axis.
    """
    target, origin = _targets(recording), _origins(recording)
    return target + origin - origin[0] if recording.sensor == "touch" else target


def _base_deviations(recording: AxisRecording) -> float:
    """Base deviations (um, arcsec) in a base position (mm, deg)."""
    units = recording.units
    return units.deviations_per_position * units.base_deviation / units.base_position


def scatter_of_neighbours(away: Array, placement: NDArray[np.int64], face: NDArray[np.int64]) -> float:
    """Standard deviation of a reading, from the differences of successive ones at the same target.

    What changes slowly cancels (J. von Neumann, Ann. Math. Statist. 12 (1941) 367); the median bears single wild
    readings. Without repeats, successive readings along the axis; of readings that are all the same what is usual.
    """
    order = np.lexsort((np.arange(len(face)), face, placement))
    same = (np.diff(face[order]) == 0) & (np.diff(placement[order]) == 0)
    steps = np.diff(away[order])[same] if same.sum() >= FEWEST_ROWS // 2 else np.diff(away)
    median = mad_sigma(steps) / np.sqrt(2.0)
    root = float(np.sqrt((steps**2).mean() / 2.0))
    least = ROUNDING * float(np.abs(away).max())
    found = (one for one in (median, root, float(np.std(away))) if one > least)
    return next(found, shipped_priors().sizes.repeatability_um)


def _scale(typical: float, value: float) -> float:
    """The factor from a value to what is typical."""
    return typical / value if value > 0.0 else 1.0


def _gauge(recording: AxisRecording, places: Array, u_um: Array) -> Gauge:
    """The targets as a gauge of two faces each."""
    table = GaugeTable.model_construct(
        name=recording.comments.get("artefact", "targets"),
        serial="-",
        material="-",
        expansion_per_K=0.0,
        expansion_uncertainty_per_K=0.0,
        reference_temperature_C=20.0,
        block_width_mm=1.0,
        block_height_mm=1.0,
        rail_height_mm=1.0,
        faces="",
    )
    certificate = CertificateTable.model_construct(
        number="-",
        laboratory="-",
        date=datetime.date(1, 1, 1),
        coverage_factor=1.0,
    )
    both = np.repeat(places, 2)
    return Gauge(table, certificate, both, both, np.repeat(u_um, 2))


def _machine(recording: AxisRecording, places: Array, repeatability_um: float) -> Machine:
    """A machine of one axis whose travel is that of the targets, without errors."""
    travel = (float(places.min()) - 1e-6, float(places.max()) + 1e-6)
    table = MachineTable.model_construct(
        name=recording.comments.get("axis", "axis"),
        travel_mm=Travel.model_construct(x=travel, y=(-1.0, 1.0), z=(-1.0, 1.0)),
        repeatability_um=repeatability_um,
        measuring_speed_mm_s=1.0,
        travel_speed_mm_s=1.0,
        scale_expansion_per_K=0.0,
    )
    probe = ConstantTable.model_validate({"tip_radius_mm": 1.0, "pretravel_um": 0.0, "stylus_diameter_mm": 1.0})
    return Machine(table, probe)


def _rows(recording: AxisRecording, face: NDArray[np.intp], reading: Array, scaling: Scaling) -> pd.DataFrame:
    """Rows as a recording of a gauge has them; ``reading``: in um or arcsec, whose last digit is looked at."""
    frame = recording.frame
    columns: Mapping[str, Any] = {
        "placement": frame["placement"].to_numpy(np.int64),
        "cycle": frame["cycle"].to_numpy(np.int64),
        "face": face.astype(np.int64),
        **dict.fromkeys(POSITION, 0.0),
        **dict.fromkeys(APPROACH, 0.0),
    }
    rows = pd.DataFrame(columns, index=range(len(frame)))
    rows["x_mm"] = reading * scaling.deviation * 1e-3
    rows["approach_i"] = frame["way"].to_numpy(float)
    if "time_s" in frame:
        rows["time_s"] = frame["time_s"].to_numpy(float) * scaling.time
    for name in recording.covariates:
        rows[f"{name} recorded" if name in OPTIONAL[3:] or name in rows else name] = frame[name].to_numpy(float)
    return rows


def _residuals(
    recording: AxisRecording,
    rows: pd.DataFrame,
    um: Array,
    way: Array,
    gauge: Gauge,
    machine: Machine,
    scaling: Scaling,
    shift_mm: Array,
) -> Residuals:
    """``shift_mm (n,)``: how far along the axis the placement of a row lies from the first one."""
    numbers, placement = np.unique(rows["placement"], return_inverse=True)
    turns = recording.form == "axis" and recording.units.axis == "rotary"
    face = rows["face"].to_numpy()
    seen = rows.assign(x_mm=gauge.position_mm[face - 1] + shift_mm)
    steps = even(seen["x_mm"]) if recording.form == "axis" else None
    setting = replace(
        Setting.of(machine, gauge, {int(number): np.array([1.0, 0.0, 0.0]) for number in numbers}),
        recording=recording_of(recording.form, turns),
        turn_mm=360.0 * scaling.position if turns else None,
        step_mm=None if steps is None else steps.spacing,
    )
    speed = scanning_speed(seen)
    if speed is not None and "speed_mm_s" not in rows:
        rows, seen = rows.assign(speed_mm_s=speed), seen.assign(speed_mm_s=speed)
    unknown = station_columns(recording) if recording.form == "distances" else None
    return Residuals(um, way, placement, face, Probings(seen, setting), rows, gauge, machine, unknown)


def scanning_speed(rows: pd.DataFrame) -> Array | None:
    """Speed at every reading, mm/s ``(n,)``, of an axis that is read while it moves; None for any other.

    From the neighbours in time of the same pass: central differences.
    """
    if "time_s" not in rows or rows["time_s"].nunique() < len(rows):
        return None
    order = np.argsort(rows["time_s"].to_numpy(), kind="stable")
    x, t, way = (rows[name].to_numpy(float)[order] for name in ("x_mm", "time_s", "approach_i"))
    passes = np.split(np.arange(len(x)), np.flatnonzero(np.diff(way)) + 1)
    standing = float((np.abs(np.diff(x)) < ROUNDING * max(float(np.ptp(x)), 1e-300)).mean())
    if min(map(len, passes)) < FEWEST_SCANNED or standing > STANDING:
        return None
    speed = np.empty(len(x))
    for one in passes:
        speed[order[one]] = np.abs(np.gradient(x[one], t[one]))
    return speed


def fitted_distances(recording: AxisRecording) -> Array:
    """What every distance would be between first guesses of the stations' places, in units of position, ``(n,)``."""
    known = mean_distances(recording.frame)
    places = line_places(known)
    ends = zip(*(recording.frame[name].astype(str) for name in STATIONS), strict=True)
    if places is None:
        return np.array([known[min(pair), max(pair)] for pair in ends])
    return np.array([abs(places[far] - places[near]) for near, far in ends])


def station_columns(recording: AxisRecording) -> Array:
    """Columns ``(p, n)``: of what every distance changes with the place of each station but one.

    Where the stations do not lie in a line, or only the pairs' distances are there, every pair has a distance of its
    own: only what changes between its repeats can be told.
    """
    frame = recording.frame
    ends = [frame[name].to_numpy(str) for name in STATIONS]
    places = line_places(mean_distances(frame))
    if places is None:
        pair = np.unique(np.sort(np.stack(ends), axis=0), axis=1, return_inverse=True)[1].ravel()
        return (pair == np.arange(pair.max() + 1)[:, None]).astype(float)
    names = sorted(places)
    sign = np.sign([places[far] - places[near] for near, far in zip(*ends, strict=True)])
    columns = [sign * ((ends[1] == name).astype(float) - (ends[0] == name)) for name in names[1:]]
    return np.array(columns)


def mean_distances(frame: pd.DataFrame) -> dict[tuple[str, str], float]:
    """Mean reading of every pair, by the names of its stations in order."""
    found: dict[tuple[str, str], list[float]] = {}
    for one, other, reading in zip(*(frame[name].astype(str) for name in STATIONS), frame["reading"], strict=True):
        found.setdefault((min(one, other), max(one, other)), []).append(float(reading))
    return {pair: float(np.mean(readings)) for pair, readings in found.items()}


def line_places(distance: Mapping[tuple[str, str], float]) -> dict[str, float] | None:
    """Places of the stations along a line from one end of the longest distance; None where they lie in no line."""
    (start, end), longest = max(distance.items(), key=lambda one: one[1])
    places = {start: 0.0, end: longest}
    left = sorted({name for pair in distance for name in pair} - set(places))
    while left:
        name = max(left, key=lambda one: len(_seen_from(one, places, distance)))
        seen = _seen_from(name, places, distance)
        if not seen:
            return None
        tries = [places[other] + sign * d for other, d in seen.items() for sign in (1.0, -1.0)]
        off, best = min((max(abs(abs(at - places[o]) / d - 1.0) for o, d in seen.items()), at) for at in tries)
        if off > IN_LINE:
            return None
        places[name] = best
        left.remove(name)
    return places


def _seen_from(name: str, places: Mapping[str, float], distance: Mapping[tuple[str, str], float]) -> dict[str, float]:
    """Distances from a station to those that are placed."""
    pairs = {other: (min(name, other), max(name, other)) for other in places}
    return {other: distance[pair] for other, pair in pairs.items() if pair in distance}
