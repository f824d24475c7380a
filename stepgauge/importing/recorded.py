"""What a controller or a person wrote down to a recording, or to the questions that settle it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from stepgauge.errors import InputError, naming
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.importing.axis import AxisOptions, import_axis
from stepgauge.importing.axis.placed import on_placement
from stepgauge.importing.axis.targets import gauge_targets, parse_targets
from stepgauge.importing.build import ImportOptions
from stepgauge.importing.formats import TABLES
from stepgauge.importing.logs import import_log, read_run_program, recognise_log
from stepgauge.importing.points import has_points, names_faces
from stepgauge.importing.result import Imported, imported_or_asked
from stepgauge.importing.tables.cells import DELIMITERS
from stepgauge.importing.tables.columns import parse_columns
from stepgauge.importing.tables.questions import Decisions, shown
from stepgauge.importing.tables.read import TableLayout
from stepgauge.importing.tables.source import Given, read_source
from stepgauge.machine.file import Machine, check_recorded
from stepgauge.recording import Recording
from stepgauge.recording.conventions import complete_convention, state_convention
from stepgauge.recording.identity import check_recording

DECIMALS = {"point": ".", "comma": ","}
Pairs = Mapping[str, str] | Sequence[str]
"""``{"target": "Soll"}``, or as typed, ``("target=Soll",)``."""


def import_recording(
    source: Given,
    *,
    sensor: str | None = None,
    gauge: Gauge | None = None,
    placement: Placement | None = None,
    program: str | Path | None = None,
    machine: Machine | None = None,
    format: str | None = None,
    placement_number: int = 1,
    tip_radius_mm: float | None = None,
    points: str | None = None,
    gauge_temperature_C: float | None = None,
    temperature_convention: str | None = None,
    unit: str | None = None,
    deviation_unit: str | None = None,
    temperature_unit: str = "C",
    time_unit: str | None = None,
    columns: Pairs = (),
    rows: Sequence[str] = (),
    constants: Pairs = (),
    accept: Sequence[str] = (),
    header: str | None = None,
    table: int | str | None = None,
    sheet: str | None = None,
    delimiter: str | None = None,
    decimal: str | None = None,
    targets: str | None = None,
    heights: str | Path | None = None,
) -> Imported:
    """Read what somebody else wrote: a log, or a table of any make (``docs/import.md``).

    Parameters are those of the verb ``import``. Nothing is guessed that would give other numbers: what the file leaves
    open is a question of the result, with the choices that settle it. Call again with a choice: ``argument=value``.
    """
    content = read_source(source)
    layout = TableLayout(
        None if delimiter is None else DELIMITERS.get(delimiter, delimiter),
        None if decimal is None else DECIMALS.get(decimal, decimal),
        sheet,
        {},
        unit,
        temperature_unit,
        time_unit,
        pairs_of(constants, "constants"),
        header,
        None if table is None else int(table),
        (rows,) if isinstance(rows, str) else tuple(rows),
    )
    chosen = [f"{name}={value}" for name, value in pairs_of(columns, "columns").items()]

    listed = gauge_targets(gauge) if gauge is not None and sensor == "touch" else None
    of_faces = placement is None or (targets is None and names_faces(content, layout, listed))

    def finish_axis(decisions: Decisions) -> Imported:
        known = None if targets is None else parse_targets(targets)
        known = gauge_targets(gauge) if known is None and gauge is not None and of_faces else known
        assert sensor is not None
        options = AxisOptions(sensor, unit, deviation_unit, known, "missing" in accept, heights)
        found = import_axis(content, options, replace(layout, columns=parse_columns(chosen)), decisions)
        if sensor != "touch" or gauge is None or placement is None or not of_faces:
            return found
        placed = on_placement(found, gauge, placement, tip_radius_mm, placement_number)
        assert isinstance(placed.recording, Recording)
        check_recording(placed.recording, gauge)
        return finished(placed, gauge_temperature_C)

    def finish_points(decisions: Decisions) -> Imported:
        steps, lies, cmm = gauge, placement, machine
        ran, radius = None, tip_radius_mm
        if program is not None:
            known = (
                tip_radius_mm or (lies.tip_radius_mm if lies else None) or (cmm.probe.tip_radius_mm if cmm else None)
            )
            ran, stated = read_run_program(program, known)
            radius = tip_radius_mm or stated
        surface = None if points is None else points == "surface"
        nominal = cmm.probe.tip_radius_mm if cmm else None
        options = ImportOptions(placement_number, gauge_temperature_C, radius, surface, tuple(accept), nominal)
        known_layout = replace(layout, columns=parse_columns(chosen))
        kind = format or recognise_log(content)
        found = import_log(content, kind, steps, lies, ran, options, known_layout, decisions)
        return finished(found, None)

    def finished(found: Imported, stated_C: float | None) -> Imported:
        recording = found.recording
        assert isinstance(recording, Recording)
        if stated_C is not None:
            recording = replace(recording, frame=recording.frame.assign(gauge_temperature_C=stated_C))
        recording = state_convention(recording.assign_comments(sensor=sensor), temperature_convention)
        if machine is not None:
            check_recorded(recording.comments, machine)
            recording = complete_convention(recording, machine.table)
        return replace(found, recording=recording, report=(*found.report, *missing_faces(recording)))

    axis = sensor is not None and not names_points(content, format, layout, chosen)
    return imported_or_asked(finish_axis if axis else finish_points)


def missing_faces(recording: Recording) -> tuple[str, ...]:
    """The warning that names the faces between measured ones, of whole blocks, of which nothing is there."""
    there = set(recording.frame["face"])
    first, last = (min(there) - 1) // 2 * 2 + 1, (max(there) + 1) // 2 * 2
    lacking = [str(one) for one in range(first, last + 1) if one not in there]
    if not lacking:
        return ()
    return (f"warning: nothing was measured of faces that lie between measured ones: {shown(lacking)}",)


def names_points_of(values: Mapping[str, Any]) -> bool:
    """Whether what is given has points of three coordinates; ``values`` are arguments of :func:`import_recording`."""
    decimal, delimiter = DECIMALS.get(values["decimal"] or ""), DELIMITERS.get(values["delimiter"] or "")
    constants = pairs_of(values["constants"], "constants")
    layout = TableLayout(delimiter, decimal, values["sheet"], {}, header=values["header"], constants=constants)
    return names_points(values["log"], values["format"], layout, values["columns"])


def pairs_of(given: Pairs, name: str) -> dict[str, str]:
    """Names and values of an argument that takes pairs; of ``ignore`` several headers, one below the other."""
    if isinstance(given, Mapping):
        return {str(key): str(value) for key, value in given.items()}
    found: dict[str, str] = {}
    for text in (given,) if isinstance(given, str) else given:
        key, equals, value = text.partition("=")
        if not (key.strip() and equals and value.strip()):
            raise InputError(naming(name), "not understood", found=repr(text), expected="NAME=VALUE")
        before = f"{found[key.strip()]}\n" if key.strip() == "ignore" and "ignore" in found else ""
        found[key.strip()] = before + value.strip()
    return found


def names_points(source: Given, format: str | None, layout: TableLayout, columns: Sequence[str]) -> bool:
    """Whether a log has points of three coordinates: any but a table, and a table that names x, y and z."""
    if (format or recognise_log(source)) not in TABLES:
        return True
    return has_points(source, replace(layout, columns=parse_columns(columns)))
