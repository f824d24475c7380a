"""The report of a length test by ISO 10360-2."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from stepgauge.conditions.decision import together
from stepgauge.figures.iso10360 import length_test_figure
from stepgauge.files.notation import number, quantity, uncertainty, vector
from stepgauge.machine.file import Machine
from stepgauge.reports.outcome import StandardTest
from stepgauge.reports.page import (
    Cells,
    Page,
    PrintedTable,
    TableColumn,
    UserStatements,
    expanded,
    measured,
    numbers,
    table_of,
    words,
)
from stepgauge.reports.sections import Section, certificate_section
from stepgauge.reports.standards import machine_lines, recording_lines, rules_table, test_content
from stepgauge.standards.iso10360 import KINDS, LengthTest
from stepgauge.standards.iso10360_files import decide_test, length_test_csv, length_test_to_dict, statements, verdicts

CONTRIBUTIONS = ("certificate", "expansion", "temperature", "alignment", "fixture", "tip diameter")
INFORMATION = "unidirectional, for information"
METHOD = (
    "The error is the indicated length minus the certified one. A bidirectional "
    "length lies between the front of a block and the back of a later one, and the effective tip diameter is"
    " subtracted; "
    "a unidirectional one lies between faces of one side. Conformity is proven where |E| ≤ MPE − U, nonconformity"
    " where "
    "|E| > MPE + U; between these nothing is proven (ISO 14253-1). U covers the test procedure only, not the machine "
    "(ISO/TS 23165). The repeatability range R_0 is the largest minus the smallest error of three repeats; what"
    " makes the "
    "test uncertain is the same in all three, so that nothing is subtracted from its limit."
)


def length_test_content(
    test: LengthTest, stated: UserStatements, machine: Machine | None, further: Sequence[LengthTest] = ()
) -> dict[str, Any]:
    """The content of the report (see :class:`stepgauge.reports.page.Page`); ``further`` series beside E0."""
    data = length_test_to_dict(test, further)
    tests, every = [test, *further], [data, *data["further"]]
    page = Page(
        "Length measurement test",
        "Errors of length measurement of a coordinate measuring machine by ISO 10360-2:2009, with a step gauge",
        (),
        _summary(every),
        ("iso10360.json", data),
        overall=data["decision"]["text"],
        figures=[(length_test_figure(one), caption(two)) for one, two in zip(tests, every, strict=True)],
        sections=[
            certificate_section(data, test.gauge),
            _specification(data),
            _conditions(data),
            _recording(data, machine),
        ],
        tables=[
            *(_rules(each) for each in every),
            *(_positions(each) for each in every),
            _uncertainties(data),
            *(_errors(each, kind) for each in every for kind in KINDS if each["results"][kind]),
        ],
        lists=[("Statements", [text for one in (test, *further) for text in verdicts(one)])],
        method=METHOD,
        not_stated=[f"contribution to U: {what}" for what in test.missing],
    )
    return test_content(page, stated, test.gauge, machine.table.name if machine else test.comments.get("machine"))


def caption(data: dict[str, Any]) -> str:
    """What the figure shows, in a sentence."""
    said = [
        f"{kind}: {result['errors']} errors, the largest {number(result['largest_error_um'], 2)} µm"
        for kind, result in data["results"].items()
        if result
    ]
    symbol = data["series"]["symbol"]
    return (
        f"Errors {symbol} against nominal length, and ± MPE = ± {data['mpe']['text']}; the marks of positions are"
        " set side"
        " by side about the nominal length. " + "; ".join(said) + "."
    )


def _summary(every: Sequence[dict[str, Any]]) -> PrintedTable:
    columns = [
        TableColumn("Characteristic", words=True),
        TableColumn("Test values"),
        TableColumn("Largest"),
        TableColumn("Limit", words=True),
        TableColumn("Largest share of the limit"),
        TableColumn("Decision", words=True),
    ]
    rows = [row for data in every for kind in KINDS if data["results"][kind] for row in _results(data, kind)]
    title = "Result" if all(data["complete"] for data in every) else "Result of an incomplete test"
    return PrintedTable(title, columns, rows, stripe=0)


def _results(data: dict[str, Any], kind: str) -> list[list[str]]:
    """The errors, and the range of the three repeats."""
    result, limit, of_test = data["results"][kind], data["repeatability_limit_um"], kind == "bidirectional"
    symbol = data["series"]["symbol"]
    errors = [
        symbol if of_test else INFORMATION,
        str(result["errors"]),
        quantity(result["largest_error_um"], 2, "µm"),
        f"± {data['mpe']['text']}",
        quantity(100.0 * result["largest_share_of_mpe"], 0, "%"),
        result["outcome"] or "none",
    ]
    if data["series"]["key"] != "e0" or result["largest_range_um"] is None:
        return [errors]
    share = None if limit is None else 100.0 * result["largest_range_um"] / limit
    ranges = [
        "R_0" if of_test else "range of repeats, unidirectional",
        str(result["errors"] // 3),
        quantity(result["largest_range_um"], 2, "µm"),
        "none stated" if limit is None else quantity(limit, 2, "µm"),
        quantity(share, 0, "%"),
        result["repeatability_outcome"] or "none",
    ]
    return [errors, ranges]


def _rules(data: dict[str, Any]) -> PrintedTable:
    table = rules_table(data["rules"], data["excluded"])
    return table if data["series"]["key"] == "e0" else replace(table, title=f"Rules: {data['series']['name']}")


def _specification(data: dict[str, Any]) -> Section:
    section = Section("Specification and decision")
    section.add("E_0,MPE", f"± {data['mpe']['text']}")
    limit = data["repeatability_limit_um"]
    section.add("R_0,MPL", quantity(limit, 2, "µm") if limit is not None else "not stated")
    section.add("Decision rule", data["decision_rule"])
    section.add("Coverage factor", f"k = {data['coverage_factor']:g}")
    return section


def _conditions(data: dict[str, Any]) -> Section:
    section = Section("Tip diameter and temperature")
    tip = data["tip_diameter"]
    if tip is None:
        section.add("Effective tip diameter", "none: unidirectional lengths only")
    else:
        u = "u not stated" if tip["u_um"] is None else f"u = {number(tip['u_um'], 2)} µm"
        section.add("Effective tip diameter", f"{number(tip['diameter_mm'], 5)} mm ({u})")
        section.add("Origin", tip["origin"])
    section.add("Convention", data["temperature_convention"])
    return section


def _recording(data: dict[str, Any], machine: Machine | None) -> Section:
    section = Section("Machine and recording")
    machine_lines(section, machine)
    recording_lines(section, data)
    return section


def _positions(data: dict[str, Any]) -> PrintedTable:
    chosen = {True: "the standard", False: "the user", None: "–"}
    columns = (
        numbers("Position", "", "position", 0),
        words("Along (x, y, z)", lambda one: vector(one["axis"], 4)),
        words("Nearest line", lambda one: one["orientation"] or "–"),
        words("Chosen by", lambda one: chosen[one["mandatory"]]),
        numbers("Off", "°", "orientation_off_deg", 2),
        numbers("Travel along it", "mm", "line_mm", 1),
        numbers("Longest", "mm", "longest_mm", 1),
        numbers("Share", "%", lambda one: one["longest_share"] and 100.0 * one["longest_share"], 0),
        numbers("Gauge", "°C", "gauge_temperature_C", 2),
    )
    tail = "" if data["series"]["key"] == "e0" else f": {data['series']['name']}"
    note = "The standard demands the four body diagonals; the other positions are the user's choice."
    return table_of(f"Measuring positions{tail}", data["positions"], columns, note if not tail else "")


def _uncertainties(data: dict[str, Any]) -> PrintedTable:
    """What U is made of, for the length of each kind that has the largest."""
    kinds = [kind for kind in KINDS if data["results"][kind]]
    worst = [
        max((one for one in data["lengths"] if one["kind"] == kind), key=lambda one: one["expanded_uncertainty_um"])
        for kind in kinds
    ]
    columns = [TableColumn("Standard uncertainty by", words=True)]
    columns += [TableColumn(f"{one['kind']}, {number(one['nominal_mm'], 0)} mm", "µm") for one in worst]
    rows = [(name, *(number(one["uncertainty_um"].get(name), 3) for one in worst)) for name in CONTRIBUTIONS]
    rows.append(("combined", *(uncertainty(one["standard_uncertainty_um"]) for one in worst)))
    factor = f"U, k = {data['coverage_factor']:g}"
    rows.append((factor, *(uncertainty(one["expanded_uncertainty_um"]) for one in worst)))
    note = "Of the lengths with the largest U. – not stated, or without influence on this length."
    return PrintedTable("Uncertainty of the test", columns, rows, note)


def _errors(data: dict[str, Any], kind: str) -> PrintedTable:
    lengths = [one for one in data["lengths"] if one["kind"] == kind]
    columns = (
        numbers("Position", "", "position", 0),
        words("Faces", lambda one: f"{one['faces'][0]} to {one['faces'][1]}"),
        numbers("Nominal", "mm", "nominal_mm", 3),
        numbers("Certified", "mm", "certified_mm", 5),
        *(_repeat(place) for place in range(max(len(one["errors_um"]) for one in lengths))),
        numbers("Range", "µm", "range_um", 2),
        numbers("MPE", "µm", "mpe_um", 2),
        expanded("U", "µm"),
        words("Decision", lambda one: together(decided) if (decided := _decided(one)) else "none"),
    )
    series = data["series"]
    tail = f" ({series['name']})" if series["key"] != "e0" else ""
    of_test = f"Errors {series['symbol']} of bidirectional lengths", "Errors of unidirectional lengths, for information"
    note = "E1, E2, E3: errors of the repeats. – not measured or not defined."
    return table_of(of_test[kind != "bidirectional"] + tail, lengths, columns, note)


def _decided(one: dict[str, Any]) -> list[Any]:
    return [outcome for outcome in one["outcomes"] if outcome is not None]


def _repeat(place: int) -> Cells:
    """The error of a repeat; – of a length with fewer."""
    return measured(f"E{place + 1}", lambda one: dict(enumerate(one["errors_um"])).get(place), "µm")


def length_outcome(test: LengthTest, machine: Machine | None, further: Sequence[LengthTest]) -> StandardTest:
    """The test, with the series beside E0, as a result of its verb."""
    every = [test, *further]
    decision = decide_test(every)
    lines = [decision.text, *(f"- {text}" for one in every for text in statements(one))]
    return StandardTest(
        test,
        decision,
        tuple(lines),
        "iso10360",
        length_test_to_dict(test, further),
        {"": length_test_csv(test)} | {f"-{one.series.key}": length_test_csv(one) for one in further},
        lambda stated: length_test_content(test, stated, machine, further),
        lambda: {"": length_test_figure(test)} | {f"-{one.series.key}": length_test_figure(one) for one in further},
    )
