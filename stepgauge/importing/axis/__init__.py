"""Tables of one axis, of one spot over time, and of distances between stations, of any make.

A table goes through four steps, one module each: where the numbers stand (:mod:`.grid`), what the columns are
(:mod:`.roles`), one reading per row (:mod:`.long`), units and targets (:mod:`.build`).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stepgauge.axis.recording import FORM, FORMS, AxisRecording, places_of, ways_doubt
from stepgauge.errors import InputError, reading
from stepgauge.importing.axis.build import AxisOptions, build_axis
from stepgauge.importing.axis.grid import Grid, find_grid
from stepgauge.importing.axis.heights import read_heights, reduced
from stepgauge.importing.axis.laserfile import is_laser_file, read_laser_file
from stepgauge.importing.axis.long import Long, to_long
from stepgauge.importing.axis.roles import Role, read_roles
from stepgauge.importing.axis.turned import turned
from stepgauge.importing.cells import Cells, decode, is_workbook, read_column_cells, read_workbook_cells
from stepgauge.importing.json_cells import is_json, read_json_cells
from stepgauge.importing.sheet import TableLayout
from stepgauge.recording import comment_lines

__all__ = ["AxisImport", "AxisOptions", "import_axis"]


@dataclass(frozen=True)
class AxisImport:
    """A recording, and in a few lines what was mapped and what was left out."""

    recording: AxisRecording
    report: tuple[str, ...]


def import_axis(path: str | Path, options: AxisOptions, layout: TableLayout | None = None) -> AxisImport:
    """The recording of a table of one axis, one spot, or distances between stations.

    Parameters
    ----------
    path : text with any delimiter, an Excel workbook, records in JSON, or a file of laser software in sections
    options : what the table does not state
    layout : its delimiter, decimal mark and sheet, where they do not show by themselves

    Raises
    ------
    InputError
        names the row, or the option that settles what the table leaves open
    """
    layout = layout or TableLayout()
    with reading(path, "table"):
        grid, notes, comments = _read_grid(path, options, layout)
        grid = grid.with_constants(options.constants)
        roles = read_roles(grid.headers, grid.units, options.columns)
        _check_chosen(grid, roles, options)
        found = to_long(grid, roles, options.missing)
        recording = build_axis(found, grid, options)
    if options.heights is not None:
        recording = reduced(recording, read_heights(options.heights), options.heights)
    clock = () if found.clock is None else found.clock.words
    report = (*notes, *grid.left_out, *_words(roles, found, recording), *clock)
    said = {**recording.comments, **_date(found), **comments, "log": Path(path).name, "import": "\n".join(report)}
    return AxisImport(AxisRecording(recording.frame, recording.form, recording.units, recording.sensor, said), report)


def _date(found: Long) -> dict[str, str]:
    start = None if found.clock is None else found.clock.start
    return {} if start is None else {"measured_at": start}


def _read_grid(
    path: str | Path, options: AxisOptions, layout: TableLayout
) -> tuple[Grid, tuple[str, ...], dict[str, str]]:
    """The grid, how the file was read, and what its comments say."""
    text = "" if is_workbook(path) else decode(path)[0]
    if is_laser_file(text):
        return read_laser_file(path), ("file of laser software with targets and deviations",), {}
    cells = turned(_read_cells(path, text, layout))
    grid = find_grid(cells, layout.decimal, options.header)
    said = {key: value for key, value in comment_lines(cells.comments).items() if key not in (*FORMS, FORM, "sensor")}
    return grid, (*cells.notes, f"decimal {'comma' if grid.decimal == ',' else 'point'}"), said


def _read_cells(path: str | Path, text: str, layout: TableLayout) -> Cells:
    if is_workbook(path):
        return read_workbook_cells(path, layout.sheet)
    return read_json_cells(path) if is_json(text) else read_column_cells(path, layout.delimiter)


def _check_chosen(grid: Grid, roles: list[Role], options: AxisOptions) -> None:
    """Every column that is named by hand must be there."""
    for role, header in options.columns.items():
        if not any(one.role == role for one in roles):
            known = ", ".join(one.header for one in roles if one.header)
            raise InputError(grid.path, f"there is no column {header!r} for {role}", found=known)


def _words(roles: list[Role], found: Long, recording: AxisRecording) -> list[str]:
    """What became of the columns, and what the recording is."""
    units, frame = recording.units, recording.frame
    mapped = [f"{one.header} -> {one.role}" for one in roles if one.role not in (None, "dropped") and one.header]
    if all(one.header != found.value_header or one.role is None for one in roles):
        mapped.append(f"{found.value_header} -> reading")
    words = [f"mapped: {', '.join(mapped)}"] if mapped else []
    if recording.form == "axis":
        ways = "stated" if found.way.all() else "from the order of the targets"
        count = len(np.unique(places_of(frame["target"].to_numpy(float))))
        words.append(f"{len(frame)} readings of {count} targets, cycles: {frame['cycle'].max()}, direction {ways}")
        doubt = ways_doubt(frame)
        words += [f"doubtful: {doubt}"] if doubt else []
    else:
        what = "one spot" if recording.form == "spot" else "distances between stations"
        words.append(f"{len(frame)} readings of {what}")
    words += [f"{key}: {recording.comments[key]}" for key in ("turned", "reduced") if key in recording.comments]
    words.append(f"told in {units.position}, deviations in {units.deviation}")
    if recording.covariates:
        words.append(f"kept as covariates: {', '.join(recording.covariates)}")
    return [*words, *([f"dropped: columns {', '.join(found.dropped)}"] if found.dropped else [])]
