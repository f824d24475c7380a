"""Values of I++ DME as commands and data have them: numbers, texts, words, and names with arguments in parentheses."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from typing import NamedTuple, NoReturn, TypeVar

from stepgauge.ippdme.codes import DmeError

MOST_DIGITS = 16
"""Of a number, before its exponent (specification 1.40, page 33)."""
DEEPEST = 4
"""Parentheses inside parentheses; the standard needs two."""
MOST_ARGUMENTS = 200
_NUMBER = re.compile(r"[-+]?(?=\.?[0-9])[0-9]*\.?[0-9]*(?:[eE][-+]?[0-9]{1,3})?", re.ASCII)
"""Optional sign; digits with at most one point before, between or behind them; optional exponent of one to three
digits (specification 1.40, pages 33 and 34)."""
_TOKEN = re.compile(
    r" *(?:([-+.0-9][-+.0-9eE]*)(?!\w)|([A-Za-z]\w*(?:\.[A-Za-z]\w*)*)(?![.\"])|(\"[^\"]*\"?)|([(),]))", re.ASCII
)
Held = TypeVar("Held")


class QuotedText(str):
    """A text in quotes."""

    __slots__ = ()


class Word(str):
    """A name without parentheses, such as ``MachineCsy``."""

    __slots__ = ()


class Call(NamedTuple):
    """A name with arguments in parentheses: a command, or an argument such as ``X(1.5)``."""

    name: str
    arguments: tuple[Value, ...] = ()

    def numbers(self) -> list[float]:
        """The arguments, all of which are numbers (error 0509 if not)."""
        for one in self.arguments:
            if not isinstance(one, float):
                raise DmeError(509, detail=f"no number of I++ DME: {one!s} in {self.name}(..)")
        return [one for one in self.arguments if isinstance(one, float)]

    def number(self) -> float:
        """The only argument, a number (error 0509 if not)."""
        numbers = self.numbers()
        if len(numbers) != 1:
            raise DmeError(509, detail=f"{self.name}(..) has {len(numbers)} numbers instead of one")
        return numbers[0]

    def calls(self) -> list[Call]:
        """The arguments, all of which are names with parentheses (error 0502 if not)."""
        if not all(isinstance(one, Call) for one in self.arguments):
            raise DmeError(502, detail=f"not all of {self.name}(..) have parentheses")
        return [one for one in self.arguments if isinstance(one, Call)]

    def named(self) -> dict[str, Call]:
        """The same by name, each of which is there once (error 0502 if not)."""
        return once((one.name, one) for one in self.calls())


Value = float | QuotedText | Word | Call


def read_number(text: str) -> float:
    """A number as the standard writes it; :class:`DmeError` 0509 for anything else, also for what no float holds."""
    digits = sum(one.isdigit() for one in re.split("[eE]", text)[0])
    if digits > MOST_DIGITS:
        raise DmeError(509, detail=f"no number of I++ DME: {text[:40]} has {digits} digits, at most {MOST_DIGITS} are")
    if _NUMBER.fullmatch(text) is None or not abs(value := float(text)) < 1e300:
        raise DmeError(509, detail=f"no number of I++ DME: {text[:40]}")
    return value


def fixed(value: float, decimals: int = 7) -> str:
    """A number as it is sent: fixed point, never -0, at most :data:`MOST_DIGITS` digits."""
    whole = 1 if abs(value) < 10.0 else 1 + math.floor(math.log10(abs(value)))
    text = f"{value:.{max(0, min(decimals, MOST_DIGITS - whole - 1))}f}" if whole < MOST_DIGITS else f"{value:.14e}"
    return text.removeprefix("-") if float(text) == 0.0 else text


def once(pairs: Iterable[tuple[str, Held]]) -> dict[str, Held]:
    """What each name has, where every name stands once: of two, nothing says which is true (:class:`DmeError` 0502)."""
    found: dict[str, Held] = {}
    for name, held in pairs:
        if name in found:
            raise DmeError(502, detail=f"{name}(..) is there twice")
        found[name] = held
    return found


def named(lines: Iterable[str]) -> dict[str, Call]:
    """Data such as ``X(1.0), Y(2.0)`` of all lines of an answer, by name.

    :class:`DmeError` 0502 for a name that is there twice, in one line or in two, and for what is no name with
    parentheses; 0509 for numbers.
    """
    return Call("data", tuple(one for line in lines for one in parse_values(line))).named()


def parse_call(text: str, method: str = "") -> Call:
    """``Name(arguments)``: the whole text of a command.

    :class:`DmeError` 0507 where there is no name with parentheses or something after them, 0502 and 0509 for arguments.
    """
    return _LineParser(text, method).command()


def parse_values(text: str) -> tuple[Value, ...]:
    """Values separated by commas, as data have them (:class:`DmeError` 0502, for numbers and texts 0509)."""
    return _LineParser(text, "data").all()


class _LineParser:
    """Recursive descent over the tokens of one line: number, name, text in quotes, mark."""

    def __init__(self, text: str, method: str) -> None:
        self.method, self.at = method, 0
        text = text.rstrip(" ")
        self.tokens, end = list[tuple[str, ...]](), 0
        while end < len(text):
            match = _TOKEN.match(text, end)
            if match is None:
                self._fail(f"{text[end : end + 20]!r}")
            self.tokens.append(match.groups())
            end = match.end()

    def all(self) -> tuple[Value, ...]:
        """All values."""
        values = self._values(0)
        if self.at != len(self.tokens):
            self._fail("a mark too much")
        return values

    def command(self) -> Call:
        """The only value, a call."""
        value = self._value(0)
        if not isinstance(value, Call) or self.at != len(self.tokens):
            raise DmeError(507, self.method)
        return value

    def _fail(self, detail: str, number: int = 502) -> NoReturn:
        """Arguments that are wrong; what has no method is no command at all."""
        raise DmeError(number if self.method else 507, self.method, detail=detail)

    def _is_next(self, mark: str) -> bool:
        """Whether a mark is next, which is then taken."""
        found = self.at < len(self.tokens) and self.tokens[self.at][3] == mark
        self.at += found
        return found

    def _values(self, depth: int) -> tuple[Value, ...]:
        if depth > DEEPEST:
            self._fail(f"parentheses more than {DEEPEST} deep")
        values = [self._value(depth)]
        while self._is_next(","):
            values.append(self._value(depth))
            if len(values) > MOST_ARGUMENTS:
                self._fail(f"more than {MOST_ARGUMENTS} values")
        return tuple(values)

    def _value(self, depth: int) -> Value:
        if self.at >= len(self.tokens):
            self._fail("nothing where a value is expected")
        number, name, quoted, mark = self.tokens[self.at]
        self.at += 1
        if number is not None:
            return self._number(number)
        if quoted is not None:
            return self._text(quoted)
        if name is None:
            self._fail(f"{mark!r} where a value is expected")
        return self._call(name, depth) if self._is_next("(") else Word(name)

    def _call(self, name: str, depth: int) -> Call:
        if self._is_next(")"):
            return Call(name)
        arguments = self._values(depth + 1)
        if not self._is_next(")"):
            self._fail(f"{name}( without its parenthesis")
        return Call(name, arguments)

    def _number(self, text: str) -> float:
        try:
            return read_number(text)
        except DmeError as error:
            self._fail(error.detail, 509)

    def _text(self, quoted: str) -> QuotedText:
        """At least one character between two quotes (specification 1.40, page 33)."""
        if len(quoted) < 3 or not quoted.endswith('"'):
            self._fail(f"no text of I++ DME: {quoted[:20]}", 509)
        return QuotedText(quoted[1:-1])
