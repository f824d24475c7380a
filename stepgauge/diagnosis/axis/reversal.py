"""The reversal error of an axis target by target: what a function with opposite sign in the two directions is."""

from __future__ import annotations

import numpy as np

from stepgauge.axis.recording import AxisRecording, places_of
from stepgauge.diagnosis.wording.phrases import Phrase, number
from stepgauge.files.arrays import Array

OF_PLACES = ("position", "machine x", "face", "target")
"""Covariates of forms that are told as a reversal error where they have opposite signs in the two directions."""


def reversal_by_target(recording: AxisRecording) -> tuple[Array, Array]:
    """Targets ``(t,)`` that were read from both sides, and the reversal error at each, in units of deviation.

    Mean reading in positive minus that in negative direction (ISO 230-2:2014, 2.11).
    """
    target, way = recording.frame["target"].to_numpy(float), recording.frame["way"].to_numpy(float)
    place, away = places_of(target), recording.deviation
    count, total = (
        np.array([np.bincount(place, own * (way == sign), int(place.max()) + 1) for sign in (1.0, -1.0)])
        for own in (np.ones(len(away)), away)
    )
    both = count.min(axis=0) > 0
    where = np.bincount(place, target) / np.bincount(place)
    mean = total[:, both] / count[:, both]
    return where[both], mean[0] - mean[1]


def reversal_phrase(recording: AxisRecording) -> Phrase:
    """That the reversal error differs along the axis, with its least and largest value and where these are."""
    where, um = reversal_by_target(recording)
    least, largest = int(np.abs(um).argmin()), int(np.abs(um).argmax())
    deviation, position = recording.units.deviation, recording.units.position
    return {
        "say": "reversal",
        "least": number(um[least], deviation),
        "largest": number(um[largest], deviation),
        "least_at": number(where[least], position),
        "largest_at": number(where[largest], position),
    }


def is_reversal(recording: AxisRecording, covariate: str, opposite: bool) -> bool:
    """Whether a form over a covariate is a reversal error by position; ``opposite``: in sign by direction."""
    both = recording.form == "axis" and recording.both_ways
    return both and opposite and covariate in OF_PLACES
