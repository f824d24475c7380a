"""The series of lengths of ISO 10360-2:2009: E0, E150 with the stylus offset, and the length of normal expansion."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class LengthSeries:
    """A series: its symbol, how many positions and lengths it has, and what it is in words.

    ``least_lengths``: in each position. ``unconfirmed``: what could not be confirmed of it, for the report.
    """

    key: str
    symbol: str
    limit: str
    name: str
    positions: int
    least_lengths: int
    unconfirmed: str = ""


E0 = LengthSeries("e0", "E_0", "E_0,MPE", "errors of length measurement, stylus tip on the axis of the ram", 7, 5)
E150 = LengthSeries(
    "e150",
    "E_150",
    "E_150,MPE",
    "errors of length measurement with a stylus offset of 150 mm",
    2,
    5,
    "two positions, and their directions, are taken from secondary sources and are unconfirmed",
)
NORMAL = LengthSeries(
    "normal",
    "E_0",
    "E_0,MPE",
    "length of a gauge of normal expansion, beside the gauge of low expansion",
    1,
    1,
    "how long this length must be could not be confirmed",
)
