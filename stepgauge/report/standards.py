"""Reports of standard tests: one structure that ``templates/reports/standard.typ`` prints for any of them.

As everywhere, what nobody stated is listed as not stated and nothing is filled in.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from stepgauge import __version__
from stepgauge.gauge import Gauge
from stepgauge.machine_file import Machine
from stepgauge.report.content import Stated
from stepgauge.report.numbers import clean, number
from stepgauge.report.render import write_report
from stepgauge.report.sections import Section
from stepgauge.resources import folder


def write_standard_report(
    path: str | Path, content: dict[str, Any], template: str | Path | None = None
) -> tuple[str, ...]:
    """Write a report of :func:`standard_content` through a Typst template (None: the shipped one); returns notes."""
    return write_report(path, content, template or folder("templates") / "reports" / "standard.typ")


@dataclass(frozen=True)
class Column:
    """A column of a table: name, unit, and whether its cells are numbers (set right) or words (set left)."""

    name: str
    unit: str = ""
    words: bool = False


@dataclass(frozen=True)
class PrintedTable:
    """A table of text; ``note`` stands below it."""

    title: str
    columns: Sequence[Column]
    rows: Sequence[Sequence[str]]
    note: str = ""

    def as_dict(self) -> dict[str, Any]:
        """Plain containers for a template; every row must have a cell for every column."""
        if any(len(row) != len(self.columns) for row in self.rows):
            raise ValueError(f"table {self.title!r}: a row has another number of cells than there are columns")
        columns = [{"name": one.name, "unit": one.unit, "words": one.words} for one in self.columns]
        return {"title": self.title, "columns": columns, "rows": [list(row) for row in self.rows], "note": self.note}


@dataclass
class StandardReport:
    """What a report of a standard test says; ``figures`` are pairs of SVG and caption, ``data`` a name and JSON."""

    title: str
    subtitle: str
    summary: PrintedTable
    statements: Sequence[str]
    sections: list[Section]
    figures: Sequence[tuple[str, str]]
    rules: PrintedTable
    tables: Sequence[PrintedTable]
    method: str
    data: tuple[str, dict[str, Any]]
    missing: list[str] = field(default_factory=list)


def standard_content(report: StandardReport, stated: Stated, gauge: Gauge, machine: str | None) -> dict[str, Any]:
    """The content of a report, as plain text in plain containers; ``machine`` is its name where it is known."""
    file_name, data = report.data
    asked = (
        ("report number", stated.number),
        ("customer", stated.customer),
        ("place of measurement", stated.location),
        ("operator", stated.operator),
        ("machine", machine),
    )
    missing = [what for what, value in asked if not _said(value)]
    missing += [what for section in report.sections for what in section.missing] + report.missing
    return {
        "title": report.title,
        "subtitle": report.subtitle,
        "number": _said(stated.number),
        "date": stated.date.isoformat(),
        "date_parts": [stated.date.year, stated.date.month, stated.date.day],
        "example": gauge.certificate.example,
        "simulated": "seed" in data["comments"],
        "identity": [
            {"label": label, "value": _said(value)}
            for label, value in (
                ("Report number", stated.number),
                ("Date of report", stated.date.isoformat()),
                ("Customer", stated.customer),
                ("Place of measurement", stated.location),
                ("Machine", machine),
                ("Operator", stated.operator),
            )
        ],
        "summary": report.summary.as_dict(),
        "statements": [clean(text) for text in report.statements],
        "sections": [section.as_dict() for section in report.sections],
        "figures": [{"svg": svg, "caption": caption} for svg, caption in report.figures],
        "rules": report.rules.as_dict(),
        "tables": [table.as_dict() for table in report.tables],
        "remarks": _said(stated.remarks),
        "not_stated": missing,
        "method": report.method,
        "signatures": [{"role": "Measured by", "name": _said(stated.operator)}, {"role": "Approved by", "name": None}],
        "data": {"name": file_name, "text": json.dumps(data, indent=1, ensure_ascii=False)},
        "version": __version__,
    }


def _said(text: str | None) -> str | None:
    return clean(text) or None if text is not None else None


def _file_names(paths: Sequence[str]) -> str:
    return ", ".join(Path(path).name for path in paths if path)


def rules_table(rules: Sequence[dict[str, Any]], excluded: Sequence[dict[str, str]] = ()) -> PrintedTable:
    """Rules with what was found, then what was left out and why, each with its source."""
    words = {True: "met", False: "not met", None: "not checked"}
    rows = [(words[rule["met"]], rule["asks"], rule["found"], rule["source"]) for rule in rules]
    rows += [("left out", part["what"], part["reason"], part["source"]) for part in excluded]
    columns = [Column(name, words=True) for name in ("", "What is asked, or left out", "Found, or why", "Source")]
    return PrintedTable("Rules of the standard, and what was left out", columns, rows)


def unmet(rules: Sequence[dict[str, Any]]) -> list[str]:
    """One sentence that names the rules that are not met or not checked; none where there are none."""
    asked = [rule["asks"] for rule in rules if not rule["met"]]
    return ["Not met, or not checked (see the table of rules): " + "; ".join(asked) + "."] if asked else []


def machine_lines(section: Section, machine: Machine | None) -> None:
    """The machine as its file has it."""
    if machine is None:
        section.missing.append("machine and its travel (--machine)")
        return
    travel = ", ".join(f"{number(low, 0)} to {number(high, 0)}" for low, high in machine.travel_mm)
    section.add("Travel x, y, z (mm)", travel)
    section.add("Probe", f"{machine.probe.name or 'touch-trigger'}, stylus {machine.probe.shank_length_mm:g} mm")


def recording_lines(section: Section, data: dict[str, Any]) -> None:
    """The recording's files and what they say of themselves."""
    section.add("Recordings", _file_names(data["recording"].split(", ")) or "not stated")
    for key, value in sorted(data["comments"].items()):
        section.add(key, _file_names(value.split("; ")) if key == "program" else value)
    if not {"date", "measured", "time"} & set(data["comments"]):
        section.missing.append("date of the measurement (the recording does not say)")
