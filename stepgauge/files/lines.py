"""Files of JSON lines, each on the disk before the next one is written, for one process at a time.

Each line has a checksum of itself and of all above it. A line that a power cut or a kill left unfinished is no line.
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
from stepgauge.files.checksum import KEY, add_checksum, is_whole

Row = dict[str, Any]


@dataclass
class DurableLines:
    """A file of which every line is on the disk before the next one is written; ``last``: checksum of its last line."""

    path: Path
    last: str = field(default="", kw_only=True)
    _file: BinaryIO | None = field(default=None, kw_only=True)

    def write(self, line: Row) -> None:
        """Put a line on the disk; when this returns, it is there."""
        assert self._file is not None
        whole = add_checksum(line, self.last)
        try:
            self._file.write(json.dumps(whole, allow_nan=False).encode("ascii") + b"\n")
            self._file.flush()
            os.fsync(self._file.fileno())
        except OSError as error:
            raise InputError(self.path, f"cannot be written: {error.strerror or error}") from None
        self.last = whole[KEY]

    def go_on(self, file: BinaryIO, size: int) -> None:
        """Write on behind the first ``size`` bytes of a file that is held (:func:`held`)."""
        file.truncate(size)
        self._file = file

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


@dataclass(frozen=True)
class Read:
    """The whole lines of a file, without their checksums; how many bytes they are; and the checksum of the last one."""

    path: Path
    lines: list[Row]
    size: int
    last: str

    def damaged(self, number: int) -> InputError:
        """What is wrong with a line, counted from 1, and what a person can do."""
        return _damaged(self.path, number)


def read_lines(path: Path) -> Read:
    """The whole lines of a journal (:class:`InputError` where one is not as it was written)."""
    with reading(path, "journal"):
        data = path.read_bytes()
    *whole, rest = data.split(b"\n")
    found, last = [], ""
    for number, raw in enumerate(whole, 1):
        line = _parsed(raw)
        if line is None or not is_whole(line, last):
            raise _damaged(path, number)
        last = line.pop(KEY)
        found.append(line)
    if _is_more_than_a_line(rest):
        raise _damaged(path, len(whole) + 1)
    return Read(path, found, len(data) - len(rest), last)


def _parsed(raw: bytes) -> Row | None:
    try:
        line = json.loads(raw)
    except (ValueError, RecursionError):
        return None
    return line if isinstance(line, dict) else None


def _is_more_than_a_line(rest: bytes) -> bool:
    """What a kill leaves is the beginning of a line; a whole one with more behind it has lost its end otherwise."""
    try:
        text = rest.decode("ascii", "replace")
        return json.JSONDecoder().raw_decode(text)[1] < len(text)
    except (ValueError, RecursionError):
        return False


def _damaged(path: Path, number: int) -> InputError:
    return InputError(
        f"{path}:{number}",
        "the journal is damaged: this line is not as it was written",
        expected="the line as it was; where it and all below are deleted, what they hold is done again",
    )


def sync_folder(folder: Path) -> None:
    """A new file is on the disk only when its folder says so; where folders cannot be opened, the system sees to it."""
    if os.name != "posix":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
