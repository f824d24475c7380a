"""The report of a drift test by ISO 230-3."""

from __future__ import annotations

from typing import Any

from stepgauge.figures.drift import drift_figure
from stepgauge.files.notation import make_sentence, number, quantity
from stepgauge.reports.outcome import StandardTest
from stepgauge.reports.page import Page, PrintedTable, UserStatements, quantities, table_of, words
from stepgauge.reports.sections import Section
from stepgauge.reports.standards import recording_lines, rules_table, said_of, test_content, unmet
from stepgauge.standards.drift import DriftTest, drift_csv, drift_to_dict, rules_of
from stepgauge.standards.iso230_decision import Requirement
from stepgauge.standards.rules import incomplete

METHODS = {
    "etve": (
        "The ETVE of a channel is the range (largest minus smallest value) of its displacement over the whole test, the"
        " machine standing still; it is stated for the temperatures of this test only."
    ),
    "axis": (
        "Displacements are counted from the first reading, along the axis of the machine. d_60 is their range in the"
        " first 60 min, d_t their range over the whole time in which the axis moved. P1 and P2 are the targets at the"
        " low and the high end of the axis, + and − the directions of approach, P2 − P1 the change of their distance"
        " (mean of both directions). Of a step gauge a displacement is the change of the indicated position of a face:"
        " the negative of what the axis itself has moved at the same reading."
    ),
}


def drift_content(test: DriftTest, stated: UserStatements) -> dict[str, Any]:
    """The content of the report (see :class:`stepgauge.reports.page.Page`)."""
    data, requirement = drift_to_dict(test), test.requirement
    page = Page(
        "Drift test",
        f"{make_sentence(data['name'], '')} by {data['standard']}",
        (),
        _summary(data, requirement),
        ("iso230-3.json", data),
        overall=data["decision"]["text"],
        statements=[*said_of(test.conditions), *unmet(data["rules"])],
        figures=[(drift_figure(test), f"Displacements and temperatures over {test.duration_s / 3600.0:.1f} h.")],
        sections=[_temperatures(data), _recording(data)],
        tables=[rules_table(data["rules"])],
        lists=[("Unconfirmed readings of the standard", data["unconfirmed"])],
        method=METHODS[test.kind],
        not_stated=[] if requirement.expanded_um is not None else ["measurement uncertainty of the displacements"],
    )
    return test_content(page, stated, None, test.drift.comments.get("machine"))


def _summary(data: dict[str, Any], requirement: Requirement) -> PrintedTable:
    heads = ("ETVE", "First 60 min") if data["test"] == "etve" else ("d_t", "d_60")
    columns = (
        words("Displacement", lambda one: one["channel"].replace("_", " ")),
        quantities(heads[0], "range_um", 2),
        quantities(heads[1], "first_hour_um", 2),
        quantities("At the end", "end_um", 2),
        quantities("Tolerance", lambda one: requirement.tolerance_um.get(one["channel"]), 2),
        words("Decision", lambda one: data["outcomes"].get(one["channel"], "none")),
    )
    title = "Result" if data["complete"] else "Result; not every rule of the standard is met"
    return table_of(title, data["channels"], columns, stripe=0)


def _temperatures(data: dict[str, Any]) -> Section:
    section = Section("Temperatures")
    for name, kelvin in data["temperature_ranges_K"].items():
        section.add(f"Range of {name.replace('_', ' ')}", quantity(kelvin, 2, "K"))
    if not data["temperature_ranges_K"]:
        section.add("Recorded", "none")
    return section


def _recording(data: dict[str, Any]) -> Section:
    section = Section("Recording")
    section.add("Readings", f"{data['readings']} over {number(data['duration_s'] / 3600.0, 2)} h")
    if data["span_mm"] is not None:
        section.add("Distance of P1 and P2", quantity(data["span_mm"], 1, "mm"))
    recording_lines(section, data)
    return section


def drift_outcome(test: DriftTest) -> StandardTest:
    """The test as a result of its verb."""
    lines = [f"note: {note}" for note in test.conditions.notes]
    for one in test.channels:
        hour = f"first 60 min {one.first_hour_um:.2f} um, end {one.end_um:.2f} um"
        lines.append(f"{one.name}: range {one.range_um:.2f} um, {hour}")
    decision = test.requirement.decision([("", test.values_um)])
    lines.append(decision.text)
    lines += [f"- {text}" for text in incomplete(rules_of(test))]
    return StandardTest(
        test,
        decision,
        tuple(lines),
        "iso230-3",
        drift_to_dict(test),
        {"": drift_csv(test)},
        lambda stated: drift_content(test, stated),
        lambda: {"": drift_figure(test)},
    )
