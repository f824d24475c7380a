"""Meaning of a finding at the machine: a sentence per kind, with the spans of the recording and the gauge length."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from stepgauge.diagnose.machine_text import effect_table
from stepgauge.diagnose.residuals import Residuals
from stepgauge.diagnose.result import Finding, Member
from stepgauge.effects import effect_kinds
from stepgauge.recording import APPROACH

Values = Mapping[str, Any]
Sentence = Callable[[Values, Residuals], str]


def in_practice(finding: Finding | Member, data: Residuals) -> str:
    """Meaning of a finding, for the person at the machine."""
    values = _values(finding)
    sentence = _SENTENCES.get(finding.kind)
    if sentence is not None:
        return sentence(values, data)
    kind = effect_kinds().get(finding.kind)
    return f"{kind.title()}: {kind.equation}." if kind is not None else finding.label


def name_of(kind: str) -> str:
    """A kind in words."""
    return kind.replace("_", " ")


def counted(names: Iterable[str]) -> list[str]:
    """Names, each once, with their number: ``vibration``, ``twice step change x``."""
    said = {1: "", 2: "twice "}
    return [f"{said.get(times, f'{times} times ')}{name}" for name, times in Counter(names).items()]


def _values(finding: Finding | Member) -> Values:
    if finding.effect is not None:
        return effect_table(finding.effect)
    return {**finding.choices, **{k: e.value for k, e in finding.parameters.items() if k not in finding.choices}}


def _span_mm(axis: str, data: Residuals) -> float:
    return float(np.ptp(data.probings.coordinate_mm(axis)))


def _length_mm(data: Residuals) -> float:
    return float(np.ptp(data.probings.certified_mm()))


def _size(value: float) -> str:
    """The magnitude in two significant digits, without an exponent where a number has few."""
    return f"{float(f'{abs(value):.2g}'):g}"


def _um(value: float, digits: int = 2) -> str:
    """A length of some um: two significant digits, never an exponent."""
    size = abs(value)
    decimals = int(np.clip(digits - 1 - np.floor(np.log10(size)), 0, 4)) if size > 1e-9 else 1
    return f"{size:.{decimals}f} um"


def _long(value: float) -> str:
    return "long" if value > 0 else "short"


def _towards(direction: Any, um: float) -> str:
    """A displacement along a machine axis, in words."""
    if isinstance(direction, str):
        return f"{'+' if um > 0 else '-'}{direction}"
    return f"{'' if um > 0 else '-'}{line(direction)}"


def line(direction: Any) -> str:
    """A machine axis by name, or a direction by its components."""
    if isinstance(direction, str):
        return direction
    return f"({', '.join(f'{d + 0.0:.3f}' for d in np.round(direction, 3))})"


def _scale_error(v: Values, data: Residuals) -> str:
    axis, ppm = v["axis"], v["ppm"]
    span, length = _span_mm(axis, data), _length_mm(data)
    return (
        f"The {axis} scale indicates {_size(ppm)} um/m too {_long(ppm)}: {_um(ppm * span * 1e-3)} over the {span:.0f}"
        f" mm of {axis} that were used (a gauge of {length:.0f} mm laid along {axis}: {_um(ppm * length * 1e-3)})."
    )


def _scale_curvature(v: Values, data: Residuals) -> str:
    axis = v["axis"]
    low, high = data.probings.setting.travel_mm["xyz".index(axis)]
    reach = np.abs(data.probings.coordinate_mm(axis) - (low + high) / 2.0).max()
    um = v["um_per_m2"] * (reach * 1e-3) ** 2
    return (
        f"The error of the {axis} scale is a parabola about the middle of its travel: {_um(um)} at {reach:.0f} mm from"
        " there, the largest distance that was measured."
    )


def _periodic(v: Values, data: Residuals) -> str:
    a, period = v["amplitude_um"], v["period_mm"]
    return (
        f"The error of the {v['axis']} scale repeats every {period:.5g} mm: up to {_um(a)} for a position,"
        f" up to {_um(2 * a)} for a length. Compare the period with the pitch of the scale, screw or rack."
    )


def _local(v: Values, data: Residuals) -> str:
    return (
        f"Near {v['axis']} = {v['at_mm']:.1f} mm, over about {v['width_mm']:.0f} mm, the machine indicates"
        f" {_um(v['height_um'])} too {_long(v['height_um'])}, wherever the gauge lies: inspect the scale."
    )


def _squareness(v: Values, data: Residuals) -> str:
    first, second = v["plane"]
    um = v["urad"] * _span_mm(second, data) * 1e-3
    return (
        f"The axes {first} and {second} are {_size(v['urad'])} urad off perpendicular: {first} changes by {_um(um)}"
        f" over the {_span_mm(second, data):.0f} mm of {second} that were used."
    )


def _angular(v: Values, data: Residuals) -> str:
    return (
        f"The {v['travel_axis']} carriage rotates about {v['rotation_axis']} by {_size(v['urad_per_m'])} urad per metre"
        " of travel; the error of a length is this rotation times its distance from the scale (Abbe)."
    )


def _roll(v: Values, data: Residuals) -> str:
    return f"The {v['axis']} carriage rolls by {_size(v['urad_per_m'])} urad per metre of its travel."


def _straightness(v: Values, data: Residuals) -> str:
    return (
        f"The {v['axis']} guideway is curved towards {_towards(v['direction'], v['um'])} by {_um(v['um'])} in the"
        f" middle of {v['length_mm']:.0f} mm."
    )


def _reversal(v: Values, data: Residuals) -> str:
    more = "more" if v["um"] > 0 else "less"
    return (
        f"{v['axis'].upper()} indicates {_um(v['um'])} {more} when probed towards +{v['axis']} than towards"
        f" -{v['axis']}: backlash, hysteresis of the drive, or a probe with a pre-travel that depends on the direction."
        " The size of a block has this error."
    )


def _radius(v: Values, data: Residuals) -> str:
    later = "later" if v["um"] > 0 else "earlier"
    modelled = float(np.mean(data.machine.sensor.pretravel_um(data.frame[APPROACH].to_numpy(float))))
    pretravel = modelled + v["um"]
    return (
        f"The probe triggers {_um(v['um'])} {later} than modelled, equally on all faces: the pre-travel is"
        f" {pretravel:.2f} um instead of {modelled:.2f} um, the effective radius"
        f" {data.machine.probe.tip_radius_mm - pretravel * 1e-3:.5f} mm. Blocks appear too"
        f" {'small' if v['um'] > 0 else 'large'} by {_um(2 * v['um'])}."
    )


def _lobing(v: Values, data: Residuals) -> str:
    return (
        f"The pre-travel varies by {_um(2 * v['amplitude_um'])} with the direction of approach in three lobes, largest"
        f" at an azimuth of {v['phase_deg']:.0f} deg and every 120 deg from there."
    )


def _delay(v: Values, data: Residuals) -> str:
    speed = (
        data.probings.speed_mm_s if "speed_mm_s" in data.frame else np.array(data.machine.table.measuring_speed_mm_s)
    )
    speeds = np.unique(np.round(speed, 6))
    at = ", ".join(f"{_um(v['ms'] * s)} at {s:g} mm/s" for s in speeds[:3])
    return f"The position is latched {abs(v['ms']):.3g} ms {'late' if v['ms'] > 0 else 'early'}: {at}."


def _lever(v: Values, data: Residuals) -> str:
    return f"The trigger lever is {_size(v['mm'])} mm {'longer' if v['mm'] > 0 else 'shorter'} than modelled."


def _gauge_temperature(v: Values, data: Residuals) -> str:
    um = v["delta_K"] * data.gauge.table.expansion_per_K * 1e3 * _length_mm(data)
    return (
        f"The gauge is {_size(v['delta_K'])} K {'warmer' if v['delta_K'] > 0 else 'colder'} than recorded:"
        f" {_um(um)} over the {_length_mm(data):.0f} mm measured. Wait for thermal equilibrium, or measure its"
        " temperature."
    )


def _scale_temperature(v: Values, data: Residuals) -> str:
    axis, k = v["axis"], v["delta_K"]
    um = k * data.probings.setting.scale_expansion_per_K * 1e3 * _span_mm(axis, data)
    return (
        f"The {axis} scale is {_size(k)} K {'warmer' if k > 0 else 'colder'} than recorded: it indicates"
        f" {_um(float(um))} too {_long(-k)} over the {_span_mm(axis, data):.0f} mm of {axis} that were used."
    )


def _drift(v: Values, data: Residuals) -> str:
    rate, tau = v["rate_um_per_h"], v.get("time_constant_h")
    hours = float(np.ptp(data.probings.time_s)) / 3600.0
    if tau is None:
        return (
            f"Relative to the machine the gauge drifts towards {_towards(v['direction'], rate)} at {abs(rate):.3g}"
            f" um/h: {_um(rate * hours)} during this measurement of {hours * 60:.0f} min."
        )
    return (
        f"Relative to the machine the gauge settles towards {_towards(v['direction'], rate)} with a time constant of"
        f" {tau * 60:.3g} min, by {_um(rate * tau)} in all: wait three time constants before measuring."
    )


def _cycle(v: Values, data: Residuals) -> str:
    return (
        f"The gauge oscillates along {line(v['direction'])} by +-{_um(v['amplitude_um'])} every"
        f" {v['period_s']:.4g} s, as with an air conditioning or a coolant unit that switches on and off."
    )


def _step(v: Values, data: Residuals) -> str:
    before = int((data.probings.time_s < v["time_s"]).sum())
    return (
        f"At {v['time_s']:.4g} s, between probings {before} and {before + 1} in order of time, the origin changed by"
        f" {_um(v['um'])} towards {_towards(v['direction'], v['um'])}: a knock or a slipped clamp. Do not combine"
        " readings from before and after."
    )


def _misalignment(v: Values, data: Residuals) -> str:
    um = _length_mm(data) * 1e3 * (1.0 / np.cos(v["mrad"] * 1e-3) - 1.0)
    return (
        f"The probed line is {abs(v['mrad']):.3g} mrad off the axis of the gauge; the cosine error makes lengths too"
        f" long: {_um(um)} over the {_length_mm(data):.0f} mm measured. Locate the gauge again."
    )


def _block(v: Values, data: Residuals) -> str:
    face = int(v["face"])
    side = "front" if face % 2 else "back"
    end = "end" if v["um"] > 0 else "beginning"
    u = float(data.gauge.u_um[face - 1])
    return (
        f"Face {face}, the {side} of block {(face + 1) // 2}, lies {_um(v['um'])} nearer to the {end} block than"
        f" certified (standard uncertainty {_size(u)} um): clean it, then have it calibrated."
    )


def _bending(v: Values, data: Residuals) -> str:
    return f"The gauge sags by {_um(v['sag_um'])} between its supports, which tilts its faces."


def _memory(v: Values, data: Residuals) -> str:
    later = "later" if v["um"] > 0 else "earlier"
    return (
        f"The first probing after a pause triggers {_um(v['um'])} {later}; this decays to 1/e within"
        f" {_size(v['touches'])} probings: probe some points before the measurement."
    )


def _vibration(v: Values, data: Residuals) -> str:
    return (
        f"The machine and the gauge vibrate relative to each other along {line(v['direction'])} by"
        f" +-{_um(v['amplitude_um'])} at {v['frequency_hz']:.5g} Hz, or at an alias of this frequency at these"
        " times of probing."
    )


def _growth(v: Values, data: Residuals) -> str:
    unit = {"speed": "mm/s of speed", "time": "hour"}.get(v["per"], f"metre of {v['per']}")
    return (
        f"The scatter grows with {v['per']}: {_size(v['rate'])} um per {unit} are added in quadrature. These points"
        " have less weight in the fit."
    )


def _outliers(v: Values, data: Residuals) -> str:
    count = len(v["rows"])
    return (
        f"{count} probing{'s are' if count > 1 else ' is'} far outside the scatter of the repeats and not used in the"
        " fit: dirt, a false trigger, or a hand on the table."
    )


_SENTENCES: dict[str, Sentence] = {
    "scale_error": _scale_error,
    "scale_curvature": _scale_curvature,
    "periodic_scale_error": _periodic,
    "local_scale_defect": _local,
    "squareness": _squareness,
    "angular_error": _angular,
    "roll": _roll,
    "straightness": _straightness,
    "reversal_error": _reversal,
    "effective_radius": _radius,
    "probe_lobing": _lobing,
    "trigger_delay": _delay,
    "lever_arm": _lever,
    "gauge_temperature": _gauge_temperature,
    "scale_temperature": _scale_temperature,
    "thermal_drift": _drift,
    "temperature_cycle": _cycle,
    "step_change": _step,
    "misalignment": _misalignment,
    "block_defect": _block,
    "gauge_bending": _bending,
    "approach_memory": _memory,
    "vibration": _vibration,
    "noise_growth": _growth,
    "outliers": _outliers,
}
