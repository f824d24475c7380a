"""Lines of I++ DME: tags, commands, answers. No sockets here; server and client share it.

A command is a tag of five characters, a blank, and a method with its arguments in parentheses. An answer is the tag of
its command, a blank, and one of ``&`` (accepted), ``#`` (data), ``!`` (error), ``%`` (complete). Lines are ASCII 32 to
126 and end with CR LF.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple

from stepgauge.ippdme.codes import DmeError
from stepgauge.ippdme.values import Call, parse_call

PORT = 1294
"""TCP port of the standard."""
NO_TAG = "E0000"
"""Tag of what no command asked for."""
LONGEST_LINE = 65_536
END = b"\r\n"
_TAG = re.compile(r"(?!00000)[0-9]{5}|E(?!0000)[0-9]{4}", re.ASCII)
_ANSWER = re.compile(r"([0-9]{5}|E[0-9]{4}) (?:([&%])|([#!]) (.*))", re.ASCII)
_ERROR = re.compile(r'Error\( *([0-9]) *, *([0-9]{1,4}) *, *"([^"]*)" *, *"([^"]*)" *\)', re.ASCII)


class Command(NamedTuple):
    """A tagged command; ``error`` instead of a call where the line is none, for its turn among the answers."""

    tag: str
    call: Call
    error: DmeError | None = None


class Response(NamedTuple):
    """A line of a server: ``kind`` is one of ``& # ! %``; ``text`` is what follows it."""

    tag: str
    kind: str
    text: str


class LineReader:
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


def is_event_tag(text: str) -> bool:
    """Whether a text is a tag of events, and of commands that are executed at once."""
    return text[:1] == "E" and is_tag(text)


def parse_command(line: bytes, cut: bool = False) -> Command:
    """The command of a line of a client, without its end; what is wrong with it is in ``error``."""
    text = line.decode("latin-1")
    tag = text[:5]
    if not is_tag(tag):
        return Command(NO_TAG, Call(""), DmeError(1))
    method = re.match(r" *([A-Za-z]\w{0,63}) *\(", text[5:], re.ASCII)
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
    if text[6:7] == " ":  # a blank may stand beside parentheses and commas only (specification 1.40, page 33)
        raise DmeError(502, name)


def parse_answer(line: bytes) -> Response | None:
    """The answer of a line of a server; None where it is none."""
    text = line.decode("latin-1").rstrip(" ")
    match = _ANSWER.fullmatch(text)
    return (
        Response(match[1], match[2] or match[3], match[4] or "")
        if match and text.isascii() and text.isprintable()
        else None
    )


def parse_error(text: str) -> DmeError:
    """The error of an answer ``! Error(..)``; one without that form is a protocol error with its text."""
    match = _ERROR.fullmatch(text.strip())
    if match is None:
        return DmeError(8, text=text)
    return DmeError(int(match[2]), match[3], int(match[1]), match[4])
