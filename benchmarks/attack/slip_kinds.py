"""Kinds of slips of a hand: in a table of readings, in its comments, in the files of a gauge.

Each changes a world in place and says what it did. What no data can show (``docs/readings.md``) is not among them.
"""

from __future__ import annotations

import datetime
import random
import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

Slip = Callable[[Any, random.Random], str]
Kinds = dict[str, Slip]


def _row(world: Any, pick: random.Random) -> int:
    return pick.randrange(len(world.table))


def cell(column: str, change: Callable[[float, random.Random], float]) -> Slip:
    """One value of a column."""

    def slip(world: Any, pick: random.Random) -> str:
        row = _row(world, pick)
        old = float(world.table.loc[row, column])
        new = change(old, pick)
        world.table[column] = world.table[column].astype(float)
        world.table.loc[row, column] = new
        return f"{column} of row {row}: {old:g} -> {new:g}"

    return slip


def whole(column: str, change: Callable[[np.ndarray], np.ndarray]) -> Slip:
    """A whole column."""

    def slip(world: Any, pick: random.Random) -> str:
        world.table[column] = change(world.table[column].to_numpy(float))
        return f"{column}, all rows"

    return slip


def part(column: str, change: Callable[[np.ndarray], np.ndarray]) -> Slip:
    """A column from some row on."""

    def slip(world: Any, pick: random.Random) -> str:
        first = pick.randrange(len(world.table) // 4, 3 * len(world.table) // 4)
        values = world.table[column].to_numpy(float).copy()
        values[first:] = change(values[first:])
        world.table[column] = values
        return f"{column} from row {first} on"

    return slip


def digits(low: float, high: float) -> Callable[[float, random.Random], float]:
    """A wrong digit: off by a size between two, either way."""
    return lambda old, pick: old + pick.uniform(low, high) * pick.choice((-1.0, 1.0))


def _decimal(old: float, pick: random.Random) -> float:
    return old * pick.choice((0.1, 10.0, 0.01))


def twice(world: Any, pick: random.Random) -> str:
    """A row that is there twice."""
    row = _row(world, pick)
    world.table = world.table.iloc[[*range(row + 1), *range(row, len(world.table))]].reset_index(drop=True)
    return f"row {row} twice"


def exchanged(columns: list[str]) -> Slip:
    """Readings of two neighbouring rows, exchanged."""

    def slip(world: Any, pick: random.Random) -> str:
        row = pick.randrange(len(world.table) - 2)
        world.table.loc[[row, row + 2], columns] = world.table.loc[[row + 2, row], columns].to_numpy()
        return f"rows {row} and {row + 2} exchanged"

    return slip


def copied(columns: list[str], by: str) -> Slip:
    """All cycles are the first one."""

    def slip(world: Any, pick: random.Random) -> str:
        groups = [rows.index for _, rows in world.table.groupby(by)]
        for rows in groups[1:]:
            world.table.loc[rows, columns] = world.table.loc[groups[0], columns].to_numpy()
        return "all cycles copied"

    return slip


def one_copied(columns: list[str], by: str) -> Slip:
    """One cycle is another one."""

    def slip(world: Any, pick: random.Random) -> str:
        groups = [rows.index for _, rows in world.table.groupby(by)]
        one, other = pick.sample(range(len(groups)), 2)
        world.table.loc[groups[one], columns] = world.table.loc[groups[other], columns].to_numpy()
        return f"cycle {one + 1} is cycle {other + 1}"

    return slip


def tilted(world: Any, pick: random.Random) -> str:
    """The gauge lies some mrad off the axis of the approaches."""
    mrad = pick.uniform(4.0, 10.0)
    x = world.table["x_mm"] - world.table["x_mm"].iloc[0]
    world.table["y_mm"] += mrad * 1e-3 * x
    world.table["x_mm"] -= (mrad * 1e-3) ** 2 / 2.0 * x
    return f"tilted by {mrad:.1f} mrad"


def drifting(world: Any, pick: random.Random) -> str:
    """A drift with time."""
    rate = pick.uniform(20.0, 80.0) * pick.choice((-1, 1))
    world.table["x_mm"] += rate * 1e-6 * world.table["time_s"]
    return f"{rate:.0f} nm/s"


def comment(key: str, value: str | None) -> Slip:
    """A comment of the recording changed, or lost."""

    def slip(world: Any, pick: random.Random) -> str:
        if value is None:
            world.comments.pop(key, None)
        else:
            world.comments[key] = value
        return f"{key}: {value}"

    return slip


def position(world: Any, pick: random.Random) -> str:
    """A wrong digit in the certificate's table."""
    face, um = pick.randrange(1, 24), pick.uniform(20.0, 150.0) * pick.choice((-1, 1))
    positions = world.gauge.position_mm.copy()
    positions[face] += um * 1e-3
    world.gauge = replace(world.gauge, position_mm=positions)
    return f"face {face + 1} by {um:+.0f} um"


def expansion(world: Any, pick: random.Random) -> str:
    """Another expansion than the material's."""
    value = pick.choice((0.0, 23e-6, 115e-6, 1.15e-6))
    world.gauge = replace(world.gauge, table=world.gauge.table.model_copy(update={"expansion_per_K": value}))
    return f"expansion {value:g}"


def calibrated(world: Any, pick: random.Random) -> str:
    """A date of calibration in another century, or after the measurement."""
    day = pick.choice((datetime.date(1999, 3, 2), datetime.date(2006, 3, 2), datetime.date(2026, 8, 1)))
    world.gauge = replace(world.gauge, certificate=world.gauge.certificate.model_copy(update={"date": day}))
    return f"calibrated {day}"


def moved_row(column: str, by: int) -> Slip:
    """A count that is off, of one row."""

    def slip(world: Any, pick: random.Random) -> str:
        row = _row(world, pick)
        world.table.loc[row, column] += by
        return f"{column} of row {row} by {by:+d}"

    return slip


def dropped(world: Any, pick: random.Random) -> str:
    """Rows that were lost."""
    row = _row(world, pick)
    world.table = world.table.drop(index=range(row, min(row + 3, len(world.table)))).reset_index(drop=True)
    return f"rows {row} to {row + 2} lost"


def _element(xml: str, tag: str, within: str) -> tuple[int, int]:
    """Where the text of the first element of a name stands, behind the words by which it is found."""
    found = re.compile(rf"<{tag}>([^<]*)</{tag}>").search(xml, xml.index(within) if within else 0)
    assert found is not None
    return found.span(1)


def number_of(tag: str, change: Callable[[float, random.Random], float], within: str = "") -> Slip:
    """One number of an element of an XML certificate; ``within``: text before it, by which it is found."""

    def slip(world: Any, pick: random.Random) -> str:
        first, last = _element(world.xml, tag, within)
        numbers = world.xml[first:last].split()
        place = pick.randrange(min(1, len(numbers) - 1), len(numbers))
        old = float(numbers[place])
        numbers[place] = f"{change(old, pick):.9g}"
        world.xml = world.xml[:first] + " ".join(numbers) + world.xml[last:]
        return f"{tag} {place}: {old:g} -> {numbers[place]}"

    return slip


def all_of(tag: str, change: Callable[[float], float], within: str = "") -> Slip:
    """All numbers of an element."""

    def slip(world: Any, pick: random.Random) -> str:
        first, last = _element(world.xml, tag, within)
        text = " ".join(f"{change(float(one)):.9g}" for one in world.xml[first:last].split())
        world.xml = world.xml[:first] + text + world.xml[last:]
        return f"{tag}, all"

    return slip


def words(old: str, new: str) -> Slip:
    """Other words in an XML certificate, where they stand last."""

    def slip(world: Any, pick: random.Random) -> str:
        assert old in world.xml, old
        before, _, behind = world.xml.rpartition(old)
        world.xml = before + new + behind
        return f"{old} -> {new}"

    return slip


def exchanged_positions(world: Any, pick: random.Random) -> str:
    """Two neighbouring positions, exchanged."""
    first, last = _element(world.xml, _LIST, _MEASURED)
    numbers = world.xml[first:last].split()
    place = pick.randrange(1, len(numbers) - 1)
    numbers[place], numbers[place + 1] = numbers[place + 1], numbers[place]
    world.xml = world.xml[:first] + " ".join(numbers) + world.xml[last:]
    return f"positions {place} and {place + 1}"


_MEASURED = "basic_measuredValue"
_EXPANSION, _LIST, _U = "stepgauge_expansion", "si:valueXMLList", "si:uncertaintyXMLList"
CERTIFICATE: Kinds = {
    "a digit of a position": number_of(_LIST, digits(0.02, 0.15), _MEASURED),
    "a large digit of a position": number_of(_LIST, digits(0.5, 90.0), _MEASURED),
    "decimal point of a position": number_of(_LIST, lambda old, pick: _decimal(old or 1.0, pick), _MEASURED),
    "sign of a position": number_of(_LIST, lambda old, _: -(old or 1.0), _MEASURED),
    "positions exchanged": exchanged_positions,
    "an uncertainty": number_of(_U, lambda old, pick: old * pick.choice((10.0, 100.0, 0.0)), _MEASURED),
    "uncertainties of zero": all_of(_U, lambda _: 0.0, _MEASURED),
    "uncertainties in another unit": all_of(_U, lambda u: 1e3 * u, _MEASURED),
    "unit of the positions": words("\\milli\\metre</si:unitXMLList>", "\\metre</si:unitXMLList>"),
    "coverage factor": all_of("si:coverageFactorXMLList", lambda _: 20.0),
    "end before the beginning": words("2026-03-02</dcc:endPerf", "2025-03-02</dcc:endPerf"),
    "another century": words("2026-03-02</dcc:endPerf", "2126-03-02</dcc:endPerf"),
    "expansion": number_of("si:value", lambda old, pick: old * pick.choice((0.1, 10.0, 2.0, 0.0)), _EXPANSION),
    "reference temperature": number_of("si:value", lambda *_: 2.0, "stepgauge_referenceTemperature"),
    "width of a block": number_of("si:value", lambda *_: 0.02, "stepgauge_blockWidth"),
}
POSITION = ["x_mm", "y_mm", "z_mm"]
_F = lambda c: c * 1.8 + 32.0  # noqa: E731
GAUGE_TABLE: Kinds = {
    "a digit of a coordinate": cell("x_mm", digits(0.02, 0.45)),
    "a large digit": cell("x_mm", digits(0.5, 90.0)),
    "decimal point": cell("x_mm", _decimal),
    "sign": cell("x_mm", lambda old, _: -old),
    "sign of an approach": cell("approach_i", lambda old, _: -old),
    "across": cell("y_mm", digits(40.0, 300.0)),
    "row twice": twice,
    "rows exchanged": exchanged(POSITION),
    "rows lost": dropped,
    "cycles copied": copied(POSITION, "cycle"),
    "a cycle copied": one_copied(POSITION, "cycle"),
    "face off by two": moved_row("face", 2),
    "inch": whole("x_mm", lambda x: x / 25.4),
    "micrometres": whole("x_mm", lambda x: x * 1e3),
    "half in inch": part("x_mm", lambda x: x / 25.4),
    "rounded": whole("x_mm", lambda x: np.round(x, 2)),
    "frozen": part("x_mm", lambda x: np.full_like(x, x[0])),
    "tilt": tilted,
    "drift": drifting,
    "gauge temperature decimal": whole("gauge_temperature_C", lambda c: c / 10.0),
    "gauge temperature off": whole("gauge_temperature_C", lambda c: c + 10.0),
    "gauge temperature in F": whole("gauge_temperature_C", _F),
    "gauge temperature in K": whole("gauge_temperature_C", lambda c: c + 273.15),
    "gauge temperature zero": part("gauge_temperature_C", lambda c: 0.0 * c),
    "one gauge temperature": cell("gauge_temperature_C", digits(3.0, 20.0)),
    "half of the gauge temperatures": part("gauge_temperature_C", lambda c: c + 8.0),
}
GAUGE_FILE: Kinds = {
    "certified position": position,
    "expansion": expansion,
    "date of calibration": calibrated,
    "date of measurement": comment("measured_at", "2019-05-04"),
    "serial number": comment("gauge_serial", "SG-420-007"),
}
AXIS: Kinds = {
    "a digit": cell("reading", digits(0.01, 0.4)),
    "a large digit": cell("reading", digits(0.5, 90.0)),
    "decimal point": cell("reading", lambda old, pick: _decimal(old or 1.0, pick)),
    "sign": cell("reading", lambda old, _: -(old or 3.0)),
    "deviations in mm": whole("reading", lambda x: np.round(x / 50.0) * 50.0 + (x - np.round(x / 50.0) * 50.0) * 1e-3),
    "deviations in um": whole("reading", lambda x: np.round(x / 50.0) * 50.0 + (x - np.round(x / 50.0) * 50.0) * 1e3),
    "positions as deviations": whole("reading", lambda x: np.round(x / 50.0) * 50.0 + x * 1e-3),
    "inch": whole("reading", lambda x: x / 25.4),
    "metres": whole("reading", lambda x: x * 1e-3),
    "row twice": twice,
    "rows exchanged": exchanged(["reading"]),
    "runs copied": copied(["reading"], "cycle"),
    "a run copied": one_copied(["reading"], "cycle"),
    "frozen": part("reading", lambda x: np.full_like(x, x[0])),
    "rounded": whole("reading", lambda x: np.round(x, 2)),
    "sign of all from a row on": part("reading", lambda x: 2.0 * np.round(x / 50.0) * 50.0 - x),
    "a wrong run": moved_row("cycle", 1),
    "a thermometer not connected": part("room_C", lambda c: 0.0 * c),
    "room in K": part("room_C", lambda c: c + 273.15),
    "room in F": whole("room_C", _F),
    "room 9999": cell("room_C", lambda *_: 9999.0),
    "room decimal": cell("room_C", _decimal),
}
SPHERE: Kinds = {
    "a digit": lambda world, pick: _outwards(world, pick),
    "a large digit": cell("z_mm", digits(0.5, 20.0)),
    "decimal point": cell("y_mm", _decimal),
    "sign": cell("x_mm", lambda old, _: -old),
    "row twice": twice,
    "rows exchanged": exchanged(["x_mm"]),
    "rounded to 0.1 mm": lambda world, pick: _rounded(world, 1),
    "rounded to 0.01 mm": lambda world, pick: _rounded(world, 2),
    "an exact sphere": lambda world, pick: _exact(world),
    "points copied": lambda world, pick: _points_copied(world, pick),
    "inch": lambda world, pick: _scaled(world, 1.0 / 25.4),
    "one coordinate in um": whole("y_mm", lambda x: x * 1e3),
    "sign of an approach": cell("approach_k", lambda old, _: -old + 0.02),
    "approaches are normals": lambda world, pick: _turned(world),
}


def _outwards(world: Any, pick: random.Random) -> str:
    """Of the coordinate that points out of the sphere most: of another the data show little, and it moves little."""
    row, um = _row(world, pick), pick.uniform(50.0, 400.0) * pick.choice((-1.0, 1.0))
    normal = world.table.loc[row, ["approach_i", "approach_j", "approach_k"]].to_numpy(float)
    column = POSITION[int(np.abs(normal).argmax())]
    world.table.loc[row, column] += um * 1e-3
    return f"{column} of row {row} by {um:+.0f} um"


def _rounded(world: Any, decimals: int) -> str:
    world.table[POSITION] = world.table[POSITION].round(decimals)
    return f"{decimals} decimals"


def _exact(world: Any) -> str:
    world.table[POSITION] = np.array([1.0, 2.0, 3.0]) - 15.5 * world.table[["approach_i", "approach_j", "approach_k"]]
    return "computed points"


def _points_copied(world: Any, pick: random.Random) -> str:
    rows = pick.sample(range(len(world.table)), 8)
    world.table.loc[rows[4:]] = world.table.loc[rows[:4]].to_numpy()
    return f"points {rows}"


def _scaled(world: Any, by: float) -> str:
    world.table[POSITION] *= by
    return f"times {by:g}"


def _turned(world: Any) -> str:
    world.table[["approach_i", "approach_j", "approach_k"]] *= -1.0
    return "turned"


CHANNELS: Kinds = {
    "a digit": cell("x1_um", digits(5.0, 90.0)),
    "decimal point": cell("x1_um", lambda old, _: 10.0 * (old + 1.0)),
    "millimetres": whole("x1_um", lambda x: np.round(x * 1e-3, 6)),
    "nanometres": whole("x1_um", lambda x: x * 1e3),
    "millimetres from a row on": part("x1_um", lambda x: x * 1e-3),
    "frozen": part("x1_um", lambda x: np.full_like(x, x[0])),
    "saturated": whole("y1_um", lambda x: np.clip(x, -0.4 * np.ptp(x), 0.3 * np.ptp(x))),
    "sensor fails": part("y1_um", lambda x: np.full_like(x, 9999.0)),
    "zeros": part("x1_um", lambda x: 0.0 * x),
    "channel copied": lambda world, pick: _channel(world, 1.0),
    "channel copied and turned": lambda world, pick: _channel(world, -1.0),
    "first reading": lambda world, pick: _first(world, pick),
    "rows copied": lambda world, pick: _block(world, pick),
    "row twice": twice,
    "rows lost": dropped,
    "room -273.15": cell("room_C", lambda *_: -273.15),
    "room 9999": cell("room_C", lambda *_: 9999.0),
    "room zero": part("room_C", lambda c: 0.0 * c),
    "room in F": part("room_C", _F),
    "room decimal": cell("room_C", lambda old, _: old / 10.0),
    "time in minutes": whole("time_s", lambda t: t / 60.0),
}


def _channel(world: Any, sign: float) -> str:
    world.table["y1_um"] = sign * world.table["x1_um"]
    return "y1 is x1"


def _first(world: Any, pick: random.Random) -> str:
    world.table.loc[0, "x1_um"] += pick.uniform(10.0, 80.0)
    return "first reading off"


def _block(world: Any, pick: random.Random) -> str:
    first = pick.randrange(40, 200)
    columns = ["x1_um", "y1_um", "room_C"]
    world.table.loc[first : first + 29, columns] = world.table.loc[first - 40 : first - 11, columns].to_numpy()
    return f"rows {first} to {first + 29}"
