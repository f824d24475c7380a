"""By what recordings, certificates and machine files are known again: their content, not their names."""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path, PurePosixPath
from typing import TypeVar

import numpy as np

from stepgauge.errors import InputError
from stepgauge.files.checksum import DIGITS, content_name, file_digest
from stepgauge.files.lines import sync_folder
from stepgauge.files.outputs import one_set
from stepgauge.recording import COUNTS, Recording
from stepgauge.recording.simulated import content_comments

MANIFEST = "manifest.json"
"""Names of the files of a key, the main one first, with the SHA-256 of their content; its own is the key."""
T = TypeVar("T")


def recording_key(recording: Recording) -> str:
    """The first digits of the SHA-256 of comments and columns, whatever the order and the form of the file."""
    columns = recording.columns
    digest = hashlib.sha256(
        json.dumps(sorted(content_comments(recording.comments).items())).encode("utf-8", "surrogatepass")
    )
    for name in sorted(columns):
        kind = "<i8" if name in COUNTS else "<f8"
        digest.update(f"\n{name} {len(recording)} {kind}\n".encode())
        digest.update(np.ascontiguousarray(columns[name], kind).tobytes())
    return digest.hexdigest()[:DIGITS]


def read_with_files(read: Callable[[str], T], name: str) -> tuple[T, dict[Path, bytes]]:
    """What a file says (``read``: of it), and all files that were read for it with their content, the first one first.

    A gauge is two files; a machine may name a probe, and that its tables.
    """
    with one_set() as files:
        found = read(name)
        places = list(files.read)
    return found, {place: place.read_bytes() for place in places}


def keep(folder: Path, files: Mapping[Path, bytes]) -> str:
    """Put files that belong together into ``folder/KEY``, side by side as they were; returns the key, of their content.

    What is there already is left as it is.
    """
    root = Path(os.path.commonpath([place.parent for place in files]))
    named = {place.relative_to(root).as_posix(): data for place, data in files.items()}
    for name in named:
        if not is_inside(name):
            raise InputError(root / name, "a file of this name cannot be kept", expected="a name for every system")
    listed = [[name, file_digest(data)] for name, data in named.items()]
    manifest = json.dumps(listed).encode()
    key = content_name(manifest)
    target = folder / key
    if target.is_dir():
        return key
    beside = folder / f"{key}.{os.getpid()}.tmp"
    try:
        for name, data in {**named, MANIFEST: manifest}.items():
            _write(beside / name, data)
        beside.rename(target)
        sync_folder(folder)
    except OSError as error:
        if not target.is_dir():  # else another one was quicker
            raise InputError(target, f"cannot be written: {error.strerror or error}") from None
    finally:
        shutil.rmtree(beside, ignore_errors=True)
    return key


def _write(path: Path, data: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())


def main_file(folder: Path, key: str) -> Path:
    """The file that was kept under a key, beside the others that it needs; errors as :func:`kept_files`."""
    return folder / key / next(iter(kept_files(folder, key)))


def kept_files(folder: Path, key: str) -> dict[str, bytes]:
    """What was kept under a key, by the ways from its folder, the main one first.

    :class:`InputError` where something is missing, was changed after it was written, or leads elsewhere.
    """
    try:
        manifest = (folder / key / MANIFEST).read_bytes()
        listed = json.loads(manifest)
        found = {str(name): (folder / key / name).read_bytes() for name, _ in listed if is_inside(str(name))}
        whole = content_name(manifest) == key
        whole = whole and listed == [[name, file_digest(data)] for name, data in found.items()]
    except (OSError, ValueError, TypeError):
        found, whole = {}, False
    if not (whole and found):
        expected = "a copy of the store, made when it was whole"
        raise InputError(folder / key, "this is missing from the store, or was changed", expected=expected)
    return found


LONGEST = 120
"""Characters of a name; file systems take 255 bytes."""
_OTHER = re.compile(r"[^\w .()+,=@-]")
_PART = re.compile(r'[^/\\:*?"<>|\x00-\x1f]+')
_DEVICE = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\.|$)", re.IGNORECASE)


def safe_name(name: str) -> str:
    """A name as every system takes it, for one file in one folder: nothing in it leads elsewhere or means a device."""
    plain = _OTHER.sub("_", name)[-LONGEST:].rstrip(". ")
    hidden = not plain or plain.startswith((".", " "))
    return f"_{plain}" if hidden or _DEVICE.match(plain) else plain


def is_inside(way: str) -> bool:
    """Whether a way (``a/b.toml``) leads to a file below the folder that it starts from, by names as they should be."""
    parts = PurePosixPath(way).parts
    return bool(parts) and all(part not in (".", "..") and _PART.fullmatch(part) for part in parts)
