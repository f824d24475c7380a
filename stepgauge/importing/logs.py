"""What a controller wrote down while it ran a program, read back as a recording.

Tables of any layout (CSV, XLSX) are read by :mod:`stepgauge.importing.tables`. What a log has to say about the program
that made it is checked once for all formats in :mod:`stepgauge.correspondence`.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from stepgauge.correspondence.probe_log import ProbeLog
from stepgauge.errors import InputError, naming, reading
from stepgauge.files.text import read_text
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.importing.axis.targets import gauge_targets
from stepgauge.importing.build import ImportOptions, build_recording
from stepgauge.importing.formats import FORMATS, TABLES, gist
from stepgauge.importing.points import read_points
from stepgauge.importing.result import Imported
from stepgauge.importing.tables.questions import Decisions
from stepgauge.importing.tables.read import TableLayout
from stepgauge.importing.tables.source import Given, read_source
from stepgauge.importing.thermal import read_convention, said_lines
from stepgauge.motion.moves import ProbingSettings, Program
from stepgauge.programs import DIALECTS, recognise
from stepgauge.recording import Recording
from stepgauge.recording.identity import check_recording


def recognise_log(path: Given) -> str:
    """Name of the format of a file, from its content; :class:`InputError` where it is none that is known."""
    source = read_source(path)
    if source.is_workbook or source.frame is not None:
        return "xlsx" if source.is_workbook else "csv"
    text = gist(source.decoded[0])
    known = next((one.name for one in FORMATS.values() if one.recognises(text)), None)
    if known is not None:
        return known
    if any(dialect.recognises(text) for dialect in DIALECTS.values()):
        raise InputError(
            source.name,
            "this is a measuring program, not what a machine wrote down while it ran",
            expected=naming("program", words="a log, and the program as {}"),
        )
    return "csv"


def read_log(
    given: Given,
    source: str,
    layout: TableLayout | None = None,
    decisions: Decisions | None = None,
    gauge: Gauge | None = None,
) -> ProbeLog:
    """Read a probe log; ``source`` is a name in :data:`FORMATS`, ``layout`` says how a table is to be read.

    ``gauge``: by which positions along it are known.

    :class:`InputError` for a file of another kind, and for the first line that is not as the format wants it.
    """
    content = read_source(given)
    path = content.name
    if source in TABLES:
        _check_layout(path, source, layout or TableLayout())
        with reading(path, FORMATS[source].title):
            listed = None if gauge is None else gauge_targets(gauge)
            return read_points(content, source, layout or TableLayout(), decisions, listed)
    asked, plain = layout or TableLayout(), TableLayout()
    if replace(asked, unit=plain.unit) != plain:
        raise InputError(
            path,
            "delimiter, decimal mark, sheet, columns and temperature unit can be said of tables only",
            found=f"a {FORMATS[source].title}",
            expected="none of these options",
        )
    text = content.decoded[0]
    known = FORMATS[source]
    if not known.recognises(gist(text)):
        lines = text.split("\n")
        first = next((number for number, line in enumerate(lines, 1) if line.strip()), 0)
        raise InputError(
            f"{path}:{first}" if first else path,
            f"this is not a {known.title}",
            found=repr(lines[first - 1].strip()[:60]) if first else "an empty file",
            expected=known.layout,
        )
    log = _convert_to_mm(known.read(text, path), asked.unit)
    thermal, told = read_convention(said_lines(text))
    return replace(log, comments=thermal | dict(log.comments), mapped=(*log.mapped, *told))


def _convert_to_mm(log: ProbeLog, asked: str | None) -> ProbeLog:
    """The log in mm: its unit is the one that it states, else the one asked for."""
    if asked is not None and log.units and asked not in log.units:
        what = naming("unit", words="{} is another unit than the log states")
        raise InputError(log.path, what, found=asked, expected=" or ".join(log.units))
    name = asked or (log.units[0] if len(log.units) == 1 else "mm")
    return log if name == "mm" else log.convert_unit(name)


def _check_layout(path: str | Path, source: str, layout: TableLayout) -> None:
    """A delimiter of a workbook, or a sheet of a text, is a mistake about the file."""
    for name, value, of in (("delimiter", layout.delimiter, "csv"), ("sheet", layout.sheet, "xlsx")):
        if value is not None and source != of:
            what = naming(name, words=f"{{}} is of a {FORMATS[of].title}")
            raise InputError(path, what, found=f"a {FORMATS[source].title}")


def import_log(
    path: Given,
    source: str,
    gauge: Gauge | None = None,
    placement: Placement | None = None,
    program: Program | None = None,
    options: ImportOptions | None = None,
    layout: TableLayout | None = None,
    decisions: Decisions | None = None,
) -> Imported:
    """The recording of a run, from what the controller or a person wrote down.

    With the program every point is known beforehand; with gauge and placement alone the faces follow from the
    positions, and what is missing from the usual orders of ``stepgauge plan``; a file that states cycle, face and
    direction of every row needs neither.

    Parameters
    ----------
    path : the log: a path, an open file, or a DataFrame
    source : name of its format in :data:`FORMATS`
    gauge, placement : which faces the points belong to
    program : what the controller ran, read from its text (:func:`stepgauge.programs.read_program`)
    options : what the log does not state, and what may be wrong with it
    layout : how a table is to be read
    decisions : takes what was decided about a table, also where something stays open

    Raises
    ------
    InputError
        names the log's line: a foreign or truncated file, points missing, repeated, out of order or missed, and a log
        that another program made; the program's line where it does not measure this gauge as placed; and the evidence
        where numbers and statements contradict each other (serial, units, tip radius, swapped faces)
    """
    decisions = decisions or Decisions()
    log = read_log(path, source, layout, decisions, gauge)
    imported = build_recording(log, gauge, placement, program, options or ImportOptions())
    if gauge is not None:
        assert isinstance(imported.recording, Recording)
        check_recording(imported.recording, gauge)
    return replace(imported, columns=tuple(decisions.columns), rejected=tuple(decisions.rejected))


def read_run_program(path: str | Path, tip_radius_mm: float | None) -> tuple[Program, float | None]:
    """The program that was run, and the tip radius where its text states one.

    ``tip_radius_mm`` turns the surface points of programs that leave the radius to the controller into tip centres;
    :class:`InputError` where such a program comes without one (None), for none is assumed.
    """
    text = read_text(path)
    dialect = recognise(gist(text), path)
    known = float("nan") if tip_radius_mm is None else tip_radius_mm
    with reading(path, "measuring program"):
        program = dialect.read(text, path, ProbingSettings(tip_radius_mm=known))
    if not np.isfinite(program.position_mm).all():
        what = "the program has surface points, and nothing states the radius of the tip that turns them into centres"
        expected = naming("tip_radius_mm", "placement", words="{}, or tip_radius_mm in the machine file or that of {}")
        raise InputError(path, what, expected=expected)
    return program, program.settings.tip_radius_mm if "tip_radius_mm" in dialect.carries else None
