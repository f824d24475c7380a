"""Reader of LinuxCNC G-code: G0/G1 moves and G38.2 straight probes, in millimetres and absolute coordinates.

G38.2 names the end of the search; the named parameter ``#<_search_mm>`` says how far that is beyond the nominal tip
centre at contact.
"""

from __future__ import annotations

import re

from stepgauge.motion.moves import ProbingSettings, Program
from stepgauge.programs.reading import Reader

_WORD = re.compile(r"([A-Z])([-+]?(?:\d+\.?\d*|\.\d+))", re.ASCII)
_PARAMETER = re.compile(r"#<(\w+)>=(.+)")
_STATES = {
    21: "units",
    40: "tool radius",
    49: "tool length",
    54: "coordinates",
    61: "path",
    90: "distances",
    94: "feed",
}
_NO_EFFECT = {17, 80}
_M_CODES = {2.0, 30.0, 66.0}
_READ_INPUT, _INPUT_WORDS = 66.0, "PELQ"
_REFUSED = {20: "G21 (mm)", 91: "G90 (absolute)", 93: "G94 (mm/min)", 95: "G94 (mm/min)", 31: "G38.2"}


def recognises(text: str) -> bool:
    """Whether a G38.2 straight probe is in the text."""
    return re.search(r"(?im)^[^(;\n]*G38\.2", text) is not None


class _Interpreter:
    """Modal state of the G-code between lines."""

    def __init__(self, reader: Reader) -> None:
        self.reader = reader
        self.motion: float | None = None
        self.feed_mm_s: float | None = None
        self.position: dict[str, float] = {}
        self.ended = False

    def block(self, text: str) -> None:
        """One line without its comments."""
        if self.ended:
            self.reader.fail("statement after the end of the program", found=repr(text))
        parameter = _PARAMETER.fullmatch(text)
        if parameter:
            self._parameter(parameter[1], parameter[2])
            return
        if text == "%":
            self.ended = "units" in self.reader.states
            return
        words = self._words(text)
        for value in words.pop("G", []):
            self._state(value)
        codes = set(words.pop("M", []))
        if codes - _M_CODES:
            self.reader.fail("M code not understood", found=", ".join(f"M{code:g}" for code in codes - _M_CODES))
        self.ended = bool({2.0, 30.0} & codes)
        if _READ_INPUT in codes:  # reads an input of the controller into #5399 and moves nothing
            words = {letter: values for letter, values in words.items() if letter not in _INPUT_WORDS}
        twice = [letter for letter, values in words.items() if len(values) > 1]
        if twice:
            self.reader.fail("the same word twice in a line", found=", ".join(twice), expected="one of each")
        self._move({letter: values[0] for letter, values in words.items()})

    def _parameter(self, name: str, value: str) -> None:
        number = self.reader.number(value, f"#<{name}>")
        if name == "_search_mm":
            self.reader.set(search_mm=number)
        elif not name.startswith("_n"):
            self.reader.fail("named parameter not understood", found=f"#<{name}>", expected="#<_search_mm> or #<_n>")

    def _words(self, text: str) -> dict[str, list[float]]:
        words: dict[str, list[float]] = {}
        for letter, value in _WORD.findall(text):
            words.setdefault(letter, []).append(float(value))
        if _WORD.sub("", text):
            self.reader.fail("words not understood", found=repr(text), expected="words like G1 X10.5 F600")
        return words

    def _state(self, code: float) -> None:
        if code in (0.0, 1.0, 38.2):
            self.motion = code
        elif code in _REFUSED:
            self.reader.fail(f"G{code:g} is not accepted", expected=_REFUSED[int(code)])
        elif code in _STATES:
            self.reader.states[_STATES[int(code)]] = f"G{code:g}"
        elif code not in _NO_EFFECT:
            self.reader.fail("G code not understood", found=f"G{code:g}")

    def _move(self, words: dict[str, float]) -> None:
        if "F" in words:
            self._feed(words.pop("F") / 60.0)
        words.pop("N", None)
        target = {axis: words.pop(axis) for axis in "XYZ" if axis in words}
        if words:
            self.reader.fail("words not understood", found=" ".join(words), expected="G, X, Y, Z, F, M and N words")
        if target:
            self._go(target)

    def _feed(self, speed_mm_s: float) -> None:
        if speed_mm_s <= 0:
            self.reader.fail("the feed must be positive", found=f"F{speed_mm_s * 60:g}")
        self.feed_mm_s = speed_mm_s

    def _go(self, target: dict[str, float]) -> None:
        if "units" not in self.reader.states:
            self.reader.fail("a move before the units are set", expected="G21 first")
        if self.motion is None:
            self.reader.fail("coordinates without a motion", expected="G0, G1 or G38.2")
        self.position.update(target)
        if len(self.position) < 3:
            missing = ", ".join(axis for axis in "XYZ" if axis not in self.position)
            self.reader.fail("the position is not complete", found=f"no {missing} yet", expected="X, Y and Z")
        end = [self.position[axis] for axis in "XYZ"]
        if self.feed_mm_s is not None and self.motion != 0.0:
            which = "measuring_speed_mm_s" if self.motion == 38.2 else "travel_speed_mm_s"
            self.reader.set(**{which: self.feed_mm_s})  # a feed holds until there is another, searches or not
        if self.motion == 38.2:
            approach = self.reader.from_here(end, "G38.2")
            target_mm = [p - self.reader.settings.search_mm * d for p, d in zip(end, approach, strict=True)]
            self.reader.measure(target_mm, approach)
        else:
            self.reader.goto(end, as_fast_as_it_can=self.motion == 0.0)


def read(text: str, path: str, settings: ProbingSettings) -> Program:
    """The moves of a program text; :class:`stepgauge.errors.InputError` names the line."""
    reader = Reader(path, settings)
    interpreter = _Interpreter(reader)
    for reader.line, raw in enumerate(text.splitlines(), 1):
        block = re.sub(r"\([^()]*\)", "", raw).split(";")[0]
        block = block if "#<" in block else block.upper()
        block = re.sub(r"\s+", "", block)
        if block:
            interpreter.block(block)
    if not interpreter.ended:
        reader.fail("the program is cut short", expected="M2 or % at the end")
    return reader.finish()
