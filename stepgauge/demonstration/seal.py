"""A sealed file: what was concealed, unreadable at a glance; its checksum is shown before the answer is known."""

from __future__ import annotations

import base64
import binascii
import hashlib
import json
from pathlib import Path
from typing import Any

from stepgauge.errors import InputError
from stepgauge.files.text import read_text, write_text

FIRST_LINE = "# What stepgauge demo concealed. It is opened when the diagnosis is done."


def close_seal(path: Path, truth: dict[str, Any], salt: str) -> str:
    """Write the sealed file; returns its checksum.

    With the ``salt`` (random text) nobody can find the truth by trying, and after the checksum was shown nobody can
    change it.
    """
    data = json.dumps({"concealed": truth, "salt": salt}, sort_keys=True).encode()
    write_text(path, f"{FIRST_LINE}\n{base64.b64encode(data).decode()}\n")
    return hashlib.sha256(data).hexdigest()


def open_seal(path: Path, checksum: str) -> dict[str, Any]:
    """What the file conceals; :class:`InputError` where it is not the one whose checksum was shown."""
    try:
        data = base64.b64decode(read_text(path).splitlines()[1], validate=True)
    except (IndexError, binascii.Error):
        data = b""
    if hashlib.sha256(data).hexdigest() != checksum:
        raise InputError(path, "the seal was changed after it was closed", expected=f"SHA-256 {checksum}")
    truth: dict[str, Any] = json.loads(data)["concealed"]
    return truth
