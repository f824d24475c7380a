"""A compensation table as the file of a controller, through a Jinja template.

A template sees ``table`` (:class:`~stepgauge.compensation.table.CompensationTable`), ``rows`` (each with
``position_mm``, ``positive_um``, ``negative_um``, ``mean_um``, ``reversal_um``, ``u_positive_um``, ``u_negative_um``,
``from_positive``, ``from_negative``), ``line`` and ``pulses`` (:mod:`stepgauge.compensation.reduced`), ``convention``
(:class:`~stepgauge.compensation.conventions.Convention`: what the control does with a value, what it needs, and where
that was read), ``about`` and ``notes`` (plain ASCII), ``joint`` and ``kind`` (numbers that a format asks for) and
``version``; the filters of :mod:`stepgauge.files.templating`.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from stepgauge import __version__
from stepgauge.compensation.conventions import CONVENTIONS, Convention
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
    """A controller's table: which senses of travel it tells apart by default and at all, and its limits."""

    name: str
    title: str
    travel: Travel
    both: bool
    even: bool
    most_rows: int | None = None

    @property
    def template(self) -> str:
        """File name of the shipped template."""
        return f"compensation-{self.name}.j2"

    @property
    def convention(self) -> Convention:
        """What the control does with the values."""
        return CONVENTIONS[self.name]


FORMATS = {
    known.name: known
    for known in (
        Format("linuxcnc", "LinuxCNC screw compensation (COMP_FILE)", "both", True, False, 256),
        Format("siemens", "Siemens SINUMERIK $AA_ENC_COMP", "mean", False, True),
        Format("siemens-cec", "Siemens SINUMERIK $AN_CEC, a table for each sense", "both", True, True),
        Format("heidenhain", "HEIDENHAIN compensation table (.COM)", "both", True, False, 256),
        Format("fanuc", "Fanuc stored pitch error compensation", "both", True, True, 128),
        Format("fanuc-g10", "the same as a program (G10 L50)", "both", True, True, 128),
        Format("grbl", "steps per mm of grbl, play of grblHAL", "both", True, False),
        Format("marlin", "scale and play of Marlin (M92, M425)", "both", True, False),
        Format("rrf", "scale and play of RepRapFirmware (M579, M425)", "both", True, False),
        Format("csv", "table for any other controller", "both", True, False),
    )
}


def check_confirmed(known: Format, unconfirmed_sense: str | None) -> None:
    """:class:`InputError` where what no source confirms is not asked for by name, or asked for in vain."""
    missing = known.convention.unconfirmed
    if missing and unconfirmed_sense != known.name:
        raise InputError(
            known.title,
            "no manual and no source code that we read confirms what is written: a wrong sense doubles the error",
            found=missing,
            expected=naming("unconfirmed_sense", words=f"{{}} {known.name}, and a comparison at one position"),
        )
    if not missing and unconfirmed_sense is not None:
        raise InputError(
            naming("unconfirmed_sense"), f"the sense of {known.name} is confirmed", found=unconfirmed_sense
        )


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
    table: CompensationTable,
    known: Format,
    template: str | Path | None = None,
    kind: int = 0,
    joint: int | None = None,
    unconfirmed_sense: str | None = None,
) -> str:
    """The text of a controller's file.

    ``kind``: LinuxCNC's COMP_FILE_TYPE, 0 (positions) or 1 (trims); Siemens' number of the measuring system.
    ``joint``: number of the axis in the controller; default: x 0, y 1, z 2. ``unconfirmed_sense``: name of the format,
    where no source confirms its sense and it is to be written all the same. :class:`InputError` as
    :func:`check_format` and :func:`check_confirmed`, and naming the line of a template that fails.
    """
    check_confirmed(known, unconfirmed_sense)
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
        "convention": known.convention,
        "joint": number,
        "version": __version__,
    }
    text = fill_template(source, "compensation", context)
    check_printable(text, source)
    return text


def _rows(table: CompensationTable) -> list[tuple[Any, ...]]:
    columns = [getattr(table, name).tolist() for name in (*COLUMNS, "from_positive", "from_negative")]
    return list(zip(*columns, strict=True))


def table_to_dict(table: CompensationTable, known: Format) -> dict[str, Any]:
    """The table with all that is known about it and about its format, as JSON types."""
    return {
        "format": FORMAT,
        "stepgauge": __version__,
        "axis": table.axis,
        "error": "indicated minus true coordinate of the axis, um; positive, negative: sense of travel",
        "controller": {"format": known.name, **asdict(known.convention)},
        "travel": table.travel,
        "zero_at_mm": table.zero_at_mm,
        "about": dict(table.about),
        "notes": list(table.notes),
        "rows": [dict(zip((*COLUMNS, "from_positive", "from_negative"), row, strict=True)) for row in _rows(table)],
    }


def write_table(path: str | Path, text: str, table: CompensationTable, known: Format) -> list[Path]:
    """Write the controller's file and beside it ``<name>.json``, which says what it is; returns their paths."""
    target = Path(path)
    beside = target.with_name(target.name + ".json")
    write_json(beside, table_to_dict(table, known))
    write_text(target, text)
    return [target, beside]
