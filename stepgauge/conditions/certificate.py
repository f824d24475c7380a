"""What the gauge is and when it was calibrated, beside what and when was measured with it."""

from __future__ import annotations

import datetime
from collections.abc import Iterator

import numpy as np

from stepgauge.conditions.condition import Condition
from stepgauge.conditions.outliers import odd_faces
from stepgauge.files.dates import YEAR_DAYS, moments, parse_moment
from stepgauge.files.notation import rounded
from stepgauge.gauge.certified import Gauge
from stepgauge.recording import Recording
from stepgauge.recording.conventions import REFERENCE_C

OLD_YEARS, FORGOTTEN_YEARS = 3.0, 10.0
"""Gauges are calibrated again after one to three years (their certificates recommend it): older is remarked. After
ten years nobody knows what the gauge is today."""
ODD_LEAST_UM = 10.0
"""A certified position is remarked beyond so much: gauges deviate from nominal as they were made, and slips more."""
ODD_SHARE, ODD_REACH = 3.0, 3
"""An uncertainty is unlike the others beyond so many times that of as many faces to either side."""
BEST_UM, WORST_UM = 0.02, 20.0
"""Expanded uncertainties of positions that laboratories state, short to long and good to simple gauges, widened."""
EXPANSION_PER_K = {
    "invar": (0.0, 3e-6),
    "zerodur": (-0.2e-6, 0.2e-6),
    "super invar": (-0.5e-6, 1.5e-6),
    "glass ceramic": (-0.5e-6, 1e-6),
    "carbon fibre": (-1e-6, 4e-6),
    "tungsten carbide": (4e-6, 7.5e-6),
    "hard metal": (4e-6, 7.5e-6),
    "granite": (3e-6, 10e-6),
    "ceramic": (3e-6, 12e-6),
    "zirconia": (8e-6, 12e-6),
    "cast iron": (8.5e-6, 13e-6),
    "stainless": (9e-6, 18e-6),
    "steel": (9.5e-6, 14e-6),
    "aluminium": (20e-6, 25.5e-6),
    "aluminum": (20e-6, 25.5e-6),
    "brass": (17e-6, 22e-6),
}
"""Expansion of materials of gauges near 20 deg C, lowest and highest in 1/K, by a word of their name (handbook
ranges, widened by the spread of alloys); a material that is not here is not judged."""


def certificate_conditions(recording: Recording, gauge: Gauge) -> Iterator[Condition]:
    """What the certificate says, and its dates."""
    yield from table_conditions(gauge)
    yield from _dates(recording, gauge)


def table_conditions(gauge: Gauge) -> Iterator[Condition]:
    """Reference temperature, expansion against material, and single faces unlike the others; of no measurement."""
    reference = gauge.table.reference_temperature_C
    if reference != REFERENCE_C:
        words = f"the certificate holds at {reference:g} deg C, not at {REFERENCE_C:g} (ISO 1)"
        yield Condition("certificate", "contribution", words, f"{reference:g} deg C", f"{REFERENCE_C:g} deg C")
    yield from _expansion(gauge)
    yield from _positions(gauge)
    yield from _uncertainties(gauge)


def _positions(gauge: Gauge) -> Iterator[Condition]:
    """Faces whose deviation from nominal is unlike that of their neighbours: a slip of the pen moves one."""
    um = (gauge.position_mm - gauge.nominal_mm) * 1e3
    faces = odd_faces(np.arange(1, gauge.n_faces + 1), gauge.position_mm, um, gauge.u_um)
    faces = [(face, off) for face, off in faces if abs(off) > ODD_LEAST_UM]
    if faces:
        shown = ", ".join(f"face {face} ({rounded(off, 3, plus=True)} um)" for face, off in faces[:5])
        words = f"certified deviations from nominal unlike those of the neighbours: {shown}: a slip in the table?"
        size = max(abs(off) for _, off in faces)
        yield Condition("certificate", "contribution", words, shown, "deviations of one size", size)


def _uncertainties(gauge: Gauge) -> Iterator[Condition]:
    """Uncertainties of single faces unlike the others, and of all that no laboratory states."""
    expanded = gauge.u_um * gauge.certificate.coverage_factor
    stated = expanded[expanded > 0.0]
    if not stated.size:
        return
    usual = float(np.median(stated))
    beyond = np.pad(np.where(expanded > 0.0, expanded, usual), ODD_REACH, mode="reflect")
    near = np.median(np.lib.stride_tricks.sliding_window_view(beyond, 2 * ODD_REACH + 1), axis=1)
    rows = np.flatnonzero((expanded > ODD_SHARE * near) | ((expanded == 0.0) & (np.arange(len(expanded)) > 0)))
    if rows.size:
        shown = ", ".join(f"face {row + 1} ({rounded(float(expanded[row]), 3)} um)" for row in rows[:5])
        words = f"certified uncertainties unlike the others (U = {rounded(usual, 2)} um): {shown}: a slip in the table?"
        yield Condition("certificate", "contribution", words, shown, "uncertainties of one size")
    if not BEST_UM <= usual <= WORST_UM:
        words = f"no laboratory states such an uncertainty of a step gauge: U = {rounded(usual, 2)} um; another unit?"
        yield Condition("certificate", "contribution", words, f"{usual:g} um", f"{BEST_UM:g} to {WORST_UM:g} um")


def _expansion(gauge: Gauge) -> Iterator[Condition]:
    material, expansion = gauge.table.material.casefold(), gauge.table.expansion_per_K
    known = next((name for name in EXPANSION_PER_K if name in material), None)
    if known is None:
        return
    low, high = EXPANSION_PER_K[known]
    if not low <= expansion <= high:
        found, expected = f"{expansion * 1e6:g}e-6 1/K", f"{low * 1e6:g}e-6 to {high * 1e6:g}e-6 1/K for {known}"
        words = f"the expansion of the gauge, {found}, is not that of {gauge.table.material}"
        yield Condition("certificate", "prevents", words, found, expected)


def _dates(recording: Recording, gauge: Gauge) -> Iterator[Condition]:
    """The measurement against the date of calibration; without a date of the measurement, today."""
    said = recording.comments.get("measured_at")
    days = [parse_moment(one, recording.path).date() for one in moments(said)] if said else [datetime.date.today()]
    calibrated = gauge.certificate.date
    years, recall = (max(days) - calibrated).days / YEAR_DAYS, gauge.certificate.recall
    if recall is not None and max(days) > recall:
        words = f"the gauge was due for calibration on {recall}, and measured with on {max(days)}"
        yield Condition("dates", "contribution", words, str(max(days)), f"{recall} or before")
    if said and min(days) < calibrated:
        words = f"measured on {min(days)}, before the gauge was calibrated on {calibrated}"
        yield Condition("dates", "prevents", words, str(min(days)), f"{calibrated} or later")
    elif years > FORGOTTEN_YEARS:
        words = f"the gauge was calibrated {years:.0f} years before ({calibrated}): nobody knows its lengths today"
        yield Condition("dates", "prevents", words, str(calibrated), "a calibration of the last years")
    elif years > OLD_YEARS:
        tail = "a drift since counts only where it is stated"
        words = f"the gauge was calibrated {years:.0f} years before ({calibrated}): {tail}"
        yield Condition("dates", "contribution", words, str(calibrated), f"within {OLD_YEARS:g} years")
