"""The report of a positioning test by ISO 230-2."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from stepgauge.figures.iso230 import positioning_figure
from stepgauge.files.notation import number, quantity
from stepgauge.machine.file import Machine
from stepgauge.reports.outcome import StandardTest
from stepgauge.reports.page import Cells, Page, PrintedTable, TableColumn, UserStatements, numbers, table_of, words
from stepgauge.reports.sections import Section, certificate_section
from stepgauge.reports.standards import (
    machine_lines,
    recording_lines,
    rules_table,
    said_of,
    test_content,
    unmet,
)
from stepgauge.standards.iso230_decision import PARAMETERS, parameters_um
from stepgauge.standards.iso230_files import LABELS as FURTHER_LABELS
from stepgauge.standards.iso230_files import (
    assumptions,
    decide_test,
    deviations_csv,
    further_um,
    linear_keys,
    positioning_to_dict,
    statements,
    targets_csv,
)
from stepgauge.standards.positioning import AxisTest, PositioningTest, Units

LABELS = {"A_up": "A↑", "A_down": "A↓", "E_up": "E↑", "E_down": "E↓", "R_up": "R↑", "R_down": "R↓", "mean_B": "mean B"}
METHOD = (
    "With the mean x̄ and the standard deviation s (n − 1) of the runs at each target in each direction (↑ up, ↓ down): "
    "B at a target is x̄↑ − x̄↓, and B the largest of them without its sign; R↑ and R↓ are the largest 4 s; R is the "
    "largest of 2 s↑ + 2 s↓ + |B|, 4 s↑ and 4 s↓; E is the range of x̄ (of one direction, or of both), M the range of "
    "(x̄↑ + x̄↓) / 2; A is the largest x̄ + 2 s minus the smallest x̄ − 2 s. (ISO 230-2:2014, terms and definitions.)"
)


def positioning_content(test: PositioningTest, stated: UserStatements, machine: Machine | None) -> dict[str, Any]:
    """The content of the report (see :class:`stepgauge.reports.page.Page`)."""
    data, units = linear_keys(test), test.units
    rules = [{**rule, "asks": _of(one, rule["asks"], data)} for one in data["axes"] for rule in one["rules"]]
    excluded = [{**part, "what": _of(one, part["what"], data)} for one in data["axes"] for part in one["excluded"]]
    by = "a step gauge" if test.gauge else f"{'an' if data['instrument'][0] in 'aeio' else 'a'} {data['instrument']}"
    reference = certificate_section(data, test.gauge) if test.gauge else _instrument(data)
    page = Page(
        "Positioning test",
        f"Accuracy and repeatability of positioning of numerically controlled axes by ISO 230-2:2014, with {by}",
        (),
        _summary(data, units),
        ("iso230.json", positioning_to_dict(test)),
        overall=data["decision"]["text"],
        statements=[*said_of(test.conditions), *unmet(rules)],
        figures=[(positioning_figure(one), caption(one)) for one in test.axes],
        sections=[reference, _conditions(data), _recording(data, machine, units)],
        tables=[*_further(data, units), rules_table(rules, excluded), *(_targets(one, units) for one in data["axes"])],
        lists=[("What the results rest on", assumptions(test))],
        method=METHOD,
        not_stated=[] if test.requirement.expanded_um is not None else ["measurement uncertainty of the parameters"],
    )
    return test_content(page, stated, test.gauge, machine.table.name if machine else test.comments.get("machine"))


def _of(one: dict[str, Any], text: str, data: dict[str, Any]) -> str:
    return f"placement {one['placement']}: {text}" if len(data["axes"]) > 1 else text


def caption(one: AxisTest) -> str:
    """What the figure shows, in a sentence."""
    at, units, known = one.targets.machine_mm, one.units, parameters_um(one.parameters)
    decimals, symbol = units.deviation_decimals, units.deviation_symbol
    told = [f"{LABELS.get(n, n)} = {quantity(v, decimals, symbol)}" for n, v in known.items()]
    chosen = told if len(told) < len(PARAMETERS) else [told[0], told[PARAMETERS.index("R")]]
    return (
        f"Placement {one.placement}, {one.name}: {len(at)} targets from {number(at.min(), 1)} to"
        f" {quantity(at.max(), 1, units.position_symbol)}, {len(one.runs)} runs; {', '.join(chosen)}."
    )


def _summary(data: dict[str, Any], units: Units) -> PrintedTable:
    names = [name for name in PARAMETERS if any(name in one["parameters_um"] for one in data["axes"])]
    columns = [words("Axis", lambda one: one["name"] if one["axis"] else f"near {one['name'].split()[2]}")]
    columns += [_parameter(LABELS.get(name, name), name, units, lambda one: one["parameters_um"]) for name in names]
    title = "Result" if data["complete"] else "Result; not every rule of the standard is met"
    return table_of(title, data["axes"], columns, stripe=0)


def _parameter(title: str, name: str, units: Units, of: Callable[[Any], Any]) -> Cells:
    """A parameter; the cell is empty where an axis has it not."""
    decimals = units.deviation_decimals
    return (
        TableColumn(title, units.deviation_symbol),
        lambda one: number(of(one)[name], decimals) if name in of(one) else "",
    )


def _further(data: dict[str, Any], units: Units) -> list[PrintedTable]:
    """A table for each further standard, with what of it is unconfirmed."""
    return [
        _standard_table(name, title, axes, units)
        for name, title in FURTHER_LABELS.items()
        if (axes := [one for one in data["axes"] if name in one["further"]])
    ]


def _standard_table(name: str, title: str, axes: list[dict[str, Any]], units: Units) -> PrintedTable:
    own = axes[0]["further"][name]
    columns = [words("Axis", "name")]
    columns += [
        _parameter(known.replace("_", " "), known, units, lambda one: one["further"][name]["parameters_um"])
        for known in own["parameters_um"]
    ]
    return table_of(f"By {title}", axes, columns, f"{own['note']}. No requirement is judged by it.", stripe=0)


def _conditions(data: dict[str, Any]) -> Section:
    section = Section("Conventions")
    tip = data.get("tip_diameter")
    if tip is not None:
        u = "" if tip["u_um"] is None else f" (u = {number(tip['u_um'], 2)} µm)"
        section.add("Tip diameter", f"{number(tip['diameter_mm'], 5)} mm{u}, {tip['origin']}")
    section.add("Deviation", data["sign_convention"])
    section.add("Temperature", data["temperature_convention"])
    return section


def _instrument(data: dict[str, Any]) -> Section:
    section = Section("Instrument and targets")
    section.add("Instrument", data["instrument"])
    section.add("Targets", data["artefact"])
    section.missing.append("calibration of the instrument")
    return section


def _recording(data: dict[str, Any], machine: Machine | None, units: Units) -> Section:
    section = Section("Machine and recording")
    machine_lines(section, machine)
    for one in data["axes"]:
        low, high = one["measured_mm"]
        travel = one["axis_travel_mm"]
        share = f", {number(100.0 * (high - low) / travel, 0)} % of the travel" if travel else ""
        measured = f"{number(low, 1)} to {number(high, 1)} {units.position_symbol}"
        section.add(f"Measured on {one['name']}", measured + share)
    recording_lines(section, data)
    return section


def _targets(one: dict[str, Any], units: Units) -> PrintedTable:
    known = (
        ("x̄↑", "mean_up_um"),
        ("2 s↑", "s_up_um"),
        ("x̄↓", "mean_down_um"),
        ("2 s↓", "s_down_um"),
        ("x̄", "mean_um"),
        ("B", "b_um"),
        ("R↑", "r_up_um"),
        ("R↓", "r_down_um"),
        ("R", "r_um"),
    )
    columns = [
        numbers("Block" if one["gauge_against_axis"] is not None else "No.", "", "block", 0),
        numbers("Target", units.position_symbol, "target_mm", units.position_decimals),
        *(_target_column(name, key, units) for name, key in known if key in one["targets"][0]),
    ]
    return table_of(f"Targets of placement {one['placement']}, {one['name']}", one["targets"], columns)


def _target_column(name: str, key: str, units: Units) -> Cells:
    times = 2.0 if key.startswith("s_") else 1.0
    return numbers(name, units.deviation_symbol, lambda row: times * row[key], units.deviation_decimals)


def positioning_outcome(test: PositioningTest, machine: Machine | None = None) -> StandardTest:
    """The test as a result of its verb."""
    units, axes = test.units, [(one.name, parameters_um(one.parameters)) for one in test.axes]
    lines = [f"note: {note}" for note in test.conditions.notes]
    for one, (name, known) in zip(test.axes, axes, strict=True):
        values = ", ".join(f"{key} {units.deviation_text(value)}" for key, value in known.items())
        count = f"{len(one.targets.block)} targets, {len(one.runs)} runs"
        lines.append(f"placement {one.placement}, {name}: {values}; {count}")
    decision = decide_test(test)
    lines.append(decision.text)
    for one in test.axes:
        for name, found in further_um(one.parameters, test.further).items():
            values = ", ".join(f"{key} {units.deviation_text(value)}" for key, value in found["parameters_um"].items())
            lines.append(f"{one.name} by {FURTHER_LABELS[name]}: {values} (unconfirmed)")
    lines += [f"- {text}" for text in statements(test)]
    return StandardTest(
        test,
        decision,
        tuple(lines),
        "iso230",
        positioning_to_dict(test),
        {"": targets_csv(test), "-deviations": deviations_csv(test)},
        lambda stated: positioning_content(test, stated, machine),
        lambda: {f"-placement-{one.placement}" if len(axes) > 1 else "": positioning_figure(one) for one in test.axes},
    )
