"""Checksums (SHA-256) of what stepgauge writes and reads back: a change after the writing is an error, never a value.

One rule for every kind of file: a result (JSON) has the key ``checksum``; each line of a journal has it, and it counts
the lines above; a text (TOML) ends with the line ``# checksum: ...``; files of a store are called by it. It tells of
damage and of edits, and is no signature: who means to change a text takes that line away.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from stepgauge.errors import InputError

KEY = "checksum"
DIGITS = 32
"""Of a name by content: 128 bits."""
_LAST_LINE = re.compile(rf"# {KEY}: ([0-9a-f]{{64}})\n")
_ONE = re.compile(rf"^# {KEY}", re.MULTILINE)
_WHEN = re.compile(rb"# measured_at:[^\n]*\n")
_HEAD = re.compile(rb"(?:#[^\n]*\n)+")
_SIMULATED = re.compile(rb"^# simulated:", re.MULTILINE)


def checksum(data: Mapping[str, Any], before: str = "") -> str:
    """SHA-256 of JSON types, whatever the order of the keys and the layout of the file.

    ``before``: the checksum of what stands above, where the order counts.
    """
    said = {key: value for key, value in data.items() if key != KEY}
    text = before + json.dumps(said, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()


def file_sha256(path: str | Path) -> str | None:
    """SHA-256 of a file as it is now; None for data that were never in a file."""
    place = Path(path)
    return file_digest(place) if str(path) and place.is_file() else None


def add_checksum(data: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    """The same with its checksum as the last key."""
    return {**{key: value for key, value in data.items() if key != KEY}, KEY: checksum(data, before)}


def is_whole(data: Mapping[str, Any], before: str = "") -> bool:
    """Whether it is as :func:`add_checksum` made it."""
    return data.get(KEY) == checksum(data, before)


def seal_text(text: str) -> str:
    """A text with its checksum in the last line, as a comment."""
    whole = text if text.endswith("\n") else text + "\n"
    return f"{whole}# {KEY}: {hashlib.sha256(whole.encode()).hexdigest()}\n"


def check_text(text: str, path: str | Path) -> str:
    """The text without its checksum; one that has none is a person's own.

    :class:`InputError` where it was changed after it was written.
    """
    stated = _ONE.search(text) if f"# {KEY}" in text else None  # most texts have none, and a search by lines takes time
    if stated is None:
        return text
    whole, found = text[: stated.start()], _LAST_LINE.fullmatch(text[stated.start() :])
    if found is None or found[1] != hashlib.sha256(whole.encode("utf-8", "surrogatepass")).hexdigest():
        expected = f"the file as it was written; if the change is meant, take the line '# {KEY}' away"
        raise InputError(path, "this was changed after stepgauge wrote it", expected=expected)
    return whole


def file_digest(content: bytes | Path) -> str:
    """SHA-256 by which results know the files again that they were made from, in hexadecimal digits.

    When the virtual CMM ran is nothing that its recording depends on: the line that says so does not count (as in
    :func:`stepgauge.recording.simulated.content_comments`), so that the same program, machine and seed give what is
    known again. Every other file counts as it is.
    """
    if isinstance(content, Path):
        with content.open("rb") as file:
            if file.read(1) != b"#":
                file.seek(0)
                return hashlib.file_digest(file, "sha256").hexdigest()
        content = content.read_bytes()
    head = _HEAD.match(content)
    if head is None or not _SIMULATED.search(head[0]):
        return hashlib.sha256(content).hexdigest()
    digest = hashlib.sha256(_WHEN.sub(b"", head[0]))
    digest.update(content[head.end() :])
    return digest.hexdigest()


def content_name(content: bytes | Path) -> str:
    """What a file of a store is called by: the first digits of its :func:`file_digest`."""
    return file_digest(content)[:DIGITS]


def check_name(path: Path, again: str = "a copy of the store, made when it was whole") -> Path:
    """The same path of a file whose name ends with that of its content, looked at once while it does not change.

    :class:`InputError` where it was changed after it was written; ``again``: what helps then.
    """
    state = path.stat()
    found = _content_name(path, state.st_mtime_ns, state.st_size, state.st_ino)
    if not re.fullmatch(rf"(\d+-)?{found}", path.stem):
        raise InputError(path, "this file of the store was changed after it was written", expected=again)
    return path


@lru_cache(maxsize=100_000)
def _content_name(path: Path, *_: int) -> str:
    return content_name(path)
