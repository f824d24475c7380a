"""What is known of the effects that bend the readings of a machine, in words."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

from stepgauge.files.notation import rounded

if TYPE_CHECKING:
    from stepgauge.effects import Effect, Parameter
    from stepgauge.gauge.certified import Gauge
    from stepgauge.machine.file import Machine

    Given = tuple[Gauge | None, Machine | None]


def effects_text(kinds: Sequence[str], gauge: Gauge | None, machine: Machine | None) -> str:
    """Equation, source, parameters and usual sizes of kinds; :class:`InputError` for one that there is not."""
    from stepgauge.effects import effect_kinds

    known = effect_kinds(every=True)
    return "\n\n".join(_explain(kind, known, (gauge, machine)) for kind in kinds)


def _explain(kind: str, known: dict[str, type[Effect]], given: Given) -> str:
    if kind in known:
        return _describe(known[kind], given)
    from stepgauge.diagnosis.laws.geometry import KIND  # what fits it is not needed to explain an effect
    from stepgauge.errors import InputError

    if kind == KIND:
        return _describe_geometry()
    raise InputError(kind, "no such effect", expected=", ".join(sorted(known)))


def _describe_geometry() -> str:
    """What a diagnosis names that is no effect by itself, but all errors of the geometry together."""
    from stepgauge.diagnosis.laws.geometry import FEWEST_PLACEMENTS, KIND, PARTS
    from stepgauge.diagnosis.laws.usual import odds_of
    from stepgauge.diagnosis.priors import shipped_priors

    priors = shipped_priors()
    prior = priors.laws.of(KIND)
    every = textwrap.fill(f"every {', '.join(sorted(PARTS))} of the machine", 100, subsequent_indent="  ")
    return f"""{KIND}: All geometric errors of a machine at once, as of one that is not compensated
  {every}
  source: ISO 230-1:2012, the 21 error motions of three axes; Zhang et al. 1985

  A diagnosis names it from {FEWEST_PLACEMENTS} placements on, and writes every error as an effect of its own.

  usual size: {prior.usual:g} {prior.unit} ({prior.why})
  prior odds: 1 to {rounded(1.0 / odds_of(KIND, priors), 3)}"""


def _describe(effect: type[Effect], given: Given) -> str:
    lines = [f"{effect.kind}: {effect.title()}", f"  {effect.equation}", f"  source: {effect.source}", ""]
    lines += [_parameter(parameter) for parameter in effect.parameters()]
    lines.append(f"  {'when':<16} {effect.model_fields['when'].description}; optional")
    lines += _formula_words() if effect.kind == "empirical" else []
    lines += _usual(effect, *given)
    lines += ["", "  [[effect]]", f'  kind = "{effect.kind}"']
    lines += [f"  {p.name} = {_example(p)}" for p in effect.parameters() if p.required]
    return "\n".join(lines)


def _usual(effect: type[Effect], gauge: Gauge | None, machine: Machine | None) -> list[str]:
    """What a diagnosis expects of the effect before it has seen a reading."""
    from stepgauge.diagnosis.laws.grids import shape_range, usual_shape
    from stepgauge.diagnosis.laws.usual import odds_of, usual_size
    from stepgauge.diagnosis.priors import shipped_priors

    priors = shipped_priors()
    if not effect.sought or (effect.prior is None and effect.__module__.startswith("stepgauge.")):
        return []
    prior, usual = priors.laws.of(effect.kind), usual_size(effect, priors, gauge, machine)
    sizes = (usual.size, usual.size / priors.sizes.below, usual.size * priors.sizes.above)
    middle, low, high = (rounded(value, 2) for value in sizes)
    unit = f" {prior.unit}" if prior.unit else ""
    lines = ["", f"  usual size: {middle}{unit}, nearly two thirds of what occurs from {low} to {high}{unit}"]
    lines += [f"    {prior.usual:g}{unit}: {prior.why or 'what is usual on coordinate measuring machines'}"]
    if math.isfinite(prior.most):
        lines.append(f"    standard deviation at most {rounded(prior.most, 3)}{unit}: no more is physically possible")
    lines += [f"    times {rounded(factor, 3)}: {reason}" for reason, factor in usual.factors.items()]
    lines += [f"    {_MISSING[prior.basis]}"] if prior.basis and not usual.factors and prior.basis in _MISSING else []
    for p in effect.parameters():
        if p.decades:
            axes = "xyz" if machine is not None and p.unit == "mm" else [""]
            ends = {axis: _span(*shape_range(p, machine, axis), 4) for axis in axes}
            told = ", ".join(f"{axis} {words}".strip() for axis, words in ends.items())
            lines.append(f"  {p.name}: {told} {p.unit}, as likely in every decade")
        if p.usual is not None and (about := usual_shape(p, machine)) is not None:
            centre, factor, reason = about[0], math.exp(about[1]), p.usual.why
            usually, reach = rounded(centre, 3), _span(centre / factor, centre * factor, 3)
            lines.append(f"  {p.name}: usually {usually} {p.unit}, two thirds from {reach} {p.unit} ({reason})")
    odds = 1.0 / odds_of(effect.kind, priors)
    return [*lines, f"  prior odds: 1 to {rounded(odds, 2)}, shared among its axes, faces and columns"]


def _span(low: float, high: float, digits: int) -> str:
    return f"{rounded(low, digits)} to {rounded(high, digits)}"


_MISSING = {
    "grade": "grows with the repeatability of the machine (--machine)",
    "sag": "for a gauge of 1 m; --gauge tells it for yours",
    "certificate": "grows with the uncertainty of the certificate where that is large (--gauge)",
    "stylus": "grows with the third power of the stylus' length (--machine)",
}


def _formula_words() -> list[str]:
    from stepgauge.effects.empirical import DERIVED
    from stepgauge.files.formula import CONSTANTS, FUNCTIONS

    lines = ["", "  A formula knows the columns of the recording by name (x_mm, time_s, speed_mm_s, ...), besides"]
    lines += [f"  {name:<16} {meaning}" for name, meaning in DERIVED.items()]
    words = textwrap.wrap(f"and + - * / ** % < > ( ), {', '.join([*CONSTANTS, *FUNCTIONS])}", 100)
    return [*lines, *(f"  {line}" for line in words)]


def _parameter(parameter: Parameter) -> str:
    facts = [parameter.meaning]
    if parameter.unit:
        facts[0] += f", {parameter.unit}"
    if parameter.choices and not all(choice in parameter.meaning for choice in parameter.choices):
        facts.append(f"one of {', '.join(parameter.choices)}")
    if abs(parameter.low) < float("inf") or abs(parameter.high) < float("inf"):
        facts.append(f"{'above' if parameter.open_low else 'from'} {parameter.low:g} to {parameter.high:g}")
    if parameter.sensible is not None:
        facts.append(f"usually {parameter.sensible[0]:g} to {parameter.sensible[1]:g}")
    if not parameter.required:
        facts.append("optional" if parameter.default is None else f"default {parameter.default}")
    facts.append(parameter.role)
    return f"  {parameter.name:<16} {'; '.join(facts)}"


def _example(parameter: Parameter) -> str:
    """A value that the effect takes, as it is written in a machine file."""
    if parameter.name in _EXAMPLES:
        return _EXAMPLES[parameter.name]
    if parameter.choices:
        return f'"{parameter.choices[0]}"'
    if parameter.sensible is not None:
        low, high = parameter.sensible
        return rounded(high / 4 if low <= 0 else (low * high) ** 0.5, 3)
    return "1.0"


_EXAMPLES = {
    "block": "4",
    "column": '"scale_temperature_x_C"',
    "direction": '"y"',
    "face": "7",
    "placement": "2",
    "rows": "[12, 40]",
    "supports_mm": "[87.0, 323.0]",
    "length_mm": "700.0",
    "file": '"map.csv"',
    "formula": '"0.5 * side"',
}
