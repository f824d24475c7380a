"""Readings in the order in which they were taken -> a recording of an axis, a spot or distances.

Whether a column holds readings or deviations shows in its slope against the targets, one or nought. Units that no
header states are not guessed: readings have the unit of their targets, anything else is asked for.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from stepgauge.axis.order import ORDER, STATED
from stepgauge.axis.recording import OWN, STATIONS, AxisRecording, places_of
from stepgauge.axis.units import BASE, AxisUnits, base_of, plain_name
from stepgauge.conditions.axis import LARGEST, SMALLEST, is_unlikely
from stepgauge.errors import InputError, naming
from stepgauge.files.arrays import Array
from stepgauge.files.units import ANGLE_DEG, LENGTH_MM, Unit, find_unit, unit_hint
from stepgauge.importing.axis.faces import check_names
from stepgauge.importing.axis.long import Long
from stepgauge.importing.axis.sides import check_ways, ways_into
from stepgauge.importing.axis.targets import Targets
from stepgauge.importing.axis.travel import ReadingOrder, cycles_of_repeats, travel_of_order
from stepgauge.importing.tables.columns import DEVIATIONS, Role
from stepgauge.importing.tables.grid import Table
from stepgauge.importing.tables.questions import Decisions, QuestionAnswer
from stepgauge.importing.tables.vocabulary import WORDS, says, words_of

UNIT_RATIOS = [a / b for units in (LENGTH_MM, ANGLE_DEG) for a in units.values() for b in units.values() if a != b]
NEAR_ONE = min(abs(ratio - 1.0) for ratio in UNIT_RATIOS) / 2.0
"""Slope of readings against targets: within this of one.

Half of the way to the nearest ratio of two units (gon and deg, 0.9), so that no wrong unit is taken for a scale error.
"""
NEAR_NOUGHT = LENGTH_MM["mm"] / LENGTH_MM["inch"] / 2.0
"""Slope of deviations: within this of nought.

Half of what readings in inch of targets in mm have, 0.039. A smaller ratio, as um for mm, may be a deviation's slope as
well: the unit of the deviations is then asked for.
"""
MOST_UM_PER_MM = 0.1 / LENGTH_MM["um"] * LENGTH_MM["mm"]
"""Slope of deviations in um of targets in mm: an axis that is off by a tenth of its travel is none."""
MOST_OFF_LINE = 3e-4
"""Scatter about a straight line, over its rise: more than readings have, 0.1 mm in 400 mm, and less than deviations."""


@dataclass(frozen=True)
class AxisOptions:
    """What a table of an axis does not state.

    ``sensor``: what read it (:data:`stepgauge.axis.sensors.SENSORS`); ``targets``: the artefact; ``missing``: whether
    readings may be missing, ``ordered``: whether rows are in the order of reading where targets follow in none;
    ``heights``: file of the heights of stations, by which slope distances become horizontal ones; ``unit``,
    ``deviation_unit``: of columns that state none.
    """

    sensor: str = "other"
    unit: str | None = None
    deviation_unit: str | None = None
    targets: Targets | None = None
    missing: bool = False
    ordered: bool = False
    heights: str | Path | None = None


def build_axis(found: Long, table: Table, options: AxisOptions, decisions: Decisions) -> tuple[AxisRecording, int, str]:
    """The recording, how many targets it has, and where the directions of travel are from.

    :class:`InputError` asks for all that the table leaves open, with the options that settle it.
    """
    form = "distances" if found.has_stations else "axis" if found.target is not None or options.targets else "spot"
    if form == "axis" and options.targets is None and _counts_targets(found):
        listed = QuestionAnswer("targets", words="for the list of them", suggestions=("0:500:25",))
        decisions.ask(table.path, "targets are told by their numbers alone", listed, found=found.target.called)  # type: ignore[union-attr]
        decisions.settle()
    if form == "spot" and np.isin([1, -1], found.columns["way"]).all():
        if not decisions.offers(Role.TARGET):
            listed = QuestionAnswer("targets", words="for the list of them", suggestions=("0:500:25",))
            decisions.ask(table.path, "readings of two directions have no targets", listed)
        decisions.settle()
    target, index = _targets(found, table, options, decisions)
    role = _role(found, table, target, options, decisions) if form == "axis" else Role.READING
    units = _units(found, table, options, form, role, decisions)
    decisions.settle()
    assert units is not None
    target = None if target is None else target * _per(found.target_unit, units, options)
    against = found.column.sign < 0.0
    turned = role == Role.DEVIATION and found.column.role == Role.CORRECTION
    value = found.value * _value_factor(found, units, options, role) * (-1.0 if turned else 1.0)
    reading = (
        value if role == Role.READING else value / units.deviations_per_position + (0.0 if target is None else target)
    )
    travel = _ways(found, None if found.has_stations else target, index, table, options, decisions)
    frame, targets = _frame(found, target, reading, travel)
    u_target = found.numbers("u_target")
    if index is not None and options.targets is not None and options.targets.u.any():
        frame["u_target"] = options.targets.u[index] / units.base_deviation
    elif u_target is not None:
        frame["u_target"] = u_target * _value_factor(found, units, options, Role.DEVIATION)
    for name, values in found.others.items():
        frame[f"{name}_recorded" if name in OWN or name in STATIONS else name] = values
    artefact = options.targets.name if options.targets else "targets" if form == "axis" else "none"
    words = f"readings of {found.column.header}, by hand" if against else _sign_words(found)
    comments = {"artefact": artefact, **({"turned": words} if turned or against else {})}
    comments |= {ORDER: STATED} if form == "axis" and options.ordered else {}
    return AxisRecording(frame, form, units, options.sensor, comments, table.path), targets, travel.source


def _counts_targets(found: Long) -> bool:
    """Whether the column of targets holds their numbers, as its name says: ``Target no``, ``Soll-Nr.``."""
    target = found.numbers("target")
    if target is None or found.target is None or not says(words_of(found.target.name), "number of"):
        return False
    return bool((target == np.floor(target)).all() and target.min() >= 0.0 and np.ptp(target) < len(target))


def _sign_words(found: Long) -> str:
    name = found.column.header
    return f'sign of {name}, taken as target minus reading (column deviation="{name}" takes it the other way round)'


def _targets(
    found: Long, table: Table, options: AxisOptions, decisions: Decisions
) -> tuple[Array | None, NDArray[np.intp] | None]:
    """Certified targets of all rows in the unit of the table, and which of the artefact each is."""
    known = options.targets
    target = found.numbers("target")
    if known is None or found.has_stations:
        return target, None
    of_file = 1.0
    if known.gauge:
        stated = found.target_unit or found.column.unit or _file_unit(found, table)
        of_file = 1.0 / (stated.factor if stated is not None else base_of(options.unit or "mm"))
    listed = Targets(known.nominal * of_file, known.certified * of_file, known.u, known.name)
    if known.gauge:
        _ask_unit(found, table, options, known, listed, decisions)
    if known.gauge and found.target is not None and target is not None and listed.lists(target):
        check_names(table, found.target.place, listed)
    index = (
        listed.nearest(found.value, found.columns["placement"], table.path)
        if target is None
        else listed.matched(target, table.path)
    )
    return listed.certified[index], index


def _ask_unit(
    found: Long, table: Table, options: AxisOptions, known: Targets, listed: Targets, decisions: Decisions
) -> None:
    """Targets, or readings without any, that are positions of the gauge in another unit than is stated or assumed."""
    target = found.numbers("target")
    values, column = (found.value, found.column) if target is None else (target, found.target or found.column)
    unit = None if listed.lists(values) else known.unit_of(values)
    if unit is None:
        return
    of_column = column.unit or _file_unit(found, table)
    stated = None if of_column is None else of_column.name
    told = stated or options.unit or "mm"
    if plain_name(told) == unit:
        return
    what = f"no positions of {known.name} in {told}, and all of them on its list in {unit}"
    at = f"{column.called}, {values.min():g} to {values.max():g}"
    if stated is not None:
        raise InputError(table.path, what, found=at, expected=naming("header", words=f"{unit} in the name, or in {{}}"))
    decisions.ask(table.path, what, QuestionAnswer("unit", unit), found=at)
    decisions.settle()


def _role(found: Long, table: Table, target: Array | None, options: AxisOptions, decisions: Decisions) -> str:
    """Whether the values are readings or deviations: as they are named, where their size does not contradict.

    Numbers without a unit that do not follow their targets are deviations in the unit that is stated, or asked for: of
    um, any slope is that of some machine.
    """
    assert target is not None
    named = found.column.role in DEVIATIONS
    if not np.ptp(target):
        return Role.DEVIATION if named else Role.READING
    slope, straight = _slope(found, target)
    stated = _stated_scale(found, table, options)
    fits_stated = stated is not None and abs(slope) * stated < NEAR_NOUGHT
    if fits_stated and (named or not straight):
        return Role.DEVIATION
    if abs(slope - 1.0) < NEAR_ONE:
        return Role.READING
    if abs(slope) < NEAR_NOUGHT:
        _ask_far(found, table, target, decisions)
        return Role.DEVIATION
    if (named and _scale(found) == 1.0) or (found.column.unit is None and found.column.role != Role.READING):
        return Role.DEVIATION
    if abs(slope + 1.0) < NEAR_ONE:
        way = QuestionAnswer("columns", f"{Role.READING}=-{found.column.header}", "to turn their sign")
        decisions.ask(table.path, "readings go against their targets", way, found=f"{slope:.4g} per unit of target")
        decisions.settle()
    hint = unit_hint(abs(slope), 1.0)
    possible = fits_stated or (options.deviation_unit is None and abs(slope) < MOST_UM_PER_MM)
    if possible and not hint and found.column.unit is None:
        return Role.DEVIATION
    words = '1 or about 0; the units in {}, that of deviations by {}, or the right column by {} reading="HEADER"'
    raise InputError(
        table.path,
        f"column {found.column.header!r} holds neither readings nor deviations of the targets{hint}",
        found=f"a change of {slope:.4g} per unit of target",
        expected=naming("header", "deviation_unit", "columns", words=words),
    )


def _slope(found: Long, target: Array) -> tuple[float, bool]:
    """The change of the values per unit of target, and whether they are as straight as readings are."""
    travel = target - target.mean()
    slope = float(travel @ found.value / (travel @ travel))
    off = found.value - found.value.mean() - slope * travel
    return slope * _scale(found), float(off.std()) < MOST_OFF_LINE * abs(slope) * float(np.ptp(target))


def _scale(found: Long) -> float:
    """What one unit of a value is in units of its target, by their headers; 1 where they do not say it."""
    known = found.column.unit is not None and found.target_unit is not None
    return found.column.unit.factor / found.target_unit.factor if known else 1.0  # type: ignore[union-attr]


def _ask_far(found: Long, table: Table, target: Array, decisions: Decisions) -> None:
    """Asks about readings that do not change with their targets, where they are too large for deviations."""
    far = abs(float(found.value.mean())) * _scale(found) > LARGEST * float(np.ptp(target))
    if found.column.role == Role.READING and far:
        way = QuestionAnswer("columns", f"{Role.DEVIATION}={found.column.header}", "if they are deviations")
        expected = QuestionAnswer("columns", "target=HEADER", "for the right targets")
        what = "readings that do not change with their targets, and are too large for deviations"
        decisions.ask(table.path, what, way, expected, found=found.column.header)


def _stated_scale(found: Long, table: Table, options: AxisOptions) -> float | None:
    """What one unit of a deviation is in units of its target, where it is stated beside the column; None where not."""
    if found.column.unit is not None or options.deviation_unit is None:
        return None
    deviation, of_target = plain_name(options.deviation_unit), found.target_unit or _file_unit(found, table)
    told = options.unit or (of_target.name if of_target is not None else "mm" if deviation in LENGTH_MM else "deg")
    return base_of(deviation) / base_of(plain_name(told))


def _units(
    found: Long, table: Table, options: AxisOptions, form: str, role: str, decisions: Decisions
) -> AxisUnits | None:
    """Units in which the axis is told: of the targets, else of the readings, else as asked; never guessed.

    What no header states, the file may state once for all its lengths. None where a unit is asked for.
    """
    asked = None if options.unit is None else plain_name(options.unit)
    of_axis = form == "axis" and found.target is not None
    stated = found.target_unit if of_axis else found.column.unit
    if stated is None and role == Role.READING:
        stated = found.column.unit
    stated = stated or _file_unit(found, table)
    if stated is None and options.targets is not None and options.targets.gauge:
        asked = asked or "mm"
    name = _settled_unit(table, "unit", options.unit, stated) or asked
    of_value = found.column.unit if role == Role.DEVIATION else None
    doubted = of_value is not None and not _is_possible(found, of_value, stated)
    if of_value is not None and doubted:
        if options.deviation_unit is None:
            what = f"the deviations are an unlikely part of the travel: is their unit {of_value.name}?"
            told = plain_name(of_value.name)
            others = [QuestionAnswer("deviation_unit", one) for one in ("um", "mm", "nm") if one != told]
            decisions.ask(
                table.path,
                what,
                QuestionAnswer("deviation_unit", told, "if it is"),
                *others,
                found=" over ".join(one.called for one in (found.column, found.target) if one is not None),
            )
        of_value = None
    deviation = _settled_unit(table, "deviation_unit", options.deviation_unit, of_value) or options.deviation_unit
    if not name:
        what = f"the unit of the {'target' if of_axis else 'reading'}s is not stated"
        units = QuestionAnswer("unit", suggestions=("mm", "um", "m", "inch", "deg", "arcsec"))
        asked_of = found.target if of_axis and found.target is not None else found.column
        decisions.ask(table.path, what, units, found=asked_of.called)
    if role == Role.DEVIATION and deviation is None and not doubted:
        units = QuestionAnswer("deviation_unit", suggestions=("um", "mm", "nm", "uin", "arcsec"))
        decisions.ask(table.path, "the unit of the deviations is not stated", units, found=found.column.header)
    return AxisUnits.of(name, deviation) if name else None


def _is_possible(found: Long, unit: Unit, of_target: Unit | None) -> bool:
    """Whether deviations are such a part of the travel as an axis may have."""
    target = found.numbers("target")
    if target is None or of_target is None or of_target.quantity != unit.quantity:
        return True
    fine = BASE["linear" if unit.quantity == "length" else "rotary"][1]
    travel = float(np.ptp(target)) * of_target.factor * fine
    size = float(np.ptp(found.value)) * unit.factor * fine
    if unit.factor * fine < 1.0 and size < travel:  # who states nm or uin means it: what is mixed up is mm and um
        size = max(size, SMALLEST * travel)
    return not size or not is_unlikely(size, travel)


def _file_unit(found: Long, table: Table) -> Unit | None:
    """The unit of all lengths that the file states beside the table, or in a column of its own."""
    texts = [text for key, text in table.facts.items() if key in WORDS["unit"]]
    for place, header in enumerate(table.headers):
        of_units = header.strip().casefold() in WORDS["unit"]
        cells = {str(cell).strip() for cell in table.cells(place)} if of_units else set()
        texts += cells if len(cells) == 1 else []
    units = [find_unit(text) for text in texts]
    return next((one for one in units if one is not None and one.quantity in ("length", "angle")), None)


def _settled_unit(table: Table, option: str, asked: str | None, stated: Unit | None) -> str | None:
    """The unit that a header states, None for none; an option that says otherwise is an :class:`InputError`."""
    name = None if stated is None else plain_name(stated.name)
    if name is not None and asked is not None and plain_name(asked) != name:
        what = naming(option, words="{} is another unit than that of the header")
        raise InputError(table.path, what, found=asked, expected=name)
    return name


def _per(unit: Unit | None, units: AxisUnits, options: AxisOptions) -> float:
    """What a number in a column is in units of position."""
    return 1.0 if unit is None else base_of(plain_name(unit.name)) / units.base_position


def _value_factor(found: Long, units: AxisUnits, options: AxisOptions, role: str) -> float:
    """What a value is in units of position (a reading) or of deviation; what is asked for goes before a header."""
    if role == Role.READING:
        return _per(found.column.unit, units, options)
    stated = None if found.column.unit is None else found.column.unit.name
    name = plain_name(options.deviation_unit or stated or units.deviation)
    _check_kind(name, units)
    return base_of(plain_name(name)) / base_of(units.deviation)


def _check_kind(name: str, units: AxisUnits) -> None:
    if (name in LENGTH_MM) != (units.axis == "linear"):
        raise InputError(
            naming("deviation_unit"), "not a unit of this axis", found=name, expected=f"as {units.deviation}"
        )


def _ways(
    found: Long, target: Array | None, index: NDArray[np.intp] | None, table: Table, options: AxisOptions,
    decisions: Decisions,
) -> ReadingOrder:  # fmt: skip
    """The direction of travel to every reading: of the faces, stated, or from the order of the targets."""
    stated, rows = found.columns["way"], np.arange(len(found.value))
    of_faces = options.sensor == "touch" and options.targets is not None and options.targets.gauge
    if index is not None and of_faces:
        check_ways(found, index, table, decisions)
        if not stated.all():
            return ReadingOrder(ways_into(index), rows, "of the faces (fronts towards +, backs towards −)")
    if stated.all() or target is None:
        return ReadingOrder(stated if stated.all() else np.ones(len(rows), np.int64), rows, "stated")
    times = found.numbers("time_s")
    order = None if times is None else np.lexsort((times, found.columns["placement"]))
    return travel_of_order(table.path, places_of(target), order, options.ordered, decisions)


def _frame(found: Long, target: Array | None, reading: Array, travel: ReadingOrder) -> tuple[pd.DataFrame, int]:
    """The columns of every recording of an axis, and how many places it has; cycles are counted where none are."""
    columns, stations = dict(found.columns), found.has_stations
    key = np.zeros(len(reading)) if target is None else target
    if stations:
        ends = pd.factorize(np.concatenate([columns[name] for name in STATIONS]))[0].reshape(2, -1)
        key = np.unique(np.sort(ends, axis=0), axis=1, return_inverse=True)[1].ravel().astype(float)
    travels = target is not None and not stations
    place, order = places_of(key), travel.order
    if not columns["cycle"].all():
        columns["cycle"] = np.ones(len(order), np.int64)
        if travels or stations:
            counted = (each[order] for each in (place, travel.way, columns["placement"]))
            columns["cycle"][order] = cycles_of_repeats(*counted)
    columns |= {"way": travel.way, "reading": reading} | ({"target": key} if travels else {})
    names = ("placement", "cycle", "way", *STATIONS, *(["target"] if travels else []), "reading", "time_s")
    return pd.DataFrame({name: columns[name] for name in names if name in columns}), int(place.max(initial=-1)) + 1
