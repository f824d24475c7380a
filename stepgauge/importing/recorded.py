"""What a controller or a person wrote down to a recording, or to the questions that settle it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from stepgauge.errors import InputError, naming
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
from stepgauge.importing.tables.read import DECIMALS, TableLayout
from stepgauge.importing.tables.source import Given, Source, read_source
from stepgauge.machine.file import check_recorded
from stepgauge.recording import Recording
from stepgauge.recording.conventions import complete_by_machine, convention_of, state_convention
from stepgauge.recording.identity import check_recording

Pairs = Mapping[str, str] | Sequence[str]
"""``{"target": "Soll"}``, or as typed, ``("target=Soll",)``."""


def import_asked(asked: Any) -> Imported:
    """Read what somebody else wrote: a log, or a table of any make (``docs/import.md``).

    ``asked`` has the parameters of the verb ``import`` as attributes, with gauge, placement and machine as objects.
    Nothing is guessed that would give other numbers: what the file leaves open is a question of the result, with the
    choices that settle it. Call again with a choice: ``argument=value``.
    """
    content = read_source(asked.log)
    asked.accept = (asked.accept,) if isinstance(asked.accept, str) else tuple(asked.accept)
    columns = parse_columns(asked.columns)
    layout = _layout(asked)
    of_points = names_points(content, asked.format, layout, columns)
    if asked.sensor is None and not of_points and asked.placement is not None:
        known = gauge_targets(asked.gauge)  # a gauge that was placed was touched
        asked.sensor = "touch" if names_faces(content, layout, known, read=True) else None
    axis = asked.sensor is not None and not of_points
    read = _read_axis if axis else _read_points
    return imported_or_asked(lambda decisions: read(asked, content, layout, columns, decisions))


def _layout(asked: Any) -> TableLayout:
    """How the table is written, as far as it is stated."""
    return TableLayout(
        None if asked.delimiter is None else DELIMITERS.get(asked.delimiter, asked.delimiter),
        None if asked.decimal is None else DECIMALS.get(asked.decimal, asked.decimal),
        asked.sheet,
        {},
        asked.unit,
        asked.temperature_unit,
        asked.time_unit,
        pairs_of(asked.constants, "constants"),
        asked.header,
        None if asked.table is None else int(asked.table),
        (asked.rows,) if isinstance(asked.rows, str) else tuple(asked.rows),
    )


def _read_axis(
    asked: Any, content: Source, layout: TableLayout, columns: Mapping[str, str], decisions: Decisions
) -> Imported:
    """A table of one axis; with gauge and placement, touches on the line of the placement."""
    gauge, placement = asked.gauge, asked.placement
    listed = gauge_targets(gauge) if gauge is not None and asked.sensor == "touch" else None
    of_faces = placement is None or (asked.targets is None and names_faces(content, layout, listed))
    known = None if asked.targets is None else parse_targets(asked.targets)
    known = gauge_targets(gauge) if known is None and gauge is not None and of_faces else known
    missing, ordered = ("missing" in asked.accept, "order" in asked.accept)
    options = AxisOptions(asked.sensor, asked.unit, asked.deviation_unit, known, missing, ordered, asked.heights)
    found = import_axis(content, options, replace(layout, columns=columns), decisions)
    if asked.sensor != "touch" or gauge is None or placement is None or not of_faces:
        return found
    nominal_mm = asked.machine.probe.tip_radius_mm if asked.machine else None  # as of points: the same everywhere
    placed = on_placement(found, gauge, placement, asked.tip_radius_mm or nominal_mm, asked.placement_number)
    assert isinstance(placed.recording, Recording)
    check_recording(placed.recording, gauge)
    return _completed(asked, placed, asked.gauge_temperature_C)


def _read_points(
    asked: Any, content: Source, layout: TableLayout, columns: Mapping[str, str], decisions: Decisions
) -> Imported:
    """A log or a table of points of three coordinates."""
    nominal = asked.machine.probe.tip_radius_mm if asked.machine else None
    ran, radius = None, asked.tip_radius_mm
    if asked.program is not None:
        known = radius or (asked.placement.tip_radius_mm if asked.placement else None) or nominal
        ran, stated = read_run_program(asked.program, known)
        radius = radius or stated
    surface = None if asked.points is None else asked.points == "surface"
    number, temperature = asked.placement_number, asked.gauge_temperature_C
    options = ImportOptions(number, temperature, radius, surface, asked.accept, nominal)
    known_layout = replace(layout, columns=columns)
    kind = asked.format or recognise_log(content)
    found = import_log(content, kind, asked.gauge, asked.placement, ran, options, known_layout, decisions)
    return _completed(asked, found, None)


def _completed(asked: Any, found: Imported, stated_C: float | None) -> Imported:
    """The import with what is stated beside the file, and with a warning where faces are missing."""
    recording = found.recording
    assert isinstance(recording, Recording)
    if stated_C is not None:
        recording = replace(recording, frame=recording.frame.assign(gauge_temperature_C=stated_C))
    recording = state_convention(recording.assign_comments(sensor=asked.sensor), asked.temperature_convention)
    if asked.machine is not None:
        check_recorded(recording.comments, asked.machine)
        recording = complete_by_machine(recording, asked.machine.table)
    named = [f"machine: {recording.comments['machine']}"] if "machine" in recording.comments else []
    warnings = (*missing_temperature(recording, found.report), *missing_faces(recording), *missing_rows(recording))
    return replace(found, recording=recording, report=(*found.report, *named, *warnings))


def missing_temperature(recording: Recording, report: Sequence[str]) -> tuple[str, ...]:
    """What follows where nobody says how warm the gauge was; nothing of readings that are corrected for it."""
    stated = "gauge_temperature_C" in recording.frame or convention_of(recording.comments) not in (None, "as_read")
    if stated or any("gauge_temperature_C=" in one for one in report):
        return ()
    return (
        "warning: no temperature of the gauge is stated: it counts as that of the certificate, and each K that it"
        " differs passes for a scale error of the gauge's expansion, of steel 12 um/m; --gauge-temperature states it",
    )


def missing_faces(recording: Recording) -> tuple[str, ...]:
    """The warning that names the faces between measured ones, of whole blocks, of which nothing is there."""
    there = set(recording.frame["face"])
    first, last = (min(there) - 1) // 2 * 2 + 1, (max(there) + 1) // 2 * 2
    lacking = [str(one) for one in range(first, last + 1) if one not in there]
    if not lacking:
        return ()
    return (f"warning: nothing was measured of faces that lie between measured ones: {shown(lacking)}",)


def missing_rows(recording: Recording) -> tuple[str, ...]:
    """The warning that names what single cycles lack of the faces that others have, by cycle and face."""
    cycle, face = (recording.frame[name].tolist() for name in ("cycle", "face"))
    there = set(zip(cycle, face, strict=True))
    pairs = ((one, other) for one in sorted(set(cycle)) for other in sorted(set(face)))
    lacking = [f"{one}/{other}" for one, other in pairs if (one, other) not in there]
    if not lacking:
        return ()
    return (f"warning: readings that other cycles have are missing, as cycle/face: {shown(lacking)}",)


def names_points_of(values: Mapping[str, Any]) -> bool:
    """Whether what is given has points of three coordinates; ``values`` are arguments of the verb."""
    decimal, delimiter = DECIMALS.get(values["decimal"] or ""), DELIMITERS.get(values["delimiter"] or "")
    constants = pairs_of(values["constants"], "constants")
    layout = TableLayout(delimiter, decimal, values["sheet"], {}, header=values["header"], constants=constants)
    return names_points(values["log"], values["format"], layout, values["columns"])


def pairs_of(given: Pairs, name: str) -> dict[str, str]:
    """Names and values of an argument that takes pairs."""
    if isinstance(given, Mapping):
        return {str(key): str(value) for key, value in given.items()}
    found: dict[str, str] = {}
    for text in (given,) if isinstance(given, str) else given:
        key, equals, value = text.partition("=")
        if not (key.strip() and equals and value.strip()):
            raise InputError(naming(name), "not understood", found=repr(text), expected="NAME=VALUE")
        if key.strip() in found:
            raise InputError(naming(name), f"{key.strip()} is given twice", found=repr(text), expected="one value")
        found[key.strip()] = value.strip()
    return found


def names_points(source: Given, format: str | None, layout: TableLayout, columns: Pairs) -> bool:
    """Whether a log has points of three coordinates: any but a table, and a table that names x, y and z."""
    if (format or recognise_log(source)) not in TABLES:
        return True
    return has_points(source, replace(layout, columns=parse_columns(columns)))
