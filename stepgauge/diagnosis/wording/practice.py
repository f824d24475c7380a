"""Meaning of a finding at the machine: a sentence per kind, with the spans of the recording and the gauge length."""

from __future__ import annotations

from typing import Any

import numpy as np

from stepgauge.diagnosis.output.machine_text import effect_table
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.diagnosis.result import Finding, FindingMember
from stepgauge.diagnosis.wording.aliases import SAME_PLACE, even, in_words, leads_into_mm
from stepgauge.diagnosis.wording.notation import (
    direction_words,
    in_um,
    length_mm,
    listed,
    long,
    name_of,
    scatter_ratio,
    size,
    span_mm,
    towards,
)
from stepgauge.diagnosis.wording.sentences import FURTHER, Sentence, Values
from stepgauge.effects import effect_kinds
from stepgauge.files.notation import rounded
from stepgauge.recording import APPROACH

LEAST_ALONG = 0.2
"""Cosine to an axis from which on a gauge shows errors that repeat along it: it passes some pitches."""


def in_practice(finding: Finding | FindingMember, data: Residuals) -> str:
    """Meaning of a finding, for the person at the machine."""
    if isinstance(finding, Finding) and finding.effects:
        return _of_geometry(finding)
    values = _values(finding)
    sentence = _SENTENCES.get(finding.kind)
    if sentence is not None:
        part = f"Only where {values['when']}: " if "when" in values else ""
        return part + sentence(values, data) + in_words(aliases_of(finding, data))
    kind = effect_kinds().get(finding.kind)
    if kind is None:
        return finding.label
    words = kind.words_at("gauge")
    if words is None or not words.means:
        return f"{kind.title()}: {kind.equation}."
    units = {p.name: p.unit for p in kind.parameters()}
    said = {
        k: f"{size(v)} {units[k]}".strip() if isinstance(v, float) else str(v) for k, v in values.items() if k in units
    }
    return words.means.format(**said)


def _of_geometry(finding: Finding) -> str:
    """What all geometric errors at once do, and which of them are determined at k = 2."""
    known = [name for name, one in finding.parameters.items() if one.u is not None and abs(one.value) > 2.0 * one.u]
    largest = float(np.abs(finding.share_um).max())
    which = f": {listed([name_of(name) for name in known])}" if known else ""
    return (
        f"Scales, straightness, rotations and squareness of the machine err together, by up to {in_um(largest)} along"
        f" the approach, as of a machine that is not compensated. This recording determines {len(known)} of"
        f" {len(finding.parameters)} errors{which}; of the others it knows the sum along its lines only. Single"
        " values are no compensation."
    )


def aliases_of(finding: Finding | FindingMember, data: Residuals) -> dict[str, Any]:
    """Periods along the axis of a finding that evenly spaced faces cannot tell from its own; else none."""
    period = finding.parameters.get("period_mm")
    steps = None if period is None else even(data.probings.coordinate_mm(str(finding.choices["axis"])))
    return {} if steps is None or period is None else steps.told(period.value, period.u or 0.0, "mm", 1.0)


def even_steps_mm(data: Residuals) -> dict[str, float]:
    """The step by machine axis, mm, in which all fronts were probed, and all backs, whatever lies between the two.

    Only where usual leads of screws go into it: an error with such a period is one shift of all fronts, and another
    one of all backs.
    """
    found, placements = {}, np.unique(data.frame["placement"])
    axes = np.abs([data.probings.setting.axis[int(one)] for one in placements])
    for number, axis in enumerate("xyz"):
        at, along = data.probings.coordinate_mm(axis), axes[data.placement, number] > LEAST_ALONG
        steps = [even(at[along & (data.side == side)]) for side in (1.0, -1.0)]
        spacing = [one.spacing for one in steps if one is not None]
        if len(spacing) == 2 and np.ptp(spacing) < SAME_PLACE * spacing[0] and leads_into_mm(spacing[0]):
            found[axis] = spacing[0]
    return found


def _values(finding: Finding | FindingMember) -> Values:
    if finding.effect is not None:
        return effect_table(finding.effect)
    return {**finding.choices, **{k: e.value for k, e in finding.parameters.items() if k not in finding.choices}}


def _scale_error(v: Values, data: Residuals) -> str:
    axis, ppm = v["axis"], v["ppm"]
    span, length = span_mm(axis, data), length_mm(data)
    return (
        f"The {axis} scale indicates {size(ppm)} um/m too {long(ppm)}: {in_um(ppm * span * 1e-3)} over the {span:.0f}"
        f" mm of {axis} that were used (a gauge of {length:.0f} mm laid along {axis}: {in_um(ppm * length * 1e-3)})."
    )


def _scale_curvature(v: Values, data: Residuals) -> str:
    axis = v["axis"]
    low, high = data.probings.setting.travel_mm["xyz".index(axis)]
    reach = np.abs(data.probings.coordinate_mm(axis) - (low + high) / 2.0).max()
    um = v["um_per_m2"] * (reach * 1e-3) ** 2
    return (
        f"The error of the {axis} scale is a parabola about the middle of its travel: {in_um(um)} at {reach:.0f} mm"
        " from there, the largest distance that was measured."
    )


def _periodic(v: Values, data: Residuals) -> str:
    a, period = v["amplitude_um"], v["period_mm"]
    return (
        f"The error of the {v['axis']} scale repeats every {period:.5g} mm: up to {in_um(a)} for a position,"
        f" up to {in_um(2 * a)} for a length."
    )


def _local(v: Values, data: Residuals) -> str:
    return (
        f"Near {v['axis']} = {v['at_mm']:.1f} mm, over about {v['width_mm']:.0f} mm, the machine indicates"
        f" {in_um(v['height_um'])} too {long(v['height_um'])}, wherever the gauge lies."
    )


def _squareness(v: Values, data: Residuals) -> str:
    first, second = v["plane"]
    um = v["urad"] * span_mm(second, data) * 1e-3
    return (
        f"The axes {first} and {second} are {size(v['urad'])} urad off perpendicular: {first} changes by {in_um(um)}"
        f" over the {span_mm(second, data):.0f} mm of {second} that were used."
    )


def _angular(v: Values, data: Residuals) -> str:
    return (
        f"The {v['travel_axis']} carriage rotates about {v['rotation_axis']} by {size(v['urad_per_m'])} urad per metre"
        " of travel; the error of a length is this rotation times its distance from the scale (Abbe)."
    )


def _roll(v: Values, data: Residuals) -> str:
    return f"The {v['axis']} carriage rolls by {size(v['urad_per_m'])} urad per metre of its travel."


def _straightness(v: Values, data: Residuals) -> str:
    return (
        f"The {v['axis']} guideway is curved towards {towards(v['direction'], v['um'])} by {in_um(v['um'])} in the"
        f" middle of {v['length_mm']:.0f} mm."
    )


def _reversal(v: Values, data: Residuals) -> str:
    more = "more" if v["um"] > 0 else "less"
    return (
        f"{v['axis'].upper()} indicates {in_um(v['um'])} {more} when probed towards +{v['axis']} than towards"
        f" -{v['axis']}: backlash, hysteresis of the drive, or a probe with a pre-travel that depends on the direction."
        " The size of a block has this error."
    )


def _radius(v: Values, data: Residuals) -> str:
    later = "later" if v["um"] > 0 else "earlier"
    modelled = float(np.mean(data.machine.sensor.pretravel_um(data.frame[APPROACH].to_numpy(float))))
    pretravel = modelled + v["um"]
    return (
        f"The probe triggers {in_um(v['um'])} {later} than modelled, equally on all faces: the pre-travel is"
        f" {pretravel:.2f} um instead of {modelled:.2f} um, the effective radius"
        f" {data.machine.probe.tip_radius_mm - pretravel * 1e-3:.5f} mm. Blocks appear too"
        f" {'small' if v['um'] > 0 else 'large'} by {in_um(2 * v['um'])}."
    )


def _lobing(v: Values, data: Residuals) -> str:
    return (
        f"The pre-travel varies by {in_um(2 * v['amplitude_um'])} with the direction of approach in three lobes,"
        f" largest at an azimuth of {v['phase_deg']:.0f} deg and every 120 deg from there."
    )


def _delay(v: Values, data: Residuals) -> str:
    speed = (
        data.probings.speed_mm_s if "speed_mm_s" in data.frame else np.array(data.machine.table.measuring_speed_mm_s)
    )
    speeds = np.unique(np.round(speed, 6))
    at = ", ".join(f"{in_um(v['ms'] * s)} at {s:g} mm/s" for s in speeds[:3])
    return f"The position is latched {rounded(abs(v['ms']), 3)} ms {'late' if v['ms'] > 0 else 'early'}: {at}."


def _lever(v: Values, data: Residuals) -> str:
    return f"The trigger lever is {size(v['mm'])} mm {'longer' if v['mm'] > 0 else 'shorter'} than modelled."


def _pretravel_scale(v: Values, data: Residuals) -> str:
    more, bends = ("larger", "more") if v["percent"] > 0 else ("smaller", "less")
    return (
        f"The pre-travel is {size(v['percent'])} % {more} than modelled in every direction: the stylus bends {bends},"
        " or the spring is set otherwise. Check which stylus is in the probe, or correct its stiffness in the machine"
        " file."
    )


def _gauge_temperature(v: Values, data: Residuals) -> str:
    um = v["delta_K"] * data.gauge.table.expansion_per_K * 1e3 * length_mm(data)
    return (
        f"The gauge is {size(v['delta_K'])} K {'warmer' if v['delta_K'] > 0 else 'colder'} than recorded:"
        f" {in_um(um)} over the {length_mm(data):.0f} mm measured."
    )


def _gauge_reversed(v: Values, data: Residuals) -> str:
    return (
        "The faces stand where the certificate has them if it is counted from the other end"
        f" (share {v['share']:.2f}; 1 if it is so): the gauge was laid the wrong way round, or its blocks were numbered"
        " from the wrong end."
    )


def _gauge_soaking(v: Values, data: Residuals) -> str:
    um = v["delta_K"] * data.gauge.table.expansion_per_K * 1e3 * length_mm(data)
    minutes = v["time_constant_h"] * 60.0
    each = "Whenever it has been laid, the gauge is" if v["warmed"] == "anew" else "At first the gauge is"
    return (
        f"{each} {size(v['delta_K'])} K {'warmer' if v['delta_K'] > 0 else 'colder'} than recorded, {in_um(um)} over"
        f" the {length_mm(data):.0f} mm measured, and takes on the temperature of its surroundings with a time constant"
        f" of {rounded(minutes, 3)} min: let it soak for {size(3.0 * minutes)} min."
    )


def _scale_temperature(v: Values, data: Residuals) -> str:
    axis, k = v["axis"], v["delta_K"]
    if axis == "all":
        return _all_scales(k, data)
    um = k * data.probings.setting.scale_expansion_per_K * 1e3 * span_mm(axis, data)
    return (
        f"The {axis} scale is {size(k)} K {'warmer' if k > 0 else 'colder'} than recorded: it indicates"
        f" {in_um(float(um))} too {long(-k)} over the {span_mm(axis, data):.0f} mm of {axis} that were used."
    )


def _all_scales(k: float, data: Residuals) -> str:
    um = k * data.probings.setting.scale_expansion_per_K * 1e3 * length_mm(data)
    return (
        f"All scales are {size(k)} K {'warmer' if k > 0 else 'colder'} than recorded: they indicate"
        f" {in_um(float(um))} too {long(-k)} over the {length_mm(data):.0f} mm of the gauge, wherever it lies."
    )


def _drift(v: Values, data: Residuals) -> str:
    rate, tau = v["rate_um_per_h"], v.get("time_constant_h")
    since = max(float(v.get("start_s", 0.0)), float(data.probings.time_s.min()))
    hours = (float(data.probings.time_s.max()) - since) / 3600.0
    begun = f" from {rounded(since, 4)} s on" if since > data.probings.time_s.min() else ""
    if tau is None:
        return (
            f"Relative to the machine the gauge drifts{begun} towards {towards(v['direction'], rate)} at"
            f" {rounded(abs(rate), 3)} um/h: {in_um(rate * hours)} in the {hours * 60:.0f} min that were measured."
        )
    return (
        f"Relative to the machine the gauge settles{begun} towards {towards(v['direction'], rate)} with a time constant"
        f" of {rounded(tau * 60, 3)} min, by {in_um(rate * tau)} in all: it is at rest after three time constants."
    )


def _cycle(v: Values, data: Residuals) -> str:
    return (
        f"The gauge oscillates along {direction_words(v['direction'])} by +-{in_um(v['amplitude_um'])} every"
        f" {rounded(v['period_s'], 4)} s, as with an air conditioning or a coolant unit that switches on and off."
    )


def _step(v: Values, data: Residuals) -> str:
    before = int((data.probings.time_s < v["time_s"]).sum())
    return (
        f"At {rounded(v['time_s'], 4)} s, between probings {before} and {before + 1} in order of time, the origin"
        f" changed by {in_um(v['um'])} towards {towards(v['direction'], v['um'])}: a knock or a slipped clamp."
    )


def _misalignment(v: Values, data: Residuals) -> str:
    um = length_mm(data) * 1e3 * (1.0 / np.cos(v["mrad"] * 1e-3) - 1.0)
    where = f"In placement {v['placement']} the" if v.get("placement") else "The"
    return (
        f"{where} probed line is {abs(v['mrad']):.3g} mrad off the axis of the gauge; the cosine error makes lengths"
        f" too long: {in_um(um)} over the {length_mm(data):.0f} mm measured."
    )


def _block(v: Values, data: Residuals) -> str:
    face = int(v["face"])
    side = "front" if face % 2 else "back"
    end = "end" if v["um"] > 0 else "beginning"
    u = float(data.gauge.u_um[face - 1])
    return (
        f"Face {face}, the {side} of block {(face + 1) // 2}, lies {in_um(v['um'])} nearer to the {end} block than"
        f" certified (standard uncertainty {size(u)} um)."
    )


def _shifted(v: Values, data: Residuals) -> str:
    end = "end" if v["um"] > 0 else "beginning"
    u = float(data.gauge.u_um[2 * int(v["block"]) - 1])
    return (
        f"Both faces of block {int(v['block'])} lie {in_um(v['um'])} nearer to the {end} block than certified (standard"
        f" uncertainty {size(u)} um): the block was moved."
    )


def _bending(v: Values, data: Residuals) -> str:
    return f"The gauge sags by {in_um(v['sag_um'])} between its supports, which tilts its faces."


def _memory(v: Values, data: Residuals) -> str:
    later = "later" if v["um"] > 0 else "earlier"
    return (
        f"The first probing after a pause triggers {in_um(v['um'])} {later}; this decays to 1/e within"
        f" {size(v['touches'])} probings."
    )


def _vibration(v: Values, data: Residuals) -> str:
    return (
        f"The machine and the gauge vibrate relative to each other along {direction_words(v['direction'])} by"
        f" +-{in_um(v['amplitude_um'])} at {v['frequency_hz']:.5g} Hz, or at an alias of this frequency at these"
        " times of probing."
    )


def _growth(v: Values, data: Residuals) -> str:
    unit = {"speed": "mm/s of speed", "time": "hour"}.get(v["per"], f"metre of {v['per']}")
    return (
        f"The scatter grows with {v['per']}: {size(v['rate'])} um per {unit} are added in quadrature. These points"
        " have less weight in the fit."
    )


def _repeatability(v: Values, data: Residuals) -> str:
    return f"{scatter_ratio(v['repeatability_um'], v['stated_um'])}; uncertainties follow what was found."


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
    "pretravel_scale": _pretravel_scale,
    "gauge_temperature": _gauge_temperature,
    "gauge_reversed": _gauge_reversed,
    "gauge_soaking": _gauge_soaking,
    "scale_temperature": _scale_temperature,
    "thermal_drift": _drift,
    "temperature_cycle": _cycle,
    "step_change": _step,
    "misalignment": _misalignment,
    "block_defect": _block,
    "block_shift": _shifted,
    "gauge_bending": _bending,
    "approach_memory": _memory,
    "vibration": _vibration,
    "noise_growth": _growth,
    "outliers": _outliers,
    "repeatability": _repeatability,
    **FURTHER,
}
