"""The files that a verb writes are one set: they are made aside, and take their places together when all are whole.

Aside is the folder :data:`UNFINISHED` beside them. What a killed run leaves there is cleared by the next one, or, where
all files were whole and only some had taken their places, put in place. The set also knows what was read while it was
made, so that every result can say what it was made from, and that nothing of it is replaced.
"""

from __future__ import annotations

import os
import re
import shutil
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from stepgauge.errors import InputError, PartlyDoneError
from stepgauge.files.checksum import file_digest

UNFINISHED = ".stepgauge-unfinished"
"""Folder of files that are not whole yet, with one folder per process inside."""


READY = ".ready"
"""In the folder of a process: all files are whole."""
HEAD = 4096
"""Bytes in which a result says what it is."""
_PICTURE = r"\.(png|svg|pdf)"
GO_WITH = {
    "evaluation.json": rf"evaluation(-placement-\d+)?{_PICTURE}",
    "budget.json": rf"budget-\d+{_PICTURE}",
    "uncertainty.json": rf"uncertainty-\d+{_PICTURE}",
    "iso10360.json": rf"iso10360-figure{_PICTURE}",
    "iso230.json": rf"iso230-figure(-placement-\d+)?{_PICTURE}",
    "history.json": rf"history{_PICTURE}",
    "diagnosis.json": rf"figures\.npy|separate-\d+\.toml|(overview|residuals|directions|effects){_PICTURE}",
    "plan.json": r"position-\d+(-machine)?\.(toml|dmi|ngc|ipp|jyc)",
}
"""What is written beside a result as often as it is needed; those of an earlier call would be taken for new ones."""
PLAIN_NAMES = {
    "diagnosis.json": ("stepgauge diagnosis", r"diagnosis\.md|residuals\.csv|(machine|probe)\.diagnosed\.toml"),
}
"""Results beside which files have names that anybody may have given: what each begins with, and these names."""


@dataclass
class OutputSet:
    """Files that are written aside (``staged``: by the place they will take), and those that were ``read`` for them.

    ``sources``: what the results among those were made from; ``said``: lines and table of the result that is written;
    ``afterwards``: what is done once they have taken their places.
    """

    process: int = field(default_factory=os.getpid)
    staged: dict[Path, Path] = field(default_factory=dict)
    made: list[Path] = field(default_factory=list)
    read: dict[Path, str | None] = field(default_factory=dict)
    sources: set[Path] = field(default_factory=set)
    said: Callable[[], dict[str, Any]] | None = None
    afterwards: list[Callable[[], None]] = field(default_factory=list)

    def commit(self) -> None:
        """Every file takes its place; files of an earlier call that go with the same result are removed."""
        for result in self.staged:
            refuse_own(result)
        for folder in {beside.parent for beside in self.staged.values()}:
            (folder / READY).touch()
        for target, beside in self.staged.items():
            _rename(beside, target)
        for result in self.staged:
            pattern = GO_WITH.get(result.name)
            for old in result.parent.iterdir() if pattern else ():
                if re.fullmatch(pattern or "", old.name) and old.is_file() and old not in self.staged:
                    old.unlink(missing_ok=True)
        self._clear()
        acts, self.afterwards = self.afterwards, []
        for act in acts:
            act()

    def discard(self) -> None:
        """Nothing of it is kept, and no folder that was made for it."""
        for beside in self.staged.values():
            beside.unlink(missing_ok=True)
        self._clear()
        for folder in reversed(self.made):
            if folder.is_dir() and not any(folder.iterdir()):
                folder.rmdir()

    def _clear(self) -> None:
        for folder in {beside.parent for beside in self.staged.values()}:
            _remove_aside(folder)
        self.staged = {}


_open: list[OutputSet] = []


def _current() -> OutputSet | None:
    """The set that is being written; a process that was forked off writes for itself."""
    return _open[-1] if _open and _open[-1].process == os.getpid() else None


@contextmanager
def one_set() -> Iterator[OutputSet]:
    """Files written inside appear together when the body is done, and none of them when it fails.

    A verb that calls verbs has finished what it wrote before: that is put in place first. :class:`PartlyDoneError`
    keeps what was done (a program that the virtual machine stopped).
    """
    before = _current()
    if before is not None:
        before.commit()
    files = OutputSet()
    _open.append(files)
    try:
        yield files
        files.commit()
    except PartlyDoneError:
        files.commit()
        raise
    finally:
        files.discard()
        _open.remove(files)


@contextmanager
def open_set(said: Callable[[], dict[str, Any]] | None = None) -> Iterator[None]:
    """The set of the verb that runs; one of its own where a program writes a result without a verb.

    ``said``: what the JSON file of the result says besides, to be read back (:mod:`stepgauge.files.stored`).
    """
    with nullcontext() if _current() is not None else one_set():
        files = _current()
        assert files is not None
        before, files.said = files.said, said
        try:
            yield
        finally:
            files.said = before


def shown_of_result() -> dict[str, Any]:
    """Lines and table of the result that is written now; nothing where it is read back in another way."""
    files = _current()
    return {} if files is None or files.said is None else files.said()


@contextmanager
def outside_of_sets() -> Iterator[None]:
    """A verb that serves has no end at which its files could appear: each of its writes is a set of its own."""
    before, _open[:] = list(_open), []
    try:
        yield
    finally:
        _open[:] = before


def when_in_place(act: Callable[[], None]) -> None:
    """Do something once the files that are written have taken their places: at once where none waits."""
    files = _current()
    if files is not None and files.staged:
        files.afterwards.append(act)
    else:
        act()


def was_read(path: str | Path, data: bytes | None = None) -> None:
    """A file was read for what this set writes; without its content it is looked at again when it is asked for."""
    files = _current()
    place = Path(os.path.realpath(path))
    if files is not None and place not in files.staged:
        files.read[place] = None if data is None else file_digest(data)


def is_source(path: str | Path) -> None:
    """A result that was read for this set was made from this file, which is thus not to be replaced."""
    files = _current()
    if files is not None:
        files.sources.add(Path(os.path.realpath(path)))


def refuse_input(path: str | Path) -> None:
    """:class:`InputError` for a file to write that was read for what is written now, or that a result was made from."""
    target = Path(os.path.realpath(path))
    for files in _open:
        if (target in files.read or target in files.sources) and target not in files.staged:
            raise InputError(path, "this output would replace what the command reads", expected="another name")


def refuse_own(result: str | Path) -> None:
    """:class:`InputError` where a folder has files of :data:`PLAIN_NAMES` but not the result that they go with.

    They are then not of an earlier call but somebody's own.
    """
    path = Path(result)
    if path.name not in PLAIN_NAMES or not path.parent.is_dir():
        return
    format_, names = PLAIN_NAMES[path.name]
    if path.is_file() and f'"{format_}' in path.read_bytes()[:HEAD].decode("utf-8", "replace"):
        return
    for file in sorted(path.parent.iterdir()):
        if file.name == path.name or re.fullmatch(f"{names}|{GO_WITH[path.name]}", file.name):
            raise InputError(
                file,
                "this file would be replaced or removed, and is of no earlier result",
                found=f"no {path.name} of stepgauge in this folder",
                expected="another folder, or this file moved elsewhere",
            )


def inputs() -> dict[Path, str]:
    """The files that were read for this set, in that order, with the SHA-256 of their content."""
    files = _current()
    if files is None:
        return {}
    for place, known in files.read.items():
        if known is None:
            files.read[place] = file_digest(place)
    return {place: str(known) for place, known in files.read.items()}


def place_of(path: str | Path) -> Path:
    """Where a file is now: aside, if this set has written it; else at its path."""
    files = _current()
    return Path(path) if files is None else files.staged.get(Path(os.path.realpath(path)), Path(path))


@contextmanager
def replacing(path: str | Path, at_once: bool = False) -> Iterator[Path]:
    """Yield a path to write to that takes the place of ``path`` when all went well.

    That is at the end of the set that is open, or at once. The folder is made if it is missing; a link is followed.
    When the body raises, what stood at ``path`` before still stands. Devices are written to as they are.

    :class:`InputError` names the file where it cannot be written, also for a full disk, and one that was read.
    """
    target = Path(os.path.realpath(path))
    if target.exists() and not stat.S_ISREG(target.stat().st_mode) and not target.is_dir():
        with _naming(Path(path), target):
            yield target
        return
    refuse_input(path)
    files = None if at_once else _current()
    made = list[Path]() if files is None else files.made
    beside = _aside(Path(path), target, made)
    try:
        with _naming(Path(path), beside):
            yield beside
            if files is None:
                _rename(beside, target)
            else:
                files.staged[target] = beside
    finally:
        if files is None or target not in files.staged:
            beside.unlink(missing_ok=True)
            _remove_aside(beside.parent)


def _aside(named: Path, target: Path, made: list[Path]) -> Path:
    """Where a file is written before it is whole; what a killed run left there is cleared."""
    if target.is_dir():
        raise InputError(named, "cannot write here: this is a folder", expected="the name of a file")
    unfinished = target.parent / UNFINISHED
    try:
        made += [one for one in reversed(target.parents) if not one.exists()]
        finish_left(target.parent)
        unfinished.mkdir(parents=True, exist_ok=True)
        own = unfinished / str(os.getpid())
        own.mkdir(exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        file = next(one for one in target.parents if one.exists())
        raise InputError(named, "cannot write here", found=f"the file {file}", expected="a folder") from None
    except OSError as error:
        raise InputError(named, f"cannot write here: {error.strerror or error}") from None
    return own / target.name


def finish_left(folder: str | Path) -> None:
    """What killed runs left in a folder: whole sets take their places, anything else is removed."""
    unfinished = Path(folder) / UNFINISHED
    for left in unfinished.iterdir() if unfinished.is_dir() else ():
        if not _is_running(left.name):
            _finish(left)
    with suppress(OSError):
        unfinished.rmdir()


def _finish(left: Path) -> None:
    """What a killed run left: a whole set takes its places, anything else is removed."""
    if (left / READY).exists():
        for file in left.iterdir():
            if file.name != READY:
                _rename(file, left.parent.parent / file.name)
    shutil.rmtree(left, ignore_errors=True)


def _is_running(process: str) -> bool:
    if not process.isdecimal():
        return False
    try:
        os.kill(int(process), 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return True
    return True


@contextmanager
def _naming(path: Path, beside: Path) -> Iterator[None]:
    """A failure of the disk names the file that the person asked for."""
    try:
        yield
    except OSError as error:
        if error.filename not in (None, str(beside), beside):
            raise
        raise InputError(path, f"cannot be written: {error.strerror or error}") from None


def _rename(beside: Path, target: Path) -> None:
    try:
        beside.replace(target)
    except OSError as error:
        raise InputError(target, f"cannot write here: {error.strerror or error}") from None


def _remove_aside(own: Path) -> None:
    """The folder of this process, and the one around it, once nothing is in them."""
    for folder in (own, own.parent):
        try:
            (folder / READY).unlink(missing_ok=True)
            folder.rmdir()
        except OSError:
            return
