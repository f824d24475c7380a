"""A verb runs from the command line: what it leaves of the project, its checks, its work, what it writes and says."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from stepgauge.cli.interrupt import stoppable
from stepgauge.cli.say import say, say_lines, say_written, show
from stepgauge.cli.supplied import supply
from stepgauge.errors import for_command
from stepgauge.files.display import Written
from stepgauge.verbs.define import Verb, reads, writes
from stepgauge.verbs.kinds import Pair, Reads, Supplied, Writes

SHOWN = 10
"""Recordings without a result that are told."""


def run_verb(verb: Verb, values: dict[str, Any]) -> None:
    """Check, work, write, say."""
    _leave(verb, values)
    check_files(verb, values)
    given = _given(verb, values)
    with ExitStack() as stack:
        _bound(verb, values, stack)
        more = _supplied(verb, values, stack)
        if "stop" in more:
            stack.enter_context(stoppable())
        result = verb.function(**given, **more)
    writing = {one.name: values[one.name] for one in verb.parameters if one.writes}
    if verb.writer is None:
        written = Written(values.get(one.name) for one in writes(verb.parameters))
    else:
        written = verb.writer(result, **_collected(verb, writing))
    if result is not None:
        with for_command():
            text = verb.says(result) if verb.says else result.summary()
        if text:
            (show if verb.shows else say_lines)(text)
    for note in getattr(written, "notes", ()):
        say(note)
    if any(path is not None for path in written):
        say_written(*written)
    stop = getattr(result, "stop", None)
    if isinstance(stop, Exception):
        raise stop
    if verb.partly:
        _say_left_out(str(values.get("store") or values.get("output")), getattr(result, "left_out", ()))


def _say_left_out(where: str, errors: Sequence[str]) -> None:
    """Why some have no result, a line each; :class:`PartlyDoneError` where there are any."""
    from stepgauge.errors import PartlyDoneError

    for error in errors[:SHOWN]:
        say(error)
    if len(errors) > SHOWN:
        say(f"and {len(errors) - SHOWN} more: the column 'error' has them all")
    if errors:
        raise PartlyDoneError(where, f"{len(errors)} recordings could not be used")


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
    from stepgauge.files.resource_limits import file_limits, within

    for one in reads(verb.parameters):
        kind = one.one
        for path in _paths(values.get(one.name)) if isinstance(kind, Reads) and kind.foreign else ():
            stack.enter_context(within(file_limits(path), path))


def _given(verb: Verb, values: dict[str, Any]) -> dict[str, Any]:
    """The arguments of the function; what was borrowed only where it was given."""
    source = click.get_current_context().get_parameter_source
    given = {}
    for one in verb.parameters:
        if not one.writes and one.name in values and not (one.borrowed and source(one.name) == ParameterSource.DEFAULT):
            given[one.name] = values[one.name]
    return _collected(verb, given)


def _collected(verb: Verb, values: dict[str, Any]) -> dict[str, Any]:
    """Values of what is repeated as lists, pairs as mappings."""
    found = dict(values)
    for one in verb.parameters:
        if one.name in values and one.repeated:
            pairs = isinstance(one.one, Pair) and not one.one.whole
            found[one.name] = dict(values[one.name]) if pairs else list(values[one.name])
    return found


def _supplied(verb: Verb, values: dict[str, Any], stack: ExitStack) -> dict[str, Any]:
    """What only a program can give; a wish to stop before what asks for it."""
    wanted = [one for one in verb.parameters if isinstance(one.kind, Supplied)]
    made: dict[str, Any] = {}
    for one in sorted(wanted, key=lambda one: one.name != "stop"):
        assert isinstance(one.kind, Supplied)
        kind = one.kind
        made[one.name] = supply(kind.made, values, made, stack) if kind.made else kind.at_command
    return made
