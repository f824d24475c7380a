"""Lists of angles in words, and the grid of directions that two of them make."""

from __future__ import annotations

import math
from collections.abc import Sequence

from stepgauge.errors import InputError, naming

MOST = 200_000
"""More directions than this are a slip of the step, not a wish."""
BOTH = naming("polar_deg", "azimuth_deg", words="{} and {}")
Angles = str | Sequence[float]
"""Degrees, or ``"90,80"`` and ``"0:360:10"`` (start:stop:step, the stop included), also mixed."""


def direction_grid(polar: Angles, azimuth: Angles) -> tuple[list[float], list[float]]:
    """Polar angles and azimuths in deg, an azimuth of 360 not beside 0; :class:`InputError` where they are none."""
    polars = parse_angles(polar, "polar_deg", 0.0, 180.0)
    azimuths = _once_around(parse_angles(azimuth, "azimuth_deg", -360.0, 360.0))
    if len(polars) * len(azimuths) > MOST:
        found = len(polars) * len(azimuths)
        raise InputError(BOTH, "too many directions", found=found, expected=f"at most {MOST}")
    return polars, azimuths


def parse_angles(text: Angles, name: str, low: float, high: float) -> list[float]:
    """The angles of a list, each once.

    Raises :class:`InputError` of the argument ``name`` for anything else and for angles outside ``low`` to ``high``.
    """
    text = text if isinstance(text, str) else ",".join(f"{float(angle):.12g}" for angle in text)
    angles = [angle for part in text.split(",")[:MOST] for angle in _expand(part.strip(), name)]
    if len(angles) > MOST:
        raise InputError(naming(name), "too many angles", found=len(angles), expected=f"at most {MOST}")
    for angle in angles:
        if not low <= angle <= high:
            raise InputError(
                naming(name), "angle out of range", found=f"{angle:g}", expected=f"{low:g} to {high:g} deg"
            )
    return list(dict.fromkeys(angles))


def _expand(part: str, name: str) -> list[float]:
    try:
        numbers = [float(number) for number in part.split(":")]
    except ValueError:
        numbers = []
    if not all(math.isfinite(number) for number in numbers) or len(numbers) not in (1, 3):
        raise InputError(
            naming(name), "not a list of angles", found=repr(part), expected="90,80 or start:stop:step in deg"
        )
    if len(numbers) == 1:
        return numbers
    start, stop, step = numbers
    if step == 0.0 or (stop - start) / step < 0.0:
        raise InputError(
            naming(name), "the steps lead nowhere", found=repr(part), expected="a step from start towards stop"
        )
    count = (stop - start) / step
    if count > MOST:
        raise InputError(naming(name), "too many angles", found=f"{count:.0f}", expected=f"at most {MOST}")
    return [round(start + i * step, 9) for i in range(int(count + 1e-9) + 1)]


def _once_around(azimuths: list[float]) -> list[float]:
    """Without a last 360 that repeats the first 0."""
    return [a for a in azimuths if a - 360.0 not in azimuths]
