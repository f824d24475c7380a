"""Tables of one axis, of one spot over time, and of distances between stations, of any make.

The columns of a table (:mod:`stepgauge.importing.tables`) become one reading per row (:mod:`.long`), and these with
units and targets a recording (:mod:`.build`); what the file states of itself is compared with it (:mod:`.stated`).
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from stepgauge.axis.order import is_order_known
from stepgauge.axis.recording import FORM, FORMS, AxisRecording, ways_doubt
from stepgauge.conditions.axis import recording_conditions
from stepgauge.errors import reading
from stepgauge.files.units import find_unit
from stepgauge.importing.axis.build import AxisOptions, build_axis
from stepgauge.importing.axis.faces import check_measured, check_placements, header_answer
from stepgauge.importing.axis.heights import read_heights, reduced
from stepgauge.importing.axis.long import Long, to_long
from stepgauge.importing.axis.sides import faces_as_targets, texts_of_fronts
from stepgauge.importing.axis.stated import check_stated
from stepgauge.importing.axis.targets import Targets
from stepgauge.importing.axis.travel import check_stated_travel, numbered_runs
from stepgauge.importing.result import Imported
from stepgauge.importing.tables.clock import is_moment
from stepgauge.importing.tables.columns import AXIS, VALUE_ROLES, Column, Role, check_chosen, read_columns
from stepgauge.importing.tables.grid import Table
from stepgauge.importing.tables.kinds import is_text
from stepgauge.importing.tables.makes import named_by_make
from stepgauge.importing.tables.questions import Decisions
from stepgauge.importing.tables.read import TableLayout, choose_table, read_file, taken_columns
from stepgauge.importing.tables.rivals import settled_roles
from stepgauge.importing.tables.source import Given, read_source
from stepgauge.importing.thermal import read_convention, said_lines
from stepgauge.recording import comment_lines

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["AxisOptions", "import_axis"]
_OURS = (*FORMS, FORM, "sensor")
"""Comments of a recording that are made anew."""
UNORDERED = (
    "the order of the readings is not known: either direction may have been the first of a cycle, and uncertainties"
    " have what a drift makes of that; rows in the order of reading, or a column of times, show it, and --accept order"
    " states that they stand in it"
)
LOOKED_AT = 50_000
"""Readings by which the doubts of a table are told: what is wrong with all of it shows in these."""


def import_axis(
    given: Given, options: AxisOptions, layout: TableLayout | None = None, decisions: Decisions | None = None
) -> Imported:
    """The recording of a table of one axis, one spot, or distances between stations.

    Parameters
    ----------
    given : a path, an open file or a DataFrame: text with any delimiter, an Excel workbook, records in JSON, lines of a
        console, or a file of laser software in sections
    options : what the table does not state
    layout : its delimiter, decimal mark and sheet, and columns by hand, where they do not show by themselves

    Raises
    ------
    InputError
        names the row, or asks all that the table leaves open, with the options that settle it
    """
    layout, source, decisions = layout or TableLayout(), read_source(given), decisions or Decisions()
    with reading(source.name, "table"):
        file = read_file(source, layout, decisions)
        table = choose_table(file, lambda one: _has_readings(one, layout), layout, source.name, decisions)
        if "title" in layout.columns.get(Role.IGNORE, "").split("\n"):
            table = replace(table, titles=[""], block=np.zeros(len(table), np.int64))
        table = _named(named_by_make(table), options.targets, decisions)
        if options.targets is not None and options.targets.gauge and not layout.columns:
            check_measured(table, options.targets)
        roles = _roles(table, options, layout, decisions)
        roles = numbered_runs(table, _circle_columns(roles, decisions), decisions)
        decisions.columns = taken_columns(table, [(one.place, one.role, one.unit) for one in roles])
        check_chosen(roles, layout.columns, table.path)
        check_stated_travel(table, roles, layout, decisions)
        if options.targets is not None and options.targets.gauge and options.sensor == "touch":
            check_placements(table, roles, layout, decisions)
        found = to_long(table, roles, options.missing, options.ordered, layout.time_unit, decisions)
        recording, targets, ways = build_axis(found, table, options, decisions)
        check_stated(table.facts, recording, source.name)
    if options.heights is not None:
        recording = reduced(recording, read_heights(options.heights), options.heights)
    clock = () if found.clock is None else found.clock.words
    looked_at = replace(recording, frame=recording.frame.head(LOOKED_AT))
    doubted = recording_conditions(looked_at, table_alone=True).of("units", "channel", "duplicates")
    doubts = (f"warning: {one.sentence}" for one in doubted)
    decided = (*decisions.taken, *decisions.rejected)
    lines = file.comments if source.is_workbook or source.frame is not None else said_lines(source.decoded[0])
    thermal, told = read_convention([*lines, *(f"{key}: {value}" for key, value in table.facts.items())])
    report = (
        *file.notes,
        *table.left_out,
        *_words(roles, found, recording, targets, ways),
        *told,
        *clock,
        *decided,
        *doubts,
    )
    comments = {key: value for key, value in comment_lines(file.comments).items() if key not in _OURS}
    name = Path(source.name).name
    said = {**recording.comments, **_date(found), **thermal, **comments, "log": name, "import": "\n".join(report)}
    whole = AxisRecording(recording.frame, recording.form, recording.units, recording.sensor, said)
    return Imported(whole, report, tuple(decisions.columns), rejected=tuple(decisions.rejected))


def _roles(table: Table, options: AxisOptions, layout: TableLayout, decisions: Decisions) -> list[Column]:
    """The role of every column; of the faces of a gauge, their numbers are targets, and their sides directions."""
    listed = options.targets
    if listed is None or not listed.gauge:
        return settled_roles(table, layout, decisions)
    unit = None if options.unit is None else find_unit(options.unit)
    touched = options.sensor == "touch"
    fronts = texts_of_fronts(table, layout, listed, 1.0 if unit is None else unit.factor) if touched else {}
    for place, text in fronts.items():
        decisions.take(f"{table.headers[place]!r} tells fronts ({text}), touched towards +, from backs")
    return faces_as_targets(table, settled_roles(table, layout, decisions, fronts), listed)


def _circle_columns(roles: list[Column], decisions: Decisions) -> list[Column]:
    """Lengths over an angle, as of a circular test: the angle is no target of theirs, and kept beside them."""
    angles = [one for one in roles if one.role == Role.TARGET and one.unit is not None and one.unit.quantity == "angle"]
    values = [one for one in roles if one.role in VALUE_ROLES and one.unit is not None]
    if not angles or not values or any(one.unit is None or one.unit.quantity != "length" for one in values):
        return roles
    if any(one.role != Role.READING for one in values):
        return roles
    decisions.take(f"lengths over an angle (a circular test): {angles[0].header!r} is kept beside the readings")
    return [replace(one, role=None) if one is angles[0] else one for one in roles]


def _has_readings(table: Table, layout: TableLayout) -> bool:
    """Whether the names of a table's columns say that it has readings."""
    roles = read_columns(table.headers, table.units, layout.columns, AXIS)
    return any(one.role in VALUE_ROLES for one in roles)


def _named(table: Table, listed: Targets | None, decisions: Decisions) -> Table:
    """The table, whose columns must have names: a number and times alone need none."""
    if any(table.headers):
        return table
    width = max(len(row) for row in table.rows)
    kinds = [_content(table, place) for place in range(width)]
    if kinds.count("reading") == 1:
        decisions.take("no header: the only numbers that are no times are taken as the readings")
        return replace(table, headers=kinds, units=[None] * width)
    what, found = "no row above the numbers names the columns", f"{len(table.headers)} columns"
    of_gauge = listed if listed is not None and listed.gauge else None
    wanted = header_answer(table, ("target_mm", "reading_mm"), of_gauge)
    decisions.ask(table.at(0), what, wanted, found=found)
    decisions.settle()
    return table


def _content(table: Table, place: int) -> str:
    """What a column without a name holds: times, text, or numbers."""
    cells = [cell for cell in table.first_cells(place, 100) if cell != ""]
    if cells and all(not isinstance(cell, str | float) or is_moment(cell) for cell in cells):
        return "time"
    return "name" if is_text(table, place) else "reading"


def _twice(found: Long, frame: pd.DataFrame) -> list[str]:
    """The warning of readings that stand there twice, in one run that is stated."""
    again = frame.duplicated()
    if not found.columns["cycle"].all() or not again.any():
        return []
    at = frame[again].iloc[0]
    return [f"doubtful: rows that stand there twice: {again.sum()}, the first at target {at['target']:g} in run"
            f" {at['cycle']:g}: a row that was pasted again counts as a second reading"]  # fmt: skip


def _date(found: Long) -> dict[str, str]:
    start = None if found.clock is None else found.clock.start
    return {} if start is None else {"measured_at": start}


def _words(roles: list[Column], found: Long, recording: AxisRecording, count: int, ways: str) -> list[str]:
    """What became of the columns, and what the recording is."""
    units, frame = recording.units, recording.frame
    mapped = [f"{one.header} -> {one.role}" for one in roles if one.role not in (None, "dropped") and one.header]
    if all(one.header != found.column.header or one.role is None for one in roles):
        mapped.append(f"{found.column.header} -> reading")
    words = [f"mapped: {', '.join(mapped)}"] if mapped else []
    if recording.form == "axis":
        words.append(f"{len(frame)} readings of {count} targets, cycles: {frame['cycle'].max()}, direction {ways}")
        words.append(f"readings towards +: {(frame['way'] > 0).sum()}, towards −: {(frame['way'] < 0).sum()}")
        doubt = ways_doubt(frame)
        words += [f"doubtful: {doubt}"] if doubt else []
        words += [] if is_order_known(recording) else [UNORDERED]
        words += _twice(found, frame)
    else:
        what = "one spot" if recording.form == "spot" else "distances between stations"
        words.append(f"{len(frame)} readings of {what}")
    if count == 1 and len(frame) > 1 and recording.form != "distances":
        reading = frame["reading"].to_numpy(float)
        spread = (reading.std(ddof=1) * units.deviations_per_position, np.ptp(reading) * units.deviations_per_position)
        said = f"mean {reading.mean():.9g} {units.position}, standard deviation {spread[0]:.4g} {units.deviation}"
        words.append(f"{said}, range {spread[1]:.4g} {units.deviation}")
    words += [f"{key}: {recording.comments[key]}" for key in ("turned", "reduced") if key in recording.comments]
    words.append(f"told in {units.position}, deviations in {units.deviation}")
    if recording.covariates:
        words.append(f"kept as covariates: {', '.join(recording.covariates)}")
    return [*words, *([f"dropped: columns {', '.join(found.dropped)}"] if found.dropped else [])]
