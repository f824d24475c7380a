"""A compensation table as the file of a controller, through a Jinja template.

A template sees ``table`` (:class:`~stepgauge.compensation.table.CompensationTable`), ``rows`` (each with
``position_mm``, ``positive_um``, ``negative_um``, ``mean_um``, ``reversal_um``, ``u_positive_um``, ``u_negative_um``,
``from_positive``, ``from_negative``), ``line`` and ``pulses`` (:mod:`stepgauge.compensation.formats`), ``convention``
(:class:`~stepgauge.compensation.conventions.Convention`: what the control does with a value, what it needs, and where
that was read), ``about`` and ``notes`` (plain ASCII), ``joint`` and ``kind`` (numbers that a format asks for) and
``version``; the filters of :mod:`stepgauge.files.templating`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from stepgauge import __version__
from stepgauge.compensation.conventions import CONVENTIONS, Convention
from stepgauge.compensation.table import CompensationTable, Travel
from stepgauge.errors import InputError, naming
from stepgauge.files.arrays import Array
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


PULSE_UM = 1.0
"""Least input increment that the pulses of a pitch error table are counted in."""
MOST_PULSES, MOST_MAGNIFICATION = 7, 100
POINTS, POINTS_OF_AXIS = 1024, 256
"""Numbers of points in a control, and of an axis: both senses of up to 128, so that no axis has those of another."""


def straight_line(table: CompensationTable) -> dict[str, float | None]:
    """The least-squares line through the mean of both senses, and what it leaves.

    ``ppm``: slope of the error (indicated minus true) in um per m; ``factor``: by which commands must be stretched,
    1 / (1 - slope); ``play_mm``: mean reversal (positive minus negative travel), None where no tip radius was stated,
    from which readings cannot tell it; ``left_um``: largest error that
    neither corrects.
    """
    x, mean = table.position_mm, table.mean_um
    slope, offset = np.polyfit(x, mean, 1)
    play_um = float(table.reversal_um.mean())
    left = [table.positive_um - play_um / 2.0, table.negative_um + play_um / 2.0]
    return {
        "ppm": float(slope * 1e3),
        "factor": float(1.0 / (1.0 - slope * 1e-3)),
        "play_mm": play_um * 1e-3 if table.reversal_known else None,
        "left_um": float(np.abs(np.array(left) - (slope * x + offset)).max()),
    }


def pitch_pulses(table: CompensationTable, joint: int = 0) -> dict[str, Any]:
    """Increments of the error in whole pulses, from each point to the next, by sense of travel.

    ``magnification``: the smallest that keeps every pulse within +-7; ``points``: one entry a point, of which the first
    stands at the low end and is 0; ``reference``: number of the point nearest to the zero of the table. Rounding does
    not add up: the sum of pulses up to a point is the rounded error there. ``first``: number of the lowest point in the
    control, 256 times ``joint`` (the axis, from 0). :class:`InputError` for a table too steep and an axis too many.
    """
    first = POINTS_OF_AXIS * joint
    if first >= POINTS:
        most = POINTS // POINTS_OF_AXIS - 1
        raise InputError(naming("joint"), "no points left in the control", found=joint, expected=f"0 to {most}")
    reference = int(np.abs(table.position_mm - table.zero_at_mm).argmin())
    senses = {"positive": table.positive_um, "negative": table.negative_um}
    magnification, steps = _fewest_pulses(senses, reference)
    unit = PULSE_UM * magnification
    there = (table.negative_um - table.positive_um)[reference]
    return {
        "magnification": magnification,
        "unit_um": unit,
        "first": first,
        "reference": reference,
        "points": [dict(zip(senses, pair, strict=True)) for pair in zip(*steps, strict=True)],
        "at_reference": int(np.rint(there / unit)),
    }


def _fewest_pulses(senses: Mapping[str, Array], reference: int) -> tuple[int, list[list[int]]]:
    """The smallest magnification that a control can hold, and the pulses to each point by sense of travel."""
    for magnification in range(1, MOST_MAGNIFICATION + 1):
        unit = PULSE_UM * magnification
        steps = [np.diff(np.rint((values - values[reference]) / unit)).astype(int) for values in senses.values()]
        if max(np.abs(one).max() for one in steps) <= MOST_PULSES:
            return magnification, [[0, *one.tolist()] for one in steps]
    raise InputError(
        naming("step_mm"),
        "the error changes too much from point to point",
        expected=f"{MOST_PULSES * MOST_MAGNIFICATION} um",
    )
