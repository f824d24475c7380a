"""Errors a technician can act on: where, what, what was found, what was expected.

Whatever goes wrong while a file is read becomes an :class:`InputError` here (:func:`reader`), and every message is one
line of at most :data:`LONGEST` printable characters: a file can neither fill the screen nor steer the terminal.
"""

from __future__ import annotations

import difflib
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import cache, partial, wraps
from os import PathLike
from typing import TYPE_CHECKING, ClassVar, ParamSpec, TypeVar

if TYPE_CHECKING:
    from stepgauge.verbs.define import VerbParameter

LONGEST = 300
"""Characters of a message."""
_WORD = 24
"""Characters of the longest word or number that is not cut through."""
_SHORTEST = 40
"""Characters that are left of a part of a message that is too long."""
_UNIT = re.compile(r"_(per_K|um_per_m|mm|um|mm_s|s|C|K|deg|mrad|percent|MB)$")
P = ParamSpec("P")
T = TypeVar("T")


_VALUE = r' \w+=(?:"[^"]*"|[^\s;,)]+)| [a-z0-9_-]+'
_NAMED = re.compile(
    rf"'(?P<quoted>stepgauge [^']*)'|(?P<command>stepgauge [^';,)]*[^';,) ])|(?<![\w-])--(?P<option>[a-z][a-z0-9-]*)"
    rf"(?P<value>{_VALUE})?(?P<more>(?: --(?P=option)(?:{_VALUE}))*)"
)
"""A command, or an option with what stands behind it, which may be there several times."""
_for_command: ContextVar[bool] = ContextVar("for_command", default=False)


def plain(name: str) -> str:
    """A name as it is compared: small letters and digits alone, so that ``TNC 640`` is ``tnc640``."""
    return "".join(c for c in name.lower() if c.isalnum())


FRAME = "DataFrame"
"""Name in messages of a table that Python gave."""


def at_row(path: object, row: object) -> str:
    """``file:line``; of a table that Python gave as pandas has it, ``DataFrame.iloc[row]``, counted from 0."""
    return f"{path}.iloc[{row}]" if str(path) == FRAME else f"{path}:{row}"


def nearest_first(given: object, words: Iterable[str], names: Mapping[str, str] | None = None) -> str:
    """What may be given, for a message: of words, and names that stand for them, the nearest as a question before all.

    ``names``: words by what they are called besides, :func:`plain`.
    """
    every = ", ".join(words)
    known = {plain(word): word for word in every.split(", ")} | dict(names or {})
    near = difflib.get_close_matches(plain(str(given)), known, 1, cutoff=0.7)
    return f"{known[near[0]]}? All: {every}" if near else every


@cache
def _declared() -> tuple[VerbParameter, ...]:
    """The parameters of all verbs: asked for when a message is put into words, not before."""
    from stepgauge.verbs.catalogue import all_verbs

    return tuple(one for _, verb in all_verbs() for one in verb.parameters)


@cache
def _argument_by_option() -> dict[str, str]:
    """Those that Python can state before those that say what the command line writes."""
    every = sorted(_declared(), key=lambda one: one.writes)
    return {one.key: one.name for one in reversed(every)}


@cache
def _choices(argument: str) -> frozenset[str]:
    """Words that an argument may have."""
    return frozenset(word for one in _declared() if one.name == argument for word in getattr(one.one, "words", ()))


@cache
def _lists_of_words() -> frozenset[str]:
    """Arguments that take several words, of which none is known beforehand."""
    return frozenset(one.name for one in _declared() if one.repeated and type(one.one).__name__ == "Text")


def python_text(text: str) -> str:
    """A text that names options or commands, with the arguments and calls of Python in their place.

    As it is inside :func:`for_command`.
    """
    return text if _for_command.get() else _NAMED.sub(_named_in_python, text)


def _named_in_python(found: re.Match[str]) -> str:
    """A call for a command; an argument for an option, with its value."""
    if command := found["quoted"] or found["command"]:
        from stepgauge.verbs.catalogue import python_call

        call = python_call(command)
        return found[0] if call == command else call
    option, behind, more = found["option"], found["value"] or "", found["more"]
    argument = _argument_by_option().get(option, option.replace("-", "_"))
    if behind and argument in _lists_of_words():
        every = [_quoted(one) for one in (behind, *more.split(f" --{option}")[1:])]
        listed = ", ".join(every)
        return f"{argument}={listed}" if len(every) == 1 else f"{argument}=[{listed}]"
    return _python_value(argument, behind) + python_text(more)


def _quoted(value: str) -> str:
    """A text as Python has it, which a shell may have had with quotes within."""
    return '"' + value.strip().replace('"', "") + '"'


def _python_value(argument: str, behind: str) -> str:
    """An argument with what stands behind it, as Python has it where that is its value: a choice, or a pair."""
    found = re.match(_VALUE, behind)
    value = "" if found is None else found[0].strip()
    key, equals, one = value.partition("=")
    if equals and argument in _lists_of_words():
        return f"{argument}={_quoted(value)}{behind[len(value) + 1 :]}"
    if equals:
        return f'{argument}={{"{key}": "{one.strip(chr(34))}"}}{behind[len(value) + 1 :]}'
    return f'{argument}="{value}"{behind[len(value) + 1 :]}' if value in _choices(argument) else argument + behind


@contextmanager
def for_command() -> Iterator[None]:
    """Texts are said as they are kept: with the options of the command line."""
    before = _for_command.set(True)
    try:
        yield
    finally:
        _for_command.reset(before)


def option_of(name: str) -> str:
    """The option of the command line that stands for an argument, or would."""
    return "--" + next((one.key for one in _declared() if one.name == name), without_unit(name))


def without_unit(name: str) -> str:
    """A name as the command line has it: without its unit, which ``--help`` states."""
    return _UNIT.sub("", name).replace("_", "-")


@dataclass(frozen=True)
class Naming:
    """A part of a message that names what the caller gave: ``words`` with a ``{}`` for each of ``names``.

    As text it names arguments of Python, with their values as Python has them; :meth:`cli_text` names the options of
    the command line, :meth:`named` whatever the person sees: the fields of a page.
    """

    names: tuple[str, ...]
    words: str = "{}"

    def __str__(self) -> str:
        return self._filled(_python_value)

    def cli_text(self) -> str:
        """With the options that stand for the arguments."""
        return self.named(option_of)

    def named(self, name: Callable[[str], str]) -> str:
        """With other names of the arguments."""
        return self._filled(lambda one, behind: name(one) + behind)

    def _filled(self, said: Callable[[str, str], str]) -> str:
        """The words with each name as ``said`` together with what stands behind it."""
        first, *rest = self.words.split("{}", len(self.names))
        return first + "".join(said(name, behind) for name, behind in zip(self.names, rest, strict=False))


def naming(*names: str, words: str = "{}") -> Naming:
    """Arguments by their names in Python, in ``words`` or alone."""
    return Naming(names, words)


def cli_text(part: object) -> object:
    """A part of a message, or a place or text in it, as somebody at the command line knows it."""
    return _named(part, option_of)


def _named(part: object, name: Callable[[str], str]) -> object:
    return part.named(name) if isinstance(part, Naming) else part


Place = str | PathLike[str] | Naming


class InputError(Exception):
    """Something given to stepgauge is wrong; the message is one line for the person who can mend it.

    Every part may be a :class:`Naming`, or name options in its text: the message and the attributes name arguments,
    :meth:`cli_text` the options of the command line; ``parts``: as they were given.

    Parameters
    ----------
    where : the file, with line, row or key where there is one, e.g. ``"points.csv:7"``; or the argument
    what : what is wrong, in words
    found, expected : the offending value and what would have been right, where that helps
    """

    longest: ClassVar[int] = LONGEST

    def __init__(self, where: Place, what: str | Naming, *, found: object = None, expected: object = None) -> None:
        self.parts = (where, what, found, expected)
        self.where, self.what, self.found = str(where), python_text(str(what)), found
        self.expected = None if expected is None else python_text(str(expected))
        super().__init__(_message(self.where, self.what, found, self.expected, self.longest))

    def cli_text(self) -> str:
        """The message with the options of the command line in place of the arguments of Python."""
        where, what, found, expected = self.named(option_of)
        return _message(str(where), str(what), found, expected, self.longest)

    @property
    def namings(self) -> tuple[Naming, ...]:
        """The parts of the message that name arguments, by which it can be settled."""
        return tuple(part for part in self.parts[:0:-1] if isinstance(part, Naming))

    def named(self, name: Callable[[str], str]) -> tuple[object, ...]:
        """Where, what, found and expected, with other names of the arguments."""
        return tuple(_named(part, name) for part in self.parts)

    def __reduce__(self) -> tuple[object, ...]:
        """As it was made, for it crosses from one process to another."""
        where, what, found, expected = self.parts
        return partial(type(self), found=found, expected=expected), (where, what)

    def at(self, where: Place) -> InputError:
        """The same error with its place as somebody knows it who knows the file."""
        _, what, found, expected = self.parts
        return type(self)(where, what, found=found, expected=expected)


class PartlyDoneError(InputError):
    """A part of what was asked could not be done; the files of the rest are kept."""


class ProgramStoppedError(PartlyDoneError):
    """The virtual machine stopped in the middle of a program; what was recorded until then is kept."""


def one_line(text: str, longest: int = LONGEST) -> str:
    """Text on one line: what is not printable is written as its escape, what is too long is cut in the middle."""
    line = " ".join(text[: 20 * longest].split())
    if not line.isprintable():
        line = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in line)
    return _cut(line, longest)


def _message(where: str, what: str, found: object, expected: object, longest: int) -> str:
    """The parts of a message; where they are too long together, the folders of the place go first, then the longest."""
    values = (where, what, found, expected)
    heads = ("", ": ", "; found ", "; expected ")
    parts = ["" if value is None else one_line(str(value), 10 * longest) for value in values]
    used = sum(len(head) for head, value in zip(heads, values, strict=True) if value is not None)
    over = used + sum(map(len, parts)) - longest
    if over > 0:
        parts[0] = _place(parts[0], max(len(parts[0]) - over, _SHORTEST))
    for i in (*sorted((2, 3), key=lambda i: -len(parts[i])), 1):
        over = used + sum(map(len, parts)) - longest
        parts[i] = _cut(parts[i], max(len(parts[i]) - max(over, 0), _SHORTEST))
    said = [head + part for head, part, value in zip(heads, parts, values, strict=True) if value is not None]
    return _cut("".join(said).removeprefix(": "), longest)  # what was never in a file has no place


def _cut(text: str, longest: int) -> str:
    """The beginning and the end of a text that is too long, both of whole words where there are any."""
    if len(text) <= longest:
        return text
    end = (longest - 3) // 3
    first, last = text[: longest - 3 - end], text[-end:]
    if not text[len(first)].isspace() and (space := first.rfind(" ")) >= len(first) - _WORD:
        first = first[: max(space, 0)]
    if not text[-end - 1].isspace() and 0 <= (space := last.find(" ")) < _WORD:
        last = last[space + 1 :]
    return f"{first.rstrip()}...{last.lstrip()}"


def _place(text: str, longest: int) -> str:
    """A place that is too long without the folders of its file, then without its middle."""
    if len(text) <= longest:
        return text
    file, space, inside = text.partition(" ")
    return _cut(f".../{file.rpartition('/')[2]}{space}{inside}" if "/" in file else text, longest)


def no_such_file(path: str | PathLike[str]) -> InputError:
    """That a file is not there, with the one of its folder whose name is most like it."""
    folder, name = os.path.split(path)
    try:
        near = difflib.get_close_matches(name, os.listdir(folder or "."), 1, cutoff=0.7)
    except OSError:
        near = []
    return InputError(path, "no such file", expected=f"{os.path.join(folder, near[0])}?" if near else None)


@contextmanager
def reading(path: str | PathLike[str], what: str = "file") -> Iterator[None]:
    """Whatever fails inside is an :class:`InputError` of ``path``; ``what`` it should be, in words."""
    if not str(path):
        raise InputError(what, "this names no file", found="an empty name", expected="the name of a file")
    try:
        yield
    except InputError:
        raise
    except FileNotFoundError as error:
        raise no_such_file(error.filename or path) from None
    except IsADirectoryError:
        raise InputError(path, "this is a folder", expected="a file") from None
    except OSError as error:
        raise InputError(path, error.strerror or str(error)) from None
    except UnicodeDecodeError as error:
        raise InputError(path, f"not a UTF-8 text file (byte {error.start})") from None
    except RecursionError:
        raise InputError(path, f"not a {what}: nested too deeply") from None
    except MemoryError:
        raise InputError(path, f"this {what} needs more memory than there is") from None
    except Exception as error:  # the libraries that unpack and parse fail in their own ways
        raise InputError(path, f"the {what} is damaged: {type(error).__name__}: {error}") from None


def reader(what: str) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """Decorator of functions that read the file of their first argument: :func:`reading` around the whole of it."""

    def decorate(function: Callable[P, T]) -> Callable[P, T]:
        """The same function, whose failures name the file."""

        @wraps(function)
        def read(*args: P.args, **kwargs: P.kwargs) -> T:
            """The same, where the file has a name."""
            path = args[0] if args else next(iter(kwargs.values()))
            if not isinstance(path, str | PathLike):
                found = "None" if path is None else type(path).__name__
                raise InputError(what, "this names no file", found=found, expected="the name of a file")
            with reading(str(path), what):
                return function(*args, **kwargs)

        return read

    return decorate
