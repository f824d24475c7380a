"""Numbers as a report prints them: fixed decimals, a true minus sign, a dash where nothing is defined."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from decimal import Decimal

UNDEFINED = "–"
FIGURE_SPACE, POINT_SPACE = "\u2007", "\u2008"
"""As wide as a digit, and as a point."""


def number(value: float | None, decimals: int) -> str:
    """A number with a fixed count of decimals; never a negative zero; a dash for None and NaN."""
    if value is None or math.isnan(value):
        return UNDEFINED
    text = f"{value:.{decimals}f}"
    return text.removeprefix("-") if float(text) == 0.0 else text.replace("-", "−")


def decimals(value: float, digits: int) -> int:
    """How many decimals show that many significant digits of a number; 0 for large ones, and for 0."""
    return max(digits - 1 - math.floor(math.log10(abs(value))), 0) if value else 0


def rounded(value: float, digits: int, plus: bool = False) -> str:
    """A number to some significant digits as one reads it out: 140, never 1.4e+02; ``plus``: with a sign if positive.

    Zeros at the end behind the point are left out. One below :data:`LEAST_PLAIN` keeps its exponent.
    """
    sign = "+" if plus else ""
    text = f"{value:{sign}.{digits}g}"
    return f"{Decimal(text):{sign}f}" if "e" in text and abs(value) >= LEAST_PLAIN else text


LEAST_PLAIN = 1e-6
"""A smaller number is nothing in any unit of a report, and its zeros would fill the line."""


def printed(text: str) -> str:
    """Text as it is set in print (ISO 80000-1): 0.3 µm for 0.3 um, °C, a minus sign before a number.

    A unit stands behind a number or a bracket: elsewhere the letters may be a word of some language, or a name.
    """
    return ANGLE.sub("°", DEGREES.sub("°C", MINUS.sub("−", MICRO.sub("µ", PLUS_MINUS.sub("±", text)))))


def printed_unit(unit: str) -> str:
    """A unit alone as it is set in print: µm/m for um/m, µrad for urad, 10⁻⁶ for 1e-6."""
    return MICRO_UNIT.sub("µ", unit).replace("1e-6", "10⁻⁶")


ANGLE = re.compile(r"(?<=\d) deg\b(?! C)")
DEGREES = re.compile(r"(?<=\d )deg C\b")
MICRO = re.compile(r"(?:(?<=\d )|(?<=\())u(?=(?:m|rad)\b)")
MICRO_UNIT = re.compile(r"(?<![^\W\d_])u(?=(?:m|rad|in)\b)")
MINUS, PLUS_MINUS = re.compile(r"(?<![^\s(])-(?=\d)"), re.compile(r"\+-(?=\d)")


def uncertain(value: float | None, expanded: float | None, most: int = 5) -> tuple[str, str]:
    """A value and its expanded uncertainty as a certificate states them.

    The uncertainty has two significant digits and the value is rounded to the same decimal place (GUM 7.2.6; ILAC-P14),
    with at most ``most`` decimals. Rounding never takes more than 5 % off the uncertainty: it is then rounded up. Where
    the uncertainty is zero or unknown, the value has two decimals.
    """
    if expanded is None or math.isnan(expanded) or expanded <= 0.0:
        return number(value, 2), number(expanded, 2)
    place = math.floor(math.log10(float(f"{expanded:.1e}")))
    step = min(1 - place, most)
    near = round(expanded, step)
    sure = near if near >= LEAST_LEFT * expanded else math.ceil(expanded * 10.0**step) / 10.0**step
    return number(None if value is None else round(value, step), max(step, 0)), number(sure, max(step, 0))


def uncertainty(value: float | None) -> str:
    """A standard or an expanded uncertainty alone, to two significant digits (GUM 7.2.6)."""
    return uncertain(None, value)[1]


def significant(value: float | None, digits: int = 3) -> str:
    """A number to some significant digits with the zeros at its end, without an exponent where it is not usual."""
    if value is None:
        return "undefined"
    if value == 0.0 or 1e-3 <= abs(value) < 1e6:
        return f"{value:.{decimals(value, digits) if value else 0}f}"
    return f"{value:.{digits - 1}e}"


LEAST_LEFT = 0.95
"""Share of an expanded uncertainty that rounding must leave (EA-4/02 M)."""


def aligned(texts: Sequence[str]) -> list[str]:
    """Numbers of a column with their decimal points below each other: filled up with spaces as wide as a digit."""
    tails = [text.partition(".")[2] if text[-1:].isdigit() else None for text in texts]
    most = max((len(tail) for tail in tails if tail is not None), default=0)
    point = [POINT_SPACE if most and not tail else "" for tail in tails]
    return [
        text if tail is None else text + gap + FIGURE_SPACE * (most - len(tail))
        for text, tail, gap in zip(texts, tails, point, strict=True)
    ]


def quantity(value: float | None, decimals: int, unit: str) -> str:
    """A number with its unit (degrees without a space); a dash alone where it is not defined."""
    text = number(value, decimals)
    return text if text == UNDEFINED else f"{text}{'' if unit == '°' else ' '}{unit}"


def percent(share: float, decimals: int = 0) -> str:
    """A share in percent, with the space that ISO 80000-1 (7.1.4) has before the symbol: 66 %."""
    return f"{100.0 * share:.{decimals}f} %"


def plural(thing: str, count: int) -> str:
    """The name of so many things: cycle, cycles."""
    return thing if count == 1 else f"{thing}s"


def counted(count: int, thing: str) -> str:
    """So many things with their name: 1 cycle, 3 cycles."""
    return f"{count} {plural(thing, count)}"


def number_ranges(numbers: Iterable[int]) -> str:
    """``1, 2, 3, 7`` as ``1 to 3, 7``; of two neighbours both are named."""
    runs: list[list[int]] = []
    for value in numbers:
        if runs and value == runs[-1][-1] + 1:
            runs[-1].append(value)
        else:
            runs.append([value])
    return ", ".join(f"{run[0]} to {run[-1]}" if len(run) > 2 else ", ".join(map(str, run)) for run in runs)


def vector(values: Iterable[float], decimals: int, unit: str = "") -> str:
    """Components in brackets, with their unit."""
    text = "(" + ", ".join(number(value, decimals) for value in values) + ")"
    return f"{text} {unit}".strip()


KEPT = "\n\u00a0"


def make_sentence(text: str, end: str = ".") -> str:
    """A note as a sentence: a capital letter first, a full stop last."""
    return f"{text[:1].upper()}{text[1:]}{end}"


def clean(text: object) -> str:
    """Text a page can show: control characters become spaces, lone surrogates question marks.

    Line breaks stay, and the spaces inside of numbers, at which no line is broken.
    """
    whole = str(text).encode("utf-8", "replace").decode("utf-8").replace("\r\n", "\n").replace("\r", "\n")
    return "".join(mark if mark in KEPT or mark.isprintable() else " " for mark in whole).strip()
