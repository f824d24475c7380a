"""Reading and writing files so that an error names its place and no output is ever half-written."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from stepgauge.errors import InputError


def read_text(path: str | Path) -> str:
    """Text of a UTF-8 file (a byte order mark is dropped); :class:`InputError` if it cannot be read."""
    try:
        return Path(path).read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise InputError(path, "no such file") from None
    except IsADirectoryError:
        raise InputError(path, "this is a folder", expected="a file") from None
    except UnicodeDecodeError as error:
        raise InputError(path, f"not a UTF-8 text file (byte {error.start})") from None
    except OSError as error:
        raise InputError(path, error.strerror or str(error)) from None


def check_output(path: str | Path, *inputs: str | Path | None) -> None:
    """Refuse an output that would replace what the command reads, or that has no place, before any work is done."""
    target = Path(path)
    for source in inputs:
        if source is not None and target.exists() and Path(source).exists() and target.samefile(source):
            raise InputError(target, "this output would replace what the command reads", expected="another name")
    if target.is_dir():
        raise InputError(target, "cannot write here: this is a folder", expected="the name of a file")
    check_folder(target.parent)


def check_folder(path: str | Path) -> None:
    """Refuse a folder for outputs that cannot be made or written to, before any work is done."""
    folder = Path(path)
    present = next(one for one in (folder, *folder.absolute().parents) if os.path.lexists(one))
    if not present.is_dir():
        raise InputError(folder, "cannot write here", found=f"the file {present}", expected="a folder")
    if not os.access(present, os.W_OK | os.X_OK):
        raise InputError(folder, "cannot write here", found=f"no permission to write to {present}")


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """Yield a path beside ``path`` to write to; it takes the name of ``path`` only when all went well.

    The folder is made if it is missing. When the body raises, what stood at ``path`` before still stands.
    """
    target = Path(path)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.stem}-", suffix=target.suffix)
    except OSError as error:
        raise InputError(target, f"cannot write here: {error.strerror or error}") from None
    os.close(handle)
    beside = Path(name)
    try:
        yield beside
        _take_default_mode(beside)
        _rename(beside, target)
    finally:
        beside.unlink(missing_ok=True)


def _rename(beside: Path, target: Path) -> None:
    try:
        beside.replace(target)
    except OSError as error:
        raise InputError(target, f"cannot write here: {error.strerror or error}") from None


def _take_default_mode(path: Path) -> None:
    """Temporary files are private; a result is as readable as any other file of the user."""
    mask = os.umask(0)
    os.umask(mask)
    path.chmod(0o666 & ~mask)


def write_text(path: str | Path, text: str, newline: str | None = None) -> None:
    """Write text beside ``path``, then rename it there."""
    with replacing(path) as beside:
        beside.write_text(text, encoding="utf-8", newline=newline)


def write_json(path: str | Path, data: Any) -> None:
    """Write JSON types as every result of ours is written; NaN, which JSON has not, is a mistake of the caller."""
    write_text(path, json.dumps(data, indent=1, allow_nan=False, ensure_ascii=False) + "\n")


def read_json(path: str | Path) -> Any:
    """The content of a JSON file; :class:`InputError` names the line where it is none."""
    try:
        return json.loads(read_text(path))
    except json.JSONDecodeError as error:
        raise InputError(f"{path}:{error.lineno}", f"not valid JSON: {error.msg}") from None


def read_result(path: str | Path, kind: str) -> dict[str, Any]:
    """The result of a verb, by the key ``format`` (``stepgauge KIND 1``); :class:`InputError` for anything else.

    ``kind`` is the noun of the result, e.g. ``evaluation``; the file is ``KIND.json``.
    """
    data = read_json(path)
    found = data.get("format") if isinstance(data, dict) else None
    if found != f"stepgauge {kind} 1":
        article = "an" if kind[0] in "aeiou" else "a"
        raise InputError(path, f"not {article} {kind}", found=repr(found), expected=f"{kind}.json of stepgauge")
    return dict(data)


def in_folder(path: str | Path, name: str) -> Path:
    """The file ``name`` of a folder, or the file itself: results are given by either."""
    return Path(path) / name if Path(path).is_dir() else Path(path)
