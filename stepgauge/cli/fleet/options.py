"""What the verbs of a fleet share: the store, and who does the work."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

from stepgauge.cli.options import POSITIVE, Decorator, percent, say
from stepgauge.errors import PartlyDoneError

if TYPE_CHECKING:
    from stepgauge.work.task import Engine

STORE = click.argument("store", metavar="STORE")
SHOWN = 10


def engine_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """``--jobs``, ``--memory`` and ``--scheduler``; the command calls :func:`engine_from` with them."""
    options: tuple[Decorator, ...] = (
        click.option(
            "--scheduler",
            metavar="ADDRESS",
            help="Work on the Dask cluster of this scheduler, tcp://host:port, instead of processes of this computer.",
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


def engine_from(options: dict[str, Any]) -> Engine:
    """Who does the work, by the options of :func:`engine_options`."""
    from stepgauge.work.dask import Dask
    from stepgauge.work.processes import InProcess, Processes

    if options["scheduler"] is not None:
        if options["jobs"] is not None or options["memory"] is not None:
            raise click.UsageError("--jobs and --memory are of processes; a cluster states both where it is started")
        return Dask(options["scheduler"])
    if options["jobs"] == 1 and options["memory"] is None:
        return InProcess()
    return Processes(options["jobs"], options["memory"])


@contextmanager
def bar(label: str) -> Iterator[Callable[[int, int], None]]:
    """A progress bar that is told (done, total)."""
    with click.progressbar(length=100, label=label, file=sys.stderr) as shown:
        yield percent(shown)


def say_errors(store: str, errors: list[str], what: str) -> None:
    """Why some recordings have no result, a line each; :class:`PartlyDoneError` where there are any."""
    for error in errors[:SHOWN]:
        say(error)
    if len(errors) > SHOWN:
        say(f"and {len(errors) - SHOWN} more: the column 'error' has them all")
    if errors:
        raise PartlyDoneError(store, f"{len(errors)} recordings could not be {what}")
