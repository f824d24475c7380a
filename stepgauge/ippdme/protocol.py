"""Lines of I++ DME: tags, commands, answers. No sockets here; server and client share it.

A command is a tag of five characters, a blank, and a method with its arguments in parentheses. An answer is the tag of
its command, a blank, and one of ``&`` (accepted), ``#`` (data), ``!`` (error), ``%`` (complete). Lines are ASCII 32 to
126 and end with CR LF.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple, NoReturn

from stepgauge.ippdme.codes import DmeError

PORT = 1294
"""TCP port of the standard."""
NO_TAG = "E0000"
"""Tag of what no command asked for."""
LONGEST_LINE = 65_536
LONGEST_NUMBER = 16
"""Characters; servers that check refuse longer ones, as Python's repr writes them."""
DEEPEST = 4
"""Parentheses inside parentheses; the standard needs two."""
MOST_ARGUMENTS = 200
END = b"\r\n"
_TAG = re.compile(r"(?!00000)[0-9]{5}|E(?!0000)[0-9]{4}", re.ASCII)
_TOKEN = re.compile(
    r" *(?:([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)(?![\w.])|([A-Za-z_][\w.]*)|\"([^\"]*)\"|([(),]))",
    re.ASCII,
)
_ANSWER = re.compile(r"([0-9]{5}|E[0-9]{4}) ([&#!%])(?: (.*))?", re.ASCII)
_ERROR = re.compile(r'Error\( *([0-9]) *, *([0-9]{1,4}) *, *"([^"]*)" *, *"([^"]*)" *\)', re.ASCII)


class Text(str):
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
        if not all(isinstance(one, float) for one in self.arguments):
            raise DmeError(509)
        return [one for one in self.arguments if isinstance(one, float)]

    def number(self) -> float:
        """The only argument, a number (error 0509 if not)."""
        numbers = self.numbers()
        if len(numbers) != 1:
            raise DmeError(509)
        return numbers[0]


Value = float | Text | Word | Call


class Command(NamedTuple):
    """A tagged command; ``error`` instead of a call where the line is none, for its turn among the answers."""

    tag: str
    call: Call
    error: DmeError | None = None


class Answer(NamedTuple):
    """A line of a server: ``kind`` is one of ``& # ! %``; ``text`` is what follows it."""

    tag: str
    kind: str
    text: str


class Lines:
    """Bytes as they come, as lines without their ends. What is longer than a line may be is cut and marked."""

    def __init__(self, longest: int = LONGEST_LINE) -> None:
        self.longest, self._rest, self._skipping = longest, b"", False

    def feed(self, data: bytes) -> Iterator[tuple[bytes, bool]]:
        """Every line that is complete now, and whether it was cut."""
        *whole, rest = (self._rest + data).split(b"\n")
        self._rest = b""
        for line in whole:
            skipped, self._skipping = self._skipping, False
            if not skipped:
                cut = len(line) > self.longest + 1
                yield (line[: self.longest], True) if cut else (_without_end(line), False)
        if len(rest) > self.longest + 1:
            if not self._skipping:
                yield rest[: self.longest], True
            self._skipping = True
        elif not self._skipping:
            self._rest = rest


def _without_end(line: bytes) -> bytes:
    """Without CR; a line that ends with LF alone keeps it, as a character that may not be."""
    return line[:-1] if line.endswith(b"\r") else line + b"\n"


def is_tag(text: str) -> bool:
    """Whether a text is a tag that a client may use."""
    return _TAG.fullmatch(text) is not None


def parse_command(line: bytes, cut: bool = False) -> Command:
    """The command of a line of a client, without its end; what is wrong with it is in ``error``."""
    text = line.decode("latin-1")
    tag = text[:5]
    if not is_tag(tag):
        return Command(NO_TAG, Call(""), DmeError(1))
    method = re.match(r" *([A-Za-z]\w{0,63})\(", text[5:], re.ASCII)
    name = method[1] if method else ""
    try:
        _check_characters(line, text, cut, name)
        return Command(tag, parse_call(text[6:], name))
    except DmeError as error:
        return Command(tag, Call(name), error)


def _check_characters(line: bytes, text: str, cut: bool, name: str) -> None:
    if cut:
        raise DmeError(0, name)
    if not (line.isascii() and text.isprintable()):
        raise DmeError(7, name)
    if text[5:6] != " ":
        raise DmeError(2, name)


def parse_call(text: str, method: str = "") -> Call:
    """``Name(arguments)``; :class:`DmeError` 0507 where there is no name with parentheses, 0502 for its arguments."""
    values = parse_values(text, method)
    if len(values) != 1 or not isinstance(values[0], Call):
        raise DmeError(502 if method else 507, method)
    return values[0]


def parse_values(text: str, method: str = "") -> tuple[Value, ...]:
    """Values separated by commas, as arguments and data have them (:class:`DmeError` 0502, for numbers 0509)."""
    return _Parser(text, method).all()


class _Parser:
    """Recursive descent over the tokens of one line: number, name, text in quotes, mark."""

    def __init__(self, text: str, method: str) -> None:
        self.method, self.at = method, 0
        text = text.rstrip(" ")
        self.tokens, end = list[tuple[str, ...]](), 0
        while end < len(text):
            match = _TOKEN.match(text, end)
            if match is None:
                self._fail()
            self.tokens.append(match.groups())
            end = match.end()

    def all(self) -> tuple[Value, ...]:
        values = self._values(0)
        if self.at != len(self.tokens):
            self._fail()
        return values

    def _fail(self, number: int = 502) -> NoReturn:
        """Arguments that are wrong; what has no method is no command at all."""
        raise DmeError(number if self.method else 507, self.method)

    def _is_next(self, mark: str) -> bool:
        """Whether a mark is next, which is then taken."""
        found = self.at < len(self.tokens) and self.tokens[self.at][3] == mark
        self.at += found
        return found

    def _values(self, depth: int) -> tuple[Value, ...]:
        if depth > DEEPEST:
            self._fail()
        values = [self._value(depth)]
        while self._is_next(","):
            values.append(self._value(depth))
            if len(values) > MOST_ARGUMENTS:
                self._fail()
        return tuple(values)

    def _value(self, depth: int) -> Value:
        if self.at >= len(self.tokens):
            self._fail()
        number, name, quoted, _ = self.tokens[self.at]
        self.at += 1
        if number is not None:
            return self._number(number)
        if quoted is not None:
            return Text(quoted)
        if name is None:
            self._fail()
        return self._call(name, depth) if self._is_next("(") else Word(name)

    def _call(self, name: str, depth: int) -> Call:
        if self._is_next(")"):
            return Call(name)
        arguments = self._values(depth + 1)
        if not self._is_next(")"):
            self._fail()
        return Call(name, arguments)

    def _number(self, text: str) -> float:
        value = float(text)
        if len(text) > LONGEST_NUMBER or not abs(value) < 1e300:
            self._fail(509)
        return value


def parse_answer(line: bytes) -> Answer | None:
    """The answer of a line of a server; None where it is none."""
    match = _ANSWER.fullmatch(line.decode("latin-1").rstrip(" "))
    return Answer(match[1], match[2], match[3] or "") if match and line.isascii() else None


def parse_error(text: str) -> DmeError:
    """The error of an answer ``! Error(..)``; one without that form is a protocol error with its text."""
    match = _ERROR.fullmatch(text.strip())
    if match is None:
        return DmeError(8, text=text)
    return DmeError(int(match[2]), match[3], int(match[1]), match[4])


def fixed(value: float, decimals: int = 7) -> str:
    """A number as it is sent: fixed point, never -0, at most :data:`LONGEST_NUMBER` characters."""
    text = f"{value:.{decimals}f}"
    while len(text) > LONGEST_NUMBER and decimals > 0:
        decimals -= 1
        text = f"{value:.{decimals}f}"
    return text.removeprefix("-") if float(text) == 0.0 else text


def fields(text: str) -> dict[str, tuple[Value, ...]]:
    """Data such as ``X(1.0), Y(2.0)`` by name; what has no parentheses is left out (:class:`DmeError` as above)."""
    return {one.name: one.arguments for one in parse_values(text) if isinstance(one, Call)}
