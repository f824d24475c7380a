"""From readings to the errors of one machine axis by coordinate and sense of travel.

Sign: error = indicated minus true coordinate of the axis, um. A controller that adds the error to the position that it
commands to the scale (or takes it off what the scale reads) is right afterwards.

Every value of the table is a weighted sum of readings: interpolated between the places of its sense of travel, less the
value at the zero of the table. The weights carry the uncertainties as well. Of a gauge, fronts are probed along its
axis, backs against it, and a back is read one tip diameter farther; the tip diameter is therefore one more reading,
either given, or such that the mean reversal is 0, for readings cannot tell the one from the other.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from stepgauge.compensation.readings import AxisReadings
from stepgauge.errors import InputError, naming
from stepgauge.files.arrays import Array

Travel = Literal["both", "mean", "positive", "negative"]
Extend = Literal["none", "hold", "linear"]
LARGEST_TABLE = 5000


@dataclass(frozen=True)
class TableOptions:
    """What is asked for; lengths in mm, machine coordinates of the axis.

    ``travel``: the senses of travel that the table tells apart (``mean``: it does not). ``step_mm``: an even grid at
    whole multiples of the step; None: the places that were measured. ``range_mm``: low and high end; None: those of
    what was measured. ``extend``: beyond them refuse (``none``), hold the end value, or go on with the slope of the
    fitted line. ``zero_at_mm``: where the correction is zero (the reference point); None: the low end.
    """

    travel: Travel = "both"
    step_mm: float | None = None
    range_mm: tuple[float, float] | None = None
    extend: Extend = "none"
    zero_at_mm: float | None = None


@dataclass(frozen=True)
class CompensationTable:
    """Errors of an axis by indicated machine coordinate; all arrays of shape ``(n,)``, coordinates rising.

    ``positive_um``, ``negative_um``: indicated minus true when the axis travels in its positive, negative sense;
    ``u_...``: their standard uncertainties; ``from_positive``, ``from_negative``: whether that sense was measured
    around this place (else it follows the other one, or is an extension that was asked for). ``about``: what it was
    made from; ``notes``: what a person must know before it goes into a controller; ``reversal_known``: whether the mean
    reversal is in it, which no gauge tells from the size of a tip.
    """

    axis: str
    position_mm: Array
    positive_um: Array
    negative_um: Array
    u_positive_um: Array
    u_negative_um: Array
    from_positive: NDArray[np.bool_]
    from_negative: NDArray[np.bool_]
    zero_at_mm: float
    travel: Travel
    step_mm: float | None
    about: Mapping[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    reversal_known: bool = True

    def __len__(self) -> int:
        return len(self.position_mm)

    @property
    def mean_um(self) -> Array:
        """Mean of both senses of travel."""
        return (self.positive_um + self.negative_um) / 2.0

    @property
    def reversal_um(self) -> Array:
        """Positive minus negative travel: positive where the scale leads the table, that is backlash."""
        return self.positive_um - self.negative_um


def make_table(readings: AxisReadings, options: TableOptions) -> CompensationTable:
    """The error table of an axis.

    Raises
    ------
    InputError
        a sense of travel that was not measured, a range or a zero outside what was measured, a step that leaves fewer
        than two rows
    """
    position = _grid(readings, options)
    zero = float(position[0]) if options.zero_at_mm is None else options.zero_at_mm
    _check_inside(readings, np.array([zero]), options, "the zero of the table")
    senses = _senses(readings, options)
    rows = {sense: _rows(readings, position, sense, options) for sense in (1, -1)}
    level = np.mean([_rows(readings, np.array([zero]), sense, options) for sense in senses], axis=0)
    if options.travel != "both":
        merged = np.mean([rows[sense] for sense in senses], axis=0)
        rows = {1: merged, -1: merged}
    value = {sense: readings.combine(rows[sense] - level) for sense in rows}
    u = {sense: readings.uncertainty_um(rows[sense] - level, position - zero) for sense in rows}
    table = CompensationTable(
        readings.axis,
        position,
        value[1],
        value[-1],
        u[1],
        u[-1],
        readings.covers(position, 1),
        readings.covers(position, -1),
        zero,
        options.travel,
        options.step_mm,
        readings.about,
        reversal_known=readings.tip_um is not None,
    )
    return replace(table, notes=(*readings.notes, *_notes(table, readings, options)))


def _senses(readings: AxisReadings, options: TableOptions) -> list[int]:
    senses = {"both": [1, -1], "mean": [1, -1], "positive": [1], "negative": [-1]}[options.travel]
    for sense in senses:
        readings.require(sense)
    return senses


def _grid(readings: AxisReadings, options: TableOptions) -> Array:
    senses = _senses(readings, options)
    places = np.sort(np.concatenate([readings.coordinate_mm[readings.sense == sense] for sense in senses]))
    low, high = options.range_mm or (float(places[0]), float(places[-1]))
    if options.step_mm is None:
        inside = places[(places > low) & (places < high)]
        grid = np.unique(np.round([low, *inside, high], 6))
    else:
        first, last = np.ceil(low / options.step_mm - 1e-9), np.floor(high / options.step_mm + 1e-9)
        count = last - first + 1
        if count > LARGEST_TABLE:
            raise InputError(
                naming("step_mm"), "the table is too long", found=f"{count:.0f} rows", expected="a larger step"
            )
        grid = np.arange(first, last + 1) * options.step_mm + 0.0  # no negative zero
    if len(grid) < 2:
        raise InputError(
            naming("step_mm" if options.step_mm else "range"),
            "fewer than two rows in the table",
            found=f"{len(grid)} in {low:.3f} to {high:.3f} mm",
            expected="a smaller step, or a longer range",
        )
    _check_inside(readings, grid, options, "the range of the table")
    return np.asarray(grid, float)


def _check_inside(readings: AxisReadings, x: Array, options: TableOptions, what: str) -> None:
    low, high = _measured_range(readings, options)
    if options.extend == "none" and (x.min() < low - 1e-6 or x.max() > high + 1e-6):
        raise InputError(
            readings.path,
            f"{what} is outside what was measured on {readings.axis}",
            found=f"{x.min():.3f} to {x.max():.3f} mm" if len(x) > 1 else f"{x[0]:.3f} mm",
            expected=naming("extend", words=f"{low:.3f} to {high:.3f} mm, or {{}} hold or linear"),
        )


def _measured_range(readings: AxisReadings, options: TableOptions) -> tuple[float, float]:
    senses = _senses(readings, options)
    places = np.concatenate([readings.coordinate_mm[readings.sense == sense] for sense in senses])
    return float(places.min()), float(places.max())


def _rows(readings: AxisReadings, x: Array, sense: int, options: TableOptions) -> Array:
    """Weights of the readings in the error at ``x`` for a sense of travel."""
    if not (readings.sense == sense).any():
        return _rows(readings, x, -sense, options)
    own, other = readings.range_mm(sense), (readings.range_mm(-sense) if (readings.sense == -sense).any() else None)
    inside = np.clip(x, *own)
    rows = readings.weights(inside, sense)
    if other is None:
        return rows + _extension(readings, x, own, sense, options)
    # Where only the other sense was measured it is followed, and the reversal of the end is kept.
    followed = np.clip(x, *other)
    outside = inside != x
    rows[outside] += (readings.weights(followed, -sense) - readings.weights(np.clip(inside, *other), -sense))[outside]
    whole = (min(own[0], other[0]), max(own[1], other[1]))
    return rows + _extension(readings, x, whole, sense, options)


def _extension(
    readings: AxisReadings, x: Array, measured: tuple[float, float], sense: int, options: TableOptions
) -> Array:
    """What is added beyond the ends: nothing, or the fitted slope times the distance."""
    beyond = x - np.clip(x, *measured)
    slope = readings.slope_weights(sense) if options.extend == "linear" else 0.0 * readings.slope_weights(sense)
    return np.asarray(beyond[:, None] * slope)


def _notes(table: CompensationTable, readings: AxisReadings, options: TableOptions) -> list[str]:
    notes = [readings.reversal_note] if options.travel == "both" and readings.reversal_note else []
    low, high = _measured_range(readings, options)
    x = table.position_mm
    beyond = (x < low - 1e-6) | (x > high + 1e-6)
    if beyond.any():
        how = "held at the end value" if options.extend == "hold" else "continued with the slope of the fitted line"
        where = f"{beyond.sum()} of {len(x)} rows lie outside {low:.3f} to {high:.3f} mm"
        notes.append(f"extrapolated: {where} and are {how}; how wrong they are there is not in the uncertainty")
    if options.travel in ("both", "mean"):
        one = ((~table.from_positive | ~table.from_negative) & ~beyond).sum()
        if one:
            notes.append(
                f"at {one} of {len(x)} rows near the ends only one sense of travel was measured; the other follows it"
                " with the reversal of the nearest place where both were"
            )
    if options.travel == "mean":
        notes.append(f"mean of both senses; the mean reversal, not in the table, is {readings.mean_reversal_text(x)}")
    notes.append(
        f"beyond {x[0]:.3f} and {x[-1]:.3f} mm a controller holds the end values: outside, nothing is corrected"
    )
    return notes
