"""Reading and writing files so that an error names its place and no output is ever half-written."""

from __future__ import annotations

import json
import os
import re
import stat
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stepgauge.errors import InputError, reader, reading
from stepgauge.files.checksum import add_checksum, check_text, file_digest, is_whole, seal_text
from stepgauge.files.outputs import inputs, is_source, one_set, place_of, replacing, shown_of_result, was_read

if TYPE_CHECKING:
    import pandas as pd

__all__ = [
    "GivenTable",
    "check_folder",
    "check_output",
    "decode_text",
    "is_there",
    "one_set",
    "parse_json",
    "read_bytes",
    "read_json",
    "read_result",
    "read_text",
    "replacing",
    "result_file",
    "result_text",
    "write_files",
    "write_json",
    "write_sealed",
    "write_text",
]
LARGEST_NUMBER = 1e15
"""No quantity of ours is larger, in whatever unit."""
MOST_FOLDERS_UP = 3
"""A file farther up than this from a result is none that is kept with it."""
LARGEST_BYTES = 64_000_000
"""Larger files are none that a person writes, nor the log of a calibration."""
_NO_TEXT = (
    (b"PK\x03\x04", "an Excel workbook or another archive", "a text file (export it as CSV)"),
    (b"\xff\xfe", "text in UTF-16", "text in UTF-8"),
    (b"\xfe\xff", "text in UTF-16", "text in UTF-8"),
    (b"\x89PNG", "a picture (PNG)", "a text file"),
    (b"%PDF", "a PDF document", "a text file"),
    (b"PAR1", "a Parquet file", "a text file"),
)


class GivenTable(str):
    """A table that Python gave where the command line has a file: the name it has in messages, ``data``, what the
    file would hold, and the ``frame`` itself."""

    data: bytes
    frame: pd.DataFrame

    def __new__(cls, name: str, data: bytes, frame: pd.DataFrame) -> GivenTable:
        """The table of that name."""
        made = super().__new__(cls, name)
        made.data, made.frame = data, frame
        return made


def is_there(path: str | Path) -> bool:
    """Whether there is something to read: a file, or what Python gave in place of one."""
    return isinstance(path, GivenTable) or Path(path).is_file()


def read_bytes(path: str | Path, largest: int = LARGEST_BYTES) -> bytes:
    """The content of a file; :class:`InputError` where there is none, for devices, and above ``largest`` bytes.

    A verb may read what it has just written.
    """
    if isinstance(path, GivenTable):
        return path.data
    with reading(path), place_of(path).open("rb") as file:
        kind = os.fstat(file.fileno())
        if not (stat.S_ISREG(kind.st_mode) or stat.S_ISFIFO(kind.st_mode)):
            raise InputError(path, "this is no file", found="a device", expected="a file")
        data = file.read(largest + 1) if kind.st_size <= largest else b""
        if kind.st_size > largest or len(data) > largest:
            size = f"{max(kind.st_size, len(data)) / 1e6:.0f} MB"
            raise InputError(path, "the file is too large", found=size, expected=f"at most {largest / 1e6:.0f} MB")
        was_read(path, data)
        return data


def read_text(path: str | Path) -> str:
    """Text of a UTF-8 file (a byte order mark is dropped); :class:`InputError` if it cannot be read.

    One that stepgauge wrote with a checksum must be as it was written.
    """
    return decode_text(read_bytes(path), path)


def any_text(data: bytes, path: str | Path) -> tuple[str, str]:
    """The text of a foreign file and the name of its encoding: UTF-8, UTF-16 by its mark, else Windows-1252.

    :class:`InputError` for what is no text.
    """
    marked = data[:2] in (b"\xff\xfe", b"\xfe\xff")
    known = {"utf-16": "UTF-16"} if marked else {"utf-8-sig": "UTF-8", "cp1252": "Windows-1252"}
    for encoding, name in known.items():
        try:
            text = data.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\0" not in text:
            return text, name
        break
    raise InputError(path, "this is not a text file", found=repr(data[:16]), expected="a table as text (CSV)")


def decode_text(data: bytes, path: str | Path) -> str:
    """The content of a file as text; ``path`` is for messages. Errors as :func:`read_text`."""
    for mark, found, expected in _NO_TEXT:
        if data.startswith(mark):
            raise InputError(path, "not a UTF-8 text file", found=found, expected=expected)
    with reading(path):
        text = data.decode("utf-8-sig")
    if "\0" in text:
        raise InputError(path, f"not a text file (byte {data.index(0)} is zero)")
    return check_text(text.replace("\r\n", "\n").replace("\r", "\n"), path)


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


def write_text(path: str | Path, text: str, newline: str | None = None, at_once: bool = False) -> None:
    """Write text whole or not at all; ``at_once``: now, whatever else the verb still has to write."""
    with replacing(path, at_once) as beside:
        beside.write_text(text, encoding="utf-8", newline=newline)


def write_sealed(path: str | Path, text: str) -> None:
    """As :func:`write_text`, and TOML, which is read back, with a checksum; the others are for people."""
    write_text(path, seal_text(text) if Path(path).suffix == ".toml" else text)


def write_json(path: str | Path, data: Any, at_once: bool = False) -> None:
    """Write JSON types as every result of ours is written; NaN, which JSON has not, is a mistake of the caller.

    A result (it has the key ``format``) also says what it was made from: ``inputs``, the files that the verb has read,
    and gets a ``checksum``, by which :func:`read_result` knows that nobody changed it.
    """
    if isinstance(data, dict) and "format" in data:
        made_from = [_input(place, sha256, Path(path)) for place, sha256 in inputs().items()]
        key = "made_from" if "inputs" in data else "inputs"  # a Monte Carlo has inputs of another sort
        data = {**data, **shown_of_result(), **({key: made_from} if made_from else {})}
    write_text(path, result_text(data), at_once=at_once)


def write_files(folder: str | Path, contents: Mapping[str, Any]) -> list[Path]:
    """Write files into a folder (made if missing): text as it is, anything else as JSON; returns their paths."""
    for name, content in contents.items():
        (write_text if isinstance(content, str) else write_json)(Path(folder) / name, content)
    return [Path(folder) / name for name in contents]


def result_text(data: Any) -> str:
    """JSON types as the text of a file; a result gets its checksum."""
    said = add_checksum(data) if isinstance(data, dict) and "format" in data else data
    return json.dumps(said, indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def _input(place: Path, sha256: str, result: Path) -> dict[str, str]:
    """A file by its way from the folder of the result; one that lies elsewhere (a shipped one) by its name alone."""
    way = os.path.relpath(place, os.path.realpath(result.parent))
    near = not os.path.isabs(way) and way.split(os.sep).count(os.pardir) <= MOST_FOLDERS_UP
    return {"file" if near else "name": Path(way).as_posix() if near else place.name, "sha256": sha256}


def check_inputs(data: dict[str, Any], path: str | Path) -> None:
    """:class:`InputError` where a file that a result was made from is still there and has changed since."""
    stated = data.get("made_from", data.get("inputs", []))
    named = [one for one in stated if isinstance(one, dict) and "file" in one] if isinstance(stated, list) else []
    for one in named:
        place = Path(path).parent / str(one["file"])
        if place.is_file():
            is_source(place)
            with reading(place):
                found = file_digest(place)
            if found != one.get("sha256"):
                what = f"{one['file']} has changed since this was made from it"
                raise InputError(path, what, expected="this made again, with what is there now")


@reader("JSON file")
def read_json(path: str | Path) -> Any:
    """The content of a JSON file; :class:`InputError` names the line where it is none, and a key that is there twice.

    Numbers must be finite.
    """
    return parse_json(read_text(path), path)


def parse_json(text: str, path: str | Path) -> Any:
    """JSON from text; ``path`` is for messages. Errors as :func:`read_json`."""

    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        """The object of these pairs; no key twice, for the last one would win without a word."""
        found = dict(pairs)
        if len(found) < len(pairs):
            names = [key for key, _ in pairs]
            twice = next(key for key in names if names.count(key) > 1)
            raise InputError(path, f"key {twice!r} is there twice")
        return found

    def finite(number: str) -> float:
        value = float(number)
        if not abs(value) <= LARGEST_NUMBER:
            raise InputError(path, "a number is not finite, or too large", found=number)
        return value

    def whole(number: str) -> int:
        finite(number)
        return int(number)

    with reading(path, "JSON file"):
        try:
            return json.loads(text, object_pairs_hook=once, parse_float=finite, parse_int=whole, parse_constant=finite)
        except json.JSONDecodeError as error:
            raise InputError(f"{path}:{error.lineno}", f"not valid JSON: {error.msg}") from None


FORMATS = {"diagnosis": 3}
"""Number of the format of a result, of which keys have changed since it was 1."""


def format_of(kind: str) -> str:
    """The key ``format`` of the JSON file of a result."""
    return f"stepgauge {kind} {FORMATS.get(kind, 1)}"


def read_result(path: str | Path, kind: str, with_inputs: bool = True) -> dict[str, Any]:
    """The result of a verb, by the key ``format`` (:func:`format_of`); :class:`InputError` for anything else.

    ``kind`` is the noun of the result, e.g. ``evaluation``; the file is ``KIND.json``. A result that was changed after
    it was written is refused, and, ``with_inputs``, one of whose inputs has changed since (:func:`check_inputs`).
    """
    data = read_json(path)
    found = data.get("format") if isinstance(data, dict) else None
    if found != format_of(kind):
        if re.fullmatch(rf"stepgauge {kind} \d+", str(found)):
            what = f"this {kind} is of another version of stepgauge"
            raise InputError(path, what, found=found, expected=f"{format_of(kind)}: make it again")
        article = "an" if kind[0] in "aeiou" else "a"
        raise InputError(path, f"not {article} {kind}", found=repr(found), expected=f"{kind}.json of stepgauge")
    if not is_whole(data):
        what = "has no checksum" if "checksum" not in data else "was changed after it was written"
        raise InputError(path, f"this {kind} {what}", expected="the file as stepgauge wrote it: make it again")
    if with_inputs:
        check_inputs(data, path)
    return dict(data)


RESULTS = ("evaluation.json", "budget.json", "diagnosis.json", "investigation.json")
"""Files by which the folder of a verb is known."""


def result_file(path: str | Path, name: str) -> Path:
    """The file ``name`` of a folder, or the file itself: results are given by either.

    :class:`InputError` for the folder of another verb.
    """
    folder = Path(path)
    if not folder.is_dir():
        return folder
    other = next((one for one in RESULTS if (folder / one).is_file()), name)
    if other != name and not (folder / name).is_file():
        expected = name
        if other == "diagnosis.json":
            expected = f"{name}; what a diagnosis tells to enter stands in its diagnosis.md"
        raise InputError(path, "this is a result of another verb", found=other, expected=expected)
    return folder / name


def margins(text: str, lines: int) -> tuple[int, int]:
    """Where the first lines of a longer text end, and where its last lines begin."""
    start, end = 0, len(text)
    for _ in range(lines):
        start = text.index("\n", start) + 1
        end = text.rindex("\n", 0, end)
    return start, end + 1
