"""What to do about a cause: what to check before anything is changed, and what to repair once that confirms it.

A diagnosis says what a recording shows; a person at the machine confirms it by other means first. ``{axis}`` and the
like stand for the choices of a finding.
"""

from __future__ import annotations

import string
from collections.abc import Collection, Mapping
from typing import Any, NamedTuple

from stepgauge.diagnosis.gaussian_processes.random_function import HYSTERESIS, LOOP, RESTS, SAWTOOTH, WAVE
from stepgauge.diagnosis.wording.structure import DISTURBED
from stepgauge.effects import effect_kinds
from stepgauge.files.notation import rounded


class Remedy(NamedTuple):
    """``check``: by other means than this recording; ``repair``: once the check has confirmed the cause."""

    check: str
    repair: str


_TABLE = "Make a new error table of {axis} from an evaluation along it (stepgauge compensate)."
_BY_DIRECTION = "Compensate by direction (stepgauge probe compensate), or have the probe module exchanged."
_REMEDIES = {
    "scale_error": Remedy(
        "Compare the linear correction of {axis} in the controller, and the temperature of the {axis} scale in the"
        " machine file, with what is there.",
        "Enter a new linear correction of {axis}.",
    ),
    "geometric_errors": Remedy(
        "Look whether the error map of the machine is there, is switched on, and is the one of its last calibration.",
        "Have the machine calibrated and compensated in its whole volume.",
    ),
    "scale_curvature": Remedy(
        "Compare the error table of {axis} in the controller with the machine's last one.", _TABLE
    ),
    "periodic_scale_error": Remedy(
        "Compare the period{aliases} with the pitch of the {axis} scale, screw or rack;"
        " look for dirt on the reading head.",
        "Clean the {axis} scale and adjust the gap of its reading head.",
    ),
    "local_scale_defect": Remedy(
        "Inspect the {axis} scale at {at_mm} mm for dirt, a scratch or a joint.",
        f"Clean it; if the error stays: {_TABLE}",
    ),
    "scale_joint": Remedy("Inspect the {axis} scale for a joint at {at_mm} mm.", _TABLE),
    "reversal_error": Remedy(
        "Drive {axis} to a dial gauge from both sides: if it does not differ, the cause is the probe.",
        "Adjust the drive of {axis} or its backlash compensation; for the probe, qualify it again.",
    ),
    "reversal_wear": Remedy(
        "Drive {axis} to a dial gauge from both sides, near {at_mm} mm and far from it.",
        "Have the screw of {axis} inspected; its backlash compensation holds for one place only.",
    ),
    "stick_slip": Remedy(
        "Look at lubrication and wipers of the {axis} guideway.", "Clean and lubricate the guideway of {axis}."
    ),
    "squareness": Remedy(
        "Measure the squareness of {plane} by other means: a square, or a ball plate.",
        "Enter the squareness of {plane} in the controller.",
    ),
    "straightness": Remedy(
        "Measure the straightness of {axis} with a straightedge or a laser.",
        "Enter it in the error map, or level the bed.",
    ),
    "angular_error": Remedy(
        "Measure the angle of the {travel_axis} carriage with an electronic level or an autocollimator.",
        "Enter it in the error map; look at bearings and preload of the {travel_axis} carriage.",
    ),
    "roll": Remedy("Measure the roll of the {axis} carriage with electronic levels.", "Enter it in the error map."),
    "error_motion": Remedy(
        "Measure this error motion of {axis} with a laser, an autocollimator or levels.", "Enter it in the error map."
    ),
    "thermal_bending": Remedy(
        "Look for what heats one side of {axis}: sun, a lamp, an electrical cabinet.",
        "Remove or shield the source of heat.",
    ),
    "gauge_temperature": Remedy(
        "Measure the temperature on the bar of the gauge with a calibrated thermometer, before and after a run.",
        "Wait until the gauge has the temperature of the machine; record its temperature.",
    ),
    "gauge_reversed": Remedy(
        "Look at which end of the gauge the beginning of its certificate is.",
        "Turn the gauge round, or number its blocks from the other end; then measure again.",
    ),
    "gauge_soaking": Remedy(
        "Log the temperature on the bar of the gauge from the moment it is laid.",
        "Let the gauge soak for three time constants before measuring; lay it with gloves.",
    ),
    "scale_temperature": Remedy(
        "Measure the scale temperature of {axis} with a calibrated thermometer.",
        "Have its sensor adjusted, or state the measured temperature.",
    ),
    "thermal_drift": Remedy(
        "Log the temperatures of air, gauge and machine; ask what was switched on before the run.",
        "Wait for equilibrium, or measure there and back (stepgauge plan --order up-down).",
    ),
    "temperature_cycle": Remedy(
        "Compare the period with that of the air conditioning or the coolant unit.",
        "Keep the stream of air or coolant off the machine.",
    ),
    "thermal_expansion_of": Remedy(
        "Compare the recorded temperature {column} with a calibrated thermometer.",
        "Correct by this temperature, or keep it constant.",
    ),
    "thermal_shift": Remedy(
        "Compare the recorded temperature {column} with a calibrated thermometer.",
        "Keep this temperature constant, or measure a reference point again and again.",
    ),
    "scale_warm_up": Remedy(
        "Log the temperature of the {axis} scale from switching on.", "Warm the machine up before measuring."
    ),
    "block_defect": Remedy(
        "Look for dirt, rust or a dent on face {face}.", "Clean it; then have the gauge calibrated."
    ),
    "block_shift": Remedy(
        "Look whether block {block} sits tight; lay the gauge elsewhere: does the error go with it?",
        "Have the gauge calibrated; do not use it as it is.",
    ),
    "misalignment": Remedy(
        "Probe the 16 points again and compare the placements (stepgauge locate).", "Plan anew with the new placement."
    ),
    "gauge_bending": Remedy(
        "Compare the supports of the gauge with those of its certificate.", "Support the gauge there."
    ),
    "step_change": Remedy(
        "Look at the clamps of the gauge, and whether stylus and probe are tight.",
        "Tighten them; use no readings from before and after together.",
    ),
    "vibration": Remedy(
        "Switch off, one by one, what turns near the machine: fans, pumps, spindles.",
        "Isolate it, or measure without it.",
    ),
    "approach_memory": Remedy(
        "Probe one point ten times after a pause.", "Begin every run with some probings for nothing."
    ),
    "effective_radius": Remedy(
        "Is the stylus tight and the tip clean? Qualify it on the reference sphere and compare.",
        "Enter the new effective radius.",
    ),
    "probe_lobing": Remedy("Probe a sphere from all sides (stepgauge probe qualify).", _BY_DIRECTION),
    "kinematic_pretravel": Remedy("Probe a sphere from all sides (stepgauge probe qualify).", _BY_DIRECTION),
    "seat_defect": Remedy(
        "Probe a sphere from all sides (stepgauge probe qualify).", "Have the probe cleaned, or its module exchanged."
    ),
    "trigger_delay": Remedy(
        "Probe one face at two speeds: does the reading change in proportion?",
        "Qualify the probe at the measuring speed.",
    ),
    "servo_lag": Remedy("Probe one face at three speeds.", "Qualify and measure at one speed, a slower one."),
    "tip_change": Remedy(
        "Compare the stylus of placement {placement} with that of the others.",
        "Qualify it, and measure this placement again.",
    ),
    "lever_arm": Remedy("Measure the length of the stylus and compare it with the file.", "State the measured length."),
    "repeatability": Remedy(
        "Probe one face ten times at once: the standard deviation is the machine's repeatability today. Where it is"
        " larger than stated, look at the clamping of gauge, probe and stylus, at dirt on the tip, and at the unit of"
        " the machine file.",
        "Mend what is loose and measure again; if it is so, state this repeatability in the machine file.",
    ),
    "noise_growth": Remedy("Look for what changes with {per}.", "Nothing: readings there have less weight."),
    "outliers": Remedy("Clean the tip and the faces that are listed in the appendix.", "Measure these points again."),
}
_OF_AN_AXIS = {
    "scale_error": Remedy(
        "Measure the temperature of the scale, state its coefficient of expansion, and align the line of measurement.",
        "If it stays: enter a new linear correction.",
    ),
    "scale_curvature": Remedy(
        "Compare the error table of the controller with the last one; look at the screw's preload.",
        "Make a new error table.",
    ),
    "periodic_scale_error": Remedy(
        "Compare the period{aliases} with the pitch of scale, screw or gear, and with the wavelength.",
        "Clean the scale and adjust its reading head.",
    ),
    "local_scale_defect": Remedy(
        "Inspect the scale at this position.", "Clean it; if it stays, make a new error table."
    ),
    "scale_joint": Remedy("Inspect the scale for a joint at this position.", "Make a new error table."),
    "reversal_error": Remedy(
        "Read the position with another instrument, coming from both sides.",
        "Adjust the drive or its backlash compensation.",
    ),
    "thermal_drift": Remedy(
        "Log the temperatures of air, axis and instrument.", "Wait for equilibrium; measure there and back."
    ),
    "step_change": Remedy(
        "Look at clamps, mirrors and cables, and at the count of the instrument.",
        "Fasten them; use no readings from before and after together.",
    ),
    "effective_radius": Remedy(
        "Determine the constant by other means, on a known length or on the reference sphere.",
        "Enter the new constant.",
    ),
    "approach_memory": Remedy(
        "Read one target ten times after a pause.", "Begin every run with some readings for nothing."
    ),
    "trigger_delay": Remedy("Read one target at two speeds.", "Read at rest, or state the delay."),
    "outliers": Remedy(
        "Look at the readings that are listed in the appendix, and at what happened then.",
        "Measure these targets again.",
    ),
}
_CENTRED = Remedy(
    _OF_AN_AXIS["periodic_scale_error"].check, "Clean the scale, adjust its reading head, and centre what turns."
)
"""For an error of a rotary axis that repeats."""
_STATE = "If it is so, state it in the probe file; else have the probe repaired."
_OF_A_MAP = {
    "lever_arm": Remedy("Measure the length of stylus and carrier.", _STATE),
    "stylus_length": Remedy("Measure the stylus; was it exchanged?", "Take the probe file of this stylus."),
    "preload": Remedy("Measure the trigger force across the stylus with a force gauge.", "Have the spring adjusted."),
    "contact_radius": Remedy("Compare the module with its drawing.", _STATE),
    "contact_angle": Remedy("Compare the module with its drawing.", _STATE),
    "lobing_phase": Remedy("Look how the probe is mounted, and from which axis azimuths are counted.", _STATE),
    "eccentricity": Remedy("Look whether the stylus is screwed in straight.", "Have the module exchanged."),
    "friction": Remedy("Look for dirt on the seats and on the tip.", "Have them cleaned; then measure the map again."),
    "compliance": Remedy("Compare stylus and extension with those of the probe file; are they tight?", _STATE),
    "force_gauge_scale": Remedy("Load the force gauge with a known mass.", "Have the force gauge calibrated."),
    "force_gauge_offset": Remedy("Read the force gauge without load.", "Set its zero; the probe is not concerned."),
    "effective_radius": Remedy("Qualify the probe on the reference sphere.", "State the new mean pre-travel."),
    "probe_lobing": Remedy("Qualify the probe in many directions (stepgauge probe qualify).", _BY_DIRECTION),
    "outliers": Remedy("Look at the rows that are listed in the appendix.", "Measure these directions again."),
}
_BY_WHAT = {"axis": _OF_AN_AXIS, "map": _OF_A_MAP}
_UNKNOWN_KIND = Remedy(
    "Check by other means whether this cause is there.", "Remove it, or state it in the file that was judged."
)
_UNKNOWN = "Nothing: do not adjust or compensate before the cause is known."
_WAVE = Remedy(
    "Look for what repeats with {covariate} in this period: in time a thermostat, a compressor or a pump, along an axis"
    " a screw, a pinion or the joints of a scale.",
    _UNKNOWN,
)
_LATE = Remedy(
    "Move to one place by small and by large ways, from both sides: what friction holds back reads differently. Look at"
    " guideways, drives and cables for what rubs or gives way, and at what clamps the gauge or instrument.",
    _UNKNOWN,
)
_FORMS = {
    WAVE: _WAVE,
    SAWTOOTH: _WAVE,
    HYSTERESIS: _LATE,
    LOOP: _LATE,
    DISTURBED: Remedy(
        "Ask what shook the machine or the gauge then: a press, a lorry, a door, a draught of air, a loose clamp.",
        "Measure again without it; readings of that stretch have less weight.",
    ),
    RESTS: Remedy(
        "Read one place ten times at once, after a pause, and after a long pause: what a rest leaves fades from reading"
        " to reading.",
        _UNKNOWN,
    ),
}
"""For structure without a known law, by its shape."""


def remedy_of_form(shapes: Collection[str], covariate: str) -> Remedy:
    """What to check for structure without a known law, over one covariate and with one or several ``shapes``."""
    found = {_FORMS.get(shape) for shape in shapes}
    own = found.pop() if len(found) == 1 else None
    return filled(own or Remedy("Look for what changes with {covariate}.", _UNKNOWN), covariate=covariate)


def remedy(kind: str, parameters: Mapping[str, Mapping[str, Any]], of: str = "gauge", aliased: bool = False) -> Remedy:
    """What to check and repair for a kind of effect, with its ``parameters`` as a ``diagnosis.json`` has them.

    ``of``: what was diagnosed: a recording of a ``gauge``, of an ``axis`` without one, or the ``map`` of a probe;
    ``aliased``: whether other periods are named beside its own.
    """
    found = _BY_WHAT.get(of, {}).get(kind) or _REMEDIES.get(kind) or _declared(kind, of)
    if of == "axis" and kind == "periodic_scale_error" and "period_deg" in parameters:
        found = _CENTRED
    values = {name: _short(one["value"]) for name, one in parameters.items() if "value" in one}
    return filled(found, **values, aliases=", and every alias of it that is named," if aliased else "")


def _declared(kind: str, of: str) -> Remedy:
    """What an effect declares itself."""
    known = effect_kinds(every=True).get(kind)
    words = None if known is None else known.words_at(of)
    if words is None:
        return _UNKNOWN_KIND
    return Remedy(words.check or _UNKNOWN_KIND.check, words.repair or _UNKNOWN_KIND.repair)


def filled(found: Remedy, **values: str) -> Remedy:
    """A remedy with values in the places of their names; a name without a value is said as itself."""
    known = {name: values.get(name, name.split("_")[0]) for text in found for name in _names(text)}
    return Remedy(*(text.format(**known) for text in found))


def _names(text: str) -> list[str]:
    return [name for _, name, _, _ in string.Formatter().parse(text) if name]


def _short(value: Any) -> str:
    if value == "all":
        return "all axes"
    return rounded(value, 5) if isinstance(value, float) else str(value)
