"""Kinds of parameters: how a value is written as text, what is a value, and what is said of one that is none.

Every kind is understood by the command line, the Python function, the project file, the page and the documentation:
``parse`` makes a value of text, ``fault`` says what is wrong with one. Nothing here imports what does the work.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from os import PathLike
from typing import Any, ClassVar

from stepgauge.errors import naming, nearest_first, plain
from stepgauge.verbs.kind import Kind, is_array, is_number, is_pair, several, table_of

NO_FILE = "neither a file nor what is read from one"


@dataclass(eq=False)
class Flag(Kind):
    """Yes or no; the option alone says yes."""

    metavar: str = field(default="", kw_only=True)
    name: str = field(default="flag", kw_only=True)

    def fault(self, value: Any) -> tuple[str, str] | None:
        return None if isinstance(value, int) and value in (True, False) else ("not yes or no", "true or false")


METAVARS = {"deg C": "C", "%": "PERCENT"}


@dataclass(eq=False)
class Number(Kind):
    """A finite number with a unit, from ``low`` (or ``above`` it) to ``high``."""

    unit: str = ""
    low: float = -math.inf
    high: float = math.inf
    above: float | None = None
    what: str = "out of range"
    name: str = field(default="number", kw_only=True)

    def __post_init__(self) -> None:
        self.metavar = METAVARS.get(self.unit, self.unit.upper()) or "N"

    def parse(self, text: str) -> float:
        try:
            return float(text)
        except ValueError:
            raise ValueError from None

    def fault(self, value: Any) -> tuple[str, str] | None:
        try:
            good = (
                self.low <= value <= self.high and (self.above is None or value > self.above) and abs(value) < math.inf
            )
        except (TypeError, ValueError):
            return "not a number", self.bounds() or "a number"
        if not good and self.what == "out of range" and not abs(value) < math.inf:
            return "not a finite number", self.bounds() or "a finite number"
        return None if good else (self.what, self.bounds() or "a finite number")

    def bounds(self) -> str:
        if self.above is None and self.low > -math.inf and self.high < math.inf:
            return f"{self.low:g} to {self.high:g} {self.unit}".strip()
        low = f"more than {self.above:g}" if self.above is not None else f"at least {self.low:g}"
        limits = [low] if self.above is not None or self.low > -math.inf else []
        limits += [f"at most {self.high:g}"] if self.high < math.inf else []
        return f"{', '.join(limits)} {self.unit}".strip() if limits else ""


class Count(Number):
    """A whole number."""

    def __init__(self, low: int = 0, high: float = math.inf, **more: Any) -> None:
        super().__init__("", low, high, name="whole number")
        self.__dict__.update(more)

    def parse(self, text: str) -> int:
        try:
            return int(text)
        except ValueError:
            raise ValueError from None

    def fault(self, value: Any) -> tuple[str, str] | None:
        if isinstance(value, bool) or not hasattr(value, "__index__"):
            return "out of range", self.bounds()
        return super().fault(value)

    def bounds(self) -> str:
        return f"a whole number, {super().bounds()}"


@dataclass(eq=False)
class OneOf(Kind):
    """One of some words; ``names``: words by what they are called besides, asked for when it is none of the words."""

    def __init__(self, *words: str, names: Callable[[], Mapping[str, str]] = dict) -> None:
        super().__init__(metavar=f"[{'|'.join(words)}]", name="choice")
        self.words, self.names = words, names

    def parse(self, text: str) -> str:
        return text if text in self.words else self.names().get(plain(text), text)

    def taken(self, parameter: str, given: Any) -> Any:
        return super().taken(parameter, self.parse(given) if isinstance(given, str) else given)

    def fault(self, value: Any) -> tuple[str, str] | None:
        good = isinstance(value, str) and value in self.words
        return None if good else ("not a choice", nearest_first(value, self.words, self.names()))

    def bounds(self) -> str:
        return ", ".join(self.words)


@dataclass(eq=False)
class Text(Kind):
    """Any text; ``metavar`` says of what. Python may give a path, or the number that it states.

    ``numbers``: or several.
    """

    metavar: str = "TEXT"
    numbers: bool = False

    def taken(self, parameter: str, given: Any) -> Any:
        return super().taken(parameter, str(given) if is_number(given) else given)

    def fault(self, value: Any) -> tuple[str, str] | None:
        several_of = self.numbers and is_array(value) and all(map(is_number, value))
        return None if several_of or isinstance(value, str | PathLike) else ("not a text", f"a text: {self.metavar}")


@dataclass(eq=False)
class BlockRange(Kind):
    """First and last block, ``A:B``; with ``listed`` also single blocks, ``A,B,..``."""

    listed: bool = False
    name: str = field(default="range of blocks", kw_only=True)

    def __post_init__(self) -> None:
        self.metavar = "A:B|A,B,.." if self.listed else "A:B"

    def fault(self, value: Any) -> tuple[str, str] | None:
        numbers = isinstance(value, list | tuple) and all(map(is_number, value))
        return None if numbers or isinstance(value, str) else (f"not a {self.name}", self.metavar)


@dataclass(eq=False)
class Moment(Kind):
    """A date, with or without a time, as ISO 8601 writes it."""

    metavar: str = field(default="DATE", kw_only=True)
    name: str = field(default="date", kw_only=True)

    def check(self, parameter: str, value: Any) -> None:
        from stepgauge.files.dates import parse_moment

        parse_moment(str(value), naming(parameter))


@dataclass(eq=False)
class IsoDate(Kind):
    """A date without a time that is not to come."""

    metavar: str = field(default="YYYY-MM-DD", kw_only=True)
    name: str = field(default="date", kw_only=True)

    def parse(self, text: str) -> Any:
        import datetime

        try:
            return datetime.date.fromisoformat(text)
        except ValueError:
            raise ValueError("year-month-day, e.g. 2026-03-02") from None

    def fault(self, value: Any) -> tuple[str, str] | None:
        import datetime

        if isinstance(value, datetime.datetime) or not isinstance(value, datetime.date):
            return "not a date", "a date without time, 2026-03-02"
        if value > datetime.date.today():
            return "lies in the future", "today or a day before"
        return None


@dataclass(eq=False)
class Vector(Kind):
    """Numbers separated by commas."""

    count: int | None = None
    unit: str = ""
    metavar: str = "X,Y,Z"
    above: float | None = None
    name: str = field(default="list of numbers", kw_only=True)

    def parse(self, text: str) -> tuple[float, ...]:
        try:
            return tuple(float(part) for part in text.split(","))
        except ValueError:
            raise ValueError from None

    def written(self, value: Any) -> Any:
        numbers = isinstance(value, list | tuple) and all(isinstance(one, int | float) for one in value)
        return ",".join(f"{one:g}" for one in value) if numbers else value

    def fault(self, value: Any) -> tuple[str, str] | None:
        try:
            numbers = [float(one) for one in value]
        except (TypeError, ValueError):
            numbers = []
        good = bool(numbers) and self.count in (None, len(numbers)) and all(map(math.isfinite, numbers))
        good = good and (self.above is None or min(numbers) > self.above)
        return None if good else (f"not a {self.name}", self.bounds())

    def bounds(self) -> str:
        many = "numbers" if self.count is None else f"{self.count} numbers"
        return f"{self.metavar}: {many}{f' above {self.above:g}' if self.above is not None else ''} {self.unit}".strip()


@dataclass(eq=False)
class Pair(Kind):
    """``NAME=VALUE``; several of them make a mapping. With ``names``: only these, with positive numbers.

    ``whole``: the text stays as it is, for it holds more.
    """

    names: tuple[str, ...] = ()
    metavar: str = "NAME=VALUE"
    whole: bool = False
    name: str = field(default="pair NAME=VALUE", kw_only=True)

    def parse(self, text: str) -> Any:
        if self.whole:
            return text
        name, sign, value = (part.strip() for part in text.partition("="))
        if not (name and sign and value):
            raise ValueError(self.bounds() or self.metavar)
        if not self.names:
            return name, value
        try:
            return name, float(value)
        except ValueError:
            raise ValueError(self.bounds()) from None

    def taken(self, parameter: str, given: Any) -> Any:
        if self.whole and isinstance(given, tuple):
            given = f"{given[0]}={given[1]}"
        elif isinstance(given, str):
            return self.read(parameter, given)
        self.check(parameter, given)
        return given

    def written(self, value: Any) -> Any:
        if not is_pair(value):
            return value
        name, number = value
        return f"{name}={number:g}" if isinstance(number, int | float) else f"{name}={number}"

    def fault(self, value: Any) -> tuple[str, str] | None:
        if not (isinstance(value, str) if self.whole else is_pair(value)):
            return f"not a {self.name}", self.bounds() or f"{self.metavar}, or a dict"
        if not self.names:
            return None
        name, number = value
        good = name in self.names and isinstance(number, int | float) and 0.0 < number < math.inf
        return None if good else ("not a limit", self.bounds())

    def bounds(self) -> str:
        return f"NAME=NUMBER with NAME one of {', '.join(self.names)} and a positive number" if self.names else ""


@dataclass(eq=False)
class Reads(Kind):
    """A file that is read, or in Python the object that stands for it; ``room``: of the shipped files it may name.

    ``foreign``: what somebody else wrote, whose reading has a limit of time and memory. ``optional``: the command
    line may leave it out, and Python states None. ``numbers``: Python may give them instead.
    """

    metavar: str = "FILE"
    room: str | None = None
    short: str = ""
    variable: str | None = None
    foreign: bool = False
    folder: bool = False
    optional: bool = False
    numbers: bool = False
    name: str = field(default="file", kw_only=True)
    is_path: ClassVar[bool] = True
    is_read: ClassVar[bool] = True

    def parse(self, text: str) -> str:
        if not text.strip():
            raise ValueError("the name of a file")
        return text

    def fault(self, value: Any) -> tuple[str, str] | None:
        is_table = hasattr(value, "iloc") and hasattr(value, "columns")
        ours = any(one.__module__.partition(".")[0] == "stepgauge" for one in type(value).__mro__)
        if isinstance(value, str | PathLike) or is_table or hasattr(value, "read") or ours:
            return None
        if self.numbers and is_array(value):
            return None
        expected = f"{self.metavar}: a path, a DataFrame or a result of stepgauge"
        if value is None:
            return f"{NO_FILE}: an import that leaves questions open has no recording", f"{expected}, or the import"
        return NO_FILE, expected

    def taken(self, parameter: str, given: Any) -> Any:
        given = given if self.numbers else table_of(given)
        settled = getattr(given, "settled", None)  # of an import: its recording, or the questions that it leaves open
        return super().taken(parameter, given if settled is None else settled())

    def written(self, value: Any) -> Any:
        return value if isinstance(value, str | PathLike) else type(value).__name__


@dataclass(eq=False)
class Writes(Kind):
    """A file that is written (a folder with ``folder``); with ``suffixes`` only such ones."""

    metavar: str = "PATH"
    suffixes: tuple[str, ...] = ()
    folder: bool = False
    short: str = ""
    name: str = field(default="name of a file", kw_only=True)
    is_path: ClassVar[bool] = True

    def parse(self, text: str) -> str:
        if not text.strip():  # a variable of a script that was never set would mean the working folder
            raise ValueError("a name that is not empty")
        return text

    def fault(self, value: Any) -> tuple[str, str] | None:
        if not isinstance(value, str | PathLike):
            return f"not a {self.name}", self.bounds() or "a path"
        if not self.suffixes or str(value).lower().endswith(self.suffixes):
            return None
        return "not a name with such a suffix", self.bounds()

    def bounds(self) -> str:
        return " or ".join([", ".join(self.suffixes[:-1]), self.suffixes[-1]]) if self.suffixes else ""


@dataclass(eq=False)
class Repeated(Kind):
    """One or several of a kind; the option, repeated, has the name ``option``."""

    kind: Kind = field(default_factory=Kind)
    option: str = ""
    name: str = field(default="list", kw_only=True)

    def __post_init__(self) -> None:
        self.metavar = self.kind.metavar

    def bounds(self) -> str:
        return self.kind.bounds()

    def check(self, parameter: str, value: Any) -> None:
        for one in value.items() if isinstance(value, Mapping) else several(value):
            self.kind.check(parameter, one)

    def taken(self, parameter: str, given: Any) -> Any:
        if isinstance(self.kind, Pair):
            every = list(given.items()) if isinstance(given, Mapping) else several(given)
            pairs = [self.kind.taken(parameter, one) for one in every]
            return pairs if self.kind.whole else dict(pairs)
        if not isinstance(given, list | tuple) or (isinstance(self.kind, Reads) and table_of(given) is not given):
            return self.kind.taken(parameter, given)
        return [self.kind.taken(parameter, one) for one in given]


@dataclass(eq=False)
class Supplied(Kind):
    """What only Python can give; at the command line ``at_command``, or what is made there under the name ``made``."""

    made: str = ""
    at_command: Any = None
