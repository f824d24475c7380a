"""Work on what somebody else wrote, in a process of its own that has a budget: templates, questions in SQL, uploads.

No check of a text can tell beforehand whether a template or a question comes to an end, and a single filter can ask for
a gigabyte. The operating system can: it limits the process's processor time, memory, and files, of which it may write
none. What is over the budget ends with one line.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from stepgauge.errors import InputError
from stepgauge.files.children import python_environment, python_line

MB = 1_000_000
_WAIT = 10.0
"""Seconds of a busy machine per second of processor time."""
_OUT_OF = (-24, -9, -6, -11)
"""SIGXCPU, and what a library does that gets no memory: SIGKILL, SIGABRT, SIGSEGV."""
FILE_SECONDS, FILE_MEMORY_MB = 120.0, 2000.0
Content = dict[str, Any]
Function = Callable[[Content], bytes]


@dataclass(frozen=True)
class ResourceLimits:
    """What a piece of work may use: ``seconds`` of processor time, ``memory_MB``; ``what`` it is, for the message."""

    seconds: float
    memory_MB: float
    what: str

    def spent(self, where: str | Path) -> InputError:
        """The error of work that needs more."""
        expected = f"at most {self.seconds:.0f} s of processor time and {self.memory_MB:.0f} MB of memory"
        return InputError(where, f"{self.what}: it did not come to an end", expected=expected)


def work_within(budget: ResourceLimits, function: Function, given: Content, where: str | Path) -> bytes:
    """What a function gives, called by its name in a process of its own.

    Parameters
    ----------
    budget : what it may use
    function : of a module; takes JSON types, gives bytes; an :class:`InputError` of it is raised here
    given : its argument
    where : what is worked on, for the message

    Raises
    ------
    InputError
        that of the function, or the budget is spent
    """
    task = {
        "function": f"{function.__module__}:{function.__qualname__}",
        "budget": [budget.seconds, budget.memory_MB],
        "named": [str(where), budget.what],
    }
    try:
        done = subprocess.run(
            python_line("stepgauge.files.resource_limits"),
            input=json.dumps({**task, "given": given}).encode("utf-8", "surrogatepass"),
            capture_output=True,
            timeout=_WAIT * budget.seconds,
            env=python_environment(),
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise budget.spent(where) from None
    if done.returncode in _OUT_OF or not done.stdout:
        raise budget.spent(where)
    kind, _, content = done.stdout.partition(b"\n")
    if kind == b"done":
        return content
    if kind == b"memory":
        raise budget.spent(where)
    place, what, found, expected = json.loads(content)
    raise InputError(place, what, found=found, expected=expected)


def main() -> None:
    """The process: a task as JSON on stdin; on stdout a line that says how it ended, and the content."""
    task = json.loads(sys.stdin.buffer.read().decode("utf-8", "surrogatepass"))
    module, _, name = task["function"].partition(":")
    function: Function = getattr(import_module(module), name)
    with _stdout_alone() as out:
        limit_process(*task["budget"])
        try:
            kind, content = b"done", function(task["given"])
        except InputError as error:
            parts = [None if one is None else str(one) for one in error.parts]
            kind, content = b"error", json.dumps(parts).encode()
        except MemoryError:
            kind, content = b"memory", b""
        except Exception as error:  # what a library makes of somebody else's text is that text's fault
            where, what = task["named"]
            parts = [where, f"{what}: {type(error).__name__}: {error}", None, None]
            kind, content = b"error", json.dumps(parts).encode()
        out.write(kind + b"\n" + content)
        out.flush()


@contextmanager
def _stdout_alone() -> Iterator[Any]:
    """The real stdout for the answer: what a library prints goes to stderr, and nobody takes it for the answer."""
    with os.fdopen(os.dup(1), "wb") as out:
        os.dup2(2, 1)
        yield out


def file_limits(*paths: str | Path) -> ResourceLimits:
    """What the reading of somebody else's files may use: 2 minutes and 2 GB, and more of both for large ones."""
    return size_limits(sum(os.path.getsize(path) for path in paths if os.path.isfile(path)))


def size_limits(size: int) -> ResourceLimits:
    """The same for ``size`` bytes that are in no file."""
    return ResourceLimits(FILE_SECONDS + 20.0 * size / MB, FILE_MEMORY_MB + 100.0 * size / MB, "this file")


@contextmanager
def within(budget: ResourceLimits, where: str | Path) -> Iterator[None]:
    """The same budget for work in this process, where the system can give it one (in the main thread)."""
    try:
        import resource
        import signal
    except ImportError:
        yield
        return
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def spent(*_: object) -> None:
        raise budget.spent(where)

    kinds = (resource.RLIMIT_CPU, resource.RLIMIT_DATA)
    before, handler = [resource.getrlimit(kind) for kind in kinds], signal.signal(signal.SIGXCPU, spent)
    wanted = (time.process_time() + 1.0 + budget.seconds, _data_in_use() + budget.memory_MB * MB)
    try:
        for kind, most, (soft, hard) in zip(kinds, wanted, before, strict=True):
            resource.setrlimit(kind, (int(most) if soft == resource.RLIM_INFINITY else min(int(most), soft), hard))
        yield
    except MemoryError:
        raise budget.spent(where) from None
    finally:
        for kind, limits in zip(kinds, before, strict=True):
            resource.setrlimit(kind, limits)
        signal.signal(signal.SIGXCPU, handler)


def _data_in_use() -> int:
    """Bytes of data that this process has already, its libraries' threads among them, as RLIMIT_DATA counts them."""
    try:
        status = Path("/proc/self/status").read_text(encoding="ascii", errors="replace")
    except OSError:
        return 0
    found = re.search(r"^VmData:\s*(\d+) kB", status, re.MULTILINE)
    return int(found[1]) * 1024 if found else 0


def limit_process(seconds: float, memory_MB: float) -> None:
    """Processor time, memory and files, where the system can limit them; elsewhere the caller's clock has to do."""
    try:
        import resource
    except ImportError:
        return
    limits: Sequence[tuple[int, float]] = (
        (resource.RLIMIT_CORE, 0),
        (resource.RLIMIT_FSIZE, 0),
        (resource.RLIMIT_CPU, time.process_time() + 1.0 + seconds),
        (resource.RLIMIT_DATA, memory_MB * MB),
    )
    for limit, most in limits:
        hard = resource.getrlimit(limit)[1]
        wanted = int(most) if hard == resource.RLIM_INFINITY else min(int(most), hard)
        resource.setrlimit(limit, (wanted, hard))


if __name__ == "__main__":
    main()
