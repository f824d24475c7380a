"""Temperatures: the convention of the readings, and thermometers that contradict each other."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from stepgauge.conditions.condition import Condition, State
from stepgauge.files.notation import rounded
from stepgauge.gauge.certified import Gauge
from stepgauge.recording import Recording
from stepgauge.recording.conventions import REFERENCE_C, convention_of, convention_words, needs_gauge_temperature

NOTABLE_UM = 0.1
"""Size from which a convention that nobody states is remarked."""
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
