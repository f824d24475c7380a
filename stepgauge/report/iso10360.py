"""The report of a length test by ISO 10360-2."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from stepgauge.figures.iso10360 import length_test_figure
from stepgauge.figures.style import save_figure
from stepgauge.machine_file import Machine
from stepgauge.report.content import Stated, figure_svg
from stepgauge.report.numbers import number, quantity
from stepgauge.report.sections import Section, certificate_section
from stepgauge.report.standards import (
    Column,
    PrintedTable,
    StandardReport,
    machine_lines,
    recording_lines,
    rules_table,
    standard_content,
    unmet,
    write_standard_report,
)
from stepgauge.standards.iso10360 import KINDS, LengthTest
from stepgauge.standards.iso10360_files import length_test_to_dict, verdicts, write_length_test

CONTRIBUTIONS = ("certificate", "expansion", "temperature", "alignment", "fixture", "tip diameter")
METHOD = (
    "The error is the indicated length less the certified one at the gauge's recorded temperature. A unidirectional "
    "length lies between faces of one side; a bidirectional one between the front of a block and the back of a later "
    "one, and the effective tip diameter is taken off. Conformity is proven where |E| ≤ MPE − U, nonconformity where "
    "|E| > MPE + U; between these nothing is proven (ISO 14253-1). U is k times the test value uncertainty, in which "
    "the machine has no part (ISO/TS 23165). The repeatability range is the largest minus the smallest error of the "
    "three repeats; what makes the test uncertain is the same in all three, so nothing is taken off its limit."
)


def length_test_content(test: LengthTest, stated: Stated, machine: Machine | None) -> dict[str, Any]:
    """The content of the report (see :func:`stepgauge.report.standards.standard_content`)."""
    data = length_test_to_dict(test)
    name = machine.table.name if machine else test.comments.get("machine")
    report = StandardReport(
        "Length measurement test",
        "Errors of length measurement of a coordinate measuring machine by ISO 10360-2:2009, with a step gauge",
        _summary(data),
        [*verdicts(test), *unmet(data["rules"])],
        [certificate_section(data, test.gauge), _specification(data), _conditions(data), _recording(data, machine)],
        [(figure_svg(length_test_figure(test)), caption(data))],
        rules_table(data["rules"], data["excluded"]),
        [
            _positions(data),
            _uncertainties(data),
            *(_errors(data, kind) for kind in KINDS if data["results"][kind]),
        ],
        METHOD,
        ("iso10360.json", data),
        [f"contribution to U: {what}" for what in test.missing],
    )
    return standard_content(report, stated, test.gauge, name)


def report_length_test(
    folder: str | Path,
    test: LengthTest,
    stated: Stated,
    machine: Machine | None = None,
    template: str | Path | None = None,
    suffix: str = "png",
) -> tuple[list[Path], tuple[str, ...]]:
    """Write all files of a test into a folder (made if missing): JSON, CSV, figure and report; paths, and notes.

    ``template``: your own Typst template; ``suffix`` of the figure: png, svg or pdf. A template that fails
    (:class:`InputError`) does so before anything is written.
    """
    figure, report = Path(folder) / f"iso10360-figure.{suffix}", Path(folder) / "iso10360.pdf"
    notes = write_standard_report(report, length_test_content(test, stated, machine), template)
    paths = write_length_test(folder, test)
    save_figure(length_test_figure(test), figure)
    return [*paths, figure, report], notes


def caption(data: dict[str, Any]) -> str:
    """What the figure shows, in a sentence."""
    said = [
        f"{kind}: {result['errors']} errors, the largest {number(result['largest_error_um'], 2)} µm"
        for kind, result in data["results"].items()
        if result
    ]
    return f"Errors of indication against length, and ± {data['mpe']['text']}. " + "; ".join(said) + "."


def _summary(data: dict[str, Any]) -> PrintedTable:
    columns = [
        Column("Lengths", words=True),
        Column("Errors"),
        Column("Largest |E| / MPE", "%"),
        Column("Largest E", "µm"),
        Column("Decision", words=True),
        Column("Largest range", "µm"),
        Column("Decision on range", words=True),
    ]
    rows = [
        (
            kind,
            str(result["errors"]),
            number(100.0 * result["largest_share_of_mpe"], 0),
            number(result["largest_error_um"], 2),
            result["outcome"],
            number(result["largest_range_um"], 2),
            result["repeatability_outcome"] or "no limit stated",
        )
        for kind, result in data["results"].items()
        if result
    ]
    return PrintedTable("Result" if data["complete"] else "Result of an incomplete test", columns, rows)


def _specification(data: dict[str, Any]) -> Section:
    section = Section("Specification and decision")
    section.add("MPE of E", f"± {data['mpe']['text']}")
    limit = data["repeatability_limit_um"]
    section.add("Limit of the range R", quantity(limit, 2, "µm") if limit is not None else "not stated")
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
    columns = [
        Column("Position"),
        Column("Along (x, y, z)", words=True),
        Column("Nearest of Table 1", words=True),
        Column("Off", "°"),
        Column("Travel along it", "mm"),
        Column("Longest", "mm"),
        Column("Share", "%"),
        Column("Gauge", "°C"),
    ]
    rows = [
        (
            str(one["position"]),
            "(" + ", ".join(number(value, 4) for value in one["axis"]) + ")",
            one["orientation"] or "–",
            number(one["orientation_off_deg"], 2),
            number(one["line_mm"], 1),
            number(one["longest_mm"], 1),
            number(None if one["longest_share"] is None else 100.0 * one["longest_share"], 0),
            number(one["gauge_temperature_C"], 2),
        )
        for one in data["positions"]
    ]
    return PrintedTable("Measuring positions", columns, rows)


def _uncertainties(data: dict[str, Any]) -> PrintedTable:
    """What U is made of, for the length of each kind that has the largest."""
    kinds = [kind for kind in KINDS if data["results"][kind]]
    worst = [
        max((one for one in data["lengths"] if one["kind"] == kind), key=lambda one: one["expanded_uncertainty_um"])
        for kind in kinds
    ]
    columns = [Column("Standard uncertainty by", words=True)]
    columns += [Column(f"{one['kind']}, {number(one['nominal_mm'], 0)} mm", "µm") for one in worst]
    rows = [(name, *(number(one["uncertainty_um"].get(name), 3) for one in worst)) for name in CONTRIBUTIONS]
    rows.append(("combined", *(number(one["standard_uncertainty_um"], 3) for one in worst)))
    factor = f"U, k = {data['coverage_factor']:g}"
    rows.append((factor, *(number(one["expanded_uncertainty_um"], 2) for one in worst)))
    note = "Of the lengths with the largest U. – not stated, or without influence on this length."
    return PrintedTable("Uncertainty of the test", columns, rows, note)


def _errors(data: dict[str, Any], kind: str) -> PrintedTable:
    repeats = max(len(one["errors_um"]) for one in data["lengths"] if one["kind"] == kind)
    columns = [Column("Position"), Column("Faces", words=True), Column("Nominal", "mm"), Column("Certified", "mm")]
    columns += [Column(f"E{repeat + 1}", "µm") for repeat in range(repeats)]
    columns += [Column("Range", "µm"), Column("MPE", "µm"), Column("U", "µm"), Column("Decision", words=True)]
    rows = [_error_row(one, repeats) for one in data["lengths"] if one["kind"] == kind]
    return PrintedTable(
        f"Errors of {kind} lengths", columns, rows, "E1, E2, E3: errors of the repeats. – not measured or not defined."
    )


def _error_row(one: dict[str, Any], repeats: int) -> list[str]:
    errors = [number(error, 2) for error in one["errors_um"]]
    outcomes = one["outcomes"]
    worst = next((word for word in ("does not conform", "not decidable") if word in outcomes), "conforms")
    return [
        str(one["position"]),
        f"{one['faces'][0]} to {one['faces'][1]}",
        number(one["nominal_mm"], 3),
        number(one["certified_mm"], 5),
        *errors,
        *["–"] * (repeats - len(errors)),
        number(one["range_um"], 2),
        number(one["mpe_um"], 2),
        number(one["expanded_uncertainty_um"], 2),
        worst,
    ]
