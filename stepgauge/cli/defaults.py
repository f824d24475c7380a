"""What the project file states stands for options that are left out; the command line and the environment win."""

from __future__ import annotations

import copy
from typing import Any

import click
from click.core import ParameterSource

from stepgauge.cli.build import VerbCommand, VerbOption
from stepgauge.cli.running import left_names
from stepgauge.cli.say import say
from stepgauge.errors import InputError
from stepgauge.project.file import Project, check_file, check_options
from stepgauge.project.find import NAME


def apply_defaults(command: VerbCommand, ctx: click.Context, project: Project, words: tuple[str, ...]) -> VerbCommand:
    """The command of a verb with what the project states as its defaults, told when it runs."""
    options = {one.parameter.key: one for one in command.params if isinstance(one, VerbOption)}
    check_options(project, words, options)
    own = project.table(words)
    values: dict[str, Any] = {}
    for key, value in project.stated(*words).items():
        option = options.get(key)
        if option is None or (key not in own and option.parameter.repeated):
            continue  # what takes one file per placement of the gauge is no matter for all verbs
        values[option.parameter.name] = _value(option, key, value, project)
        _check(option, key, values[option.parameter.name], project)
    ctx.default_map = {**(ctx.default_map or {}), words[-1]: values}
    told = copy.copy(command)
    told.callback = _telling(command.callback, project, words)
    return told


def _check(option: VerbOption, key: str, value: Any, project: Project) -> None:
    """The value as the option takes it; what it refuses is told with the file and the key, not with the option."""
    one = option.parameter
    try:
        for each in value if one.repeated else [value]:
            one.one.read(one.name, each)
    except InputError as error:
        found = value if isinstance(value, str) else repr(value)
        raise InputError(project.path, f"key {key} is wrong", found=found, expected=error.parts[3]) from None


def _value(option: VerbOption, key: str, value: Any, project: Project) -> Any:
    many = value if isinstance(value, list) else [value]
    if option.parameter.one.is_path:
        many = [project.place(one) if isinstance(one, str) else one for one in many]
    if option.parameter.repeated:
        return many
    if isinstance(value, list):
        raise InputError(project.path, f"key {key} is a list", expected="one value")
    return many[0]


def _telling(callback: Any, project: Project, words: tuple[str, ...]) -> Any:
    """The verb, after one line on what it takes from the project file: a value that nobody typed must be seen.

    :class:`InputError` where that is a file that is not there.
    """

    def run(*args: Any, **kwargs: Any) -> Any:
        """The line, then the verb."""
        ctx = click.get_current_context()
        assert isinstance(ctx.command, VerbCommand)
        left = left_names(ctx.command.verb, ctx.params)
        taken = [
            option.parameter
            for option in ctx.command.params
            if isinstance(option, VerbOption)
            and option.parameter.name not in left
            and ctx.get_parameter_source(option.parameter.name) == ParameterSource.DEFAULT_MAP
        ]
        for one in taken:
            check_file(project, words, one.key, one.one)
        told = [one for one in taken if one.one.is_read or not one.one.is_path]  # what is written 'wrote' names
        if told:
            say(f"from {NAME}: {', '.join(f'--{one.key} {_shown(ctx.params[one.name])}' for one in told)}")
        return callback(*args, **kwargs)

    return run


def _shown(value: Any) -> str:
    return " ".join(map(str, value)) if isinstance(value, list | tuple) else str(value)
