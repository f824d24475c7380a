"""A compensation table as the file of a controller, through a Jinja template.

A template sees ``table`` (:class:`~stepgauge.compensation.table.CompensationTable`), ``rows`` (each with
``position_mm``, ``positive_um``, ``negative_um``, ``mean_um``, ``reversal_um``, ``u_positive_um``, ``u_negative_um``,
``from_positive``, ``from_negative``), ``line`` and ``pulses`` (:mod:`stepgauge.compensation.reduced`), ``unconfirmed``
(what could not be confirmed of a format), ``about`` and ``notes`` (plain ASCII), ``joint`` and ``kind`` (numbers that a
format asks for) and ``version``; the filters of :mod:`stepgauge.files.templating`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stepgauge import __version__
from stepgauge.compensation.reduced import pitch_pulses, straight_line
from stepgauge.compensation.table import CompensationTable, Travel
from stepgauge.errors import InputError, naming
from stepgauge.files.resources import folder
from stepgauge.files.templating import check_printable, fill_template
from stepgauge.files.text import write_json, write_text

COLUMNS = ("position_mm", "positive_um", "negative_um", "mean_um", "reversal_um", "u_positive_um", "u_negative_um")
FORMAT = "stepgauge compensation 1"


@dataclass(frozen=True)
class Format:
    """A controller's table: which senses of travel it tells apart by default and at all, and its limits.

    ``unconfirmed``: what could not be confirmed in a manual or in the source of the firmware; the file says it, too.
    """

    name: str
    title: str
    template: str
    travel: Travel
    both: bool
    even: bool
    most_rows: int | None
    unconfirmed: str = ""


_LINE: tuple[Travel, bool, bool, int | None] = ("both", True, False, None)
"""Firmwares that know a scale and a play only: the straight line through the table, and the mean reversal."""
FORMATS = {
    known.name: known
    for known in (
        Format(
            "linuxcnc", "LinuxCNC screw compensation (COMP_FILE)", "compensation-linuxcnc.j2", "both", True, False, 256
        ),
        Format("siemens", "Siemens SINUMERIK $AA_ENC_COMP", "compensation-siemens.j2", "mean", False, True, None),
        Format(
            "siemens-cec",
            "Siemens SINUMERIK $AN_CEC, a table for each sense",
            "compensation-siemens-cec.j2",
            "both",
            True,
            True,
            None,
            "the sense of $AN_CEC",
        ),
        Format(
            "heidenhain",
            "HEIDENHAIN compensation table (.COM)",
            "compensation-heidenhain.j2",
            "both",
            True,
            False,
            256,
            "the sense of the values",
        ),
        Format(
            "fanuc",
            "Fanuc stored pitch error compensation",
            "compensation-fanuc.j2",
            "both",
            True,
            True,
            128,
            "the sense of the pulses",
        ),
        Format(
            "fanuc-g10",
            "the same as a program (G10 L50)",
            "compensation-fanuc-g10.j2",
            "both",
            True,
            True,
            128,
            "the sense of the pulses; 10000 plus the point as its number; R in 0.001 mm for 3624",
        ),
        Format("grbl", "steps per mm of grbl, play of grblHAL", "compensation-grbl.j2", *_LINE),
        Format("marlin", "scale and play of Marlin (M92, M425)", "compensation-marlin.j2", *_LINE),
        Format("rrf", "scale and play of RepRapFirmware (M579, M425)", "compensation-rrf.j2", *_LINE),
        Format("csv", "table for any other controller", "compensation-csv.j2", "both", True, False, None),
    )
}


def check_format(table: CompensationTable, known: Format) -> None:
    """:class:`InputError` where a controller cannot take this table."""
    if table.travel == "both" and not known.both:
        raise InputError(
            naming("travel"),
            f"{known.title} has one table for both senses of travel",
            found="both",
            expected="mean, positive or negative",
        )
    if table.step_mm is None and known.even:
        raise InputError(naming("step_mm"), f"{known.title} needs even spacing", expected="a step in mm")
    if known.most_rows and len(table) > known.most_rows:
        raise InputError(
            naming("step_mm"),
            f"too long for {known.title}",
            found=f"{len(table)} rows",
            expected=f"at most {known.most_rows}",
        )


def render_table(
    table: CompensationTable, known: Format, template: str | Path | None = None, kind: int = 0, joint: int | None = None
) -> str:
    """The text of a controller's file.

    ``kind``: LinuxCNC's COMP_FILE_TYPE, 0 (positions) or 1 (trims); Siemens' number of the measuring system.
    ``joint``: number of the axis in the controller; default: x 0, y 1, z 2. :class:`InputError` as
    :func:`check_format`, and naming the line of a template that fails.
    """
    check_format(table, known)
    source = Path(template) if template else folder("templates") / "compensation" / known.template
    number = "xyz".index(table.axis) if joint is None else joint
    context = {
        "table": table,
        "rows": [dict(zip((*COLUMNS, "from_positive", "from_negative"), row, strict=True)) for row in _rows(table)],
        "about": table.about,
        "notes": table.notes,
        "kind": kind,
        "line": straight_line(table),
        "pulses": pitch_pulses(table, number) if known.name.startswith("fanuc") else {},
        "unconfirmed": known.unconfirmed,
        "joint": number,
        "version": __version__,
    }
    text = fill_template(source, "compensation", context)
    check_printable(text, source)
    return text


def _rows(table: CompensationTable) -> list[tuple[Any, ...]]:
    columns = [getattr(table, name).tolist() for name in (*COLUMNS, "from_positive", "from_negative")]
    return list(zip(*columns, strict=True))


def table_to_dict(table: CompensationTable) -> dict[str, Any]:
    """The table with all that is known about it, as JSON types."""
    return {
        "format": FORMAT,
        "stepgauge": __version__,
        "axis": table.axis,
        "error": "indicated minus true coordinate of the axis, um; positive, negative: sense of travel",
        "travel": table.travel,
        "zero_at_mm": table.zero_at_mm,
        "about": dict(table.about),
        "notes": list(table.notes),
        "rows": [dict(zip((*COLUMNS, "from_positive", "from_negative"), row, strict=True)) for row in _rows(table)],
    }


def write_table(path: str | Path, text: str, table: CompensationTable) -> list[Path]:
    """Write the controller's file and beside it ``<name>.json``, which says what it is; returns their paths."""
    target = Path(path)
    beside = target.with_name(target.name + ".json")
    write_json(beside, table_to_dict(table))
    write_text(target, text)
    return [target, beside]
