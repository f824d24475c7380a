"""Names of files that come out of a store or a table: data of somebody else, which may name one file in one folder."""

from __future__ import annotations

import re
from pathlib import PurePosixPath

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
