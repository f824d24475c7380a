"""The readings of one placement along the gauge axis, checked, with those named that their repeats contradict."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stepgauge.conditions.drift import clock, drift_rate
from stepgauge.conditions.outliers import NOTHING_JUDGED, ExcludedReading, Judged, judge
from stepgauge.conditions.resolution import resolution_um
from stepgauge.files.arrays import Array
from stepgauge.files.notation import rounded
from stepgauge.gauge.certified import Gauge
from stepgauge.recording import APPROACH, POSITION, Recording
from stepgauge.recording.corrected import corrected_radius_mm, zeroed_face
from stepgauge.recording.face_readings import FaceReadings
from stepgauge.recording.identity import (
    axis_from_approaches,
    certified_mm,
    check_approaches,
    check_positions,
    check_tip,
)
from stepgauge.recording.rows import check_beside, check_rows, dot, tilt_rad


@dataclass(frozen=True)
class Readings:
    """The rows of one placement, ready for :mod:`stepgauge.evaluation.face_errors`.

    ``axis``: the gauge axis that positions are projected on; ``by_face``: positions along it minus certified positions
    at the recorded gauge temperature; ``faces``: of the used section. ``judged``: readings that their repeats
    contradict; ``kept``: rows of the recording that are used, None for all; ``tilt_rad``: angle of the line of the
    readings to the axis; ``drift_corrected``: the drift that was taken off, in words, and ``drift_u_mm``: what a
    standard uncertainty of its rate moves every reading by, ``(n,)``; ``corrected_mm``: tip radius by which the points
    had been corrected before they were turned back into tip centres, 0 where they had not; ``zeroed``: the face at
    which every cycle was set to zero.
    """

    axis: Array
    by_face: FaceReadings
    faces: NDArray[np.int64]
    judged: Judged = NOTHING_JUDGED
    kept: NDArray[np.intp] | None = None
    tilt_rad: float = 0.0
    drift_corrected: str = ""
    drift_u_mm: Array | None = None
    corrected_mm: float = 0.0
    zeroed: int | None = None

    @property
    def left_out(self) -> tuple[ExcludedReading, ...]:
        """Readings that their repeats contradict."""
        return self.judged.left_out

    @property
    def face(self) -> NDArray[np.int64]:
        """Number of the face of each reading, (n,), from 1."""
        return self.by_face.face

    @property
    def off_mm(self) -> Array:
        """Position along the gauge minus certified position of each reading, (n,) in mm."""
        return self.by_face.off_mm


def project_readings(
    recording: Recording,
    gauge: Gauge,
    section: tuple[int, int],
    axis: Array | None = None,
    leave_out: bool = True,
    correct_drift: bool = False,
) -> Readings:
    """The readings of one placement along the gauge axis, checked against gauge and side of the faces.

    ``leave_out``: whether those that their repeats contradict are left out (a standard judges what was measured);
    ``correct_drift``: whether a drift with time that the repeats show is taken off.
    """
    face = recording.columns["face"]
    approach = recording.numbers(APPROACH)
    axis = axis_from_approaches(approach, face, recording.path) if axis is None else axis
    check_approaches(dot(approach, axis), face, recording.path)
    position = recording.numbers(POSITION)
    along = dot(position, axis)
    faces = np.arange(2 * section[0] - 1, 2 * section[1] + 1)
    by_face = FaceReadings.of(along - certified_mm(recording, gauge, face), face, int(faces[-1]) + 1)
    check_positions(by_face, along, gauge, recording.path)
    check_beside(position, axis, face, gauge, recording.path)
    check_tip(by_face, recording)
    check_rows(recording)
    tilt = tilt_rad(position, axis, face, gauge)
    readings = Readings(
        *(axis, by_face, faces),
        tilt_rad=tilt,
        corrected_mm=corrected_radius_mm(recording) or 0.0,
        zeroed=zeroed_face(along, face, recording.columns["cycle"]),
    )
    judged = _judged(readings, recording, leave_out)
    return _without_drift(judged, recording) if correct_drift else judged


def _judged(readings: Readings, recording: Recording, leave_out: bool) -> Readings:
    """The readings with those named, and left out if asked, that their repeats contradict."""
    cycle, placement = recording.columns["cycle"], int(recording.columns["placement"][0])
    found = judge(readings.by_face, cycle, placement, 0.0)
    if not found.nothing:  # only then the resolution matters, which takes time to find
        step_mm = 1e-3 * resolution_um(recording.numbers(POSITION), readings.axis)
        found = judge(readings.by_face, cycle, placement, step_mm)
    if not found.left_out or not leave_out:
        return replace(readings, judged=found)
    kept = np.setdiff1d(np.arange(len(readings.face)), [one.row for one in found.left_out])
    by_face = FaceReadings.of(readings.off_mm[kept], readings.face[kept], len(readings.by_face.count))
    return replace(readings, by_face=by_face, judged=found, kept=kept)


def _without_drift(readings: Readings, recording: Recording) -> Readings:
    """The readings without the rate that all faces have in common, about the mean time of all."""
    if readings.zeroed is not None:
        return readings
    time, unit = clock(recording)
    time = time if readings.kept is None else time[readings.kept]
    rate, u = drift_rate(readings.off_mm, readings.face, time)
    if not np.isfinite(rate):
        return readings
    since = time - time.mean()
    by_face = FaceReadings.of(readings.off_mm - rate * since, readings.face, len(readings.by_face.count))
    words = f"a drift of {rounded(rate * 1e6, 3, plus=True)} nm/{unit} (u = {rounded(u * 1e6, 2)}) was taken off"
    return replace(readings, by_face=by_face, drift_corrected=words, drift_u_mm=u * since)
