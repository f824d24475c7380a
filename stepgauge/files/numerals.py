"""Text to number, once for all readers: plain numbers of programs and tables, and those of spreadsheets."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

_PLAIN = re.compile(r"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
LONGEST_NUMBER = 400
"""Characters beyond which a cell is no number that anybody measured."""
_DIGITS = re.compile(r"[0-9.,]+")
_EXPONENT = re.compile(r"[eEdD][-+]?[0-9]+$")
_FORTRAN = re.compile(r"(?<=[0-9.,])[dD](?=[-+][0-9]{1,3}$)")
_MINUS_BEHIND = re.compile(r"([0-9.,' ]*[.,][0-9]+)-")
"""``0.53-``, as commercial programs write it; ``1-`` without a decimal may be a name."""
_SPACES = dict.fromkeys(map(ord, "\u00a0\u2009\u202f"), " ")
_MINUS = {ord("\u2212"): "-", ord("\u2013"): "-"}


def number(text: str) -> float:
    """A decimal number with a point; NaN where the text is none (as ``nan``, ``inf``, ``1_000``, ``1e999``)."""
    value = float(text) if len(text) <= LONGEST_NUMBER and _PLAIN.fullmatch(text) else math.nan
    return value if math.isfinite(value) else math.nan


@dataclass(frozen=True)
class Numerals:
    """How a spreadsheet writes its numbers; ``decimal`` is ``"."`` or ``","``, the other mark groups thousands."""

    decimal: str

    def number(self, text: str) -> float:
        """The number of a cell; NaN where the cell is none, or its thousands are not in groups of three."""
        if len(text) > LONGEST_NUMBER:
            return math.nan
        plain = text if self.decimal == "." else text.replace(",", ".") if "." not in text else ""
        if _PLAIN.fullmatch(plain):
            return _measured(number(plain))
        text = _MINUS_BEHIND.sub(r"-\1", _FORTRAN.sub("e", tidy(text)))
        mark = "," if self.decimal == "." else "."
        whole, point, rest = text.partition(self.decimal)
        sign, digits = re.fullmatch(r"(?s)([-+]?)(.*)", whole).groups()  # type: ignore[union-attr]
        first, three = "[1-9][0-9]{0,2}", "[0-9]{3}"
        if re.fullmatch(rf"{first}(?:{re.escape(mark)}{three})+|{first}(?:[ ']{three})+", digits):
            digits = re.sub(r"[ ',.]", "", digits)
        return _measured(number(sign + digits + ("." if point else "") + rest))


LARGEST = 1e100
"""No cell of a measurement holds a larger number, in any unit; products of such numbers would overflow."""


def _measured(value: float) -> float:
    return value if abs(value) <= LARGEST else math.nan


def tidy(text: str) -> str:
    """A cell without the spaces around it, with plain spaces and minus signs inside."""
    return text.translate(_SPACES).translate(_MINUS).strip()


@lru_cache(20_000)
def looks_numeric(text: str) -> bool:
    """Whether a cell is a number in one of the two ways of writing."""
    return math.isfinite(Numerals(".").number(text)) or math.isfinite(Numerals(",").number(text))


def decimal_mark(cells: Sequence[str]) -> str | None:
    """The decimal mark that the cells of a table prove, or None where ``1,234`` may be both.

    A mark is a decimal one where it cannot group thousands: not three digits behind it, a zero alone or nothing before
    it, or behind the other mark; it groups thousands where it stands twice in a number. Points alone are decimal ones
    unless something proves the contrary: only a comma can be doubtful.
    """
    proof, doubt = set[str](), False
    if not any("," in cell or cell.count(".") > 1 for cell in cells):
        return "."
    for cell in cells:
        if len(cell) > LONGEST_NUMBER:
            continue
        text = _EXPONENT.sub("", tidy(cell)).strip("+-").replace(" ", "").replace("'", "")
        marks = [mark for mark in text if mark in ".,"]
        if not marks or not _DIGITS.fullmatch(text) or (len(marks) > 1 and not looks_numeric(text)):
            continue
        before, _, after = text.rpartition(marks[-1])
        if len(set(marks)) == 2:
            proof.add(marks[-1])
        elif len(marks) > 1:
            proof.add("," if marks[0] == "." else ".")
        elif len(after) != 3 or before in ("", "0") or len(before) > 3:
            proof.add(marks[0])
        else:
            doubt |= marks[0] == ","
    if len(proof) == 1:
        return proof.pop()
    return None if doubt or proof else "."
