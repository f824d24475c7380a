"""What a controller does with a program text: each dialect read a second time, without any code of the package.

Only what moves the machine is looked at. A path is a list of pieces: where a straight move begins and ends, and what it
is for ("travel", "measure", "retract"). A measuring move ends where the tip meets the nominal face.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
NUMBER = r"(-?\d+\.\d+)"


class Piece(NamedTuple):
    """A straight move of the tip centre, mm; ``search_end``: where a measuring move gives up."""

    start: Array
    end: Array
    what: str
    search_end: Array | None = None


class _Tip:
    def __init__(self) -> None:
        self.place: Array | None = None
        self.pieces: list[Piece] = []

    def go(self, target: Array, what: str = "travel", search_end: Array | None = None) -> None:
        if self.place is not None:
            self.pieces.append(Piece(self.place, target, what, search_end))
        self.place = target

    def probe(
        self, contact: Array, normal: Array, radius: float, standoff: float, search: float, retract: float
    ) -> None:
        """What a controller that positions itself does at a surface point with its outward normal."""
        self.go(contact + (radius + standoff) * normal)
        self.go(contact + radius * normal, "measure", contact + (radius - search) * normal)
        self.go(contact + (radius + retract) * normal, "retract")

    def touch(self, search_end: Array, search: float) -> None:
        """A straight probe to the end of its search, from where the tip stands; nominal contact before that."""
        assert self.place is not None
        along = (search_end - self.place) / np.linalg.norm(search_end - self.place)
        self.go(search_end - search * along, "measure", search_end)


def _numbers(text: str) -> Array:
    return np.array([float(one) for one in re.findall(NUMBER, text)])


def dmis(text: str, _radius: float, _search: float) -> list[Piece]:
    """GOTO and PTMEAS; radius and distances as the text sets them."""
    tip, said = _Tip(), dict(re.findall(r"SNSET/(\w+),(\S+)", text))
    text = re.sub(r"\$\n", "", text)
    (diameter,) = re.findall(r"SNSDEF/.*,(\S+)", text)
    standoff, search, retract = (float(said[name]) for name in ("APPRCH", "SEARCH", "RETRCT"))
    for line in text.splitlines():
        if line.startswith("GOTO/"):
            tip.go(_numbers(line))
        elif line.startswith("PTMEAS/"):
            values = _numbers(line)
            tip.probe(values[:3], values[3:], float(diameter) / 2.0, standoff, search, retract)
    return tip.pieces


def ippdme(text: str, radius: float, _search: float) -> list[Piece]:
    """GoTo and PtMeas; the radius is that of the server's tool."""
    tip, said = _Tip(), dict(re.findall(r"Tool\.PtMeasPar\.(\w+)\((\S+?)\)", text))
    standoff, search, retract = (float(said[name]) for name in ("Approach", "Search", "Retract"))
    for line in text.splitlines():
        if " GoTo(" in line:
            tip.go(_numbers(line))
        elif " PtMeas(" in line:
            values = _numbers(line)
            tip.probe(values[:3], values[3:], radius, standoff, search, retract)
    return tip.pieces


def linuxcnc(text: str, _radius: float, _search: float) -> list[Piece]:
    """G1 and G38.2; the search distance as the text states it."""
    tip = _Tip()
    (search,) = re.findall(r"#<_search_mm>=(\S+)", text)
    for line in text.splitlines():
        if line.startswith("G1 "):
            tip.go(_numbers(line.split(" F")[0][3:]))
        elif line.startswith("G38.2 "):
            tip.touch(_numbers(line.split(" F")[0][6:]), float(search))
    return tip.pieces


def jinyoung(text: str, _radius: float, search: float) -> list[Piece]:
    """MV and MS; MS names the nominal contact, the search is the controller's."""
    tip = _Tip()
    for line in text.splitlines():
        if line.startswith("MV"):
            tip.go(_numbers(line))
        elif line.startswith("MS"):
            contact = _numbers(line)
            assert tip.place is not None
            along = (contact - tip.place) / np.linalg.norm(contact - tip.place)
            tip.touch(contact + search * along, search)
    return tip.pieces


CONTROLLERS: dict[str, Callable[[str, float, float], list[Piece]]] = {
    "jinyoung": jinyoung,
    "dmis": dmis,
    "linuxcnc": linuxcnc,
    "ippdme": ippdme,
}
