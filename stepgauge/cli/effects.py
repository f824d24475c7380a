"""``stepgauge effects``: the vocabulary of what bends the readings of a machine."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from stepgauge.effects import Effect, Parameter


@click.command("effects")
@click.argument("kinds", nargs=-1, metavar="[KIND...]")
def command(kinds: tuple[str, ...]) -> None:
    """List the effects that a machine file can switch on and a diagnosis can name.

    Without a KIND one line each; with a KIND its equation, source and parameters with unit, bounds and the range that
    occurs on real machines, and an example for the machine file.

    \b
    stepgauge effects
    stepgauge effects gauge_temperature probe_lobing
    """
    from stepgauge.effects import effect_kinds
    from stepgauge.errors import InputError

    known = effect_kinds(every=True)
    for kind in kinds:
        if kind not in known:
            raise InputError(kind, "no such effect", expected=", ".join(sorted(known)))
    if kinds:
        click.echo("\n\n".join(_describe(known[kind]) for kind in kinds))
        return
    width = max(map(len, known))
    for kind in sorted(known):
        click.echo(f"{kind:<{width}}  {known[kind].title()}")
    click.echo("\n'stepgauge effects KIND' explains one: equation, parameters, units and bounds.")


def _describe(effect: type[Effect]) -> str:
    lines = [f"{effect.kind}: {effect.title()}", f"  {effect.equation}", f"  source: {effect.source}", ""]
    lines += [_parameter(parameter) for parameter in effect.parameters()]
    lines.append(f"  {'when':<16} {effect.model_fields['when'].description}; optional")
    lines += _in_formulas() if effect.kind == "empirical" else []
    lines += ["", "  [[effect]]", f'  kind = "{effect.kind}"']
    lines += [f"  {p.name} = {_example(p)}" for p in effect.parameters() if p.required]
    return "\n".join(lines)


def _in_formulas() -> list[str]:
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
        return f"{high / 4 if low <= 0 else (low * high) ** 0.5:.3g}"
    return "1.0"


_EXAMPLES = {
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
