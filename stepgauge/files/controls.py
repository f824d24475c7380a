"""Numbers and texts as controllers read them."""

from __future__ import annotations

import re
import unicodedata

SPELLED = str.maketrans(
    {"ä": "ae", "ö": "oe", "ü": "ue", "Ä": "Ae", "Ö": "Oe", "Ü": "Ue", "ß": "ss", "æ": "ae", "ø": "o"}
)
MOST_DECIMALS = 17
"""A double has no more significant digits."""


def fixed(value: float, decimals: int) -> str:
    """A number with a fixed count of decimals, without exponent and without a negative zero."""
    if not 0 <= decimals <= MOST_DECIMALS:
        raise ValueError(f"fixed({decimals}): 0 to {MOST_DECIMALS} decimals")
    text = f"{float(value):.{decimals}f}"
    return text.removeprefix("-") if float(text) == 0.0 else text


def signed(value: float, decimals: int) -> str:
    """As :func:`fixed`, with the sign that some controls want before every number."""
    text = fixed(value, decimals)
    return text if text.startswith("-") else f"+{text}"


def plain(text: object) -> str:
    """Text that every controller takes in a comment or a file name; letters with marks as one spells them without."""
    spelled = unicodedata.normalize("NFKD", str(text).translate(SPELLED))
    return re.sub(r"[^A-Za-z0-9 ._-]", "_", "".join(one for one in spelled if not unicodedata.combining(one)))
