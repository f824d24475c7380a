"""What every report is made of: one structure that ``report.typ`` and ``report.html.j2`` print, whatever was measured.

Order on paper: identity and result with its statements on page 1, then figures, sections, tables, lists, what was not
stated, and at the very end the signatures, so that whoever signs has everything before them.
"""

from __future__ import annotations

import datetime
import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from stepgauge import __version__
from stepgauge.files.notation import UNDEFINED, aligned, clean, number, quantity, uncertain
from stepgauge.recording.simulated import is_simulated
from stepgauge.reports.sections import Section

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BETWEEN = "*"
"""A cell that ends so is interpolated: printed in italics, its mark beside the digits."""


@dataclass(frozen=True)
class UserStatements:
    """Statements that only the user can make; None if not stated."""

    date: datetime.date
    number: str | None = None
    customer: str | None = None
    location: str | None = None
    operator: str | None = None
    remarks: str | None = None
    language: str = "en"

    @property
    def own(self) -> tuple[str, ...]:
        """The words that people wrote."""
        return tuple(text for text in (self.number, self.customer, self.location, self.operator, self.remarks) if text)


@dataclass(frozen=True)
class TableColumn:
    """A column of a table: name, unit, and whether its cells are numbers (set right) or words (set left).

    ``place`` stands below the name.
    """

    name: str
    unit: str = ""
    words: bool = False
    place: str = ""


@dataclass(frozen=True)
class PrintedTable:
    """A table of text; ``note`` and ``figure`` (and its caption) stand below it.

    Rows of ``strong`` are bold, those of ``ruled`` have a line above; every ``stripe`` rows the ground changes (0:
    never).
    """

    title: str
    columns: Sequence[TableColumn]
    rows: Sequence[Sequence[str]]
    note: str = ""
    strong: Sequence[int] = ()
    ruled: Sequence[int] = ()
    stripe: int = 1
    figure: tuple[Figure, str] | None = None

    def to_dict(self) -> dict[str, Any]:
        """Plain containers for a template; every row must have a cell for every column."""
        if any(len(row) != len(self.columns) for row in self.rows):
            raise ValueError(f"table {self.title!r}: a row has another number of cells than there are columns")
        marked = [any(row[i].endswith(BETWEEN) for row in self.rows) for i in range(len(self.columns))]
        return {
            "title": self.title,
            "columns": [
                {"name": c.name, "unit": c.unit, "words": c.words, "place": c.place, "marked": m}
                for c, m in zip(self.columns, marked, strict=True)
            ],
            "rows": [[clean(cell) for cell in row] for row in self.rows],
            "note": self.note,
            "strong": list(self.strong),
            "ruled": list(self.ruled),
            "stripe": self.stripe,
            "figure": None if self.figure is None else {"svg": self.figure[0], "caption": self.figure[1]},
        }


Cells = tuple[TableColumn, Callable[[Any], str]]
"""A column, and what of a row stands in it."""


def words(name: str, cell: str | Callable[[Any], object]) -> Cells:
    """A column of text: of a key, or of what a function makes of a row."""
    made = (lambda row: row[cell]) if isinstance(cell, str) else cell
    return TableColumn(name, words=True), lambda row: str(made(row))


def numbers(name: str, unit: str, cell: str | Callable[[Any], Any], decimals: int) -> Cells:
    """A column of numbers with their unit in the head; – where a row has none."""
    made = (lambda row: row[cell]) if isinstance(cell, str) else cell
    return TableColumn(name, unit), lambda row: number(made(row), decimals)


def quantities(name: str, cell: str | Callable[[Any], Any], decimals: int, unit: str = "µm") -> Cells:
    """A column of numbers, each with its unit; – where a row has none."""
    made = (lambda row: row[cell]) if isinstance(cell, str) else cell
    return TableColumn(name), lambda row: quantity(made(row), decimals, unit)


def measured(name: str, cell: str | Callable[[Any], Any], unit: str = "", own: str = "µm") -> Cells:
    """A column of values that end where their expanded uncertainties do (:func:`uncertain`); – where a row has none.

    ``unit``: in the head; without one each value has its ``own``.
    """
    made = (lambda row: row[cell]) if isinstance(cell, str) else cell
    return _sure(name, unit, own, lambda row: uncertain(made(row), row[EXPANDED], most=2)[0])


def expanded(name: str, unit: str = "", own: str = "µm") -> Cells:
    """The column of these uncertainties."""
    return _sure(name, unit, own, lambda row: uncertain(None, row[EXPANDED], most=2)[1])


def _sure(name: str, unit: str, own: str, said: Callable[[Any], str]) -> Cells:
    tail = "" if unit else f" {own}"
    return TableColumn(name, unit), lambda row: text if (text := said(row)) == UNDEFINED else text + tail


EXPANDED = "expanded_uncertainty_um"
"""Key of an expanded uncertainty in a row of a result."""


def table_of(
    title: str, rows: Iterable[Any], columns: Sequence[Cells], note: str = "", stripe: int = 1
) -> PrintedTable:
    """A table of rows of any kind by its columns."""
    listed = list(rows)
    cells = [[made(row) for row in listed] for _, made in columns]
    shown = [one if column.words else aligned(one) for (column, _), one in zip(columns, cells, strict=True)]
    return PrintedTable(title, [column for column, _ in columns], list(zip(*shown, strict=True)), note, stripe=stripe)


@dataclass
class Page:
    """The content of a report. ``overall`` is the one sentence that decides; ``warnings`` belong beside the result.

    ``figures`` are pairs of a figure and its caption, ``lists`` a title with its items, ``closing`` sections in the
    full width after the tables, ``signatures`` a role and a name, ``end`` the mark of the last page,
    ``mark`` what stands in the place of the accreditation mark (empty: no place), ``data`` a name and JSON, ``own``
    what people wrote, which no language changes.
    """

    title: str
    subtitle: str
    identity: Sequence[Section]
    result: PrintedTable
    data: tuple[str, dict[str, Any]]
    overall: str = ""
    warnings: Sequence[str] = ()
    statements: Sequence[str] = ()
    figures: Sequence[tuple[Figure, str]] = ()
    sections: Sequence[Section] = ()
    tables: Sequence[PrintedTable] = ()
    lists: Sequence[tuple[str, Sequence[str]]] = ()
    closing: Sequence[Section] = ()
    method: str = ""
    not_stated: Sequence[str] = ()
    signatures: Sequence[tuple[str, str | None]] = ()
    end: str | None = None
    issued: str | None = None
    example: bool = False
    mark: str = ""
    own: Sequence[str] = ()
    more: dict[str, Any] = field(default_factory=dict)

    def to_dict(self, stated: UserStatements) -> dict[str, Any]:
        """Plain containers of text for a template; ``more`` adds keys for people's own templates."""
        name, data = self.data
        return {
            "title": self.title,
            "subtitle": self.subtitle,
            "language": stated.language,
            "own": [*self.own, *stated.own, *_own(data)],
            "number": said(stated.number),
            "date": stated.date.isoformat(),
            "date_parts": [stated.date.year, stated.date.month, stated.date.day],
            "issued": self.issued or stated.date.isoformat(),
            "example": self.example,
            "mark": self.mark,
            "simulated": is_simulated(data["comments"]),
            "identity": [section.to_dict() for section in self.identity],
            "result": self.result.to_dict(),
            "overall": clean(self.overall),
            "warnings": [clean(text) for text in self.warnings],
            "statements": [clean(text) for text in self.statements],
            "figures": [{"svg": svg, "caption": clean(caption)} for svg, caption in self.figures],
            "sections": [section.to_dict() for section in self.sections if section.rows],
            "tables": [table.to_dict() for table in self.tables],
            "lists": [
                {"title": title, "items": [clean(item) for item in items]} for title, items in self.lists if items
            ],
            "closing": [section.to_dict() for section in self.closing],
            "remarks": said(stated.remarks),
            "method": self.method,
            "not_stated": list(self.not_stated),
            "signatures": [{"role": role, "name": said(name)} for role, name in self.signatures],
            "end": self.end,
            "data": {"name": name, "text": json.dumps(data, indent=1, ensure_ascii=False)},
            "version": __version__,
            **self.more,
        }


def _own(data: dict[str, Any]) -> list[str]:
    """The names that the files of a result have."""
    gauge = data.get("gauge") or {}
    names = [gauge.get(key) for key in ("name", "serial", "certificate", "laboratory")]
    names += [text for key, text in data["comments"].items() if key != "simulated"]
    return [str(one) for one in names if one]


def said(text: str | None) -> str | None:
    """Cleaned text; None for blanks."""
    return clean(text) or None if text is not None else None


def identity_section(stated: UserStatements, machine: str | None) -> Section:
    """Who, what and when, as the options of a verb state it."""
    section = Section("")
    for label, value in (
        ("Report number", stated.number),
        ("Date of report", stated.date.isoformat()),
        ("Customer", stated.customer),
        ("Place of measurement", stated.location),
        ("Machine", machine),
        ("Operator", stated.operator),
    ):
        section.add(label, said(value))
    return section


def unsaid(stated: UserStatements) -> list[str]:
    """Statements that a report should have and that were not made."""
    asked = (
        ("report number", stated.number),
        ("customer", stated.customer),
        ("place of measurement", stated.location),
        ("operator", stated.operator),
    )
    return [what for what, value in asked if not said(value)]


def measured_and_approved(stated: UserStatements) -> list[tuple[str, str | None]]:
    """The two places to sign of a report."""
    return [("Measured by", stated.operator), ("Approved by", None)]
