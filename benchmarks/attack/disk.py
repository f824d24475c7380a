"""A full disk: every verb that writes says which file could not be written, and leaves what was there before.

    python -m benchmarks.attack.disk

The disk is full after so many bytes of a file: the system's limit of the size of a file stands for it, which fails at
the same call of the system.
"""

from __future__ import annotations

import contextlib
import resource
import shutil
import signal
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from benchmarks.attack.child import RUNS, WRITERS, lay_old, run, written
from benchmarks.attack.targets import make_measurement

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
        old = lay_old(place, names)
        message = run(verb, full_after(size)).message
        if not message.startswith("InputError: ") or not any(name in message for name in (*names, RUNS)):
            found.append(f"{verb}, full after {size} bytes: {message or 'no error'}")
        if written(place) != old:
            found.append(f"{verb}, full after {size} bytes: files changed")
    shutil.rmtree(place / "out")
    return found


def main() -> int:
    """The command; the exit code is 1 where anything was found."""
    found: list[str] = []
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        place = Path(folder)
        make_measurement(place)
        for verb in WRITERS:
            mine = attack(place, verb)
            print(f"{verb:18} {'nothing wrong' if not mine else f'{len(mine)} wrong'}")
            found += mine
    print("\n".join(found))
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main())
