"""What an evaluation remarks beside its numbers: gaps, what was not recorded, and readings that are conspicuous."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from stepgauge.evaluation.face_errors import REffOrigin, reversal_of_scale_um
from stepgauge.files.notation import rounded
from stepgauge.gauge.certified import Gauge
from stepgauge.recording import POSITION, Recording
from stepgauge.recording.by_face import FaceStatistics
from stepgauge.recording.copies import copied_cycles, copies_words
from stepgauge.recording.repeats import left_out_words, odd_blocks, odd_faces

if TYPE_CHECKING:
    from stepgauge.evaluation.evaluate import Readings

Array = NDArray[np.float64]
REFERENCE_C = 20.0
"""Reference temperature of dimensions, ISO 1."""
NOTABLE_UM = 0.1
"""Cosine error over the measured section, and reversal that a scale error shows, from which a note is made."""


def gaps(faces: NDArray[np.int64], count: NDArray[np.int64]) -> list[str]:
    """Faces not measured, or not as often as the others; ``count (k,)``: probings of each of ``faces (k,)``."""
    notes = []
    missing = faces[count == 0]
    if missing.size:
        notes.append(f"not measured: faces {', '.join(map(str, missing))}; what needs them is left undefined")
    seen = count[count > 0]
    if seen.size and seen.min() != seen.max():
        fewer = faces[(count > 0) & (count < seen.max())]
        shown = ", ".join(map(str, fewer[:10])) + (", ..." if fewer.size > 10 else "")
        notes.append(f"unequal cycles: {seen.min()} to {seen.max()} probings per face; fewer on faces {shown}")
    if seen.size and seen.max() == 1:
        notes.append("a single cycle: there is no repeatability, 2s and u of R_eff are undefined")
    return notes


def copies(recording: Recording) -> list[str]:
    """Cycles that repeat an earlier one in every reading."""
    columns = recording.columns
    found = copied_cycles(columns["placement"], columns["cycle"], recording.numbers(POSITION))
    if not found:
        return []
    return [
        f"{copies_words([cycle for _, cycle in found])}: every reading is that of an earlier cycle: copied,"
        " or simulated without scatter; 2s and u of R_eff do not say how the machine repeats"
    ]


def unrecorded(gauge: Gauge, measured: NDArray[np.int64]) -> str:
    """What it means that nobody recorded how warm the gauge was; ``measured``: faces, rising."""
    span_mm = float(np.ptp(gauge.position_mm[measured - 1]))
    per_K = rounded(gauge.table.expansion_per_K * span_mm * 1e3, 2)
    return (
        f"the temperature of the gauge is not recorded: it is taken as {gauge.table.reference_temperature_C:g} deg C,"
        f" and each K that it was warmer or colder is an error of {per_K} um over {span_mm:.0f} mm"
    )


def of_scale(faces: NDArray[np.int64], count: NDArray[np.int64], gauge: Gauge, xm_um: Array, origin: REffOrigin) -> str:
    """How much of XR is of the scale error, which no reversal of the machine explains; empty where it is little."""
    um = reversal_of_scale_um(faces, count, gauge.position_mm[faces - 1], xm_um, origin)
    if not abs(um) > NOTABLE_UM:
        return ""
    return (
        f"{rounded(um, 2, plus=True)} um of XR are of the scale error (the slope of XM) and not of a reversal: minus"
        " half the pitch of the blocks times the slope, by the definition of XR and R_eff"
    )


def doubts(readings: Readings, seen: FaceStatistics, gauge: Gauge) -> list[str]:
    """Readings that were left out, and conspicuous ones that are used."""
    notes = [left_out_words(readings.left_out)] if readings.left_out else []
    if readings.remark:
        notes.append(readings.remark)
    span_mm = float(np.ptp(gauge.position_mm[seen.faces[seen.count > 0] - 1]))
    short_um = readings.tilt_rad**2 / 2.0 * span_mm * 1e3
    if short_um > NOTABLE_UM:
        notes.append(
            f"the readings follow a line that is {readings.tilt_rad * 1e3:.2f} mrad off the axis that is used:"
            f" a cosine error of up to {short_um:.2f} um"
        )
    repeat_um = np.nan_to_num(seen.deviation_mm) * 1e3 / np.sqrt(np.maximum(seen.count, 1))
    u_um = np.hypot(gauge.u_um[seen.faces - 1], repeat_um)
    sizes = odd_blocks(seen.faces, seen.mean_mm * 1e3, u_um)
    if sizes:
        shown = ", ".join(f"block {block} by {rounded(um, 3, plus=True)} um" for block, um in sizes[:10])
        notes.append(f"read longer (+) or shorter (-) than the other blocks: {shown}: its faces, or its certificate")
    if gauge.table.reference_temperature_C != REFERENCE_C:
        reference = gauge.table.reference_temperature_C
        notes.append(f"the certificate holds at {reference:g} deg C, not at {REFERENCE_C:g} (ISO 1)")
    odd = odd_faces(seen.faces, gauge.position_mm[seen.faces - 1], seen.mean_mm * 1e3, u_um)
    if odd:
        shown = ", ".join(f"face {face} ({rounded(um, 3, plus=True)} um)" for face, um in odd[:10])
        why = "the face, its certificate, or the scale there; repeats cannot tell"
        notes.append(f"off the line between their neighbours: {shown}: {why}")
    return notes
