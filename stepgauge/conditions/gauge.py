"""The conditions of a recording of a step gauge, one placement at a time."""

from __future__ import annotations

from collections.abc import Iterator
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from stepgauge.conditions.certificate import certificate_conditions
from stepgauge.conditions.condition import Condition, Conditions, State
from stepgauge.conditions.drift import SURE, clock, drift_rate, drift_um
from stepgauge.conditions.duplicates import copied_cycles, copies_words
from stepgauge.conditions.outliers import left_out_words, odd_blocks, odd_faces
from stepgauge.conditions.readings import Readings
from stepgauge.conditions.resolution import resolution_conditions
from stepgauge.files.arrays import Array
from stepgauge.files.notation import number_ranges, rounded
from stepgauge.gauge.certified import Gauge
from stepgauge.recording import POSITION, Recording
from stepgauge.recording.conventions import REFERENCE_C, convention_of, convention_words, needs_gauge_temperature
from stepgauge.recording.face_readings import FaceStatistics

NOTABLE_UM = 0.1
"""Cosine error over the measured section, drift within a cycle, and what a convention that nobody states makes, from
which they are remarked."""
LEAST_U_UM = 0.5
"""No calibration of a machine with a step gauge states a smaller expanded uncertainty of its largest error."""


def gauge_conditions(recording: Recording, gauge: Gauge, readings: Readings, seen: FaceStatistics) -> Conditions:
    """What was measured, and under which conditions.

    Parameters
    ----------
    recording : the rows of one placement
    gauge : its certificate
    readings : the same rows along the gauge axis
    seen : their statistics by face of the used section
    """
    matters_um = least_expanded_um(seen, gauge)
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


BY_CHANCE = 1e-3
"""Probability that any face of a recording of normal scatter is remarked."""
LEAST_2S_UM = 1.0
"""No smaller 2s is remarked, however well the other faces repeat."""
NEAR = 0.7
"""Share of the limit from which a normal score, which is known nearly only, is worked out exactly."""
SHOWN = 10


def face_conditions(seen: FaceStatistics, gauge: Gauge) -> Iterator[Condition]:
    """Faces off their neighbours, blocks unlike the others, faces that repeat worse than the others."""
    repeat_um = np.nan_to_num(seen.deviation_mm) * 1e3 / np.sqrt(np.maximum(seen.count, 1))
    u_um = np.hypot(gauge.u_um[seen.faces - 1], repeat_um)
    blocks = odd_blocks(seen.faces, seen.mean_mm * 1e3, u_um)
    if blocks:
        shown = ", ".join(f"block {block} by {rounded(um, 3, plus=True)} um" for block, um in blocks[:SHOWN])
        words = f"read longer (+) or shorter (-) than the other blocks: {shown}: its faces, or its certificate"
        yield Condition("faces", "contribution", words, size_um=max(abs(um) for _, um in blocks))
    faces = odd_faces(seen.faces, gauge.position_mm[seen.faces - 1], seen.mean_mm * 1e3, u_um)
    if faces:
        shown = ", ".join(f"face {face} ({rounded(um, 3, plus=True)} um)" for face, um in faces[:SHOWN])
        why = "the face, its certificate, or the scale there; repeats cannot tell"
        words = f"off the line between their neighbours: {shown}: {why}"
        yield Condition("faces", "contribution", words, size_um=max(abs(um) for _, um in faces))
    yield from _scatter(seen)


def _scatter(seen: FaceStatistics) -> Iterator[Condition]:
    """Faces whose 2s is larger than that of the others by more than chance (F test, all faces together)."""
    often = seen.count > 1
    if often.sum() < 3:
        return
    freedom = np.where(often, seen.count - 1, 0).astype(float)
    square = np.nan_to_num(seen.deviation_mm) ** 2
    rest = freedom.sum() - freedom
    others = np.maximum((freedom * square).sum() - freedom * square, 0.0) / np.maximum(rest, 1.0)
    two_s_um = 2e3 * np.sqrt(square)
    suspect = np.flatnonzero(often & (two_s_um > LEAST_2S_UM) & (square > 0.0))
    above, below = np.maximum(freedom, 1.0)[suspect], np.maximum(rest, 1.0)[suspect]
    rows = suspect[_exceeds(square[suspect], others[suspect], above, below, BY_CHANCE / float(often.sum()))]
    if rows.size and rows.size <= often.sum() / 4:
        shown = ", ".join(f"face {seen.faces[i]} ({rounded(two_s_um[i], 3)} um)" for i in rows[:SHOWN])
        words = f"2s larger than at the other faces ({rounded(2e3 * float(seen.pooled_mm), 3)} um over all): {shown}"
        yield Condition("scatter", "contribution", words, size_um=float(two_s_um[rows].max()))


def _exceeds(square: Array, others: Array, above: Array, below: Array, chance: float) -> NDArray[np.bool_]:
    """Whether variances of ``above`` degrees of freedom are larger than others of ``below`` by more than a chance."""
    if not (_normal_score(square, others, above, below) > NEAR * NormalDist().inv_cdf(1.0 - chance)).any():
        return np.zeros(len(square), np.bool_)
    return np.asarray(square > _fisher_limit(chance, above, below) * others)


def _normal_score(square: Array, others: Array, above: Array, below: Array) -> Array:
    """A ratio of variances as a normal deviate, nearly (Paulson 1942; Abramowitz 26.6.15)."""
    a, b = 2.0 / (9.0 * above), 2.0 / (9.0 * below)
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.cbrt(square / others)
        score = ((1.0 - b) * root - (1.0 - a)) / np.sqrt(b * root**2 + a)
    return np.where(others > 0.0, score, np.inf)


def _fisher_limit(chance: float, above: Array, below: Array) -> Array:
    """What a ratio of two variances with these degrees of freedom exceeds with a probability (Abramowitz 26.5.28).

    The incomplete beta function takes longer to load than to evaluate a recording, so that it is asked only where
    :func:`_normal_score` is near the limit.
    """
    from scipy.special import betaincinv

    share = betaincinv(below / 2.0, above / 2.0, chance)
    return np.asarray(below / above * (1.0 / share - 1.0))


UNRECORDED = "not recorded"
"""Found of a gauge's temperature that nobody wrote down."""
APART_K, NOTABLE_K = 5.0, 2.0
"""Gauge and scales of one room do not differ by so much when somebody measures with them; and what is remarked."""


def temperature_conditions(
    recording: Recording, gauge: Gauge, span_mm: float, matters_um: float
) -> Iterator[Condition]:
    """What the lengths were corrected for, and whether the temperatures can be.

    ``span_mm``: measured length; ``matters_um``: what does not move a result by more does not matter.
    """
    yield from _convention(recording, gauge, span_mm, matters_um)
    yield from _apart(recording)


def _convention(recording: Recording, gauge: Gauge, span_mm: float, matters_um: float) -> Iterator[Condition]:
    stated = convention_of(recording.comments, recording.path)
    recorded = "gauge_temperature_C" in recording.columns
    if stated is not None:
        state: State = "corrected" if stated == "nominal_expansion" else "met"
        yield Condition("temperature convention", state, convention_words(recording.comments, recorded), stated)
    if not recorded:
        if needs_gauge_temperature(recording.comments):
            yield _unrecorded(gauge, span_mm)
    elif stated is None:
        yield from _unstated(recording, gauge, span_mm, matters_um)


def _unrecorded(gauge: Gauge, span_mm: float) -> Condition:
    """What it means that nobody recorded how warm the gauge was."""
    table = gauge.table
    per_K = rounded(table.expansion_per_K * span_mm * 1e3, 2)
    words = (
        f"the temperature of the gauge is not recorded: it is taken as {table.reference_temperature_C:g} deg C,"
        f" and each K that it was warmer or colder is an error of {per_K} um over {span_mm:.0f} mm"
    )
    return Condition("temperature", "contribution", words, UNRECORDED, "gauge_temperature_C")


def _unstated(recording: Recording, gauge: Gauge, span_mm: float, matters_um: float) -> Iterator[Condition]:
    """A question where the answers differ by more than matters."""
    warm_C = float(recording.columns["gauge_temperature_C"].mean())
    size = abs(warm_C - REFERENCE_C) * gauge.table.expansion_per_K * span_mm * 1e3
    if size < NOTABLE_UM:
        return
    words = (
        f"the gauge was at {warm_C:.2f} deg C, and nothing states whether the readings are corrected for that: those"
        f" that are corrected to 20 deg C differ by {rounded(size, 3)} um over {span_mm:.0f} mm; taken as not corrected"
    )
    expected = "temperature_convention in the machine file or the recording, or --temperature-convention"
    state: State = "prevents" if size > matters_um else "contribution"
    yield Condition("temperature convention", state, words, "not stated", expected, size)


def _apart(recording: Recording) -> Iterator[Condition]:
    """Gauge and scales that cannot have been in one room."""
    names = [name for name in recording.columns if name.endswith("_temperature_C") or name.startswith("scale_temp")]
    means = {name: float(np.mean(recording.columns[name])) for name in names}
    if len(means) < 2:
        return
    low, high = min(means, key=lambda name: means[name]), max(means, key=lambda name: means[name])
    apart = means[high] - means[low]
    if apart > NOTABLE_K:
        found = f"{low} {means[low]:.2f} and {high} {means[high]:.2f} deg C"
        words = f"temperatures that contradict each other, or a gauge that has not taken up the room's: {found}"
        state: State = "prevents" if apart > APART_K else "contribution"
        yield Condition("temperature", state, words, found, f"within {NOTABLE_K:g} K of each other")
