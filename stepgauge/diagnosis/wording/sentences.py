"""What a finding means at the machine: tripods, recorded temperatures, and what acts in one place or regime only."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from stepgauge.diagnosis.residuals import Residuals
from stepgauge.diagnosis.wording.notation import direction_words, in_um, length_mm, long, size
from stepgauge.effects import along_approach_um, make_effects
from stepgauge.effects.grids import lie_level
from stepgauge.files.notation import rounded

Values = Mapping[str, Any]
Sentence = Callable[[Values, Residuals], str]


def _of_kind(kind: str, values: Values, data: Residuals) -> Any:
    """Displacement along the approach of an effect with these values, um, (n,)."""
    (effect,) = make_effects([{**values, "kind": kind}], "finding")
    return along_approach_um(effect, data.probings)


def _tripod(v: Values, data: Residuals) -> str:
    spread = float(np.ptp(_of_kind("kinematic_pretravel", v, data)))
    unseen = (
        f" All gauges lay level, so it may as well be {v['arm_azimuth_deg'] - 60.0:.0f} deg, and the lever is taken,"
        " not measured: um_per_N is proportional to it."
    )
    return (
        f"The probe triggers as a tripod on six contacts does: in the directions of this recording its pre-travel"
        f" differs by {in_um(spread)}, with an arm at an azimuth of {v['arm_azimuth_deg']:.0f} deg."
        f"{unseen if lie_level(data.probings) else ''} Qualify the probe in the directions in which it measures,"
        " or compensate it by direction."
    )


def _seat(v: Values, data: Residuals) -> str:
    least = float(_of_kind("seat_defect", v, data).min())
    opposite = " (or opposite to it, for all gauges lay level)" if lie_level(data.probings) else ""
    return (
        f"One seat of the probe's tripod opens too early, that of the arm at {v['arm_azimuth_deg']:.0f} deg of azimuth"
        f"{opposite}: readings are up to {in_um(least)} early there. Have the"
        f" probe cleaned or its module exchanged. The share of {size(v['share'])} is taken: times um_per_N it is seen."
    )


def _column(v: Values) -> str:
    """The column, or the difference of two, and how late it acts."""
    name = f"{v['column']} minus {v['minus']}" if v.get("minus") else str(v["column"])
    return f"{name}, {rounded(v['lag_s'], 3)} s late" if v.get("lag_s") else name


def _change_K(v: Values, data: Residuals) -> float:
    """How far a body that follows the column warmed and cooled, K."""
    late = [data.probings.lagged(v[name], v.get("lag_s", 0.0)) for name in ("column", "minus") if v.get(name)]
    return float(np.ptp(late[0] - late[1] if len(late) > 1 else late[0]))


def _shift(v: Values, data: Residuals) -> str:
    change = _change_K(v, data)
    return (
        f"The readings move along {direction_words(v['direction'])} with {_column(v)}: {v['um_per_K']:.3g} um per K,"
        f" {in_um(v['um_per_K'] * change)} for the {size(change)} K by which it changed. Keep that temperature"
        " steady, or shield and insulate what it heats between gauge and machine."
    )


def _expansion(v: Values, data: Residuals) -> str:
    what = "The gauge grows" if v["of"] == "gauge" else f"The {v['of']} scale reads too long"
    change, length = _change_K(v, data), length_mm(data)
    return (
        f"{what} with {_column(v)}: by {v['um_per_m_K']:.3g} um per metre and K,"
        f" {in_um(v['um_per_m_K'] * change * length * 1e-3)} over {length:.0f} mm for the {size(change)} K by which it"
        " changed. Enter the right temperature and expansion, or let the controller compensate by this sensor."
    )


def _bending(v: Values, data: Residuals) -> str:
    what = f"turns about {v['component'][1]}" if len(v["component"]) > 1 else f"bows towards {v['component']}"
    unit = "urad" if len(v["component"]) > 1 else "um"
    return (
        f"The {v['axis']} guideway {what} with {_column(v)}: {size(v['per_K'])} {unit} per K at 1 m from the middle,"
        f" and the temperature changed by {size(_change_K(v, data))} K. Keep draughts and lamps off the machine."
    )


def _motion(v: Values, data: Residuals) -> str:
    turns = len(v["component"]) > 1
    what = f"turns about {v['component'][1]}" if turns else f"errs along {v['component']}"
    reach = float(np.abs(data.probings.axis_mm(v["axis"]) - v.get("about_mm", 0.0)).max()) * 1e-3
    amount = v["coefficient"] * reach ** v["order"]
    return (
        f"The {v['axis']} axis {what} with the power {v['order']} of its coordinate, by"
        f" {size(amount)} {'urad' if turns else 'um'} at the farthest place that was measured: have it mapped."
    )


def _warm_up(v: Values, data: Residuals) -> str:
    end = in_um(v["um_per_m"] * length_mm(data) * 1e-3)
    return (
        f"The {v['axis']} scale warms with a time constant of {rounded(v['time_constant_h'] * 60.0, 3)} min and reads"
        f" too {long(v['um_per_m'])} in the end, by {end} over {length_mm(data):.0f} mm: move the axis until it is warm"
        " before measuring."
    )


def _wear(v: Values, data: Residuals) -> str:
    return (
        f"The reversal of {v['axis']} is {in_um(v['um'])} {'larger' if v['um'] > 0 else 'smaller'} about"
        f" {v['axis']} = {v['at_mm']:.0f} mm, over some {v['width_mm']:.0f} mm, than elsewhere: look whether the"
        " screw is worn there."
    )


def _stick(v: Values, data: Residuals) -> str:
    return (
        f"After {v['axis']} has turned round its reading lags by {in_um(v['um'] / 2.0)}, which fades over"
        f" {v['decay_mm']:.3g} mm of way: friction holds it back. Let it come from farther off, or have guides and"
        " controller looked after."
    )


def _joint(v: Values, data: Residuals) -> str:
    what = f"a gap of {in_um(v['size'])}" if v["order"] == 0 else f"another slope, by {size(v['size'])} um/m,"
    more = "more" if v["size"] > 0 else "less"
    return (
        f"From {v['axis']} = {v['at_mm']:.0f} mm on the {v['axis']} scale has {what} and reads {more}: two scales or"
        " tapes may meet there."
    )


def _servo(v: Values, data: Residuals) -> str:
    speeds = np.unique(np.round(data.probings.speed_mm_s, 6)) if "speed_mm_s" in data.frame else np.array([1.0])
    at = ", ".join(f"{in_um(v['um_per_mm2_s2'] * s**2)} at {s:g} mm/s" for s in speeds[:3])
    return f"The axes fall behind with the square of the measuring speed: {at}. Measure slowly, at one speed."


def _tip(v: Values, data: Residuals) -> str:
    return (
        f"In placement {v['placement']} the probe triggers {in_um(v['um'])} {'later' if v['um'] > 0 else 'earlier'}"
        " than in the others: another tip or stylus, or one not qualified anew. Qualify it before each placement."
    )


FURTHER: dict[str, Sentence] = {
    "kinematic_pretravel": _tripod,
    "seat_defect": _seat,
    "thermal_shift": _shift,
    "thermal_expansion_of": _expansion,
    "thermal_bending": _bending,
    "error_motion": _motion,
    "scale_warm_up": _warm_up,
    "reversal_wear": _wear,
    "stick_slip": _stick,
    "scale_joint": _joint,
    "servo_lag": _servo,
    "tip_change": _tip,
}
