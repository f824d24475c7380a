"""What a reader decided, what it rejected and why, and what it cannot know: guesses are hypotheses.

Every stage of the reader puts what it took here, and the rivals that it rejected. A rival that nothing excludes, and
that would give other numbers, is a question. All questions of a file are asked in one message, each with the choices
that settle it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

from stepgauge.errors import LONGEST, InputError, Naming, Place, option_of

MOST_SHOWN = 4
"""Choices that a message lists; a question has all of them."""


@dataclass(frozen=True)
class QuestionAnswer:
    """A way to settle a question: ``argument`` of :func:`stepgauge.import_recording` with ``value``.

    ``value``: as it is typed, such as ``mm`` or ``target=HEADER``; empty where a person must state it, with
    ``suggestions`` of what it may be. ``words``: what it means.
    """

    argument: str
    value: str = ""
    words: str = ""
    suggestions: tuple[str, ...] = ()

    @property
    def option(self) -> str:
        """The option of the command line."""
        return option_of(self.argument)

    @property
    def typed(self) -> str:
        """The value as it is typed behind the option, in quotation marks where it has blanks."""
        name, equals, rest = self.value.partition("=")
        if equals and name.isidentifier():
            return f'{name}="{rest}"'
        return f'"{self.value}"' if self.argument == "rows" or " " in self.value else self.value

    def __str__(self) -> str:
        more = f" ({', '.join(self.suggestions[1:])}, ..)" if len(self.suggestions) > 1 else ""
        value = self.typed or f"{self.suggestions[0] if self.suggestions else ''}{more}"
        return " ".join(part for part in ("{}", value, self.words) if part)


def column_answer(role: str, header: str, words: str = "") -> QuestionAnswer:
    """The choice that a column is of a role."""
    return QuestionAnswer("columns", f"{role}={header}", words)


def shown(texts: Sequence[str], between: str = ", ") -> str:
    """The first of several texts, and how many there are more."""
    more = len(texts) - MOST_SHOWN
    return between.join(texts[:MOST_SHOWN]) + (f" and {more} more" if more > 0 else "")


def named(choices: Iterable[QuestionAnswer]) -> Naming:
    """Choices as a part of a message."""
    shown = tuple(choices)[:MOST_SHOWN]
    return Naming(tuple(one.argument for one in shown), " or ".join(map(str, shown)))


@dataclass(frozen=True)
class Question:
    """``where``: file, with a row where there is one; ``what``: is open; ``found``; ``choices``: any one settles it.

    ``expected``: of a difference from what was planned.
    """

    where: str
    what: str | Naming
    found: str | None
    choices: tuple[QuestionAnswer, ...]
    expected: str | Naming | None = None

    @property
    def text(self) -> str:
        """The question in a line."""
        expected = "" if self.expected is None else f"; expected {self.expected}"
        return f"{self.what}{'' if self.found is None else f': {self.found}'}{expected}"


class OpenQuestionsError(InputError):
    """A table that leaves something open; the message lists all of it. ``questions``: one by one."""

    longest: ClassVar[int] = 4 * LONGEST
    questions: tuple[Question, ...] = ()

    @classmethod
    def of(cls, questions: Iterable[Question]) -> OpenQuestionsError:
        """One question as the one thing that is wrong, several as a list."""
        every = tuple(questions)
        one = every[0]
        if len(every) == 1:
            error = cls(one.where, one.what, found=one.found, expected=named(one.choices))
        else:
            error = cls(one.where, f"{len(every)} questions are open", expected=_listed(every))
        error.questions = every
        return error


@dataclass(frozen=True)
class TakenColumn:
    """A column of a table and what it was taken for.

    ``place``: counted from 1; ``taken``: the name of a quantity (``target``, ``x_mm``, ..), ``covariate`` or
    ``dropped``; ``unit``: as the file states it; ``cells``: the first ones as text.
    """

    place: int
    header: str
    taken: str
    unit: str | None
    cells: tuple[str, ...]


@dataclass
class Decisions:
    """What was decided about one table, stage by stage."""

    columns: list[TakenColumn] = field(default_factory=list)
    taken: list[str] = field(default_factory=list)
    rejected: list[str] = field(default_factory=list)
    questions: list[Question] = field(default_factory=list)

    def take(self, words: str) -> None:
        """Words on what was taken for what."""
        self.taken.append(words)

    def reject(self, rival: str, why: str) -> None:
        """A rival of what was taken, and the reason against it."""
        self.rejected.append(f"not taken: {rival} ({why})")

    def ask(self, where: Place, what: str | Naming, *choices: QuestionAnswer, found: str | None = None) -> None:
        """A question that stays open; the reader goes on, to find those that follow."""
        if all(one.what != what for one in self.questions):
            self.questions.append(Question(str(where), what, found, choices))

    def offers(self, role: str) -> bool:
        """Whether an open question has a column of a role among its choices."""
        return any(choice.value.startswith(f"{role}=") for one in self.questions for choice in one.choices)

    def settle(self) -> None:
        """:class:`OpenQuestionsError` with all questions that are open."""
        if self.questions:
            raise OpenQuestionsError.of(self.questions)


def _listed(questions: tuple[Question, ...]) -> Naming:
    """All questions as one text that names options."""
    names, words = list[str](), list[str]()
    for number, one in enumerate(questions, 1):
        found = "" if one.found is None else f" ({one.found})"
        what = one.what if isinstance(one.what, Naming) else Naming((), str(one.what))
        settled = named(one.choices)
        names += [*what.names, *settled.names]
        words.append(f"{number}) {what.words}{found.replace('{}', '..')}: {settled.words}")
    return Naming(tuple(names), "; ".join(words))
