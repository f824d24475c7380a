"""A verb runs from the command line: what it leaves of the project, its checks, its work, what it writes and says."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from stepgauge.cli.say import say_lines, say_written, show
from stepgauge.verbs.define import Verb, reads, writes
from stepgauge.verbs.kinds import Reads, Supplied, Writes


def run_verb(verb: Verb, values: dict[str, Any]) -> None:
    """Check, work, write, say."""
    _leave(verb, values)
    check_files(verb, values)
    writing = {one.name: values.pop(one.name) for one in verb.parameters if one.writes}
    with ExitStack() as stack:
        _bound(verb, values, stack)
        result = verb.function(**_given(verb, values, stack))
    written = [] if verb.writer is None else list(verb.writer(result, **writing) or ())
    if result is not None:
        (show if verb.shows else say_lines)(result.summary())
    if written:
        say_written(*written)
    stop = getattr(result, "stop", None)
    if isinstance(stop, Exception):
        raise stop


def _leave(verb: Verb, values: dict[str, Any]) -> None:
    """What a call has no use for is that which it would be without a project file or the environment."""
    for name in left_names(verb, values):
        default = next(one.default for one in verb.parameters if one.name == name)
        if click.get_current_context().get_parameter_source(name) != ParameterSource.COMMANDLINE:
            values[name] = default


def left_names(verb: Verb, values: dict[str, Any]) -> Iterable[str]:
    """Names of the parameters that a call has no use for."""
    if verb.leaves is None:
        return ()
    source = click.get_current_context().get_parameter_source
    return verb.leaves(values, {name for name in values if source(name) == ParameterSource.COMMANDLINE})


def check_files(verb: Verb, values: dict[str, Any]) -> None:
    """:class:`InputError` for an output that would replace what is read, or has no place, before any work is done."""
    from stepgauge.files.text import check_folder, check_output

    sources = [path for one in reads(verb.parameters) for path in _paths(values.get(one.name))]
    for one in writes(verb.parameters):
        for path in _paths(values.get(one.name)):
            kind = one.one
            if isinstance(kind, Writes) and kind.folder:
                check_folder(path)
            else:
                check_output(path, *sources)


def _paths(value: Any) -> list[str | Path]:
    return [one for one in (value if isinstance(value, list | tuple) else [value]) if isinstance(one, str | Path)]


def _bound(verb: Verb, values: dict[str, Any], stack: ExitStack) -> None:
    """A limit of time and memory for the reading of what somebody else wrote."""
    from stepgauge.files.budget import file_budget, within

    for one in reads(verb.parameters):
        kind = one.one
        for path in _paths(values.get(one.name)) if isinstance(kind, Reads) and kind.foreign else ():
            stack.enter_context(within(file_budget(path), path))


def _given(verb: Verb, values: dict[str, Any], stack: ExitStack) -> dict[str, Any]:
    """The arguments of the function: lists of what is repeated, and what only the command line supplies."""
    given = {}
    for one in verb.parameters:
        if isinstance(one.kind, Supplied):
            given[one.name] = stack.enter_context(_maker(one.kind.made)()) if one.kind.made else one.kind.at_command
        elif one.name in values:
            value = values[one.name]
            given[one.name] = list(value) if isinstance(value, tuple) and one.repeated else value
    return given


def _maker(name: Any) -> Callable[[], Any]:
    """What supplies a parameter, a context manager of :mod:`stepgauge.cli`."""
    made: Callable[[], Any] = name
    return made
