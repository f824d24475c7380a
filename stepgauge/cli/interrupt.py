"""What verbs that drive a machine share: a wish to stop that the machine hears of, and a progress bar."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import click

from stepgauge.cli.say import say


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
