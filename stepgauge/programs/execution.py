"""A text as its controller runs it, block by block, and every way through it.

Coordinates and feeds are numbers in the text (:mod:`stepgauge.programs.grammar` takes no others), so that only a branch
can make another path of it. Of a branch both ways are read: either they come together again with nothing between them
but the program's own variables, or one of them ends the program without a move. And
after every search the text is run on with the other answer of the probe: before the next move it must have stopped
(:meth:`VirtualController.check_otherwise`). What no way comes to may not be a move at all.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import ClassVar

from stepgauge.programs.blocks import Block, read_blocks
from stepgauge.programs.expression import Grammar, Value, check_words, evaluate
from stepgauge.programs.grammar import CLOSING, END, ENDS, FIRST, FRAME, IF, JUMP, LAST, QUIET, START, DialectGrammar
from stepgauge.programs.reading import Contact, ControllerAlarmError, MovedOnError, Reader

CLEAR_MM = 1.0
"""A contact on a shorter way is within the overtravel of any probe."""


class VirtualController:
    """A virtual controller between blocks. A dialect adds a method for every statement of its table."""

    table: ClassVar[DialectGrammar]
    grammar: ClassVar[Grammar] = Grammar("(?!)")

    def __init__(self, reader: Reader) -> None:
        self.reader = reader
        self.blocks: list[Block] = []
        self.targets: dict[int, int] = {}
        self.at = 0
        self.variables: dict[str, Value] = {}
        self.contact = Contact((0.0, 0.0, 0.0), False)
        self.otherwise: Contact | None = None
        self.ended = self.alarmed = False
        self.message = ""

    def run(self, text: str) -> None:
        """Execute a program text; :class:`stepgauge.errors.InputError` names the line."""
        self.blocks = read_blocks(text, self.table, self.reader)
        self._check_frame(next((n for n, line in enumerate(text.split("\n"), 1) if line.strip()), 0))
        self._check_expressions()
        self.targets = self.find_targets()
        self._check_branches()
        self.prepare()
        reached = set()
        while self.at < len(self.blocks) and not self.ended:
            reached.add(self.at)
            self.step()
            if self.otherwise is not None:
                self._check_otherwise(self.otherwise)
        self._check_end(reached)

    def prepare(self) -> None:
        """What is known from the whole text before its first block is executed."""

    def step(self) -> None:
        """The next block."""
        block = self.blocks[self.at]
        self.reader.line = block.line
        if block.when == START and self.reader.moved:
            self.reader.fail("this belongs before the first move", found=repr(block.text))
        if block.way in (IF, JUMP):
            self._branch(block)
            return
        self.at += 1
        action: Callable[[Block], None] = getattr(self, block.form.name)
        action(block)
        self.reader.closed = self.reader.closed or block.when == END
        if block.way == ENDS:
            self.stop(block)
            self.ended = True

    def nothing(self, block: Block) -> None:
        """A block that only its place in the text speaks for."""

    def stop(self, block: Block) -> None:
        """A stop on a way that a check has led to is an alarm."""
        if self.alarmed:
            self.reader.alarm(self.message or f"the program stops itself at {block.text}")

    def _branch(self, block: Block) -> None:
        here, target = self.at, self.targets[self.at]
        jumps = block.way == JUMP or self.holds(block)
        self.at = target if jumps else here + 1
        if block.way == IF and self._stops(self.at):
            self.alarmed = jumps or not self._stops(target)

    def holds(self, block: Block) -> bool:
        """Whether a condition is true."""
        return bool(self.number(block.fields[0]))

    def stops_with(self, block: Block, state: str, other: float) -> bool:
        """Whether the branch at hand ends the program without a move if an attribute had another value."""
        held, value = bool(self.number(block.fields[0])), getattr(self, state)
        setattr(self, state, other)
        changed = bool(self.number(block.fields[0])) != held
        setattr(self, state, value)
        return changed and self._stops(self.at + 1 if held else self.targets[self.at])

    def value(self, text: str) -> Value:
        """An expression of the text."""
        try:
            return evaluate(text, self.grammar, self.look_up)
        except ValueError as error:
            self.reader.fail("expression not understood", found=f"{error} in {text!r}")

    def number(self, text: str) -> float:
        """An expression whose value is a number."""
        return self.reader.require_number(self.value(text))

    def look_up(self, name: str) -> Value:
        """The value of a variable; :class:`InputError` for one that nothing was written to."""
        if name not in self.variables:
            self.reader.fail("variable without a value", found=name)
        return self.variables[name]

    def search(self, end: list[float], what: str, measuring: bool) -> None:
        """A straight move that the probe ends; what it would be if the probe answered otherwise."""
        here = self.reader.builder.last_position
        contact = self.reader.search(end, what) if measuring else self.reader.travel(end)
        middle = [(a + b) / 2.0 for a, b in zip(end, here or end, strict=True)]
        if measuring:
            self.otherwise = Contact(end, False)
        elif here is not None and max(abs(a - b) for a, b in zip(end, here, strict=True)) >= CLEAR_MM:
            self.otherwise = Contact(middle, True)
        self.settle(contact, measuring)

    def settle(self, contact: Contact, measuring: bool) -> None:
        """What the controller knows and does after a search."""
        self.contact = contact

    def find_targets(self) -> dict[int, int]:
        """Where each branch goes to: the block with the label that it names."""
        labels: dict[str, int] = {}
        for place, block in enumerate(self.blocks):
            if block.label in labels:
                self._fail_at(place, "the label stands twice", block.label)
            labels.update({block.label: place} if block.label else {})
        targets = {}
        for place, block in enumerate(self.blocks):
            if block.way in (IF, JUMP):
                label = block.fields[-1].upper()
                if label not in labels:
                    self.reader.line = self.blocks[-1].line
                    what = "the program is cut short: a jump to what is not there"
                    self.reader.fail(what, found=f"{label} of line {block.line}")
                if labels[label] <= place:
                    self._fail_at(place, "a jump backwards", block.text, "a label further down")
                targets[place] = labels[label]
        return targets

    def _check_branches(self) -> None:
        for place, target in self.targets.items():
            block = self.blocks[place]
            between = self.blocks[place + 1 : target]
            together = all(one.way == QUIET for one in between)
            if block.way == IF and not (together or self._stops(target) or self._stops(place + 1)):
                what = "a branch of which each way goes on in its own way"
                expected = "one that ends the program without a move, or only own variables between"
                self._fail_at(place, what, block.text, expected)

    def _stops(self, place: int) -> bool:
        """Whether the program ends from here without a move."""
        while place < len(self.blocks):
            block = self.blocks[place]
            if block.way == ENDS:
                return True
            if block.way not in (QUIET, CLOSING, JUMP):
                return False
            place = self.targets[place] if block.way == JUMP else place + 1
        return False

    def _check_otherwise(self, contact: Contact) -> None:
        """The text with the other answer of the probe stops before the next move."""
        self.otherwise = None
        if not self.reader.proves:
            return
        kept = {name: dict(value) if isinstance(value, dict) else value for name, value in vars(self).items()}
        reader = {name: getattr(self.reader, name) for name in ("line", "settings", "closed")}
        states, printed = dict(self.reader.states), len(self.reader.log)
        self.reader.dry = True
        try:
            self.settle(contact, not contact.hit)
            while self.at < len(self.blocks) and not self.ended:
                self.step()
        except ControllerAlarmError:
            pass
        except MovedOnError:
            self.reader.line = reader["line"]
            what = "a contact on this way" if contact.hit else "a search without a contact"
            self.reader.fail(f"{what} does not stop the program before its next move", expected="a check that does")
        vars(self).update(kept)
        vars(self.reader).update(reader, states=states, dry=False)
        del self.reader.log[printed:]

    def _check_frame(self, first_line: int) -> None:
        """What must be first and last is, and what follows a certain statement follows it."""
        blocks, last = self.blocks, len(self.blocks) - 1
        follows = {one.after: one for one in self.table.forms if one.after}
        head = next((n for n, one in enumerate(blocks) if one.when not in (FIRST, FRAME)), last + 1)
        tail = next((n for n in range(last, -1, -1) if blocks[n].when not in (LAST, FRAME)), -1)
        named: set[str] = set()
        for place, block in enumerate(blocks):
            if block.when == FIRST and block.form.text in named:
                self._fail_at(place, "a second program begins", block.text)
            named |= {block.form.text} if block.when == FIRST else set()
            within = 0 < place < last or (place == 0 and block.line > first_line)
            if (block.when == FIRST and place > head) or (block.when == FRAME and within):
                self._fail_at(place, "this belongs at the beginning of the program", block.text)
            if block.when == LAST and place < tail:
                self._fail_at(place + 1, "statement after the end of the program", blocks[place + 1].text)
            wanted, behind = follows.get(block.form.name), blocks[place + 1 : place + 2]
            if wanted and (not behind or behind[0].form.name != wanted.name):
                self._fail_at(place, "not followed by what belongs to it", block.text, wanted.text)
            if block.form.after and (place == 0 or blocks[place - 1].form.name != block.form.after):
                before = next(one.text for one in self.table.forms if one.name == block.form.after)
                self._fail_at(place, "this stands alone", block.text, f"{before} in the line before")
        begun = self.table.last != "tape" or bool(blocks and blocks[0].form.name == "tape")
        if self.table.last and begun and (not blocks or blocks[-1].form.name != self.table.last):
            self.reader.line = blocks[-1].line if blocks else 1
            self.reader.cut_short(next(one.text for one in self.table.forms if one.name == self.table.last))

    def _check_expressions(self) -> None:
        """Every word of every expression is one of the table, on the ways that are not taken, too."""
        for place, block in enumerate(self.blocks):
            slots = re.findall(r"\{(\w+)\}", block.form.text)
            for slot, text in zip(slots, block.fields, strict=False):
                if slot in ("expression", "condition"):
                    try:
                        check_words(text, self.grammar)
                    except ValueError as error:
                        self._fail_at(place, "expression not understood", f"{error} in {text!r}")

    def _check_end(self, reached: set[int]) -> None:
        if not self.ended:
            self.reader.cut_short("the statement that ends the program")
        for place, block in enumerate(self.blocks):
            if place not in reached and block.way not in (QUIET, CLOSING, ENDS):
                self._fail_at(place, "statement after the end of the program, or that no way comes to", block.text)

    def _fail_at(self, place: int, what: str, found: str, expected: str | None = None) -> None:
        self.reader.line = self.blocks[place].line
        self.reader.fail(what, found=repr(found), expected=expected)
