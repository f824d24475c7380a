"""grbl 1.1 and what keeps to it (grblHAL, FluidNC) as a virtual controller: no variables, no file, a console.

``G38.2`` is a measurement; without a contact the controller stops with ALARM:5. ``G38.3`` protects the way: a contact
ends it, and the next search then stops with ALARM:4, for the probe is deflected before it starts. The console shows
``[PRB:x,y,z:1]`` after every search: machine coordinates, three decimals. The program therefore makes G59 the same as
machine coordinates.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import ClassVar

from stepgauge.files.templating import fixed
from stepgauge.programs.gcode import DWELL, GCode
from stepgauge.programs.reading import Reader

SET, SHIFT_OFF, PROBE, GUARD = 10.0, 92.1, 38.2, 38.3
LONGEST_BLOCK = 80
"""Characters of a line that grbl 1.1 has room for, without blanks and comments."""
_SEARCH = re.compile(r"\(SEARCH ([\d.]+) MM BEYOND THE NOMINAL CONTACT\)", re.IGNORECASE)


def recognises(text: str) -> bool:
    """Whether G59 is made machine coordinates before a straight probe."""
    return re.search(r"(?im)^ *G10 *L2 *P6\b", text) is not None and "38.2" in text


class _Interpreter(GCode):
    """The controller between lines."""

    states: ClassVar[Mapping[float, str]] = {
        21: "units",
        40: "tool radius",
        49: "tool length",
        61: "path",
        90: "distances",
        94: "feed",
        SHIFT_OFF: "shift",
    }
    no_effect: ClassVar[frozenset[float]] = frozenset({17.0, 80.0, DWELL, SET, 54.0})
    searches: ClassVar[frozenset[float]] = frozenset({PROBE, GUARD})

    def __init__(self, reader: Reader) -> None:
        super().__init__(reader)
        self.deflected = False

    def take_arguments(self, words: dict[str, list[float]], codes: Sequence[float]) -> None:
        """G10 L2 P6 X0 Y0 Z0 is the only offset that may be set."""
        if SET in codes:
            said = {letter: words.pop(letter, [None])[0] for letter in "LPXYZ"}
            if said != {"L": 2.0, "P": 6.0, "X": 0.0, "Y": 0.0, "Z": 0.0}:
                self.reader.fail("an offset is changed", found=str(said), expected="G10 L2 P6 X0 Y0 Z0")
            self.reader.states["offset"] = "G10 L2 P6 X0 Y0 Z0"
        super().take_arguments(words, codes)

    def take_code(self, code: float) -> None:
        """Work offsets are coordinates."""
        if code in (54.0, 55.0, 56.0, 57.0, 58.0, 59.0):
            self.reader.states["coordinates"] = f"G{code:g}"
        else:
            super().take_code(code)

    def go(self, target: Mapping[str, float], motion: float | None) -> None:
        """No search starts with the probe deflected."""
        if motion in self.searches and self.deflected:
            self.reader.log.append("ALARM:4")
            self.reader.alarm("ALARM:4 probe fail: the probe is not in the expected initial state")
        self.deflected = False
        super().go(target, motion)

    def measures(self, code: float) -> bool:
        """G38.2 must find its face."""
        return code == PROBE

    def after_search(self, code: float, measuring: bool) -> None:
        """The console shows every search; a contact keeps the probe deflected."""
        self.deflected = self.contact.hit
        x, y, z = (fixed(value, 3) for value in self.contact.position)
        self.reader.log.append(f"[PRB:{x},{y},{z}:{int(self.contact.hit)}]")
        if measuring and not self.contact.hit:
            self.reader.log.append("ALARM:5")
            self.reader.alarm("ALARM:5 probe fail: no contact")


def run(text: str, reader: Reader) -> None:
    """Execute a program text; :class:`stepgauge.errors.InputError` names the line."""
    interpreter = _Interpreter(reader)
    for reader.line, raw in enumerate(text.splitlines(), 1):
        said = _SEARCH.search(raw)
        if said:
            reader.set(search_mm=reader.number(said[1], "the search distance"))
        block = re.sub(r"\s+", "", re.sub(r"\([^()]*\)", "", raw).split(";")[0].upper())
        if len(block) > LONGEST_BLOCK:
            reader.fail("the line is too long for grbl", found=f"{len(block)} characters", expected=f"{LONGEST_BLOCK}")
        if block:
            interpreter.block(block)
            reader.log.append("ok")
    if not interpreter.ended:
        reader.cut_short("M2 at the end")
