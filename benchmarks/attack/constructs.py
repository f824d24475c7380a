"""The corpus of hazardous constructs: ``constructs/FAMILY.txt``, collected from manuals and public programs.

A line is ``text :: reason``; ``# source:`` names the manual of the lines below it. ``\\n`` in a text is the end of a
line. Below ``[number]`` stand texts that take the place of a number: ``{n}`` the number, ``{w}`` and ``{d}`` its digits
before and behind the point; below ``[path]`` names of files, for options only.
"""

from __future__ import annotations

import random
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

FOLDER = Path(__file__).with_name("constructs")
FAMILIES = {
    "fanuc": ("fanuc",),
    "haas": ("fanuc", "haas"),
    "mazak": ("fanuc", "mazak"),
    "mitsubishi": ("fanuc", "mitsubishi"),
    **{name: (name,) for name in ("siemens", "heidenhain", "linuxcnc", "grbl", "rrf", "dmis", "ippdme", "jinyoung")},
}
"""Files of the corpus by dialect."""
_SMALL = {"siemens", "linuxcnc", "grbl", "rrf", "dmis"}
_NO_BLANKS = {"fanuc", "haas", "mazak", "mitsubishi", "linuxcnc", "grbl"}
_NUMBERED = {
    **dict.fromkeys(("fanuc", "haas", "mazak", "mitsubishi", "siemens", "linuxcnc", "grbl", "rrf"), "N77 "),
    "heidenhain": "77 ",
}


@dataclass(frozen=True)
class Construct:
    """A text that no program of ours may have where it is executed: ``kind`` block, number or path."""

    text: str
    kind: str
    reason: str
    source: str

    def spelled(self, dialect: str, pick: random.Random) -> Construct:
        """The same in another spelling that its controller takes: small letters, no blanks, a sequence number."""
        ways = [self.text]
        if dialect in _SMALL:
            ways.append(self.text.lower())
        if dialect in _NO_BLANKS and "\n" not in self.text:
            ways.append(self.text.replace(" ", ""))
        if dialect in _NUMBERED and self.text[0].isalnum() and self.text[0] not in "NoO":
            ways += [f"{_NUMBERED[dialect]}{self.text}"] * 2
        return replace(self, text=pick.choice(ways)) if self.kind == "block" else self

    def in_place_of(self, number: str) -> str:
        """The text that takes the place of a number."""
        whole, _, decimals = number.lstrip("+-").partition(".")
        return self.text.format(n=number, w=whole, d=decimals)


@cache
def constructs(dialect: str) -> tuple[Construct, ...]:
    """All of a dialect, those of its family first."""
    return tuple(one for name in FAMILIES[dialect] for one in _read(FOLDER / f"{name}.txt"))


def _read(path: Path) -> list[Construct]:
    found: list[Construct] = []
    kind, source = "block", ""
    for line in path.read_text(encoding="utf-8").splitlines():
        if line.startswith("# source:"):
            source = line.removeprefix("# source:").strip()
        elif line in ("[number]", "[path]"):
            kind = line.strip("[]")
        elif " :: " in line:
            text, _, reason = line.rpartition(" :: ")
            found.append(Construct(text.replace("\\n", "\n"), kind, reason, source))
        elif line and not line.startswith("# "):
            raise ValueError(f"{path}: no construct: {line}")
    return found
