"""What only a program can give a verb, and the command line makes: progress, questions, a wish to stop."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import click

from stepgauge.cli.interrupt import at_once, interruptible, progress_bar
from stepgauge.cli.say import bar, percent, say


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
    """What a search has found up to now, in a line of a terminal, gone when it ends: it may take half a minute."""
    shown = sys.stderr.isatty()

    def show(labels: Sequence[str]) -> None:
        if shown:
            text = f"searching; up to now: {', '.join(labels).replace('_', ' ') or 'nothing'}"
            click.echo(f"\r\033[K{text[: shutil.get_terminal_size().columns - 1]}", nl=False, err=True)

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
