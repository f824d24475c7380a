"""The click command of a verb, from its definition: arguments, options, help."""

from __future__ import annotations

import re
from typing import Any

import click

from stepgauge.verbs.define import REQUIRED, Verb, VerbParameter
from stepgauge.verbs.kinds import Flag, Reads


class KindType(click.ParamType):
    """A kind of parameter for click, whose errors are those of the Python function."""

    def __init__(self, parameter: VerbParameter) -> None:
        self.parameter = parameter
        self.name = parameter.one.name

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        return self.parameter.one.read(self.parameter.name, value)


class VerbOption(click.Option):
    """An option that knows the parameter which it stands for."""

    parameter: VerbParameter


class VerbCommand(click.Command):
    """A command that knows its verb."""

    verb: Verb


def make_command(name: str, verb: Verb) -> VerbCommand:
    """The command that runs a verb."""
    params = [_click(one, verb) for one in verb.parameters if one.at_command]
    if any(one.name == "machine" for one in verb.parameters):
        params.append(effects_option())

    def callback(**values: Any) -> None:
        """The verb, with what it writes."""
        from stepgauge.cli.running import run_verb

        run_verb(verb, values)

    text = "\n\n".join(_paragraph(one, verb) for one in verb.paragraphs)
    command = VerbCommand(name, params=params, callback=callback, help=text, short_help=verb.sentence)
    command.verb = verb
    return command


def effects_option() -> click.Option:
    """``--effects`` of all verbs that read a machine file, whose effects may be one's own."""

    def load(context: click.Context, __: click.Parameter, files: tuple[str, ...]) -> None:
        """Load each file before anything reads a machine."""
        if files and not context.resilient_parsing:
            from stepgauge.effects import load_effects

            for file in files:
                load_effects(file)

    text = "Python file with effects of your own, which it runs (docs/adding-an-effect.md)."
    told: dict[str, Any] = {"multiple": True, "metavar": "FILE", "expose_value": False, "is_eager": True}
    return click.Option(["--effects"], callback=load, help=f"{text}  [repeatable]", **told)


def _click(one: VerbParameter, verb: Verb) -> click.Parameter:
    if one.argument:
        many = one.repeated
        shown = f"{one.key.upper()}..." if many else one.key.upper()
        shown = shown if one.required else f"[{shown}]"
        nargs = -1 if many else 1
        settings: dict[str, Any] = {"nargs": nargs, "required": one.required, "metavar": shown}
        if one.default not in (REQUIRED, None) and not many:
            settings["default"] = one.default
        return click.Argument([one.name], type=KindType(one), **settings)
    option = VerbOption([one.name, *_names(one)], **_settings(one), help=_help(one, verb), required=one.required)
    option.parameter = one
    return option


def _names(one: VerbParameter) -> list[str]:
    return [f"--{one.key}", *([f"-{one.short}"] if one.short else [])]


def _settings(one: VerbParameter) -> dict[str, Any]:
    if isinstance(one.kind, Flag):
        return {"is_flag": True, "default": bool(one.default)}
    settings = {"type": KindType(one), "metavar": one.one.metavar, "multiple": one.repeated}
    if isinstance(one.one, Reads) and one.one.variable:
        settings["envvar"] = one.one.variable
    default = getattr(one.kind, "at_command", one.default)
    return settings if one.required else {**settings, "default": None if default is REQUIRED else default}


def _help(one: VerbParameter, verb: Verb) -> str:
    sentence = _cli_text(one.sentence, verb).rstrip(".")
    repeatable = ["repeatable"] if one.repeated else []
    facts = [*one.facts, *repeatable]
    return f"{sentence[:1].upper()}{sentence[1:]}." + (f"  [{'; '.join(facts)}]" if facts else "")


def _paragraph(text: str, verb: Verb) -> str:
    """A paragraph of the docstring as click takes it; one whose lines are indented or commands stays as it is."""
    if re.search(r"^(    |stepgauge )", text, re.M):
        return "\b\n" + _cli_text(text, verb)
    return _cli_text(text, verb)


def _cli_text(text: str, verb: Verb) -> str:
    """With options in place of the names of parameters, and words without their marks."""
    names = {one.name: one for one in verb.parameters}

    def typed(match: re.Match[str]) -> str:
        one = names.get(match[1])
        if one is None:
            return match[1].strip('"')
        return one.key.upper() if one.argument else f"--{one.key}"

    return re.sub(r"``([^`]+)``", typed, text)
