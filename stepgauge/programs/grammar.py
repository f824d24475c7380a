"""What the virtual controller of a dialect understands: one table of its codes, words, statements and comments.

The table is data. :mod:`stepgauge.programs.blocks` reads a text against it, and what is not in it is no statement of
the dialect, wherever it stands; ``stepgauge list dialects NAME`` prints it.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

NOMINAL, QUIET, CLOSING, ENDS, IF, JUMP = "nominal", "quiet", "closing", "ends", "if", "jump"
"""What a statement does to the way of the tip: ``NOMINAL`` stands only on the way that the plan is compared with;
``QUIET`` changes nothing outside of the program's own variables; ``CLOSING`` may stand on a way that ends;
``ENDS`` ends the program; ``IF`` and ``JUMP`` go on elsewhere."""
START, END, FIRST, LAST, FRAME = "start", "end", "first", "last", "frame"
"""Where a statement may stand: before the first move, after the last one, as the very first, as the very last, both."""
NOT_CONFIRMED = "not confirmed"


@dataclass(frozen=True)
class Slot:
    """What may stand in a place of a statement: a pattern without groups, and what that is in words."""

    pattern: str
    what: str


SLOTS: Mapping[str, Slot] = {
    "number": Slot(r"[-+]?(?:\d{1,6}(?:\.\d{0,10})?|\.\d{1,10})", "a decimal number"),
    "positive": Slot(r"(?:\d{1,6}(?:\.\d{0,10})?|\.\d{1,10})", "a decimal number without a sign"),
    "point": Slot(
        r"[-+]?(?:\d{1,6}\.\d{0,10}|\.\d{1,10})",
        "a number with a decimal point (the control scales one without)",
    ),
    "count": Slot(r"\d{1,5}", "a whole number"),
    "label": Slot(r"\d{1,5}", "the number of a block further down"),
    "expression": Slot(r".+", "an expression of the variables below"),
    "condition": Slot(r".+", "a condition of the variables below"),
}


@dataclass(frozen=True)
class Production:
    """A statement: ``text`` with ``{slots}``, what it does, where that is confirmed.

    ``name`` is the method of the virtual controller; ``way`` and ``when`` as above; ``after``: the name of the
    statement that it directly follows, and that is followed by nothing else.
    """

    name: str
    text: str
    does: str
    source: str
    way: str = NOMINAL
    when: str = ""
    after: str = ""


@dataclass(frozen=True)
class Code:
    """A code in a block of words, as ``G1``: ``group``: its state, one in a block; ``words``: come with it."""

    code: str
    does: str
    source: str
    group: str = ""
    words: str = ""
    way: str = NOMINAL
    when: str = ""


@dataclass(frozen=True)
class Variable:
    """What an expression may read."""

    pattern: str
    name: str
    does: str
    source: str


@dataclass(frozen=True)
class Comment:
    """A comment from ``begins`` to ``ends`` (empty: the end of the line) and the only texts that may be in it."""

    begins: str
    ends: str
    pattern: str
    what: str
    source: str


@dataclass(frozen=True, eq=False)
class DialectGrammar:
    """The closed grammar of a dialect.

    ``words``: letters of a block of words and the slot of each number; ``label``: pattern of what may stand before a
    statement; ``blanks_ignored``: blanks mean nothing outside of texts and comments; ``quote``: what a text stands in;
    ``last``: the name of the statement that must be the last one; ``continued``: what continues a line.
    """

    name: str
    forms: tuple[Production, ...]
    comments: tuple[Comment, ...] = ()
    codes: tuple[Code, ...] = ()
    words: Mapping[str, str] = field(default_factory=dict)
    slots: Mapping[str, Slot] = field(default_factory=dict)
    variables: tuple[Variable, ...] = ()
    label: str = ""
    blanks_ignored: bool = False
    any_case: bool = True
    quote: str = '"'
    last: str = ""
    continued: str = ""
    longest: int = 4000

    @cached_property
    def flags(self) -> re.RegexFlag:
        """How patterns are compiled."""
        return re.ASCII | re.IGNORECASE if self.any_case else re.ASCII

    def slot(self, name: str) -> Slot:
        """The table's own slot, or the one that all tables share."""
        return self.slots.get(name) or SLOTS[name]

    @cached_property
    def patterns(self) -> list[tuple[Production, re.Pattern[str]]]:
        """Every statement as a pattern."""
        return [(one, re.compile("".join(piece for piece, _ in self.pieces(one)), self.flags)) for one in self.forms]

    def pieces(self, form: Production) -> list[tuple[str, str]]:
        """The patterns of a statement piece by piece, fixed words and a group for every slot, and each in words.

        A blank between two words is one or more, beside a sign none or more.
        """
        text = form.text if form.text.startswith("(") or not self.blanks_ignored else form.text.replace(" ", "")
        found = []
        for one in re.finditer(r"\{(\w+)\}|(\w+)|(\s+)|[^\w\s]", text):
            slot, word, blank = one.groups()
            if slot:
                found.append((f"({self.slot(slot).pattern})", self.slot(slot).what))
            elif blank:
                words = re.match(r"[\w{}]", text[one.start() - 1]) and re.match(r"[\w{]", text[one.end()])
                found.append((r"[ \t]+" if words else r"[ \t]*", "a blank"))
            else:
                found.append((re.escape(word or one[0]), word or one[0]))
        return found

    @cached_property
    def codes_by_name(self) -> dict[str, Code]:
        """The codes by name."""
        return {one.code: one for one in self.codes}

    @cached_property
    def word(self) -> re.Pattern[str]:
        """A word of a block: letters and number."""
        letters = {*self.words, *(re.sub(r"[\d.]+", "", one.code) for one in self.codes)}
        names = "|".join(sorted((one for one in letters if len(one) > 1), key=len, reverse=True))
        return re.compile(rf"[ \t]*({names + '|' if names else ''}[A-Z])=?([-+]?(?:\d+\.?\d*|\.\d+))", self.flags)

    @cached_property
    def scan(self) -> re.Pattern[str]:
        """A piece of a line: a text in quotes, a comment, or anything else."""
        kinds = [rf"(?P<text>{self.quote}[^{self.quote}]*{self.quote})"]
        for place, one in enumerate(self.comments):
            inside = rf"[^{re.escape(one.begins + one.ends)}]*{re.escape(one.ends)}" if one.ends else ".*"
            kinds.append(rf"(?P<comment{place}>{re.escape(one.begins)}{inside})")
        first = re.escape("".join([self.quote[:1], *(one.begins[:1] for one in self.comments)]))
        return re.compile("|".join([*kinds, rf"(?P<code>[^{first}]+|.)"]))
