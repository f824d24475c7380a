"""Options of a dialect, each with its type: a value is data, and cannot bring a code into a program."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass

from stepgauge.errors import InputError, naming
from stepgauge.files.numerals import number


@dataclass(frozen=True)
class ChoiceOption:
    """One of some values, of which an empty one is ``none``."""

    values: tuple[str, ...]

    @property
    def expected(self) -> str:
        """What is accepted, in words."""
        return ", ".join(value or "none" for value in self.values)

    def text(self, said: str) -> str | None:
        """The value as it stands in the program; None for what is none."""
        value = "" if said == "none" else said
        return value if value in self.values else None


@dataclass(frozen=True)
class NumberOption:
    """A number from ``least`` to ``most`` in a unit; ``whole``: without decimals; ``signed``: printed with its sign."""

    least: float
    most: float
    unit: str = ""
    whole: bool = False
    signed: bool = False
    may_be_left_out: bool = False

    @property
    def expected(self) -> str:
        """What is accepted, in words."""
        kind = "a whole number" if self.whole else "a number"
        return f"{kind} from {self.least:g} to {self.most:g} {self.unit}".strip()

    def text(self, said: str) -> str | None:
        """The value as it stands in the program; None for what is none."""
        if not said and self.may_be_left_out:
            return said
        value = number(said)
        if not math.isfinite(value) or not self.least <= value <= self.most or (self.whole and value % 1.0):
            return None
        plain = f"{value:.4f}".rstrip("0").rstrip(".")
        return f"+{plain}" if self.signed and value >= 0 else plain


@dataclass(frozen=True)
class Name:
    """A name by a pattern, which ``expected`` says in words; ``may_be_left_out``: an empty one is one, too."""

    pattern: str
    expected: str
    may_be_left_out: bool = False

    def text(self, said: str) -> str | None:
        """The value as it stands in the program; None for what is none."""
        left_out = self.may_be_left_out and not said
        return said if left_out or re.fullmatch(self.pattern, said, re.ASCII) else None


YES_NO = ChoiceOption(("yes", "no"))


@dataclass(frozen=True)
class Option:
    """How a control is set up: what is taken unless somebody says otherwise, its type, and what it is for."""

    default: str
    kind: ChoiceOption | NumberOption | Name
    does: str


def chosen(dialect: str, options: Mapping[str, Option], said: Mapping[str, str]) -> dict[str, str]:
    """All options with their values; :class:`InputError` for one that does not exist or is not of its type."""
    values = {name: option.default for name, option in options.items()}
    for name, value in said.items():
        if name not in options:
            known = ", ".join(options) or "none"
            raise InputError(naming("settings"), f"not an option of {dialect}", found=repr(name), expected=known)
        kind = options[name].kind
        text = kind.text(value)
        if text is None:
            raise InputError(
                naming("settings"), f"{name} is not of its type", found=repr(value), expected=kind.expected
            )
        values[name] = text
    return values
