"""What an import gives: the recording, what every column was taken for, what was rejected, and what stays open."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

from stepgauge.axis.recording import AxisRecording, write_axis_recording
from stepgauge.axis.sensors import SENSORS
from stepgauge.errors import LONGEST, InputError, Naming
from stepgauge.files.display import Summarized, join_lines
from stepgauge.importing.tables.questions import Decisions, OpenQuestionsError, Question, QuestionAnswer, TakenColumn
from stepgauge.recording import Recording, write_recording

if TYPE_CHECKING:
    import pandas as pd

_VALUES = {
    "constants": re.compile(r" (\w+=[^\s;,]+)"),
    "columns": re.compile(r' (\w+="(?!HEADER")[^"]+")'),
    **{name: re.compile(" ([a-z]+)") for name in ("accept", "unit")},
}
"""What stands behind an argument in a message, where it is a value."""
T = TypeVar("T")


@dataclass(frozen=True, repr=False)
class Imported(Summarized):
    """``recording``: None as long as something is open; ``report``: in a few lines what was taken, kept and dropped.

    ``columns``: of the table, with what each was taken for (empty for logs that are no tables); ``questions``: what is
    open, each with its choices; ``rejected``: what else the file might have said, and the reason against it;
    ``refusal``: the error by which the command line asks.
    """

    recording: Recording | AxisRecording | None
    report: tuple[str, ...] = ()
    columns: tuple[TakenColumn, ...] = ()
    questions: tuple[Question, ...] = ()
    rejected: tuple[str, ...] = ()
    refusal: InputError | None = field(default=None, repr=False)

    def settled(self) -> Recording | AxisRecording:
        """The recording; the :class:`InputError` that asks what is open where there is none."""
        if self.recording is None:
            assert self.refusal is not None
            raise self.refusal
        return self.recording

    def _stated(self) -> Any:
        return super()._stated() if self.recording is None else self.recording._stated()

    @property
    def extent(self) -> str:
        """How much was read, in words."""
        found = self.settled()
        if isinstance(found, AxisRecording):
            return f"{len(found)} readings"
        if len(found.placements) == 1:  # its number says nothing alone, and is the same in every file
            return f"{len(found)} probings"
        return f"{len(found)} probings, placements {', '.join(map(str, found.placements))}"

    def write(self, path: str | Path) -> None:
        """Write the recording as CSV; errors as :meth:`settled`."""
        found = self.settled()
        if isinstance(found, AxisRecording):
            write_axis_recording(path, found)
        else:
            write_recording(path, found)

    def summary(self) -> str:
        """What was taken for what, or the questions with their choices."""
        return join_lines(*self.report, *map(_asked, self.questions))

    def to_frame(self) -> pd.DataFrame:
        """A row per column of the table: its place, header, what it was taken for, its unit and its first cells."""
        import pandas as pd

        rows = [(one.place, one.header, one.taken, one.unit, ", ".join(one.cells[:3])) for one in self.columns]
        return pd.DataFrame(rows, columns=["column", "header", "taken for", "unit", "first cells"])


def _asked(one: Question) -> str:
    """A question in a line, with its choices where its words do not name them."""
    choices = ", or ".join(str(choice).replace("{}", choice.option, 1) for choice in one.choices)
    return f"open: {one.text}" if one.expected else f"open: {one.text}; {choices}"


def imported_or_asked(work: Callable[[Decisions], Imported]) -> Imported:
    """What ``work`` gives, or the questions with which it ended; :class:`InputError` for what no choice settles."""
    decisions = Decisions()
    refusal: InputError
    try:
        return work(decisions)
    except OpenQuestionsError as error:
        asked, refusal = error.questions, error
    except InputError as error:
        choices = choices_of(error)
        if not choices:
            raise
        found = None if error.found is None else str(error.found)
        _, what, _, expected = error.parts
        said = expected if isinstance(expected, Naming) else str(expected)
        asked, refusal = (Question(str(error.where), str(what), found, choices, said),), error
    columns, rejected = tuple(decisions.columns), tuple(decisions.rejected)
    return Imported(None, tuple(decisions.taken), columns, asked, rejected, refusal)


def choices_of(error: InputError) -> tuple[QuestionAnswer, ...]:
    """The choices that an error names in words: an argument, with the value that stands behind it."""
    found = list[QuestionAnswer]()
    for part in error.namings:
        for argument, behind in zip(part.names, part.words.split("{}")[1:], strict=False):
            match = _VALUES[argument].match(behind) if argument in _VALUES else None
            suggestions = tuple(SENSORS) if argument == "sensor" else ()
            value = match[1].replace('"', "") if match and not suggestions else ""
            found.append(QuestionAnswer(argument, value, suggestions=suggestions))
    return tuple(dict.fromkeys(found))


class AcceptTogetherError(InputError):
    """A log of which several things must be accepted, or that is refused all the same."""

    longest: ClassVar[int] = 2 * LONGEST


def ask_together(work: Callable[[Sequence[str]], Imported], accept: Sequence[str]) -> Imported:
    """What ``work`` gives with what is accepted; its error names all that has to be accepted.

    An option is tried before it is offered: what would be asked for next, or is wrong all the same, is named with it.
    """
    first, offered = None, list[str]()
    while True:
        try:
            found = work((*accept, *offered))
        except InputError as error:
            more = [one.value for one in choices_of(error) if one.argument == "accept" and one.value not in offered]
            if not more:
                raise (error if first is None else _join_errors(first, offered, error.what)) from None
            first = first or error
            offered += more
        else:
            if first is None:
                return found
            raise first if len(offered) == 1 else _join_errors(first, offered)


def _join_errors(error: InputError, accepted: Sequence[str], then: str = "") -> AcceptTogetherError:
    """An error that names all that has to be accepted; ``then``: what is wrong all the same."""
    given = error.parts[3]
    expected = given if isinstance(given, Naming) else Naming((), str(given or ""))
    options = " ".join(f"{{}} {one}" for one in accepted)
    words = f"{expected.words}; {f'with {options} it is refused, too: {then}' if then else f'all together: {options}'}"
    every = Naming((*expected.names, *["accept"] * len(accepted)), words)
    return AcceptTogetherError(error.where, error.what, found=error.found, expected=every)
