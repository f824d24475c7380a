"""What was measured, and under which conditions: each with its state, for every verb that decides or passes numbers on.

A result carries the :class:`Conditions` of the readings that it was made from, into its JSON file and back.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, ClassVar, Final, Literal, TypeVar, get_args

from stepgauge.errors import LONGEST, InputError, Place

State = Literal["met", "corrected", "contribution", "prevents"]
"""``met``: as it has to be; ``corrected``: the numbers hold it no more; ``contribution``: they hold it, whoever uses
them has to count with it; ``prevents``: nothing may be stated, decided or certified from these readings."""
STATES: tuple[State, ...] = get_args(State)
Name = Literal[
    "completeness",
    "repeats",
    "outliers",
    "scatter",
    "duplicates",
    "resolution",
    "alignment",
    "temperature",
    "temperature convention",
    "drift",
    "dates",
    "identity",
    "certificate",
    "effective radius",
    "reversal",
    "faces",
    "units",
    "channel",
    "sphere",
]
"""What is asked of the readings; ``docs/readings.md`` says how each is examined."""
NO_STATEMENT: Final = "no statement"
"""The decision where a condition prevents any."""
SHOWN = 3
"""Reasons that the sentence of page 1 names; the others are notes."""
OF_RESULTS: tuple[Name, ...] = ("alignment", "drift", "resolution", "temperature convention")
"""Conditions whose size moves all results, so that an uncertainty must hold it."""
Decision = TypeVar("Decision")


@dataclass(frozen=True)
class Condition:
    """One condition: its state, what was found and what was expected, and a sentence for the technician.

    ``size_um``: how far it moves the results at most, um (of a rotary axis arcsec); None where nothing says so.
    """

    name: Name
    state: State
    sentence: str
    found: str = ""
    expected: str = ""
    size_um: float | None = None

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON types."""
        return asdict(self)


def _beyond(one: Condition, expanded_um: float) -> Condition:
    larger = one.size_um is not None and one.size_um > expanded_um
    if one.state != "contribution" or one.name not in OF_RESULTS or not larger:
        return one
    return replace(one, state="prevents", sentence=f"{one.sentence} (more than U = {expanded_um:.2g})")


@dataclass(frozen=True)
class Conditions:
    """The conditions of some readings, in the order in which they were examined."""

    entries: tuple[Condition, ...] = ()

    def __iter__(self) -> Iterator[Condition]:
        return iter(self.entries)

    def __add__(self, other: Iterable[Condition]) -> Conditions:
        """Those of both, each once."""
        return Conditions(tuple(dict.fromkeys((*self.entries, *other))))

    def of(self, *names: Name) -> tuple[Condition, ...]:
        """Those with one of the names."""
        return tuple(one for one in self.entries if one.name in names)

    def without(self, *names: Name) -> Conditions:
        """Those with none of the names: a trend, in which the certificate cancels, does not rest on its date."""
        return Conditions(tuple(one for one in self.entries if one.name not in names))

    @property
    def notes(self) -> tuple[str, ...]:
        """The sentences of all that is not as it has to be, for page 1 and the command line."""
        return tuple(one.sentence for one in self.entries if one.state != "met")

    @property
    def preventing(self) -> tuple[Condition, ...]:
        """What prevents a statement."""
        return tuple(one for one in self.entries if one.state == "prevents")

    def weighed(self, expanded_um: float | None) -> Conditions:
        """The same where results have an expanded uncertainty: what moves them by more, and is no part of it, prevents
        a statement. None: no uncertainty is stated, and nothing is decided anyway."""
        if expanded_um is None:
            return self
        return Conditions(tuple(_beyond(one, expanded_um) for one in self.entries))

    @property
    def no_statement(self) -> str:
        """Why nothing may be stated, in one sentence; empty where nothing prevents it."""
        why = "; ".join(one.sentence for one in self.preventing[:SHOWN])
        more = len(self.preventing) - SHOWN
        return f"No statement is made: {why}{f'; and {more} more' if more > 0 else ''}." if why else ""

    def to_dicts(self) -> list[dict[str, Any]]:
        """Plain JSON types."""
        return [one.to_dict() for one in self.entries]

    @classmethod
    def read_dicts(cls, stored: Iterable[Mapping[str, Any]]) -> Conditions:
        """As :meth:`to_dicts` wrote them."""
        return cls(tuple(Condition(**one) for one in stored))


NOTHING = Conditions()
"""Nothing was examined."""


def gate(conditions: Conditions, decision: Decision) -> Decision | Literal["no statement"]:
    """The decision, or that there is none where a condition prevents it: every verb asks here before it decides."""
    return NO_STATEMENT if conditions.preventing else decision


class PreventedError(InputError):
    """A condition prevents a statement; its whole sentence is told, with what would settle it."""

    longest: ClassVar[int] = 2 * LONGEST


def require_statement(conditions: Conditions, where: Place) -> None:
    """:class:`PreventedError` where something prevents a statement, for what needs a statement: a certificate, a table
    for a controller, a place in a history."""
    if conditions.preventing:
        first = conditions.preventing[0]
        raise PreventedError(where, first.sentence, found=first.found or None, expected=first.expected or None)


def stored_conditions(result: Mapping[str, Any]) -> Conditions:
    """All conditions of a result as JSON has it: its own and those of its placements, each once."""
    tables = [result, *result.get("placements", ())]
    return sum((Conditions.read_dicts(table.get("conditions", ())) for table in tables), Conditions())
