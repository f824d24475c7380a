"""What the G-code dialects share: words, modal codes, one feed for all moves, searches and protected travel."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import ClassVar

from stepgauge.programs.expression import Grammar, Value, evaluate
from stepgauge.programs.reading import Contact, Reader

RAPID, FEED = 0.0, 1.0
DWELL = 4.0
AXES = "XYZ"


def moves_with_result(prints: Sequence[bool], moves: Sequence[bool]) -> list[bool]:
    """Which statements are moves whose result is printed before the next move: those measure, the others travel."""
    found, printed = [False] * len(moves), False
    for i in reversed(range(len(moves))):
        if prints[i]:
            printed = True
        elif moves[i]:
            found[i], printed = printed, False
    return found


class GCode:
    """Modal state of the G-code between blocks; a dialect states its codes and adds its own statements.

    ``states``: codes by what they state; ``no_effect``, ``refused`` (with what is accepted instead); ``searches``:
    codes of moves that the probe ends; ``one_shot``: those of one block; ``m_codes``: M codes that move nothing;
    ``ends``: those that end the program.
    """

    states: ClassVar[Mapping[float, str]] = {}
    no_effect: ClassVar[frozenset[float]] = frozenset()
    refused: ClassVar[Mapping[float, str]] = {
        20: "G21 (mm)",
        91: "G90 (absolute)",
        93: "G94 (mm/min)",
        95: "G94 (mm/min)",
    }
    searches: ClassVar[frozenset[float]] = frozenset()
    one_shot: ClassVar[frozenset[float]] = frozenset()
    m_codes: ClassVar[frozenset[float]] = frozenset({0.0, 2.0, 30.0})
    ends: ClassVar[frozenset[float]] = frozenset({2.0, 30.0})
    word: ClassVar[re.Pattern[str]] = re.compile(r"([A-Z])([-+]?(?:\d+\.?\d*|\.\d+))", re.ASCII)
    grammar: ClassVar[Grammar] = Grammar(r"#<\w+>|#\d+", brackets="[]")

    def __init__(self, reader: Reader) -> None:
        self.reader = reader
        self.motion: float | None = None
        self.feed_mm_s: float | None = None
        self.position: dict[str, float] = {}
        self.contact = Contact((0.0, 0.0, 0.0), False)
        self.variables: dict[str, Value] = {}
        self.ended = False

    def value(self, text: str) -> Value:
        """An expression of the text."""
        try:
            return evaluate(text, self.grammar, self.look_up)
        except ValueError as error:
            self.reader.fail("expression not understood", found=f"{error} in {text!r}")

    def number(self, text: str) -> float:
        """An expression whose value is a number."""
        return self.reader.as_number(self.value(text))

    def look_up(self, name: str) -> Value:
        """The value of a variable; :class:`InputError` for one that nothing was written to."""
        if name not in self.variables:
            self.reader.fail("variable without a value", found=name)
        return self.variables[name]

    def words_of(self, text: str) -> dict[str, list[float]]:
        """Letters and numbers of a block."""
        words: dict[str, list[float]] = {}
        for letter, value in self.word.findall(text):
            words.setdefault(letter, []).append(self.number(value))
        if self.word.sub("", text):
            self.reader.fail("words not understood", found=repr(text), expected="words like G1 X10.5 F600")
        return words

    def block(self, text: str) -> None:
        """A block of words."""
        self.check_end(text)
        words = self.words_of(text)
        codes = words.pop("G", [])
        for code in codes:
            self.take_code(code)
        self.take_arguments(words, codes)
        words = self.take_m_codes(words)
        twice = [letter for letter, values in words.items() if len(values) > 1]
        if twice:
            self.reader.fail("the same word twice in a line", found=", ".join(twice), expected="one of each")
        single = {letter: values[0] for letter, values in words.items()}
        self.take_words(single, next((code for code in codes if code in self.one_shot), self.motion))

    def check_end(self, text: str) -> None:
        """Nothing may follow the end."""
        if self.ended:
            self.reader.fail("statement after the end of the program", found=repr(text))

    def take_code(self, code: float) -> None:
        """A G code."""
        if code in (RAPID, FEED) or (code in self.searches and code not in self.one_shot):
            self.motion = code
        elif code in self.refused:
            self.reader.fail(f"G{code:g} is not accepted", expected=self.refused[code])
        elif code in self.states:
            self.reader.states[self.states[code]] = f"G{code:g}"
        elif code not in self.no_effect and code not in self.one_shot:
            self.reader.fail("G code not understood", found=f"G{code:g}")

    def take_arguments(self, words: dict[str, list[float]], codes: Sequence[float]) -> None:
        """Drop the words that belong to codes which move nothing: the time of a dwell."""
        if DWELL in codes:
            words.pop("P", None)

    def take_m_codes(self, words: dict[str, list[float]]) -> dict[str, list[float]]:
        """M codes, and the words that are left."""
        codes = set(words.pop("M", []))
        if codes - self.m_codes:
            self.reader.fail("M code not understood", found=", ".join(f"M{code:g}" for code in codes - self.m_codes))
        self.ended = bool(self.ends & codes)
        return words

    def take_words(self, words: dict[str, float], motion: float | None) -> None:
        """Feed and coordinates."""
        if "F" in words:
            self.set_feed(words.pop("F") / 60.0)
        words.pop("N", None)
        target = {axis: words.pop(axis) for axis in AXES if axis in words}
        if words:
            self.reader.fail("words not understood", found=" ".join(words), expected="G, X, Y, Z, F, M and N words")
        if target:
            self.go(target, motion)

    def set_feed(self, speed_mm_s: float) -> None:
        """The feed that holds from here on."""
        if speed_mm_s <= 0:
            self.reader.fail("the feed must be positive", found=f"F{speed_mm_s * 60:g}")
        self.feed_mm_s = speed_mm_s

    def go(self, target: Mapping[str, float], motion: float | None) -> None:
        """A straight move to coordinates, of which those not stated stay."""
        if "units" not in self.reader.states:
            self.reader.fail("a move before the units are set", expected="G21 first")
        if motion is None:
            self.reader.fail("coordinates without a motion", expected="G0, G1 or a search")
        self.position.update(target)
        if len(self.position) < 3:
            missing = ", ".join(axis for axis in AXES if axis not in self.position)
            self.reader.fail("the position is not complete", found=f"no {missing} yet", expected="X, Y and Z")
        end = [self.position[axis] for axis in AXES]
        measuring = motion in self.searches and self.measures(motion)
        if self.feed_mm_s is not None and motion != RAPID:
            which = "measuring_speed_mm_s" if measuring else "travel_speed_mm_s"
            self.reader.set(**{which: self.feed_mm_s})  # a feed holds until there is another, searches or not
        if motion not in self.searches:
            self.reader.goto(end, as_fast_as_it_can=motion == RAPID)
            return
        self.contact = self.reader.search(end, f"G{motion:g}") if measuring else self.reader.travel(end)
        self.after_search(motion, measuring)

    def measures(self, code: float) -> bool:
        """Whether a search with this code, at the line at hand, is a measurement."""
        return True

    def after_search(self, code: float, measuring: bool) -> None:
        """What the controller itself does after a search."""
