"""What the G-code dialects share: modal codes, one feed for all moves, searches and protected travel."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

from stepgauge.programs.blocks import WORDS, Block
from stepgauge.programs.execution import VirtualController
from stepgauge.programs.grammar import END, QUIET, Code, Comment
from stepgauge.programs.reading import Reader

RAPID = "G0"
AXES = "XYZ"
MOTION = "motion"
_SIGNS = r" A-Za-z0-9.,:_/=+*'\\\-"
ORDINARY = Comment("(", ")", rf"[{_SIGNS}]*", "letters, digits and . , : _ / = + * ' - \\", "NIST RS274/NGC, 3.3.4")
_PLAIN = rf"[ \t]*(?:(?!PROBE(?:OPEN|CLOSE)|LOGCLOSE|RPY)[A-Za-z0-9.:_/=+*-]+(?:[ \t][;{_SIGNS}]*)?)?"
PLAIN_WORDS = (
    "letters, digits and . , ; : _ / = + * ' - \\, no comma in the first word (a word and a comma are executed)"
)


def end_of_line(begins: str, source: str, signs: str = "") -> Comment:
    """A comment to the end of the line, in plain words."""
    what = f"letters, digits and . , ; : _ / = + * ' - \\ {' '.join(signs)}".strip()
    return Comment(begins, "", rf"[ \t]*[;{_SIGNS}{signs}]*", what, source)


def not_executed(source: str) -> tuple[Comment, ...]:
    """Comments of a control that executes some: plain words that are none of these."""
    return tuple(Comment(begins, ends, f"(?i:{_PLAIN})", PLAIN_WORDS, source) for begins, ends in ("()", (";", "")))


def modal(source: str, **groups: str) -> tuple[Code, ...]:
    """Codes that only state what holds, by group: ``units="G21"``."""
    does = {
        "units": "mm",
        "distances": "absolute coordinates",
        "feed": "feed in mm/min",
        "plane": "plane XY",
        "tool_radius": "no compensation of the tool radius",
        "tool_length": "no tool length",
        "path": "exact stop at the corners",
        "cycle": "no canned cycle",
        "coordinates": "work offset",
    }
    return tuple(
        Code(code, does[group], source, group.replace("_", " "))
        for group, codes in groups.items()
        for code in codes.split()
    )


def moves_with_result(blocks: list[Block], prints: Callable[[Block], bool]) -> set[int]:
    """Which blocks are moves whose result is printed before the next move: those measure, the others travel."""
    found, printed = set(), False
    for place in reversed(range(len(blocks))):
        block = blocks[place]
        if prints(block):
            printed = True
        elif block.form is WORDS and set(AXES) & set(block.words):
            found |= {place} if printed else set()
            printed = False
    return found


class GCode(VirtualController):
    """Modal state of the G-code between blocks.

    ``searches``: codes of moves that the probe ends; ``one_shot``: those that hold for their own block only.
    """

    searches: ClassVar[frozenset[str]] = frozenset()
    one_shot: ClassVar[frozenset[str]] = frozenset()

    def __init__(self, reader: Reader) -> None:
        super().__init__(reader)
        self.motion = ""
        self.feed_mm_s: float | None = None
        self.position: dict[str, float] = {}

    def words(self, block: Block) -> None:
        """Codes, feed, coordinates; then stops and the end."""
        own = ""
        for code in block.codes:
            if code.code in self.one_shot:
                own = code.code
                self.motion = self.after_one_shot(own)
            elif code.group == MOTION:
                self.motion = code.code
            elif code.group and not code.code.startswith("M"):
                if code.when != END:
                    self.reader.once(code.group, code.code)
                self.reader.states[code.group] = code.code
        if "F" in block.words:
            self.set_feed(block.words["F"] / 60.0)
        self.move(block, own or self.motion)
        for code in block.codes:
            if code.code == "M0":
                self.stop(block)

    def after_one_shot(self, code: str) -> str:
        """The motion that holds after a search of one block: the one before."""
        return self.motion

    def move(self, block: Block, motion: str) -> None:
        """The move of a block, if it has coordinates."""
        target = {axis: block.words[axis] for axis in AXES if axis in block.words}
        if target:
            self.go(target, motion)
        elif any(code.code in self.searches for code in block.codes):
            self.reader.fail("a search without coordinates", found=repr(block.text), expected="X, Y or Z")

    def set_feed(self, speed_mm_s: float) -> None:
        """The feed that holds from here on."""
        if speed_mm_s <= 0:
            self.reader.fail("the feed must be positive", found=f"F{speed_mm_s * 60:g}")
        self.feed_mm_s = speed_mm_s

    def go(self, target: dict[str, float], motion: str) -> None:
        """A straight move to coordinates, of which those not stated stay."""
        if "units" not in self.reader.states:
            self.reader.fail("a move before the units are set", expected="G21 first")
        if not motion:
            self.reader.fail("coordinates without a motion", expected="G0, G1 or a search")
        self.position.update(target)
        if len(self.position) < len(AXES):
            missing = ", ".join(axis for axis in AXES if axis not in self.position)
            self.reader.fail("the position is not complete", found=f"no {missing} yet", expected="X, Y and Z")
        end = [self.position[axis] for axis in AXES]
        measuring = motion in self.searches and self.measures(motion)
        if self.feed_mm_s is not None and motion != RAPID:
            which = "measuring_speed_mm_s" if measuring else "travel_speed_mm_s"
            self.reader.set(**{which: self.feed_mm_s})  # a feed holds until there is another, searches or not
        if motion in self.searches:
            self.search(end, motion, measuring)
        else:
            self.reader.goto(end, as_fast_as_it_can=motion == RAPID)

    def measures(self, code: str) -> bool:
        """Whether a search with this code, at the block at hand, is a measurement."""
        return True


STOP = Code("M0", "stop until the operator goes on", "NIST RS274/NGC, 3.6.1", "M", way=QUIET)
