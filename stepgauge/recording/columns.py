"""Names of columns: which ones a recording knows, and which ones look like a slip of one that it knows.

A column that nobody knows is kept as a covariate. A slip in ``gauge_temperature_C`` would therefore drop the correction
of the temperature without a word, so a name that is nearly a known one is asked about.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

POSITION = ["x_mm", "y_mm", "z_mm"]
APPROACH = ["approach_i", "approach_j", "approach_k"]
REQUIRED = ["cycle", "face", *POSITION, *APPROACH]
SCALE_TEMPERATURES = tuple(f"scale_temperature_{axis}_C" for axis in "xyz")
SCALES_C = "scale_temperature_C"
"""Comment: the temperature of the scales that no column has, as the machine file states it."""
TEMPERATURES = ("gauge_temperature_C", *SCALE_TEMPERATURES)
OPTIONAL = ["placement", "time_s", "speed_mm_s", *TEMPERATURES]
COUNTS = ["placement", "cycle", "face"]
CORRECTED = "corrected_tip_radius_mm"
"""Comment: the tip radius, mm, for which the readings had been corrected; the rows are tip centres again."""
STYLUS = "stylus"
"""Number of the stylus of a probing: 1 is that of the machine file, also where the column is missing."""
KNOWN = (*REQUIRED, *OPTIONAL)
LARGEST_SLIP = 2
"""Letters typed wrong, left out or too many in a name of six letters or more; one in a shorter one."""
_UNITS = ("degc", "mm", "um", "in", "inch", "c", "k", "f", "s", "ms", "min", "h")
_SHORT = {"temp": "temperature", "temperatur": "temperature", "pos": "", "meas": ""}
_ANY_PLACE = ("temperature", "time", "speed", "placement", "cycle", "face", "scale temperature")
"""What a name says without its unit; ``temperature`` alone does not say whose."""


def near_miss(name: str, known: Iterable[str] = KNOWN) -> str | None:
    """The column among ``known`` (those that are not there) that a name is a slip of, or None.

    The name differs by case, by one or two letters, by its unit (``time_min``), by an abbreviation (``gauge_temp_C``),
    or names the quantity alone (``temperature_C``).
    """
    others = [one for one in known if one != name]
    stem = _stem(name)
    for one in others:
        if stem and (_stem(one) == stem or (one.startswith("gauge_temperature") and stem == "temperature")):
            return one
    folded = name.strip().casefold()
    near = {one: _distance(folded, one.casefold(), LARGEST_SLIP) for one in others}
    best = min(near, key=lambda one: near[one], default=None)
    if best is None or near[best] > (LARGEST_SLIP if len(best) > 6 else 1):
        return None
    return best


def _stem(name: str) -> str:
    """What a name says of a quantity, without units and abbreviations; empty where that is nothing of ours."""
    words = [word for word in re.split(r"[^a-z0-9]+", name.casefold()) if word]
    while len(words) > 1 and words[-1] in _UNITS:
        words.pop()
    stem = " ".join(_SHORT.get(word, word) for word in words).strip()
    return stem if stem in _ANY_PLACE or stem.endswith(" temperature") or " temperature " in f"{stem} " else ""


def _distance(a: str, b: str, most: int) -> int:
    """Edit distance with exchanged neighbours as one slip; anything above ``most`` is ``most + 1``."""
    if abs(len(a) - len(b)) > most:
        return most + 1
    before, row = list[int](), list(range(len(b) + 1))
    for i, letter in enumerate(a, 1):
        last, before, row = before, row, [i]
        for j, other in enumerate(b, 1):
            cost = min(before[j] + 1, row[j - 1] + 1, before[j - 1] + (letter != other))
            if i > 1 and j > 1 and letter == b[j - 2] and a[i - 2] == other:
                cost = min(cost, last[j - 2] + 1)
            row.append(cost)
    return min(row[-1], most + 1)
