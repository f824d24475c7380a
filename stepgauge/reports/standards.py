"""Common parts of reports of tests by a standard, beside :mod:`stepgauge.reports.page`.

Data that were not stated are listed as not stated, and nothing is filled in.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from stepgauge.conditions import Conditions
from stepgauge.files.notation import make_sentence, number
from stepgauge.gauge.certified import Gauge
from stepgauge.machine.file import Machine
from stepgauge.reports.page import (
    Page,
    PrintedTable,
    TableColumn,
    UserStatements,
    identity_section,
    measured_and_approved,
    said,
    unsaid,
)
from stepgauge.reports.sections import Section, add_comments, file_names


def test_content(page: Page, stated: UserStatements, gauge: Gauge | None, machine: str | None) -> dict[str, Any]:
    """The content of a report of a test: identity, places to sign and what is missing are added to its page."""
    missing = [*unsaid(stated), *([] if said(machine) else ["machine"])]
    page.identity = [identity_section(stated, machine)]
    page.own = [machine or ""]
    page.signatures = measured_and_approved(stated)
    page.not_stated = [*missing, *(what for one in page.sections for what in one.missing), *page.not_stated]
    page.example = gauge is not None and gauge.certificate.example
    return page.to_dict(stated)


test_content.__test__ = False  # type: ignore[attr-defined]


def rules_table(rules: Sequence[dict[str, Any]], excluded: Sequence[dict[str, str]] = ()) -> PrintedTable:
    """Rules with what was found, then what was left out and why, each with its source."""
    words = {True: "met", False: "not met", None: "not checked"}
    rows = [(words[rule["met"]], rule["asks"], rule["found"], rule["source"]) for rule in rules]
    rows += [("left out", part["what"], part["reason"], part["source"]) for part in excluded]
    heads = ("Rule", "What is asked, or left out", "Found, or why", "Source")
    columns = [TableColumn(name, words=True) for name in heads]
    return PrintedTable("Rules of the standard, and what was left out", columns, rows)


def said_of(conditions: Conditions) -> list[str]:
    """What was found of the readings, in sentences; what prevents a statement is page 1's sentence already."""
    notes = [one.sentence for one in conditions if one.state not in ("met", "prevents")]
    return [make_sentence(note) for note in notes]


def unmet(rules: Sequence[dict[str, Any]]) -> list[str]:
    """One sentence that names the rules that are not met or not checked; none where there are none."""
    asked = [rule["asks"] for rule in rules if not rule["met"]]
    return ["Not met, or not checked (see the table of rules): " + "; ".join(asked) + "."] if asked else []


def machine_lines(section: Section, machine: Machine | None) -> None:
    """The machine as its file has it."""
    if machine is None:
        section.missing.append("machine and its travel (machine file)")
        return
    travel = ", ".join(f"{number(low, 0)} to {number(high, 0)}" for low, high in machine.travel_mm)
    section.add("Travel x, y, z (mm)", travel)
    section.add("Probe", f"{machine.probe.name or 'touch-trigger'}, stylus {machine.probe.shank_length_mm:g} mm")


def recording_lines(section: Section, data: dict[str, Any]) -> None:
    """The recording's files and what they say of themselves."""
    section.add("Recordings", file_names(data["recording"].split(", ")) or "not stated")
    add_comments(section, data["comments"])
