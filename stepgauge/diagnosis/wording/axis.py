"""What a finding means at an axis: one or two sentences per kind, in the user's units."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from stepgauge.axis.sensors import SENSORS
from stepgauge.diagnosis.wording.aliases import EvenSpacing, in_words
from stepgauge.diagnosis.wording.notation import name_of, significant
from stepgauge.effects import Effect, effect_kinds


@dataclass(frozen=True)
class About:
    """What was measured: ``span`` of the positions and ``duration_min``, as numbers; units and sensor in words.

    ``even``: the step of evenly spaced targets; ``unit_mm``: one unit of a linear axis in mm.
    """

    span: float
    duration_min: float
    position: str
    deviation: str
    sensor: str
    form: str
    even: EvenSpacing | None = None
    unit_mm: float | None = None

    @property
    def what(self) -> str:
        """The thing that moves, in words."""
        return {"axis": "axis", "spot": "spot", "distances": "line"}[self.form]


_NAMES = {
    "thermal_drift": "drift",
    "temperature_cycle": "slow cycle",
    "thermal_expansion_of": "thermal expansion",
    "stick_slip": "stick-slip",
}
"""Kinds whose names say more than an axis shows, or less."""
Parameters = Mapping[str, Mapping[str, Any]]
Sentence = Callable[[Parameters, About], str]


def kind_name(kind: str, form: str) -> str:
    """A kind in the words of an axis."""
    if kind == "effective_radius":
        return "additive constant" if form == "distances" else "pre-travel"
    words = None if kind not in (known := effect_kinds()) else known[kind].words_at("axis")
    return _NAMES.get(kind) or (words.name if words is not None and words.name else name_of(kind))


def meaning(kind: str, parameters: Parameters, about: About) -> str:
    """What a finding means and what to do, for the person at the axis."""
    sentence = _SENTENCES.get(kind)
    if sentence is not None:
        return sentence(parameters, about)
    known = effect_kinds().get(kind)
    if known is None:
        return kind
    words = known.words_at("axis")
    return f"{known.title()}." if words is None or not words.means else words.means.format(**_stated(known, parameters))


def _stated(known: type[Effect], parameters: Parameters) -> dict[str, str]:
    """Each parameter of an effect as its value with the user's unit, by the name that the effect declares.

    The names are in the order of the effect and end in the user's unit.
    """
    said = {}
    for p in known.parameters():
        stem = p.name.rsplit("_", 1)[0]
        one = parameters.get(p.name) or next((v for k, v in parameters.items() if k.startswith(f"{stem}_")), None)
        if one is not None:
            value, unit = one.get("value"), str(one.get("unit") or "")
            said[p.name] = _size(float(value), unit) if isinstance(value, float | int) else str(value)
    return said


def value_of(parameters: Parameters, *units: str, name: str = "") -> float:
    """The value of the first parameter in one of some units, or that begins with a name."""
    for key, one in parameters.items():
        if (name and key.startswith(name)) or (not name and one.get("unit") in units):
            return float(one["value"])
    return float("nan")


def _size(value: float, unit: str) -> str:
    return f"{significant(float(f'{abs(value):.2g}'), 2)} {unit}"


def _scale(p: Parameters, a: About) -> str:
    rate = next(one for one in p.values() if one.get("unit"))
    over = value_of(p, str(rate["unit"]))
    grows = "too long" if over > 0 else "too short"
    where = f"the distances read {grows}" if a.form == "distances" else f"the readings are {grows}"
    return (
        f"In proportion to position {where}, by {_size(over, str(rate['unit']))}. A wrong temperature or coefficient of"
        " expansion, and a line of measurement at an angle to the axis, look the same: check these first."
    )


def _curvature(p: Parameters, a: About) -> str:
    return "The error is bowed over the travel: look at the compensation table, the screw's preload and its warm-up."


def _periodic(p: Parameters, a: About) -> str:
    size, period = value_of(p, a.deviation), value_of(p, a.position)
    count = round(360.0 / period) if a.position == "deg" and a.form == "axis" else 0
    turns = f", {'once' if count == 1 else f'about {count} times'} a turn" if count else ""
    return (
        f"The error repeats every {significant(period, 4)} {a.position}{turns}, by up to {_size(size, a.deviation)}."
        " Compare the period with the pitch of the scale, screw or gear, the turn of the table, or the wavelength."
        f"{in_words(axis_aliases(p, a))}"
    )


def axis_aliases(p: Parameters, a: About) -> dict[str, Any]:
    """Periods along the axis that evenly spaced targets cannot tell from that of a finding; none for other findings."""
    period = next((one for key, one in p.items() if key.startswith("period") and one.get("unit") == a.position), None)
    if a.even is None or period is None:
        return {}
    return a.even.told(float(period["value"]), float(period.get("u") or 0.0), a.position, a.unit_mm)


def uneven_targets(even: EvenSpacing, unit: str) -> str:
    """The measurement that tells the aliases of a period apart."""
    places = ", ".join(f"{one:.12g}" for one in even.uneven())
    return (
        "measure at targets whose spacing is changed by irregular parts, by up to 30 % of it as ISO 230-2 asks, and"
        f" diagnose that recording: for example at {places} {unit}."
    )


def _local(p: Parameters, a: About) -> str:
    at = value_of(p, name="at")
    return (
        f"About {significant(at, 4)} {a.position} the readings are off by {_size(_um(p, a), a.deviation)}: look there."
    )


def _um(p: Parameters, a: About) -> float:
    return value_of(p, a.deviation)


def _reversal(p: Parameters, a: About) -> str:
    um = _um(p, a)
    more = "more" if um > 0 else "less"
    return (
        f"Coming in the positive direction the reading is {_size(um, a.deviation)} {more} than in the negative one:"
        " backlash, hysteresis of the drive or of the instrument."
    )


def _radius(p: Parameters, a: About) -> str:
    um = _um(p, a)
    if a.form == "distances":
        longer = "long" if um > 0 else "short"
        return f"All distances read {_size(um, a.deviation)} too {longer}, whatever their length."
    return f"The probe triggers {_size(um, a.deviation)} {'late' if um > 0 else 'early'}, from either side."


def _drift(p: Parameters, a: About) -> str:
    rate = value_of(p, name="rate")
    unit = f"{a.deviation}/h"
    tau = value_of(p, name="time_constant")
    if tau != tau:
        moved = abs(rate) * a.duration_min / 60.0
        return (
            f"The reading drifts by {_size(rate, unit)}, {_size(moved, a.deviation)} in {a.duration_min:.0f} min:"
            " let everything come to rest in temperature, or measure there and back."
        )
    return (
        f"The reading settles by {_size(rate * tau, a.deviation)} with a time constant of {significant(tau * 60, 3)}"
        " min: wait three time constants before measuring."
    )


def _cycle(p: Parameters, a: About) -> str:
    size, period = _um(p, a), value_of(p, "s")
    return (
        f"The reading goes to and fro by {_size(size, a.deviation)} every {significant(period, 4)} s, as an air"
        " conditioning or a cooling unit that switches would make it."
    )


def _step(p: Parameters, a: About) -> str:
    at = value_of(p, "s")
    return (
        f"At {significant(at, 4)} s the reading jumps by {_size(_um(p, a), a.deviation)}: a knock, a slipped clamp or a"
        " counting error. What was read before and after must not be mixed."
    )


def _vibration(p: Parameters, a: About) -> str:
    frequency = value_of(p, "Hz")
    return (
        f"The reading swings by {_size(_um(p, a), a.deviation)} at {significant(frequency, 4)} Hz, or at a frequency"
        " that looks the same at these moments of reading."
    )


def _delay(p: Parameters, a: About) -> str:
    return f"The position is latched {significant(abs(value_of(p, 'ms')), 3)} ms off its moment."


def _memory(p: Parameters, a: About) -> str:
    return f"The first readings after a pause are {_size(_um(p, a), a.deviation)} off: make some for nothing first."


def _growth(p: Parameters, a: About) -> str:
    per = str(p.get("per", {}).get("value", "position")).removeprefix("machine ")
    what = "distance" if a.form == "distances" else "position"
    return f"The scatter grows with {what if per in ('x', 'position') else per}; readings there count for less."


def _outliers(p: Parameters, a: About) -> str:
    count = int(value_of(p, "count")) if value_of(p, "count") == value_of(p, "count") else 0
    words = f"{count} reading{'s are' if count != 1 else ' is'}" if count else "Some readings are"
    return (
        f"{words} far outside the scatter and left out: a lost count, an interrupted beam, dirt, or a slip in writing."
    )


def _wear(p: Parameters, a: About) -> str:
    at, width = value_of(p, name="at"), value_of(p, name="width")
    return (
        f"About {significant(at, 4)} {a.position}, over a width of {significant(width, 2)} {a.position}, the reversal"
        f" is {_size(_um(p, a), a.deviation)} {'larger' if _um(p, a) > 0 else 'smaller'} than elsewhere: look there for"
        " wear of the screw or its nut, or for a guide that binds."
    )


def _joint(p: Parameters, a: About) -> str:
    at, of_slope = value_of(p, name="at"), bool(p["order"]["value"])
    size = p["size"]
    changed = "the slope of the error changes" if of_slope else "the readings jump"
    return (
        f"At {significant(at, 4)} {a.position} {changed} by {_size(float(size['value']), str(size['unit']))}: two"
        " pieces of a scale, or of a compensation table, meet there."
    )


def _stick(p: Parameters, a: About) -> str:
    return (
        f"Just after it turns, the axis lags by up to {_size(_um(p, a), a.deviation)} and catches up within"
        f" about {significant(value_of(p, name='decay'), 2)} {a.position}: friction in the guides or the drive."
        " Approach every target from farther away."
    )


def _column(p: Parameters) -> str:
    """The recorded quantity that is followed, and how late."""
    minus, lag_s = p.get("minus", {}).get("value"), value_of(p, name="lag")
    name = f"{p['column']['value']}" + (f" less {minus}" if minus else "")
    return name + (f", {_size(lag_s / 60.0, 'min')} late" if lag_s > 0.0 else "")


def _rate(p: Parameters) -> str:
    rate = next(one for name, one in p.items() if name.startswith("um_per"))
    return _size(float(rate["value"]), str(rate["unit"]))


def _expansion(p: Parameters, a: About) -> str:
    return (
        f"In proportion to position the readings follow {_column(p)}, by {_rate(p)}: the scale, or what realises the"
        " targets, expands. Correct it, or measure at one temperature."
    )


def _shift(p: Parameters, a: About) -> str:
    return (
        f"All readings follow {_column(p)} alike, by {_rate(p)}: zero moves, not the scale. Look at what holds the"
        " instrument and the part, or measure at one temperature."
    )


_SENTENCES: dict[str, Sentence] = {
    "scale_error": _scale,
    "scale_curvature": _curvature,
    "periodic_scale_error": _periodic,
    "screw_error": _periodic,
    "local_scale_defect": _local,
    "reversal_error": _reversal,
    "effective_radius": _radius,
    "thermal_drift": _drift,
    "temperature_cycle": _cycle,
    "step_change": _step,
    "vibration": _vibration,
    "trigger_delay": _delay,
    "approach_memory": _memory,
    "reversal_wear": _wear,
    "scale_joint": _joint,
    "stick_slip": _stick,
    "thermal_expansion_of": _expansion,
    "thermal_shift": _shift,
    "noise_growth": _growth,
    "outliers": _outliers,
}


def _evenly(even: EvenSpacing, about: About) -> str:
    step = f"{significant(even.spacing, 4)} {about.position}"
    return (
        f"The targets lie in even steps of {step}: an error whose period is {step} or a whole fraction of it is the"
        " same at all of them and cannot be seen, and a shorter period may show as a longer one, its alias. Targets at"
        " uneven steps show both."
    )


def axis_limits(said: Mapping[str, Any], about: About) -> list[str]:
    """What the recording cannot show, whatever the verdict."""
    found = []
    if not said["measured"]["time_recorded"]:
        found.append("No times were recorded: drift, cycles, jumps and vibration could not be looked for.")
    if not said["noise"]["from_repeats"] and about.form == "axis":
        found.append(
            "No target was read twice in the same direction: structure from target to target may count as noise."
        )
    if about.form == "axis":
        found.append(
            "Targets count as true unless their uncertainties are given; an error of what realises them is one of the"
            " axis here. There is no machine file, and none is written."
        )
    if about.form == "distances":
        found.append(
            "The places of the stations are not known and are fitted: an error in proportion to the distance cannot be"
            " told. Distances must be between points of one height, or reduced to it."
        )
    if about.form == "axis" and about.even is not None:
        found.append(_evenly(about.even, about))
    words = SENSORS[about.sensor].words
    found.append(
        f"Read by {'an' if words[0] in 'aeio' else 'a'} {words}: only what such a sensor can have was looked for."
    )
    return found
