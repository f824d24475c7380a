"""Errors a technician can act on: where, what, what was found, what was expected."""

from __future__ import annotations

from functools import partial
from os import PathLike


class InputError(Exception):
    """Something given to stepgauge is wrong; the message is one line for the person who can mend it.

    Parameters
    ----------
    where : the file, with line, row or key where there is one, e.g. ``"points.csv:7"``
    what : what is wrong, in words
    found, expected : the offending value and what would have been right, where that helps
    """

    def __init__(self, where: str | PathLike[str], what: str, *, found: object = None, expected: object = None) -> None:
        self.where, self.what, self.found, self.expected = str(where), what, found, expected
        text = f"{self.where}: {what}"
        if found is not None:
            text += f"; found {found}"
        if expected is not None:
            text += f"; expected {expected}"
        super().__init__(" ".join(text.split()))

    def __reduce__(self) -> tuple[object, ...]:
        """As it was made, for it crosses from one process to another."""
        return partial(type(self), found=self.found, expected=self.expected), (self.where, self.what)

    def at(self, where: str | PathLike[str]) -> InputError:
        """The same error with its place as somebody knows it who knows the file."""
        return type(self)(where, self.what, found=self.found, expected=self.expected)


class ProgramStoppedError(InputError):
    """The virtual machine stopped in the middle of a program; what was recorded until then is kept."""
