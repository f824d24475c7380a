"""What a reader decided, what it rejected and why, and what it cannot know: guesses are hypotheses.

Every stage of the reader puts what it took here, and the rivals that it rejected. A rival that nothing excludes, and
that would give other numbers, is a question. All questions of a file are asked in one message, each with the options
that settle it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from stepgauge.errors import LONGEST, InputError, Naming, Place


@dataclass(frozen=True)
class Question:
    """``where``: file, with a row where there is one; ``what``: is open; ``found``; ``settled``: by which options."""

    where: str
    what: str | Naming
    found: str | None
    settled: Naming

    def error(self) -> InputError:
        """The question as the one thing that is wrong."""
        return InputError(self.where, self.what, found=self.found, expected=self.settled)


class OpenQuestionsError(InputError):
    """A table that leaves more than one thing open; the message lists all of them."""

    longest: ClassVar[int] = 4 * LONGEST


@dataclass
class Decisions:
    """What was decided about one table, stage by stage."""

    taken: list[str] = field(default_factory=list)
    rejected: list[str] = field(default_factory=list)
    questions: list[Question] = field(default_factory=list)

    def take(self, words: str) -> None:
        """Words on what was taken for what."""
        self.taken.append(words)

    def reject(self, rival: str, why: str) -> None:
        """A rival of what was taken, and the reason against it."""
        self.rejected.append(f"not taken: {rival} ({why})")

    def ask(self, where: Place, what: str | Naming, settled: Naming, found: str | None = None) -> None:
        """A question that stays open; the reader goes on, to find those that follow."""
        question = Question(str(where), what, found, settled)
        if all(one.what != what for one in self.questions):
            self.questions.append(question)

    def settle(self) -> None:
        """:class:`InputError` with all questions that are open."""
        if len(self.questions) == 1:
            raise self.questions[0].error()
        if self.questions:
            path = self.questions[0].where
            raise OpenQuestionsError(
                path, f"{len(self.questions)} questions are open", expected=_listed(self.questions)
            )


def _listed(questions: list[Question]) -> Naming:
    """All questions as one text that names options."""
    names, words = list[str](), list[str]()
    for number, one in enumerate(questions, 1):
        found = "" if one.found is None else f" ({one.found})"
        what = one.what if isinstance(one.what, Naming) else Naming((), str(one.what))
        names += [*what.names, *one.settled.names]
        words.append(f"{number}) {what.words}{found.replace('{}', '..')}: {one.settled.words}")
    return Naming(tuple(names), "; ".join(words))
