"""Which result a folder or a file holds."""

from __future__ import annotations

from pathlib import Path

from stepgauge.errors import InputError
from stepgauge.files.outputs import place_of
from stepgauge.files.text import read_json

KINDS = ("evaluation", "diagnosis", "investigation")
FLEET = "fleet inference"
"""A result that is one file, whatever its name."""


def kind_of(path: str | Path) -> str:
    """Which of :data:`KINDS`, by the file in a folder or by the file itself, or :data:`FLEET`, by the file.

    :class:`InputError` where there is none of them, or more than one.
    """
    place = Path(path)
    expected = ", ".join(f"{kind}.json" for kind in KINDS[:-1]) + f" or {KINDS[-1]}.json"
    if place.is_dir():
        found = [kind for kind in KINDS if (place / f"{kind}.json").is_file()]
        if not found:
            raise InputError(path, "holds no result that can be reported", expected=f"a folder with {expected}")
        if len(found) > 1:
            what = f"holds {' and '.join('an ' + one if one[0] in 'aei' else 'a ' + one for one in found)}"
            raise InputError(path, what, expected=f"one of them by name: {place}/{found[0]}.json")
        return found[0]
    if place.is_file() and place.suffix.lower() != ".json":
        raise InputError(path, "is no result that can be reported", expected=f"a folder with {expected}, or that file")
    data = read_json(place)
    stated = str(data.get("format") if isinstance(data, dict) else None).rpartition(" ")[0]
    return next((kind for kind in (*KINDS, FLEET) if stated == f"stepgauge {kind}"), "evaluation")


def first_lines(path: str | Path) -> list[str]:
    """What to do first, of a ``diagnosis.json`` of whatever was diagnosed."""
    from stepgauge.reports.diagnosis import first_of

    return first_of(read_json(place_of(path)))
