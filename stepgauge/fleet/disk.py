"""Files of the store: whole or not at all, on the disk before anybody is told, one writer at a time.

A file never changes once it has its name, which is that of its content; a table grows by files and shrinks by files
that say which ones they replace. So readers need no lock to see whole files; they hold a shared one against files that
are removed under them.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from stepgauge.errors import InputError
from stepgauge.files.checksum import content_name
from stepgauge.files.lines import sync_folder

LOCK = ".lock"
UNFINISHED = ".tmp"


@contextmanager
def appearing(path: Path) -> Iterator[Path]:
    """Yield a path to write to; when the body is done, the file is on the disk under its name.

    A kill at any moment leaves the file as it was, and perhaps a file ``.tmp``, which nobody reads.
    """
    with _beside(path) as beside:
        yield beside
        _appear(beside, path)


def put_by_content(folder: Path, write: Callable[[Path], None], before: str = "") -> Path:
    """What ``write`` writes to a path, on the disk in a folder under the name of its content, with ``before`` it.

    Errors and kills as of :func:`appearing`.
    """
    with _beside(folder / "new.parquet") as beside:
        write(beside)
        path = folder / f"{before}{content_name(beside)}.parquet"
        _appear(beside, path)
    return path


@contextmanager
def _beside(path: Path) -> Iterator[Path]:
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(f"{path.name}.{os.getpid()}{UNFINISHED}")
    try:
        yield beside
    except OSError as error:
        raise InputError(path, f"cannot be written: {error.strerror or error}") from None
    finally:
        beside.unlink(missing_ok=True)


def _appear(beside: Path, path: Path) -> None:
    with beside.open("rb") as file:
        os.fsync(file.fileno())
    beside.replace(path)
    sync_folder(path.parent)


@contextmanager
def locked(folder: Path, alone: bool) -> Iterator[None]:
    """Hold the store: ``alone`` to change it, together with others to read it. A killed holder lets go.

    Where files cannot be locked, or not written, nobody else is looked for.
    """
    try:
        import fcntl
    except ImportError:
        yield
        return
    try:
        handle = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT if alone else os.O_RDONLY)
    except OSError as error:
        if alone:
            raise InputError(folder, f"cannot write here: {error.strerror or error}") from None
        yield
        return
    try:
        fcntl.flock(handle, fcntl.LOCK_EX if alone else fcntl.LOCK_SH)
        yield
    finally:
        os.close(handle)
