"""What all kinds of parameters have, and small questions of what is given."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from numbers import Real
from typing import Any, ClassVar

from stepgauge.errors import InputError, naming

ARGUMENT = "argument"
"""Marks a parameter that stands on the command line without a name."""


@dataclass(eq=False)
class Kind:
    """A text, and what all kinds have."""

    metavar: str = field(default="TEXT", kw_only=True)
    name: str = field(default="text", kw_only=True)
    unit: str = field(default="", kw_only=True)
    room: str | None = field(default=None, kw_only=True)
    is_path: ClassVar[bool] = False
    is_read: ClassVar[bool] = False

    def parse(self, text: str) -> Any:
        """The value that a text states (``ValueError`` for none)."""
        return text

    def fault(self, value: Any) -> tuple[str, str] | None:
        """What is wrong with a value and what would be right; None where it is good."""
        return None

    def bounds(self) -> str:
        """What limits a value, in words; empty where nothing does."""
        return ""

    def written(self, value: Any) -> Any:
        """A value as a person would write it; what is none stays as it is."""
        return value

    def check(self, parameter: str, value: Any) -> None:
        """:class:`InputError` that names the parameter, for what is no value of this kind."""
        wrong = self.fault(value)
        if wrong is not None:
            written = self.written(value)
            found = repr(written) if isinstance(written, str) else written
            raise InputError(naming(parameter), wrong[0], found=found, expected=wrong[1])

    def taken(self, parameter: str, given: Any) -> Any:
        """The checked value of what Python gives."""
        self.check(parameter, given)
        return given

    def read(self, parameter: str, given: Any) -> Any:
        """The checked value of a text, or of what a project file states."""
        try:
            value = self.parse(given) if isinstance(given, str) else given
        except ValueError as error:
            expected = str(error) or self.bounds() or f"a {self.name}"
            raise InputError(naming(parameter), f"not a {self.name}", found=repr(given), expected=expected) from None
        self.check(parameter, value)
        return value


def several(given: Any) -> Sequence[Any]:
    """What is given once or several times."""
    return given if isinstance(given, list | tuple) else [given]


def is_number(value: Any) -> bool:
    """Whether a value is one number."""
    return isinstance(value, Real) and not isinstance(value, bool)


def is_array(value: Any) -> bool:
    """Whether a value is a list of something, or an array."""
    return isinstance(value, list | tuple | range) or hasattr(value, "__array__")


def table_of(given: Any) -> Any:
    """A DataFrame of columns or rows by name, a Series, an array with named fields, or polars; else as it is."""
    rows = isinstance(given, list | tuple) and bool(given) and all(isinstance(one, Mapping) for one in given)
    if type(given).__module__.partition(".")[0] == "polars":
        given = given.to_dict(as_series=False)
    elif hasattr(given, "iloc") and not hasattr(given, "columns"):
        return given.to_frame()
    elif not (rows or isinstance(given, Mapping) or getattr(getattr(given, "dtype", None), "names", None)):
        return given
    import pandas as pd

    try:
        return pd.DataFrame(given)
    except ValueError:  # no columns: whatever it is, it is told as it was given
        return given


def is_pair(value: Any) -> bool:
    """Whether a value is a name with something."""
    return isinstance(value, tuple) and len(value) == 2
