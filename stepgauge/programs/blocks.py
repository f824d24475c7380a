"""One reader for all dialects: a text becomes blocks of the table, or it is refused with its line and word."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import NoReturn

from stepgauge.programs.grammar import NOMINAL, QUIET, Code, DialectGrammar, Production
from stepgauge.programs.reading import Reader, check_lines

WORDS = Production("words", "", "a block of words", "")
LABEL = Production("nothing", "", "a label", "", QUIET)
MOST_NAMED = 8
"""Alternatives that a message names; where there are more it names the verb that prints the table."""


@dataclass(frozen=True)
class Block:
    """A statement of a text: its form, what stood in the slots, or the codes and words of a block of words."""

    line: int
    text: str
    form: Production
    fields: tuple[str, ...] = ()
    codes: tuple[Code, ...] = ()
    words: Mapping[str, float] = field(default_factory=dict)
    label: str = ""
    comment: str = ""
    indent: int = 0

    @property
    def way(self) -> str:
        """What the statement does to the way of the tip."""
        if self.form is not WORDS:
            return self.form.way
        ways = {code.way for code in self.codes}
        return ways.pop() if len(ways) == 1 and not self.words else NOMINAL

    @property
    def when(self) -> str:
        """Where the statement may stand."""
        return next((code.when for code in self.codes if code.when), self.form.when)


_READ: dict[DialectGrammar, tuple[str, list[Block]]] = {}
"""The last text of every table: a program that was made is read back, and read again for its log."""


def read_blocks(text: str, table: DialectGrammar, reader: Reader) -> list[Block]:
    """The blocks of a text; :class:`stepgauge.errors.InputError` names line, word, and what is in the table instead."""
    text_before, before = _READ.get(table, ("", []))
    if text_before and text_before == text:
        return before
    blocks: list[Block] = []
    check_lines(text, reader.path, table.longest)
    check_signs(text, reader)
    comment = table.comments[0].begins if table.comments else "\n"
    for line, raw in joined_lines(text, table.continued, comment, reader):
        reader.line = line
        blocks += _Line(raw, table, reader).blocks()
    _READ[table] = text, blocks
    return blocks


def check_signs(text: str, reader: Reader) -> None:
    """:class:`stepgauge.errors.InputError` for a sign that no controller reads."""
    for reader.line, line in enumerate(text.split("\n"), 1):
        odd = next((sign for sign in line.removesuffix("\r") if not " " <= sign <= "~" and sign != "\t"), None)
        if odd is not None:
            reader.fail("a sign that no controller reads", found=repr(odd), expected="printable ASCII")


def joined_lines(text: str, continued: str, comment: str, reader: Reader) -> Iterator[tuple[int, str]]:
    """Lines with those that continue them, and the number of the first of each."""
    joined, first = "", 0
    for number, line in enumerate(text.split("\n"), 1):
        first = first if joined else number
        bare = line.split(comment)[0].rstrip() if continued else ""
        if bare.endswith(continued or "\n"):
            joined += bare.removesuffix(continued)
            continue
        yield first, joined + line.removesuffix("\r")
        joined = ""
    if joined:
        reader.line = first
        reader.fail("the text is cut short inside a continued line", found=repr(joined))


class _Line:
    """One line, cut into its statement and its comments."""

    def __init__(self, raw: str, table: DialectGrammar, reader: Reader) -> None:
        self.raw, self.table, self.reader = raw, table, reader
        self.comments: list[str] = []
        self.active: list[str] = []
        code = "".join(self._kept(piece) for piece in table.scan.finditer(raw))
        self.indent = len(code) - len(code.lstrip())
        self.code = code.strip()

    def _kept(self, piece: re.Match[str]) -> str:
        """What belongs to the statement; comments are looked at and put aside."""
        kind = str(piece.lastgroup)
        if not kind.startswith("comment"):
            return "".join(piece[0].split()) if kind == "code" and self.table.blanks_ignored else piece[0]
        if any(one.text.startswith("(") and pattern.fullmatch(piece[0]) for one, pattern in self.table.patterns):
            self.active.append(piece[0])
            return ""
        known = self.table.comments[int(kind.removeprefix("comment"))]
        text = piece[0].removeprefix(known.begins).removesuffix(known.ends)
        if not re.fullmatch(known.pattern, text, re.ASCII):
            self._refuse(piece[0], f"a comment of {known.what}")
        self.comments.append(text.strip())
        return ""

    def blocks(self) -> list[Block]:
        """The block of the statement, and one for every comment that the controller executes."""
        label = re.match(self.table.label, self.code, self.table.flags) if self.table.label and self.code else None
        code = self.code[label.end() :].lstrip() if label else self.code
        found = [self._block(code)] if code else []
        if label:
            name = next(one for one in label.groups() if one is not None).upper()
            found = [replace(found[0], label=name)] if found else [Block(self.reader.line, "", LABEL, label=name)]
        return [replace(one, comment=" ".join(self.comments), indent=self.indent) for one in found] + [
            self._block(one) for one in self.active
        ]

    def _block(self, code: str) -> Block:
        for form, pattern in self.table.patterns:
            match = pattern.fullmatch(code)
            if match:
                return Block(self.reader.line, code, form, match.groups())
        first = self.table.word.match(code) if self.table.codes else None
        if first and (first[1].upper() in self.table.words or _key(first) in self.table.codes_by_name):
            return self._words(code)
        return self._unknown(code)

    def _words(self, code: str) -> Block:
        """A block of codes and words, each known and each once."""
        codes: list[Code] = []
        words: dict[str, float] = {}
        at = 0
        while at < len(code):
            match = self.table.word.match(code, at)
            if match is None:
                self._refuse(code[at:].strip(), "words of a letter and a number")
            letter, number = match[1].upper(), match[2]
            if letter in self.table.words:
                words[letter] = self._word(match[0].strip(), letter, number, words)
            else:
                codes.append(self._code(match, codes))
            at = match.end()
        own = {letter for one in codes for letter in one.words.split()}
        special = {letter for one in self.table.codes for letter in one.words.split()}
        foreign = next((letter for letter in words if letter in special - own), None)
        if foreign:
            with_it = ", ".join(one.code for one in self.table.codes if foreign in one.words.split())
            self._refuse(f"{foreign}{words[foreign]:g}", f"{foreign} with {with_it} only")
        return Block(self.reader.line, code, WORDS, codes=tuple(codes), words=words)

    def _word(self, word: str, letter: str, number: str, words: Mapping[str, float]) -> float:
        slot = self.table.slot(self.table.words[letter])
        if letter in words:
            self._refuse(word, f"{letter} once in a block", "the same word twice in a line")
        if not re.fullmatch(slot.pattern, number):
            self._refuse(word, f"{letter} with {slot.what}")
        return float(number)

    def _code(self, match: re.Match[str], codes: list[Code]) -> Code:
        known, word = self.table.codes_by_name.get(_key(match)), match[0].strip()
        if known is None:
            self._refuse(word, self._codes_like(match[1].upper()))
        same = next((one for one in codes if one.group == known.group), None)
        if same:
            self._refuse(word, f"one of {same.code} and {known.code} in a block")
        return known

    def _unknown(self, code: str) -> NoReturn:
        """Fail at the place up to which the nearest statements go along, with what may stand there."""
        far, near = 0, [_verb(self.table)]
        for form in self.table.forms:
            pieces, at, count = self.table.pieces(form), 0, 0
            for count in range(len(pieces), 0, -1):
                match = re.match("".join(pattern for pattern, _ in pieces[:count]), code, self.table.flags)
                if match and match.end():
                    at = match.end()
                    break
            wanted = pieces[count][1] if at and count < len(pieces) else "nothing more"
            near = near if at < far or not at else [wanted] if at > far else list(dict.fromkeys([*near, wanted]))
            far = max(at, far)
        expected = " or ".join(near) if len(near) <= MOST_NAMED else _verb(self.table)
        first = self.table.word.match(code) if self.table.codes else None
        if not far and first:
            self._refuse(first[0], self._codes_like(first[1].upper()))
        found = code[far:].strip()
        self._refuse(found or code, f"{expected} (in {code[:60]!r})" if far > 0 and found else expected)

    def _codes_like(self, letter: str) -> str:
        """The codes with this letter, or the verb that prints all."""
        near = [one.code for one in self.table.codes if one.code.startswith(letter)]
        return ", ".join(near) if near else _verb(self.table)

    def _refuse(self, found: str, expected: str, what: str = "") -> NoReturn:
        what = what or f"not in the table of {self.table.name}"
        self.reader.fail(what, found=repr(found[:60]), expected=expected)


def _key(word: re.Match[str]) -> str:
    """A word as the table names codes: ``G01`` is ``G1``."""
    return f"{word[1].upper()}{float(word[2]):g}"


def _verb(table: DialectGrammar) -> str:
    return f"a statement that 'stepgauge list dialects {table.name}' lists"
