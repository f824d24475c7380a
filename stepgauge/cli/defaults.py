"""What the project file states stands for options that are left out; the command line and the environment win."""

from __future__ import annotations

import copy
from typing import Any

import click
from click.core import ParameterSource

from stepgauge.cli.build import VerbCommand, VerbOption
from stepgauge.cli.options import say
from stepgauge.cli.running import left_names
from stepgauge.errors import InputError
from stepgauge.project.file import Project, check_file, check_options
from stepgauge.project.find import NAME
from stepgauge.verbs.kinds import Reads, Writes

PATHS = {"FILE", "[FILE]", "FOLDER", "PATH", "GAUGE", "MACHINE", "PROBE", "P", "B", "BUDGET", "PDF", "XSD", "RECORDING"}
"""Placeholders of options that take a path, which the project file states as seen from its own folder."""


def with_defaults(command: click.Command, ctx: click.Context, project: Project, verb: tuple[str, ...]) -> click.Command:
    """The command of ``verb`` with what the project states as its defaults, told when it runs."""
    options = {_long(one): one for one in command.params if isinstance(one, click.Option)}
    check_options(project, verb, options)
    own = project.table(verb)
    stated = {**project.common, **own}
    values: dict[str, Any] = {}
    for key, value in stated.items():
        option = options.get(key)
        if option is None or not option.name or (key not in own and option.multiple):
            continue  # what takes one file per placement of the gauge is no matter for all verbs
        values[option.name] = _value(option, key, value, project)
        _check(option, key, values[option.name], ctx, project)
    ctx.default_map = {**(ctx.default_map or {}), verb[-1]: values}
    told = copy.copy(command)
    told.callback = _telling(command.callback, project, verb)
    return told


def _long(option: click.Option) -> str:
    """The long name of an option without its dashes: the key that stands for it."""
    return max(option.opts, key=len).lstrip("-")


def _check(option: click.Option, key: str, value: Any, ctx: click.Context, project: Project) -> None:
    """The value as the option takes it; what it refuses is told with the file and the key, not with the option."""
    try:
        option.type_cast_value(ctx, value)
    except (click.BadParameter, InputError) as error:
        found = value if isinstance(value, str) else repr(value)
        expected = error.expected if isinstance(error, InputError) else error.message
        raise InputError(project.path, f"key {key} is wrong", found=found, expected=expected) from None


def _is_path(option: click.Option) -> bool:
    """Whether a value is a path, which the project file states as seen from its own folder."""
    if isinstance(option, VerbOption):
        return isinstance(option.parameter.one, Reads | Writes)
    return option.metavar in PATHS


def _value(option: click.Option, key: str, value: Any, project: Project) -> Any:
    many = value if isinstance(value, list) else [value]
    if _is_path(option):
        many = [project.place(one) if isinstance(one, str) else one for one in many]
    if option.multiple:
        return many
    if isinstance(value, list) and option.nargs == 1:
        raise InputError(project.path, f"key {key} is a list", expected="one value")
    return many if isinstance(value, list) else many[0]


def _telling(callback: Any, project: Project, verb: tuple[str, ...]) -> Any:
    """The verb, after one line on what it takes from the project file: a value that nobody typed must be seen.

    :class:`InputError` where that is a file that is not there.
    """

    def run(*args: Any, **kwargs: Any) -> Any:
        """The line, then the verb."""
        ctx = click.get_current_context()
        if isinstance(ctx.command, VerbCommand):
            left = left_names(ctx.command.verb, ctx.params)
        else:
            left = getattr(callback, "leaves", lambda _: ())(ctx.params)
        taken = [
            option
            for option in ctx.command.params
            if isinstance(option, click.Option)
            and option.name
            and option.name not in left
            and ctx.get_parameter_source(option.name) == ParameterSource.DEFAULT_MAP
        ]
        for option in taken:
            if _is_path(option):
                check_file(project, verb, _long(option))
        if taken:
            shown = (f"--{_long(option)} {_shown(ctx.params[str(option.name)])}" for option in taken)
            say(f"from {NAME}: {', '.join(shown)}")
        return callback(*args, **kwargs)

    return run


def _shown(value: Any) -> str:
    return " ".join(map(str, value)) if isinstance(value, list | tuple) else str(value)
