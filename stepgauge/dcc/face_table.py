"""The table of a calibration certificate, as somebody types, pastes or exports it -> faces of a gauge.

A column is a hypothesis: its header says what it has, else its numbers do. Whoever knows better says so by column.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from stepgauge.dcc.gauge_read import SUBTRACTIONS
from stepgauge.errors import InputError, naming
from stepgauge.files.arrays import Array
from stepgauge.files.notation import rounded
from stepgauge.files.units import find_unit
from stepgauge.gauge.certified import LONGEST_MM
from stepgauge.importing.tables.grid import Table
from stepgauge.importing.tables.questions import Decisions
from stepgauge.importing.tables.read import DECIMALS, TableLayout, only_table, read_file
from stepgauge.importing.tables.source import Given, read_source
from stepgauge.importing.tables.vocabulary import signs_of, subtractions

Role = Literal["face", "nominal", "position", "deviation", "uncertainty", "unused"]
ROLES: tuple[Role, ...] = get_args(Role)
UNITS: Mapping[str, float] = {"mm": 1.0, "um": 1e-3, "m": 1e3, "inch": 25.4}
"""Units of a certificate, in mm."""
_HEADERS: Sequence[tuple[Role, str]] = (
    ("uncertainty", r"^U\b|[uU]ncert|[uU]nsicher|\bU\s*\("),
    ("deviation", r"deviation|error|abweich|diff|korrektur|correction"),
    ("nominal", r"nominal|nenn|soll"),
    ("position", r"position|certified|calibrated|actual|measured|\bist|istma|länge|length|distance|abstand|kalibrier"),
    ("face", r"face|fläche|^n[or]?\.?$|^#$|number|nummer|point|punkt"),
)
_PLAIN_DEVIATION = re.compile("deviation|error|abweich|diff", re.IGNORECASE)
LARGEST_DEVIATION_MM = 0.2
LARGEST_MM = {"deviation": LARGEST_DEVIATION_MM, "uncertainty": 0.05, "position": LONGEST_MM}
"""No certificate of a step gauge states more."""
UNSURE_UM = (0.01, 0.05)
"""An uncertainty without a unit in this range may be one of each unit."""
SAME_MM = 2e-4
"""Difference within which a stated deviation is that of the positions, rounded."""
NOTES: Mapping[str, str] = {
    "face_1_added": "the face at 0 is not in the table: it was added as face 1",
    "from_face_0": "the certificate counts its faces from 0: they are counted from 1",
    "nominal_rounded": "nominal positions are not in the table: the positions rounded to whole mm",
}
PITCH_MM = 1.0
"""Nominal positions that a certificate leaves out are whole multiples of it."""


@dataclass(frozen=True)
class FaceColumn:
    """A column: its header, what it was taken for and why, and the unit of its numbers (empty: none)."""

    header: str
    role: Role
    why: str
    unit: str = ""


@dataclass(frozen=True)
class FaceTable:
    """The faces: ``values (n, 4)`` has face, nominal mm, position mm and expanded uncertainty um.

    ``columns``: of the table that was given, ``rows``: its cells; ``notes``: what was added to it, keys of
    :data:`NOTES`.
    """

    columns: tuple[FaceColumn, ...]
    rows: tuple[tuple[str, ...], ...]
    values: Array
    notes: tuple[str, ...]


def read_face_table(
    given: Given,
    roles: Mapping[int, str] | None = None,
    units: Mapping[str, str] | None = None,
    expanded: tuple[float, float] | None = None,
    decimal: str = "",
) -> FaceTable:
    """The faces in a table of a certificate: text with any delimiter and decimal mark, or an Excel workbook.

    Parameters
    ----------
    given : the table
    roles : by number of a column (from 0), one of :data:`ROLES`, where it is known better than by header and numbers
    units : by role (``position``, ``deviation``, ``uncertainty``), one of :data:`UNITS`; ``sign``: of deviations, one
        of :data:`~stepgauge.dcc.gauge_read.SUBTRACTIONS`
    expanded : a in um and b in um/m of U = a + b L, where the certificate states this instead of a column of U
    decimal : ``point`` or ``comma``, where the numbers do not tell

    Raises
    ------
    InputError
        no position and no deviation in it, no uncertainty, a unit that cannot be known
    """
    source = read_source(given)
    table = only_table(source, TableLayout(decimal=DECIMALS.get(decimal)))
    columns = _columns(table, roles or {})
    _check_once(source.name, columns)
    values, columns, notes = _values(table, columns, units or {}, expanded)
    return FaceTable(tuple(columns), _cells(table), values, notes)


def preview(given: Given, roles: Mapping[int, str] | None = None) -> FaceTable:
    """The columns and rows alone, whatever is wrong with their numbers."""
    table = read_file(read_source(given), TableLayout(), Decisions()).tables[0]
    return FaceTable(tuple(_columns(table, roles or {})), _cells(table), np.empty((0, 4)), ())


def _cells(table: Table) -> tuple[tuple[str, ...], ...]:
    return tuple(tuple(str(cell) for cell in row) for row in table.rows)


def _columns(table: Table, roles: Mapping[int, str]) -> list[FaceColumn]:
    found: list[FaceColumn] = []
    for place, header in enumerate(table.headers):
        if (stated := roles.get(place)) in ROLES:
            found.append(FaceColumn(header, stated, "stated"))
        else:
            named = _named(header)
            taken = {one.role for one in found} | set(roles.values())
            free = named is not None and named not in taken
            found.append(FaceColumn(header, named if free and named else "unused", "header" if free else ""))
    return _guess_roles(table, found, roles)


def _named(header: str) -> Role | None:
    """What a header says; a subtraction (Soll-Ist) is a deviation, and only a capital U an uncertainty."""
    if subtractions(header):
        return "deviation"
    flags: dict[Role, re.RegexFlag] = {"uncertainty": re.NOFLAG}
    matches = (role for role, words in _HEADERS if re.search(words, header.strip(), flags.get(role, re.IGNORECASE)))
    return next(matches, None)


def _guess_roles(table: Table, columns: list[FaceColumn], roles: Mapping[int, str]) -> list[FaceColumn]:
    """What no header says, the numbers do where only one reading is possible: whoever knows says the rest."""
    there = {one.role for one in columns}
    open_ = [n for n, one in enumerate(columns) if one.role == "unused" and n not in roles and not one.header.strip()]
    small = []
    for place in open_:
        role = _rising_role(table.numbers(place))
        if role is not None and role not in there:
            there.add(role)
            columns[place] = FaceColumn("", role, "numbers")
        elif _is_small(table.numbers(place)):
            small.append(place)
    for place, role in _small_roles(table, small, there).items():
        columns[place] = FaceColumn("", role, "numbers")
    return columns


def _rising_role(values: Array) -> Role | None:
    """1, 2, 3, also from 0 or 2, are faces; rising whole numbers are nominal positions, others certified ones."""
    if not np.isfinite(values).all() or len(values) < 2 or not (np.diff(values) > 0).all() or np.ptp(values) <= 1.0:
        return None
    if values[0] in (0.0, 1.0, 2.0) and (np.diff(values) == 1.0).all():
        return "face"
    return "nominal" if np.allclose(values, np.round(values, 1), atol=1e-9) else "position"


def _is_small(values: Array) -> bool:
    return bool(np.isfinite(values).all() and (np.abs(values) < LARGEST_DEVIATION_MM * 1e3).all())


def _small_roles(table: Table, small: Sequence[int], there: set[Role]) -> dict[int, Role]:
    """Which of the columns of small numbers are deviations and uncertainties: no uncertainty is negative."""
    signed = [place for place in small if (table.numbers(place) < 0).any()]
    rest = [place for place in small if place not in signed]
    found: dict[int, Role] = {}
    if len(signed) == 1 and "deviation" not in there:
        found[signed[0]] = "deviation"
    known = there & {"position", "deviation"} or found
    if len(rest) == 1 and known and "uncertainty" not in there:
        found[rest[0]] = "uncertainty"
    return found


def _check_once(name: str, columns: Sequence[FaceColumn]) -> None:
    for role in ROLES[:-1]:
        several = [one.header or f"column {n}" for n, one in enumerate(columns, 1) if one.role == role]
        if len(several) > 1:
            raise InputError(
                name, f"two columns are taken for the {role}", found=", ".join(several), expected="one column"
            )


def _values(
    table: Table, columns: list[FaceColumn], units: Mapping[str, str], expanded: tuple[float, float] | None
) -> tuple[Array, list[FaceColumn], tuple[str, ...]]:
    place: dict[Role, int] = {one.role: n for n, one in enumerate(columns) if one.role != "unused"}
    _check_there(table, place, expanded)
    notes: list[str] = []
    for role, where in place.items():
        bad = np.flatnonzero(~np.isfinite(table.numbers(where)))
        if bad.size:
            cells = table.cells(where)
            expected = "a number in every row; choose another column for it, if this one is something else"
            found = repr(str(cells[int(bad[0])]))
            raise InputError(table.at(int(bad[0])), f"the {role} is no number", found=found, expected=expected)
    position, nominal, columns = _lengths(table, place, columns, units, notes)
    if expanded is None:
        columns = _assign_unit(table, columns, place["uncertainty"], units, "uncertainty")
        u_um = table.numbers(place["uncertainty"]) * UNITS[columns[place["uncertainty"]].unit] * 1e3
    else:
        u_um = expanded[0] + expanded[1] * nominal / 1e3
    face = table.numbers(place["face"]) if "face" in place else np.arange(1.0, len(position) + 1)
    if face[0] == 0.0 and position[0] == 0.0:
        face = face + 1.0
        notes.append("from_face_0")
    elif len(position) % 2 and position[0] > 1.0 and ("face" not in place or face[0] in (1.0, 2.0)):
        face, nominal, position, u_um = (
            np.concatenate([[0.0], one]) for one in (face - face[0] + 2.0, nominal, position, u_um)
        )
        face[0] = 1.0
        notes.append("face_1_added")
    return np.column_stack([face, nominal, position, u_um]), columns, tuple(notes)


EITHER_U = "a column of U, or its terms a (um) and b (um/m) of U = a + b·L"


def _check_there(table: Table, place: Mapping[Role, int], expanded: tuple[float, float] | None) -> None:
    if "position" not in place and not {"nominal", "deviation"} <= set(place):
        expected = "a column of certified positions, or of nominal positions and deviations"
        raise InputError(table.path, "the positions are not found", found=_shown(table), expected=expected)
    if "uncertainty" not in place and expanded is None:
        raise InputError(table.path, "the uncertainty is not found", found=_shown(table), expected=EITHER_U)
    if "uncertainty" in place and expanded is not None:
        raise InputError(table.path, "the uncertainty is stated twice", expected=EITHER_U)


def _shown(table: Table) -> str:
    return ", ".join(repr(one) for one in table.headers if one) or f"{len(table.headers)} columns without a header"


def _lengths(
    table: Table, place: Mapping[Role, int], columns: list[FaceColumn], units: Mapping[str, str], notes: list[str]
) -> tuple[Array, Array, list[FaceColumn]]:
    for role in ("nominal", "position"):
        if role in place:
            columns = _assign_unit(table, columns, place[role], units, "position")

    def lengths(role: Role) -> Array:
        return table.numbers(place[role]) * UNITS[columns[place[role]].unit]

    if "deviation" in place and "position" not in place:
        columns = _assign_unit(table, columns, place["deviation"], units, "deviation")
        sign = _sign(table, columns[place["deviation"]].header, units.get("sign", ""))
        return lengths("nominal") + sign * lengths("deviation"), lengths("nominal"), columns
    position = lengths("position")
    if "nominal" in place:
        if "deviation" in place:
            columns = _assign_unit(table, columns, place["deviation"], units, "deviation")
            _check_deviations(table, position - lengths("nominal"), lengths("deviation"))
        return position, lengths("nominal"), columns
    nominal = np.round(position / PITCH_MM) * PITCH_MM
    if np.abs(position - nominal).max() > LARGEST_DEVIATION_MM / 2:
        expected = "a column of nominal positions"
        raise InputError(table.path, "the nominal positions are not found", found=_shown(table), expected=expected)
    notes.append("nominal_rounded")
    return position, nominal, columns


def _sign(table: Table, header: str, asked: str) -> int:
    """+1 for deviations that are measured minus nominal, as without other words, -1 for the other order."""
    signs = (
        {sign for sign, name in SUBTRACTIONS.items() if name == asked}
        or signs_of(header, bool(_PLAIN_DEVIATION.search(header)))
        or {1}
    )
    if len(signs) > 1:
        what = "the header of the deviations contradicts itself"
        raise InputError(table.path, what, found=repr(header), expected=naming("deviations"))
    return next(iter(signs))


def _check_deviations(table: Table, found_mm: Array, stated_mm: Array) -> None:
    """Deviations beside both positions repeat them, in either sign."""
    off = np.abs(np.abs(found_mm) - np.abs(stated_mm))
    if off.max() > SAME_MM:
        row = int(off.argmax())
        raise InputError(
            table.at(row),
            "position minus nominal is not the stated deviation",
            found=f"{rounded(1e3 * found_mm[row], 3)} um",
            expected=f"{rounded(1e3 * stated_mm[row], 3)} um",
        )


def _assign_unit(
    table: Table, columns: list[FaceColumn], place: int, units: Mapping[str, str], of: str
) -> list[FaceColumn]:
    """The columns with the unit of one of them: stated, in its header, or, where only one is possible, by its size."""
    one, asked = columns[place], units.get(of, "")
    unit = asked if asked in UNITS else _header_unit(one.header, table, place)
    if not unit and of == "position":
        unit = "mm"
    if not unit:
        unit = _unit_by_size(table, place, of)
    elif not asked and of in LARGEST_MM:
        _check_size(table, place, of, unit)
    return [FaceColumn(c.header, c.role, c.why, unit) if n == place else c for n, c in enumerate(columns)]


def _header_unit(header: str, table: Table, place: int) -> str:
    found = table.units[place]
    words = [found.name] if found is not None else re.findall(r"[A-Za-zµμ]+", header)
    known = [unit.name for unit in map(find_unit, reversed(words)) if unit is not None and unit.name in UNITS]
    return known[0] if known else ""


def _check_size(table: Table, place: int, of: str, unit: str) -> None:
    """:class:`InputError` where the header says mm, and only um makes numbers of a gauge."""
    values = table.numbers(place)
    row = int(np.abs(values).argmax())
    largest = abs(float(values[row])) * UNITS[unit]
    if unit == "mm" and LARGEST_MM[of] < largest <= LARGEST_MM[of] * 1e3:
        what = f"the {of} is far too large in mm and looks like um (factor 1000)"
        expected = "um in the name of the column" if of == "position" else naming(f"{of}_unit")
        raise InputError(table.at(row), what, found=f"{values[row]:g} mm", expected=expected)


def _unit_by_size(table: Table, place: int, of: str) -> str:
    largest = float(np.abs(table.numbers(place)).max())
    low, high = UNSURE_UM if of == "uncertainty" else (UNSURE_UM[0], LARGEST_DEVIATION_MM)
    if 0.0 < largest < low:
        return "mm"
    if largest > high or largest == 0.0:
        return "um"
    what = f"the unit of the {of} is not stated, and {largest:g} may be mm or um"
    raise InputError(table.at(0), what, expected=naming(f"{of}_unit"))
