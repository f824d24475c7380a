"""The conditions of a recording of a step gauge, one placement at a time."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from stepgauge.conditions.condition import Condition, Conditions
from stepgauge.conditions.duplicates import copied_cycles, copies_words
from stepgauge.conditions.outliers import left_out_words, odd_blocks, odd_faces
from stepgauge.conditions.readings import Readings
from stepgauge.files.notation import rounded
from stepgauge.gauge.certified import Gauge
from stepgauge.recording import POSITION, Recording
from stepgauge.recording.by_face import FaceStatistics

Array = NDArray[np.float64]
REFERENCE_C = 20.0
"""Reference temperature of dimensions, ISO 1."""
NOTABLE_UM = 0.1
"""Cosine error over the measured section from which it is remarked."""


def gauge_conditions(recording: Recording, gauge: Gauge, readings: Readings, seen: FaceStatistics) -> Conditions:
    """What was measured, and under which conditions.

    Parameters
    ----------
    recording : the rows of one placement
    gauge : its certificate
    readings : the same rows along the gauge axis
    seen : their statistics by face of the used section
    """
    found = [
        *_completeness(seen),
        *_duplicates(recording),
        *_temperature(recording, gauge, seen),
        *_outliers(readings),
        *_alignment(readings, seen, gauge),
        *_blocks_and_faces(seen, gauge),
        *_certificate(gauge),
    ]
    return Conditions(tuple(found))


def _completeness(seen: FaceStatistics) -> Iterator[Condition]:
    """Faces not measured, or not as often as the others."""
    faces, count = seen.faces, seen.count
    missing = faces[count == 0]
    if missing.size:
        words = f"not measured: faces {', '.join(map(str, missing))}; what needs them is left undefined"
        yield Condition("completeness", "contribution", words)
    measured = count[count > 0]
    if measured.size and measured.min() != measured.max():
        fewer = faces[(count > 0) & (count < measured.max())]
        shown = ", ".join(map(str, fewer[:10])) + (", ..." if fewer.size > 10 else "")
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


def _temperature(recording: Recording, gauge: Gauge, seen: FaceStatistics) -> Iterator[Condition]:
    """What it means that nobody recorded how warm the gauge was."""
    if "gauge_temperature_C" in recording.columns:
        return
    span_mm, table = _span_mm(seen, gauge), gauge.table
    per_K = table.expansion_per_K * span_mm * 1e3
    words = (
        f"the temperature of the gauge is not recorded: it is taken as {table.reference_temperature_C:g} deg C, and"
        f" each K that it was warmer or colder is an error of {rounded(per_K, 2)} um over {span_mm:.0f} mm"
    )
    yield Condition("temperature", "contribution", words, "not recorded", "gauge_temperature_C")


def _span_mm(seen: FaceStatistics, gauge: Gauge) -> float:
    return float(np.ptp(gauge.position_mm[seen.faces[seen.count > 0] - 1]))


def _outliers(readings: Readings) -> Iterator[Condition]:
    if readings.left_out and readings.kept is not None:
        size = max(abs(one.off_um) for one in readings.left_out)
        yield Condition("outliers", "corrected", left_out_words(readings.left_out), size_um=size)
    if readings.judged.many:
        yield Condition("scatter", "contribution", readings.judged.many)
    if readings.judged.unclear:
        faces = f"face {', '.join(map(str, readings.judged.unclear))}"
        words = f"the readings of {faces} contradict each other, and nothing tells which of them is right: probe again"
        yield Condition("outliers", "prevents", words, faces, "readings that agree, or three and more of them")


def _alignment(readings: Readings, seen: FaceStatistics, gauge: Gauge) -> Iterator[Condition]:
    """The line of the readings against the axis that is used: lengths are short by the cosine."""
    short_um = readings.tilt_rad**2 / 2.0 * _span_mm(seen, gauge) * 1e3
    if short_um > NOTABLE_UM:
        found = f"{readings.tilt_rad * 1e3:.2f} mrad"
        words = (
            f"the readings follow a line that is {found} off the axis that is used: a cosine error of up to"
            f" {short_um:.2f} um"
        )
        yield Condition("alignment", "contribution", words, found, "the axis of the gauge", short_um)


def _blocks_and_faces(seen: FaceStatistics, gauge: Gauge) -> Iterator[Condition]:
    """Faces and blocks that stand out in every cycle."""
    repeat_um = np.nan_to_num(seen.deviation_mm) * 1e3 / np.sqrt(np.maximum(seen.count, 1))
    u_um = np.hypot(gauge.u_um[seen.faces - 1], repeat_um)
    blocks = odd_blocks(seen.faces, seen.mean_mm * 1e3, u_um)
    if blocks:
        shown = ", ".join(f"block {block} by {rounded(um, 3, plus=True)} um" for block, um in blocks[:10])
        words = f"read longer (+) or shorter (-) than the other blocks: {shown}: its faces, or its certificate"
        yield Condition("faces", "contribution", words, size_um=max(abs(um) for _, um in blocks))
    faces = odd_faces(seen.faces, gauge.position_mm[seen.faces - 1], seen.mean_mm * 1e3, u_um)
    if faces:
        shown = ", ".join(f"face {face} ({rounded(um, 3, plus=True)} um)" for face, um in faces[:10])
        why = "the face, its certificate, or the scale there; repeats cannot tell"
        words = f"off the line between their neighbours: {shown}: {why}"
        yield Condition("faces", "contribution", words, size_um=max(abs(um) for _, um in faces))


def _certificate(gauge: Gauge) -> Iterator[Condition]:
    reference = gauge.table.reference_temperature_C
    if reference != REFERENCE_C:
        words = f"the certificate holds at {reference:g} deg C, not at {REFERENCE_C:g} (ISO 1)"
        yield Condition("certificate", "contribution", words, f"{reference:g} deg C", f"{REFERENCE_C:g} deg C")
