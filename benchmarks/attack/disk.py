"""A full disk: every verb that writes says which file could not be written, and leaves what was there before.

    python -m benchmarks.attack.disk

The disk is full after so many bytes of a file: the system's limit of the size of a file stands for it, which fails at
the same call of the system.
"""

from __future__ import annotations

import resource
import shutil
import signal
import sys
from collections.abc import Callable
from pathlib import Path

from benchmarks.attack.child import (
    NEVER_OVER,
    RUNS,
    STEPWISE,
    STORE,
    for_every_verb,
    lay_old,
    run,
    verb_parser,
    written,
)

SIZES = (0, 100, 2000)
"""Bytes of a file after which the disk is full."""


def full_after(size: int) -> Callable[[], object]:
    """Before the verb begins: no file may grow beyond this."""

    def prepare() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    return prepare


def attack(place: Path, verb: str, sizes: tuple[int, ...] = SIZES) -> list[str]:
    """Run a verb on full disks; what was found that must not be."""
    (place / "out").mkdir(exist_ok=True)
    run(verb)
    names = sorted(written(place))
    largest = max(len(content) for content in written(place).values())
    found = []
    for size in sizes:
        if size >= largest:
            continue
        shutil.rmtree(place / "out", ignore_errors=True)
        old = lay_old(place, [] if verb in NEVER_OVER else names)
        message = run(verb, full_after(size)).message
        if not message.startswith("InputError: ") or not any(name in message for name in (*names, RUNS, STORE)):
            found.append(f"{verb}, full after {size} bytes: {message or 'no error'}")
        if written(place) != old and not (verb in STEPWISE and set(written(place)) <= set(names)):
            found.append(f"{verb}, full after {size} bytes: files changed")
    shutil.rmtree(place / "out", ignore_errors=True)
    return found


def main() -> int:
    """The command; the exit code is 1 where anything was found."""
    return for_every_verb(attack, verb_parser(__doc__).parse_args().verb)


if __name__ == "__main__":
    sys.exit(main())
