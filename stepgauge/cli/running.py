"""A verb runs from the command line: what it leaves of the project, its checks, its work, what it writes and says."""

from __future__ import annotations

import shutil
import signal
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from stepgauge.cli.say import bar, percent, say, say_lines, say_written, show
from stepgauge.errors import for_command
from stepgauge.files.display import Written
from stepgauge.verbs.define import Verb, reads, writes
from stepgauge.verbs.kinds import Pair, Reads, Supplied, Writes

SILENT_S = 10.0
"""Time after which a search says what it does where it has no terminal."""
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


def supply(made: str, values: Mapping[str, Any], given: Mapping[str, Any], stack: ExitStack) -> Any:
    """What stands under a name; ``values`` are those of the options, ``given`` what was made before."""
    makers: dict[str, Callable[[], Any]] = {
        "bar": lambda: stack.enter_context(bar("working")),
        "bars": lambda: partial(_next_bar, stack.enter_context(ExitStack())),
        "stop": lambda: stack.enter_context(interruptible()),
        "live": lambda: stack.enter_context(progress_bar()),
        "tell": lambda: say,
        "search": lambda: stack.enter_context(_found_so_far()),
        "run": _runner,
        "prompt": lambda: _prompt if sys.stdin.isatty() else None,
        "print": lambda: click.echo,
        "history store": lambda: Path(values["output"]) / "history.sqlite",
        "journal": lambda: _journal(values["output"]),
        "runs folder": lambda: Path(values["output"]) / ".uncertainty-runs",
        "ask": lambda: _done if values.get("yes") else _asking(given["stop"]),
    }
    return makers[made]()


@contextmanager
def _found_so_far() -> Iterator[Callable[[Sequence[str]], None]]:
    """What a search has found up to now, in a line of a terminal, gone when it ends: it may take a minute.

    Where it goes into a file or a pipe, a line every now and then.
    """
    shown, last_s = sys.stderr.isatty(), time.monotonic()

    def show(labels: Sequence[str]) -> None:
        """The names of what has these labels, in place of what was shown before."""
        from stepgauge.diagnosis.wording.findings import name_of  # long to load

        nonlocal last_s
        text = f"searching; up to now: {', '.join(map(name_of, labels)) or 'nothing'}"
        if shown:
            click.echo(f"\r\033[K{text[: shutil.get_terminal_size().columns - 1]}", nl=False, err=True)
        elif time.monotonic() - last_s > SILENT_S:
            last_s = time.monotonic()
            click.echo(text, err=True)

    try:
        show(())
        yield show
    finally:
        if shown:
            click.echo("\r\033[K", nl=False, err=True)


def _runner() -> Callable[..., object]:
    from stepgauge.cli import show_and_run

    return show_and_run


def _prompt(question: str, usual: str) -> str:
    return str(click.prompt(question, default=usual, show_default=bool(usual), err=True))


def _journal(output: str) -> Path:
    from stepgauge.live.journal import journal_of

    return journal_of(output)


def _next_bar(bars: ExitStack, label: str) -> Callable[[int, int], None]:
    """The bar of what begins now; that of what went before is finished."""
    bars.close()
    return percent(bars.enter_context(click.progressbar(length=100, label=label, file=sys.stderr)))


def _asking(stop: Callable[[], bool]) -> Callable[[str], bool]:
    """Asks a person; here Ctrl-C ends at once, for nothing moves."""

    def ask(question: str) -> bool:
        if stop():
            raise click.Abort
        with at_once():
            return click.confirm(f"{question}. Done?", err=True)

    return ask


def _done(question: str) -> bool:
    say(f"{question}.")
    return True


@contextmanager
def interruptible() -> Iterator[Callable[[], bool]]:
    """Whether somebody wants to stop; a second Ctrl-C ends at once, without waiting for the machine."""
    asked: list[int] = []

    def ask(number: int, _: object) -> None:
        if asked:
            raise KeyboardInterrupt
        asked.append(number)

    before = {number: signal.signal(number, ask) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield lambda: bool(asked)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def at_once() -> Iterator[None]:
    """Inside of :func:`interruptible`: a single Ctrl-C is heeded now."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def stoppable() -> Iterator[None]:
    """What a person stopped ends with a line that says how to go on, and exit code 130."""
    from stepgauge.live.measuring import StoppedByPersonError

    try:
        yield
    except StoppedByPersonError as stopped:
        say(f"stopped: {stopped}; the same command with --resume goes on")
        raise click.exceptions.Exit(130) from None


@contextmanager
def progress_bar() -> Iterator[Callable[[int, int, float], None]]:
    """A progress bar with the time of day at which the measurement will end, by its pace up to now."""
    import datetime
    import sys
    import time

    began: list[tuple[float, float]] = []

    def end(left_s: float | None) -> str:
        """What the bar shows beside itself; nothing before the first point."""
        if left_s is None:
            return ""
        began.append((time.monotonic(), left_s)) if not began else None
        took_s, done_s = time.monotonic() - began[0][0], began[0][1] - left_s
        pace = took_s / done_s if done_s > 0.0 else 1.0
        return f"end {datetime.datetime.now() + datetime.timedelta(seconds=left_s * pace):%H:%M:%S}"

    with click.progressbar(
        length=1, label="measuring", item_show_func=end, show_pos=True, show_eta=False, file=sys.stderr
    ) as bar:

        def progress(done: int, total: int, left_s: float) -> None:
            bar.length = total
            bar.update(done - bar.pos, left_s)

        yield progress
