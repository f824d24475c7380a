"""What a verb tells the person at the screen, and the text that was asked for."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import click


def say(message: str) -> None:
    """A line for the person at the screen, to stderr; stdout is for tables and texts that were asked for.

    What follows the writing of files is said when they are in place.
    """
    from stepgauge.errors import one_line
    from stepgauge.files.outputs import when_in_place

    line = one_line(message, 2000)
    when_in_place(lambda: click.echo(line, err=True))


def show(text: str) -> None:
    """Text that was asked for, to stdout; with :func:`say`, in the order in which both are called."""
    from stepgauge.files.outputs import when_in_place

    when_in_place(lambda: click.echo(text))


def say_lines(text: str) -> None:
    """The summary of a result, line by line."""
    for line in text.splitlines():
        say(line)


def say_written(*paths: object) -> None:
    """The last line of a verb: what it wrote (None for what was not asked for)."""
    say("wrote " + ", ".join(str(path) for path in paths if path is not None))


@contextmanager
def bar(label: str) -> Iterator[Callable[[int, int], None]]:
    """A progress bar that is told (done, total)."""
    with click.progressbar(length=100, label=label, file=sys.stderr) as shown:
        yield percent(shown)


def percent(shown: Any) -> Callable[[int, int], None]:
    """What a long work calls with (done, total) to move a progress bar of length 100."""
    return lambda done, total: shown.update(100 * done // total - shown.pos)
