"""What the gauge is and when it was calibrated, beside what and when was measured with it."""

from __future__ import annotations

import datetime
from collections.abc import Iterator

from stepgauge.conditions.condition import Condition
from stepgauge.files.dates import moments, parse_moment
from stepgauge.gauge.certified import Gauge
from stepgauge.recording import Recording
from stepgauge.recording.conventions import REFERENCE_C

OLD_YEARS, FORGOTTEN_YEARS = 3.0, 10.0
"""Gauges are calibrated again after one to three years (their certificates recommend it): older is remarked. After
ten years nobody knows what the gauge is today."""
YEAR_DAYS = 365.25
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
    """Reference temperature, expansion against material, and dates."""
    reference = gauge.table.reference_temperature_C
    if reference != REFERENCE_C:
        words = f"the certificate holds at {reference:g} deg C, not at {REFERENCE_C:g} (ISO 1)"
        yield Condition("certificate", "contribution", words, f"{reference:g} deg C", f"{REFERENCE_C:g} deg C")
    yield from _expansion(gauge)
    yield from _dates(recording, gauge)


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
