"""Groups of verbs, whose commands are made when they are asked for."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from typing import Any

import click

from stepgauge.cli.build import make_command
from stepgauge.project.find import find_project
from stepgauge.verbs.catalogue import GROUPS, PLACES, VERBS, find_verb, verbs_of

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
        from stepgauge.cli.defaults import apply_defaults
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
