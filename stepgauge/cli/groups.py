"""Groups of verbs, whose commands are made when they are asked for."""

from __future__ import annotations

import copy
import difflib
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from stepgauge.cli.build import VerbCommand, VerbOption, make_command
from stepgauge.cli.running import left_names
from stepgauge.cli.say import say
from stepgauge.errors import InputError
from stepgauge.project.find import NAME, find_project
from stepgauge.verbs.catalogue import GROUPS, PLACES, VERBS, find_verb, verbs_of

if TYPE_CHECKING:
    from stepgauge.project.file import Project

CALLED = {"page": "web", "browser": "web", "gui": "web", "calibrate": "evaluate", "placement": "locate"}
"""Verbs by what they are looked for as."""


class VerbGroup(click.Group):
    """Verbs by headings (``tasks``); a word that is no verb is a group of verbs itself."""

    def __init__(self, *args: Any, tasks: Mapping[str, Sequence[str]], prefix: str = "", **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.tasks, self.prefix = tasks, prefix

    def list_commands(self, ctx: click.Context) -> list[str]:
        return [name for names in self.tasks.values() for name in names]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The group or the verb of a word, made when it is asked for; None where there is none."""
        words = self.prefix + cmd_name
        if words in GROUPS:
            return make_group(words)
        if words not in PLACES:
            return None
        verb = find_verb(words)
        command = make_command(cmd_name, verb)
        path = find_project() if verb.in_project and not ctx.resilient_parsing else None
        if path is None:
            return command
        from stepgauge.project.file import read_project

        return apply_defaults(command, ctx, read_project(path, VERBS), tuple(words.split()))

    def invoke(self, ctx: click.Context) -> Any:
        """What a verb writes is one set of files, which appears when the verb is done."""
        from stepgauge.files.outputs import one_set

        if ctx.parent is not None:
            return super().invoke(ctx)
        with one_set():
            return super().invoke(ctx)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        width = max(map(len, self.list_commands(ctx)))
        for heading, names in self.tasks.items():
            with formatter.section(heading):
                formatter.write_dl([(name.ljust(width), _sentence(self.prefix + name)) for name in names])

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """The group alone, ``help`` and ``help VERB`` print help, as ``--help`` does."""
        if not args and not ctx.resilient_parsing:
            args = ["--help"]
        elif args[:1] == ["help"]:
            args = [*args[1:], "--help"]
        return super().parse_args(ctx, args)

    def resolve_command(self, ctx: click.Context, args: list[str]) -> Any:
        """The verb that is meant; one that is mistyped is an error that names the nearest and what there is."""
        try:
            return super().resolve_command(ctx, args)
        except click.UsageError as error:
            names, word = self.list_commands(ctx), args[0].lower()
            known = {name: name for name in names} | {called: one for called, one in CALLED.items() if one in names}
            near = [known[one] for one in difflib.get_close_matches(word, known, n=1)]
            hint = f" Did you mean '{near[0]}'?" if near else ""
            raise click.UsageError(f"{error.message}{hint} There are: {', '.join(names)}.", ctx) from None


def make_group(name: str) -> VerbGroup:
    """The group of the verbs that begin with a word."""
    return VerbGroup(name, tasks={"Verbs": verbs_of(name)}, prefix=f"{name} ", help=GROUPS[name])


def _sentence(words: str) -> str:
    """What a verb or a group is for, in a line."""
    if words in GROUPS:
        return GROUPS[words].partition("\n")[0].rstrip(".")
    return find_verb(words).sentence


def apply_defaults(command: VerbCommand, ctx: click.Context, project: Project, words: tuple[str, ...]) -> VerbCommand:
    """The command of a verb with what the project states as its defaults, told when it runs."""
    from stepgauge.project.file import check_options

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
        from stepgauge.project.file import check_file

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
