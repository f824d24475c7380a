"""What no thermometer at a gauge or a scale reads: an input that is not connected shows 0, or jumps out of the room."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stepgauge.files.arrays import Array
from stepgauge.files.units import temperature_hint

TEMPERATURE_C = (-10.0, 60.0)
"""Temperatures of gauge and scales that may be, deg C."""
ROOM_C = (5.0, 45.0)
"""Where step gauges are used, deg C: lengths hold at 20 (ISO 1), shop floors reach from 5 to 45. Colder or warmer ones
are believed where a gauge comes to them as its mass lets it."""
NEAR_ZERO_K = 2.0
"""A gauge that is at 0.0 deg C by chance was within this of it before or after: the coarsest displays step by 1 K."""
JUMP_K = 5.0
"""From one probing to the next the mass of a gauge or a scale does not change by this."""


class NoTemperature(NamedTuple):
    """A row, counted from 0, that is no temperature: in words why, what was found and what was expected."""

    row: int
    why: str
    found: str
    expected: str = "the temperatures in deg C, or a recording without this column"


def no_temperature(value: Array, placement: NDArray[np.int64]) -> NoTemperature | None:
    """The first row of a column of gauge or scale that is no temperature, None where all may be.

    ``value``: deg C, ``placement``: numbers, both ``(n,)``.
    """
    outside = (value < TEMPERATURE_C[0]) | (value > TEMPERATURE_C[1])
    if outside.any():
        row = int(outside.argmax())
        low, high = TEMPERATURE_C
        expected = f"{low:g} to {high:g} deg C ({temperature_hint(float(value[row]))})"
        return NoTemperature(row, "is no temperature in deg C (K or F?)", f"{value[row]:g}", expected)
    return _zero(value) or _out_of_room(value, placement)


def _zero(value: Array) -> NoTemperature | None:
    """Exactly 0 with nothing near it: what an input without its thermometer shows."""
    zero = value == 0.0
    if not zero.any() or (np.abs(value[~zero]) < NEAR_ZERO_K).any():
        return None
    row = int(zero.argmax())
    beside = value[~zero]
    others = f", the others {beside.min():g} to {beside.max():g}" if beside.size else ""
    why = "is no temperature: exactly 0, as of a thermometer that is not connected"
    return NoTemperature(row, why, f"0 in {int(zero.sum())} of {len(value)} rows{others}")


def _out_of_room(value: Array, placement: NDArray[np.int64]) -> NoTemperature | None:
    """A jump of many kelvin from where a gauge is used to where it is not, or back: a lead that fails."""
    outside = (value < ROOM_C[0]) | (value > ROOM_C[1])
    if not outside.any():
        return None
    jumps = (np.abs(np.diff(value)) > JUMP_K) & (np.diff(placement) == 0) & (outside[1:] != outside[:-1])
    if not jumps.any():
        return None
    at = int(jumps.argmax())
    row, other = (at + 1, at) if outside[at + 1] else (at, at + 1)
    why = "is no temperature: no gauge and no scale changes so fast"
    return NoTemperature(row, why, f"{value[row]:g} and {value[other]:g} deg C from one probing to the next")
