"""Files of JSON lines, each on the disk before the next one is written, for one process at a time.

A line that a power cut or a kill left unfinished is no line.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO

from stepgauge.errors import InputError, reading

Row = dict[str, Any]


@dataclass
class Lines:
    """A file of which every line is on the disk before the next one is written."""

    path: Path
    _file: BinaryIO | None = field(default=None, kw_only=True)

    def write(self, line: Row) -> None:
        """Put a line on the disk; when this returns, it is there."""
        assert self._file is not None
        try:
            self._file.write(json.dumps(line, allow_nan=False).encode("ascii") + b"\n")
            self._file.flush()
            os.fsync(self._file.fileno())
        except OSError as error:
            raise InputError(self.path, f"cannot be written: {error.strerror or error}") from None

    def close(self) -> None:
        """No more lines; the file stays."""
        if self._file is not None:
            self._file.close()
            self._file = None


@contextmanager
def held(path: Path) -> Iterator[BinaryIO]:
    """The file, open for appending, for this process alone until it is closed: here only if the block fails."""
    try:
        file = path.open("ab")
    except OSError as error:
        raise InputError(path, f"cannot write here: {error.strerror or error}") from None
    _hold(file, path)
    try:
        yield file
    except BaseException:
        file.close()
        raise


def _hold(file: BinaryIO, path: Path) -> None:
    """Two processes that write one journal would spoil it; where files cannot be locked, nobody looks."""
    try:
        import fcntl
    except ImportError:
        return
    try:
        fcntl.flock(file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        file.close()
        raise InputError(path, "another process is writing this journal", expected="one at a time") from None


def whole_lines(path: Path) -> Iterator[tuple[bytes, Row]]:
    """The whole lines of a file, each as it stands there and as read (:class:`InputError` where one is damaged)."""
    with reading(path, "journal"):
        data = path.read_bytes()
    for number, raw in enumerate(data.split(b"\n")[:-1], 1):
        try:
            line = json.loads(raw)
        except (ValueError, RecursionError):
            line = None
        if not isinstance(line, dict):
            raise InputError(f"{path}:{number}", "the journal is damaged", found=repr(raw[:40]))
        yield raw, line


def sync_folder(folder: Path) -> None:
    """A new file is on the disk only when its folder says so; where folders cannot be opened, the system sees to it."""
    if os.name != "posix":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
