"""Names that a request brings are files in the project's folder, or errors."""

from __future__ import annotations

import os
import shutil
import zipfile
from collections.abc import Iterable
from pathlib import Path

from stepgauge.errors import InputError

MOST_LISTED = 1000
_NOT_LISTED = {"__pycache__", "node_modules"}


def inside(folder: Path, name: str) -> Path:
    """The path that ``name`` means in a folder, with all links followed.

    :class:`InputError` for what lies outside of it, for hidden files, and for names that no file system has.
    """
    expected = "a file in the folder of the project"
    if not name or "\0" in name or len(name) > 1000:
        raise InputError("name", "this names no file", found=repr(name[:60]), expected=expected)
    place = Path(os.path.realpath(folder / name))
    root = Path(os.path.realpath(folder))
    if not place.is_relative_to(root):
        raise InputError(name, "this is outside of the project", expected=expected)
    if any(part.startswith(".") for part in place.relative_to(root).parts):
        raise InputError(name, "this is a hidden file", expected=expected)
    return place


def relative(folder: Path, name: str) -> str:
    """The same as a path from the folder, which is what commands and pages show."""
    return str(inside(folder, name).relative_to(os.path.realpath(folder)))


def existing(folder: Path, name: str) -> Path:
    """A file or folder that is there (:class:`InputError` if not)."""
    place = inside(folder, name)
    if not place.exists():
        raise InputError(name, "no such file", expected="a file in the folder of the project")
    return place


def put_away(folder: Path, name: str) -> str:
    """A file or folder into an archive in ``removed/`` of the project, where nothing looks; the name of the archive.

    With a file goes what was left beside it under its name: ``run.csv.journal`` with ``run.csv``.
    """
    place = existing(folder, name)
    beside = (one for one in place.parent.iterdir() if one.name.startswith(f"{place.name}."))
    files = sorted(one for one in (place.rglob("*") if place.is_dir() else [place, *beside]) if one.is_file())
    target = free_name(folder, f"removed/{relative(folder, name).replace('/', '-')}.zip")
    target.parent.mkdir(exist_ok=True)
    with zipfile.ZipFile(target, "x", zipfile.ZIP_DEFLATED) as archive:
        for one in files:
            archive.write(one, one.relative_to(os.path.realpath(folder)))
    if place.is_dir():
        shutil.rmtree(place)
    else:
        for one in files:
            one.unlink()
    return relative(folder, str(target))


def free_name(folder: Path, wanted: str, data: bytes | None = None) -> Path:
    """A path for a new file: as wanted, or with a number behind it where that name is taken by other content."""
    place = inside(folder, wanted)
    for number in range(2, MOST_LISTED):
        if not place.exists() or (data is not None and place.is_file() and place.read_bytes() == data):
            return place
        wished = Path(wanted)
        place = inside(folder, str(wished.with_name(f"{wished.stem}-{number}{wished.suffix}")))
    raise InputError(wanted, "too many files have this name already", expected="another name")


def listed(folder: Path, suffixes: Iterable[str], deep: int = 3) -> list[str]:
    """Files of a project by their suffixes, newest first, as paths from its folder; nothing hidden."""
    wanted, found = set(suffixes), []
    for root, folders, files in os.walk(folder):
        level = len(Path(root).relative_to(folder).parts)
        folders[:] = [one for one in folders if not one.startswith(".") and one not in _NOT_LISTED and level < deep]
        found += [Path(root) / one for one in files if Path(one).suffix.lower() in wanted and not one.startswith(".")]
    found.sort(key=lambda path: -path.stat().st_mtime if path.exists() else 0.0)
    return [str(path.relative_to(folder)) for path in found[:MOST_LISTED]]


Stamp = tuple[str, int, int]
"""A file: its path, when it was written (ns), its size."""
MOST_BESIDE = 500


def stamps(*paths: str | Path) -> tuple[Stamp, ...]:
    """These files and those beside them, on which they may depend (faces of a gauge, the probe of a machine)."""
    found = []
    for path in map(Path, paths):
        beside = sorted(path.parent.iterdir())[:MOST_BESIDE] if path.parent.is_dir() else []
        for one in (path, *(other for other in beside if other.is_file())):
            if one.exists():
                state = one.stat()
                found.append((str(one), state.st_mtime_ns, state.st_size))
    return tuple(dict.fromkeys(found))
