"""Temperature conventions: what a recording's lengths have been corrected for before anybody compares them.

Lengths hold at 20 deg C (ISO 1). A gauge at the temperature T_g is longer by alpha_g (T_g - 20), scales at T_s indicate
lengths that are too small by alpha_s (T_s - 20). ISO 230-2 has the readings corrected for that nominal differential
expansion (NDE); most CMMs correct part and scales themselves.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, Protocol, cast, get_args

import numpy as np

from stepgauge.errors import InputError, naming
from stepgauge.files.arrays import Array
from stepgauge.files.numerals import number
from stepgauge.gauge.certified import Gauge
from stepgauge.recording.columns import APPROACH, SCALE_TEMPERATURES, SCALES_C
from stepgauge.recording.table import Recording

Convention = Literal["as_read", "corrected_to_20", "nominal_expansion"]
CONVENTIONS: Mapping[Convention, str] = {
    "as_read": "certified positions are brought to the recorded gauge temperature; readings are not corrected",
    "corrected_to_20": "the machine has corrected the readings to 20 deg C; certified positions are those at 20 deg C",
    "nominal_expansion": "readings are not corrected; nominal expansion corrects scales and gauge to 20 deg C here",
}
"""``temperature_convention`` of a recording or of the table [machine], with what it means for the numbers."""
UNRECORDED = (
    "the temperature of the gauge is not recorded: certified positions are those of the certificate, readings are not"
    " corrected"
)
AS_IT_IS = "the machine as it is, at the temperature that it has"
AT_20 = "the machine at 20 °C"
CORRECTED: Mapping[Convention | None, str] = {
    "corrected_to_20": "the machine with its own correction of the readings to 20 °C",
    "nominal_expansion": "the machine with readings corrected to 20 °C for the nominal expansion of scales and gauge",
}
"""What an error is of where the readings are corrected."""
INSTRUMENT = {
    "as_read": "the instrument has not corrected the readings to 20 deg C",
    "corrected_to_20": "the instrument has corrected the readings to 20 deg C",
}
KEY, EXPANSION = "temperature_convention", "scale_expansion_per_K"
"""Comments of a recording: the convention; for NDE the expansion of the scales."""
REFERENCE_C = 20.0
"""Reference temperature of dimensions, ISO 1."""


class Scales(Protocol):
    """What a machine file states of its scales and of what its readings have been corrected for."""

    @property
    def name(self) -> str:
        """Of the machine."""

    @property
    def temperature_convention(self) -> Convention | None:
        """None where it states none."""

    @property
    def scale_expansion_per_K(self) -> float:
        """Of the scales, 1/K."""

    @property
    def temperature_C(self) -> float:
        """Of the scales, deg C."""


def convention_of(comments: Mapping[str, str], where: str = "") -> Convention | None:
    """The convention that a recording states, None where it states none; :class:`InputError` for another word, and
    for joined recordings that differ."""
    stated = comments.get(KEY)
    if stated is None:
        return None
    if "; " in stated:
        what, expected = (
            "some of the readings are corrected for temperature, others not",
            "recordings of one convention",
        )
        raise InputError(where, what, found=stated, expected=expected)
    if stated not in get_args(Convention):
        raise InputError(where, f"{KEY} is not known", found=stated, expected=", ".join(get_args(Convention)))
    return cast(Convention, stated)


def convention_words(comments: Mapping[str, str], gauge_recorded: bool) -> str:
    """What was corrected to which temperature, for results and reports.

    ``gauge_recorded``: the recording has the temperature of the gauge; without it nothing can be brought to it.
    """
    stated = convention_of(comments)
    words = CONVENTIONS[stated or "as_read"] if gauge_recorded or stated not in (None, "as_read") else UNRECORDED
    return words if stated else f"not stated: {words}"


def calibrated_object(comments: Mapping[str, str], at_reference: bool = False) -> str:
    """What an error is of, as the recording states the correction of its readings, in words (VIM 2.3).

    ``at_reference``: readings that nobody corrected are said to be of a machine at 20 deg C, with the temperature of
    its scales in U.
    """
    stated = convention_of(comments)
    return CORRECTED.get(stated, AT_20 if at_reference else AS_IT_IS)


def needs_gauge_temperature(comments: Mapping[str, str]) -> bool:
    """Whether the certified positions are brought to the temperature of the gauge: not where the machine did it."""
    return convention_of(comments) != "corrected_to_20"


def instrument_words(comments: Mapping[str, str]) -> str:
    """What an instrument beside the axis has corrected: nothing is corrected here."""
    return INSTRUMENT.get(convention_of(comments) or "", "not stated whether the readings are corrected to 20 deg C")


def state_convention(recording: Recording, stated: str | None) -> Recording:
    """The recording with a convention that somebody states; :class:`InputError` where it states another itself."""
    if stated is None:
        return recording
    own = convention_of(recording.comments, recording.path)
    if own not in (None, stated):
        what = f"the recording has another {KEY}"
        raise InputError(naming(KEY), what, found=stated, expected=f"{own}, as {recording.path} says")
    convention_of({KEY: stated}, KEY)
    return recording.assign_comments(**{KEY: stated})


def complete_by_machine(recording: Recording, machine: Scales | None) -> Recording:
    """The recording with what its machine file states and it does not: the name, the convention, and the scales."""
    if machine is None:
        return recording
    stated = convention_of(recording.comments, recording.path) or machine.temperature_convention
    more: dict[str, str] = {"machine": machine.name, **({KEY: stated} if stated else {})}
    if not all(name in recording.columns for name in SCALE_TEMPERATURES):
        more[SCALES_C] = f"{machine.temperature_C:g}"
    if stated == "nominal_expansion":
        more[EXPANSION] = f"{machine.scale_expansion_per_K:g}"
    return recording.assign_comments(**{key: value for key, value in more.items() if key not in recording.comments})


def warmer_K(recording: Recording, gauge: Gauge) -> Array | float:
    """How much warmer than its certificate the gauge is in the readings, K, of every row or of all."""
    reference = gauge.table.reference_temperature_C
    if convention_of(recording.comments, recording.path) == "corrected_to_20":
        return REFERENCE_C - reference
    if "gauge_temperature_C" not in recording.columns:
        return 0.0
    return np.asarray(recording.columns["gauge_temperature_C"] - reference, float)


def scales_longer(recording: Recording) -> Array | float:
    """Share by which the scales are longer than at 20 deg C, of every row, where that is to be corrected, else 0.

    :class:`InputError` where the expansion of the scales or their temperature is not known.
    """
    if convention_of(recording.comments, recording.path) != "nominal_expansion":
        return 0.0
    expansion = number(recording.comments.get(EXPANSION, ""))
    if not np.isfinite(expansion):
        found, expected = recording.comments.get(EXPANSION, "nothing"), "1/K, e.g. '# scale_expansion_per_K: 8e-6'"
        what = f"a correction for nominal expansion needs {EXPANSION}"
        raise InputError(recording.path, what, found=found, expected=expected)
    recorded = recorded_scales_C(recording)
    return expansion * ((_stated_scales_C(recording) if recorded is None else recorded) - REFERENCE_C)


def recorded_scales_C(recording: Recording) -> Array | None:
    """Recorded temperature of the scales that read the length, deg C, of every row.

    A scale that reads the share a of the length lengthens it by a^2 of its own expansion. None where the scales of half
    the length or more have no temperature.
    """
    columns = {i: recording.columns.get(name) for i, name in enumerate(SCALE_TEMPERATURES)}
    share = {i: float(np.mean(recording.columns[APPROACH[i]] ** 2)) for i, one in columns.items() if one is not None}
    if sum(share.values()) <= 0.5:
        return None
    total = sum(share[i] * np.asarray(columns[i], float) for i in share)
    return np.asarray(total / sum(share.values()))


def _stated_scales_C(recording: Recording) -> float:
    stated = number(recording.comments.get(SCALES_C, ""))
    if not np.isfinite(stated):
        what = "a correction for nominal expansion needs the temperature of the scales"
        expected = "a column scale_temperature_x_C (y, z), or the machine file"
        raise InputError(recording.path, what, expected=expected)
    return stated
