"""What the verbs of a fleet share: the store, and who does the work."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import click

from stepgauge.cli.options import POSITIVE, Decorator, percent, say
from stepgauge.errors import PartlyDoneError

STORE = click.argument("store", metavar="STORE")
SHOWN = 10


def engine_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """``--jobs``, ``--memory`` and ``--scheduler``; the command opens :func:`working` with them."""
    options: tuple[Decorator, ...] = (
        click.option(
            "--scheduler",
            metavar="FILE",
            help="Work on a Dask cluster: the file of 'fleet cluster', or tcp://host:port. Default: processes here.",
        ),
        click.option(
            "--memory", type=POSITIVE, metavar="MB", help="What each process may allocate. Default: no limit."
        ),
        click.option(
            "--jobs",
            "-j",
            type=click.IntRange(1),
            default=None,
            metavar="N",
            help="Processes that share the work; 1: this process. Default: the processors there are.",
        ),
    )
    for option in options:
        function = option(function)
    return function


@contextmanager
def working(label: str, options: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Keywords of a public function: who does the work, by :func:`engine_options`, and a progress bar."""
    with bar(label) as progress:
        given = {"jobs": options["jobs"], "scheduler": options["scheduler"], "memory_MB": options["memory"]}
        yield {**given, "progress": progress}


@contextmanager
def bar(label: str) -> Iterator[Callable[[int, int], None]]:
    """A progress bar that is told (done, total)."""
    with click.progressbar(length=100, label=label, file=sys.stderr) as shown:
        yield percent(shown)


def say_errors(store: str, errors: Sequence[str], what: str) -> None:
    """Why some recordings have no result, a line each; :class:`PartlyDoneError` where there are any."""
    for error in errors[:SHOWN]:
        say(error)
    if len(errors) > SHOWN:
        say(f"and {len(errors) - SHOWN} more: the column 'error' has them all")
    if errors:
        raise PartlyDoneError(store, f"{len(errors)} recordings could not be {what}")
