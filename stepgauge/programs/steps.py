"""Statements that are executed one after the other, with jumps to labels."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from stepgauge.programs.reading import Reader

MOST_STEPS = 2_000_000
"""No program of ours has loops; one that takes more steps than this goes round in one."""


class Steps:
    """The place in a text: ``at`` is the statement (and, counted from 1, the line) that comes next."""

    def __init__(self, reader: Reader, statements: Sequence[str], labels: Mapping[str, int]) -> None:
        self.reader, self.statements, self.labels = reader, statements, labels
        self.at = 0

    def check(self, targets: Mapping[str, int]) -> None:
        """:class:`stepgauge.errors.InputError` for a jump (label and line) to what is not there."""
        for label, line in targets.items():
            if label not in self.labels:
                self.reader.line = max(line, len(self.statements))
                self.reader.fail(
                    "the program is cut short: a jump to what is not there", found=f"{label} of line {line}"
                )

    def go_to(self, label: str) -> None:
        """The statement with this label is the next."""
        self.at = self.labels[label]

    def run(self, statement: Callable[[str], object], ended: Callable[[], bool]) -> None:
        """Take the statements in turn until one ends the program, or the text does."""
        for _ in range(MOST_STEPS):
            if self.at >= len(self.statements) or ended():
                return
            self.at += 1
            self.reader.line = self.at
            statement(self.statements[self.at - 1])
        self.reader.fail("the program does not come to an end")
