"""Work that takes longer than a click: a verb of the command line in a process of its own.

It goes on when the page is closed and when the server dies; its result is its files.
"""

from __future__ import annotations

import os
import shlex
import subprocess
import tempfile
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

from stepgauge.errors import InputError
from stepgauge.files.children import python_environment, python_line

MOST_AT_ONCE = 2
MOST_KEPT = 20
"""Ended works whose words are kept for the window that asked for them."""


@dataclass
class Work:
    """A verb that runs or has run. ``then``: the address that shows its result."""

    number: int
    arguments: tuple[str, ...]
    then: str
    process: subprocess.Popen[bytes]
    said: IO[bytes]
    began_s: float = field(default_factory=time.monotonic)

    @property
    def command(self) -> str:
        """What one would type."""
        return f"stepgauge {shlex.join(self.arguments)}"

    @property
    def is_running(self) -> bool:
        """Whether the process has not ended."""
        return self.process.poll() is None

    @property
    def has_failed(self) -> bool:
        """Whether it ended with an error."""
        return self.process.poll() not in (None, 0)

    @property
    def seconds(self) -> float:
        """Time since it began, s."""
        return time.monotonic() - self.began_s

    def words(self) -> list[str]:
        """The last lines that it has said."""
        self.said.seek(max(0, self.said.seek(0, os.SEEK_END) - 8000))
        text = self.said.read().decode("utf-8", "replace").replace("\r", "\n")
        return [line for line in text.splitlines() if line.strip()][-12:]

    def stop(self) -> None:
        """End it; what it has not finished leaves no file."""
        if self.is_running:
            self.process.terminate()


class WorkList:
    """The works of this server."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._lock, self._last = folder, threading.Lock(), 0
        self._all: dict[int, Work] = {}

    def start(self, arguments: Sequence[str], then: str) -> Work:
        """Run a verb in the project's folder; the same one, if it runs already, is not begun twice.

        :class:`InputError` where as many run as the machine should be given.
        """
        with self._lock:
            running = [one for one in self._all.values() if one.is_running]
            for one in running:
                if one.arguments == tuple(arguments):
                    return one
            if len(running) >= MOST_AT_ONCE:
                raise InputError("work", f"{len(running)} works are running", expected="one of them ended")
            self._last += 1
            self._all[self._last] = self._begin(self._last, tuple(arguments), then)
            for old in sorted(self._all)[:-MOST_KEPT]:
                if not self._all[old].is_running:
                    self._all.pop(old).said.close()
            return self._all[self._last]

    def _begin(self, number: int, arguments: tuple[str, ...], then: str) -> Work:
        said = tempfile.TemporaryFile()  # noqa: SIM115  closed with the work
        process = subprocess.Popen(
            python_line("stepgauge", *arguments),
            cwd=self._folder,
            env=python_environment(),
            stdin=subprocess.DEVNULL,
            stdout=said,
            stderr=said,
            start_new_session=True,
        )
        return Work(number, arguments, then, process, said)

    def get(self, number: int) -> Work:
        """A work by its number (:class:`InputError` where this server knows none)."""
        if number not in self._all:
            raise InputError("work", "not known to this server", found=number, expected="its result, if it has ended")
        return self._all[number]
