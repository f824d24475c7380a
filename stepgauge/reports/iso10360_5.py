"""The report of a probing test by ISO 10360-5."""

from __future__ import annotations

from typing import Any

from stepgauge.figures.iso10360_5 import probing_figure
from stepgauge.files.notation import quantity, vector
from stepgauge.reports.outcome import StandardTest
from stepgauge.reports.page import (
    Page,
    PrintedTable,
    UserStatements,
    expanded,
    measured,
    numbers,
    quantities,
    table_of,
    words,
)
from stepgauge.reports.sections import Section, add_comments
from stepgauge.reports.standards import rules_table, said_of, test_content, unmet
from stepgauge.standards.iso10360_5 import ProbingTest, rules_of
from stepgauge.standards.iso10360_5_files import decide_test, probing_csv, probing_to_dict
from stepgauge.standards.rules import incomplete

METHOD = (
    "P_Form is the range of the radial distances of the points from the centre of the least-squares (Gaussian) sphere,"
    " P_Size the diameter of that sphere minus the calibrated one; the qualified tip diameter is subtracted from the"
    " recorded tip centres. With several styli both are those of one sphere through all surface points, and L_Dia"
    " is the"
    " diameter of the smallest sphere around the centres that the styli find. U covers the test sphere only, not the"
    " machine: u(P_Form) = √((F/2)² + u²(F)) with the form error F of the sphere (ISO/TS 23165), u(P_Size) that of its"
    " diameter."
)


def probing_content(test: ProbingTest, stated: UserStatements, machine: str | None = None) -> dict[str, Any]:
    """The content of the report (see :class:`stepgauge.reports.page.Page`)."""
    data = probing_to_dict(test)
    recording = Section("Recording")
    add_comments(recording, test.comments)
    page = Page(
        "Probing test",
        f"Probing performance of a coordinate measuring machine by {data['standard']}, "
        + ("five styli" if test.multiple else "one stylus"),
        (),
        _summary(data),
        ("iso10360-5.json", data),
        overall=data["decision"]["text"],
        statements=[*said_of(test.conditions), *unmet(data["rules"])],
        figures=[(probing_figure(test), _caption(test))],
        sections=[_sphere(data), _decision(data), recording],
        tables=[rules_table(data["rules"]), _styli(data)],
        lists=[("Unconfirmed readings of the standard", data["unconfirmed"])],
        method=METHOD,
        not_stated=test.missing,
    )
    return test_content(page, stated, None, machine)


def _caption(test: ProbingTest) -> str:
    points = sum(len(one.surface_mm) for one in test.styli)
    return f"Radial deviations of {points} points from the least-squares sphere; the dashed lines are P_Form apart."


def _summary(data: dict[str, Any]) -> PrintedTable:
    columns = (
        words("Characteristic", "symbol"),
        measured("Test value", "value_um"),
        quantities("MPE", "limit_um", 2),
        expanded("U"),
        words("Decision", lambda one: one["outcome"] or "none"),
    )
    title = "Result" if data["complete"] else "Result; not every rule is met or checked"
    return table_of(title, data["values"], columns, stripe=0)


def _sphere(data: dict[str, Any]) -> Section:
    sphere = data["sphere"]
    section = Section("Test sphere")
    section.add("Calibrated diameter", quantity(sphere["diameter_mm"], 5, "mm"))
    section.add("u of the diameter", _stated(sphere["u_diameter_um"]))
    section.add("Form error F", _stated(sphere["form_um"]))
    section.add("u of the form error", _stated(sphere["u_form_um"]))
    return section


def _stated(value_um: float | None) -> str | None:
    return None if value_um is None else quantity(value_um, 3, "µm")


def _decision(data: dict[str, Any]) -> Section:
    section = Section("Decision")
    section.add("Rule", data["decision_rule"])
    section.add("Coverage factor", f"k = {data['coverage_factor']:g}")
    if data["centre_ranges_um"]:
        section.add("Ranges of the centres", vector(data["centre_ranges_um"], 2, "µm") + " in x, y, z")
    return section


def _styli(data: dict[str, Any]) -> PrintedTable:
    columns = (
        numbers("Stylus", "", lambda row: row[0], 0),
        words("File", lambda row: row[1]["file"]),
        words("From the sphere (x, y, z)", lambda row: vector(row[1]["from_sphere"], 2)),
        numbers("Points", "", lambda row: row[1]["points"], 0),
        numbers("Tip, as qualified", "mm", lambda row: row[1]["tip_diameter_mm"], 4),
        numbers("Diameter", "mm", lambda row: row[1]["diameter_mm"], 5),
        numbers("Form", "µm", lambda row: row[1]["form_um"], 2),
    )
    note = "Diameter and form of the sphere that each stylus finds by itself."
    return table_of("Styli", enumerate(data["styli"], 1), columns, note)


def probing_outcome(test: ProbingTest, machine_name: str | None) -> StandardTest:
    """The test as a result of its verb."""
    lines = [f"note: {note}" for note in test.conditions.notes]
    lines += [f"{one.symbol}: {one.value_um:.2f} um" for one in test.values]
    decision = decide_test(test)
    lines += [decision.text, *(f"- {text}" for text in incomplete(rules_of(test)))]
    return StandardTest(
        test,
        decision,
        tuple(lines),
        "iso10360-5",
        probing_to_dict(test),
        {"": probing_csv(test)},
        lambda stated: probing_content(test, stated, machine_name),
        lambda: {"": probing_figure(test)},
    )
