"""Which result a folder or a file holds."""

from __future__ import annotations

from pathlib import Path

from stepgauge.errors import InputError
from stepgauge.files.text import read_json

KINDS = ("evaluation", "diagnosis")


def kind_of(path: str | Path) -> str:
    """``evaluation`` or ``diagnosis``, by the file in a folder or by the file itself.

    :class:`InputError` where there is neither, or both.
    """
    place = Path(path)
    if place.is_dir():
        found = [kind for kind in KINDS if (place / f"{kind}.json").is_file()]
        expected = "evaluation.json or diagnosis.json"
        if not found:
            raise InputError(path, "holds no result that can be reported", expected=f"a folder with {expected}")
        if len(found) > 1:
            raise InputError(
                path, "holds an evaluation and a diagnosis", expected=f"one of them by name: {place}/{expected}"
            )
        return found[0]
    data = read_json(place)
    stated = data.get("format") if isinstance(data, dict) else None
    return next((kind for kind in KINDS if stated == f"stepgauge {kind} 1"), "evaluation")
