"""The conditions of a recording of a step gauge, one placement at a time."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from stepgauge.conditions.certificate import certificate_conditions
from stepgauge.conditions.condition import Condition, Conditions
from stepgauge.conditions.drift import SURE, clock, drift_rate, drift_um
from stepgauge.conditions.duplicates import copied_cycles, copies_words
from stepgauge.conditions.faces import face_conditions
from stepgauge.conditions.outliers import left_out_words
from stepgauge.conditions.readings import Readings
from stepgauge.conditions.resolution import resolution_conditions
from stepgauge.conditions.temperature import temperature_conditions
from stepgauge.files.notation import number_ranges, rounded
from stepgauge.gauge.certified import Gauge
from stepgauge.recording import POSITION, Recording
from stepgauge.recording.face_readings import FaceStatistics

NOTABLE_UM = 0.1
"""Cosine error over the measured section, and drift within a cycle, from which they are remarked."""
LEAST_U_UM = 0.5
"""No calibration of a machine with a step gauge states a smaller expanded uncertainty of its largest error."""


def gauge_conditions(
    recording: Recording, gauge: Gauge, readings: Readings, seen: FaceStatistics, expanded_um: float | None = None
) -> Conditions:
    """What was measured, and under which conditions.

    Parameters
    ----------
    recording : the rows of one placement
    gauge : its certificate
    readings : the same rows along the gauge axis
    seen : their statistics by face of the used section
    expanded_um : expanded uncertainty that is stated of the results; default: at least that of certificate and scatter
    """
    matters_um = max(least_expanded_um(seen, gauge), expanded_um or 0.0)
    span_mm = float(np.ptp(gauge.position_mm[seen.faces[seen.count > 0] - 1]))
    return Conditions(
        (
            *_completeness(seen),
            *_duplicates(recording),
            *_outliers(readings),
            *_alignment(readings, span_mm, matters_um),
            *temperature_conditions(recording, gauge, span_mm, matters_um),
            *resolution_conditions(recording, readings.axis),
            *_drift(recording, readings, seen),
            *face_conditions(seen, gauge),
            *certificate_conditions(recording, gauge),
        )
    )


def least_expanded_um(seen: FaceStatistics, gauge: Gauge) -> float:
    """Expanded uncertainty (k = 2) of an error at the far end by certificate and scatter alone: what does not move a
    result by more than that does not matter."""
    faces = seen.faces[seen.count > 0]
    certified = np.hypot(gauge.u_um[faces[0] - 1], gauge.u_um[faces[-1] - 1])
    repeated = np.nan_to_num(seen.pooled_mm) * 1e3 * np.sqrt(2.0 / seen.count.max())
    return max(LEAST_U_UM, float(2.0 * np.hypot(certified, repeated)))


def _completeness(seen: FaceStatistics) -> Iterator[Condition]:
    """Faces not measured, or not as often as the others."""
    faces, count = seen.faces, seen.count
    missing = faces[count == 0]
    if missing.size:
        words = f"not measured: faces {number_ranges(missing.tolist())}; what needs them is left undefined"
        yield Condition("completeness", "contribution", words)
    measured = count[count > 0]
    if measured.size and measured.min() != measured.max():
        shown = number_ranges(faces[(count > 0) & (count < measured.max())].tolist())
        words = f"unequal cycles: {measured.min()} to {measured.max()} probings per face; fewer on faces {shown}"
        yield Condition("completeness", "contribution", words)
    if measured.size and measured.max() == 1:
        words = "a single cycle: there is no repeatability, 2s and u of R_eff are undefined"
        yield Condition("repeats", "contribution", words, "1 cycle", "2 or more")


def _duplicates(recording: Recording) -> Iterator[Condition]:
    """Cycles that repeat an earlier one in every reading."""
    columns = recording.columns
    found = copied_cycles(columns["placement"], columns["cycle"], recording.numbers(POSITION))
    if found:
        numbers = copies_words([cycle for _, cycle in found])
        words = (
            f"{numbers}: every reading is that of an earlier cycle: copied, or simulated without scatter; 2s and u of"
            " R_eff do not say how the machine repeats"
        )
        yield Condition("duplicates", "prevents", words, numbers, "every cycle measured")


def _outliers(readings: Readings) -> Iterator[Condition]:
    judged = readings.judged
    if judged.left_out and readings.kept is not None:
        size = max(abs(one.off_um) for one in judged.left_out)
        yield Condition("outliers", "corrected", left_out_words(judged.left_out), size_um=size)
    if judged.many:
        yield Condition("scatter", "contribution", judged.many)
    if judged.unclear:
        faces = f"face {', '.join(map(str, judged.unclear))}"
        words = f"the readings of {faces} contradict each other, and nothing tells which of them is right: probe again"
        yield Condition("outliers", "prevents", words, faces, "readings that agree, or three and more of them")


def _alignment(readings: Readings, span_mm: float, matters_um: float) -> Iterator[Condition]:
    """The line of the readings against the axis that is used: lengths are short by the cosine."""
    short_um = readings.tilt_rad**2 / 2.0 * span_mm * 1e3
    found = f"{readings.tilt_rad * 1e3:.2f} mrad"
    words = (
        f"the readings follow a line that is {found} off the axis that is used: a cosine error of up to"
        f" {short_um:.2f} um"
    )
    if short_um > matters_um:
        expected = "readings along the axis of the gauge, or its placement"
        yield Condition("alignment", "prevents", words, found, expected, short_um)
    elif short_um > NOTABLE_UM:
        yield Condition("alignment", "contribution", words, found, "the axis of the gauge", short_um)
    else:
        yield Condition("alignment", "met", f"the readings lie {found} off the axis that is used", found, "", short_um)


def _drift(recording: Recording, readings: Readings, seen: FaceStatistics) -> Iterator[Condition]:
    """A drift that the repeats show, with what it does to the errors along the gauge."""
    if readings.zeroed is not None:
        words = (
            f"every cycle was set to zero at face {readings.zeroed}: its scatter is in all other readings, and a drift"
            " from cycle to cycle does not show"
        )
        yield Condition("drift", "contribution", words)
        return
    time, unit = clock(recording)
    time = time if readings.kept is None else time[readings.kept]
    rate, u = drift_rate(readings.off_mm, readings.face, time)
    if not np.isfinite(rate):
        return
    size = drift_um(rate, seen, readings.face, time)
    found = f"{rounded(rate * 1e6, 3, plus=True)} nm/{unit}"
    if readings.drift_corrected:
        yield Condition("drift", "corrected", readings.drift_corrected)
    elif abs(rate) <= SURE * u or size < NOTABLE_UM:
        yield Condition("drift", "met", "no drift with time shows in the repeats", found, "", size)
    else:
        words = (
            f"the readings drift by {found} (u = {rounded(u * 1e6, 2)}), {rounded(size, 3)} um from the first to the"
            " last face of a cycle: it is in the errors along the gauge, unless it is corrected"
        )
        yield Condition("drift", "contribution", words, found, "no drift, or --correct-drift", size)
