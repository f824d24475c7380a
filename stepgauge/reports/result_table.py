"""Page 1 of the report of an evaluation: the largest errors with their U, and the contributions not in U."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from stepgauge.conditions import stored_conditions
from stepgauge.evaluation.files import mean_error_extent
from stepgauge.files.notation import UNDEFINED, make_sentence, quantity, uncertain, uncertainty
from stepgauge.machine.file import Machine
from stepgauge.recording.conventions import needs_gauge_temperature
from stepgauge.reports.page import PrintedTable, TableColumn
from stepgauge.standards.budget_files import StoredBudget, StoredLine

NAMES = {"xm": "Largest mean error XM", "xr": "Largest reversal XR"}


def result_table(evaluation: dict[str, Any], budget: StoredBudget | None) -> PrintedTable:
    """One row per result of each placement: value, expanded uncertainty, coverage factor.

    The range of XM and the largest 2s are observed values: no uncertainty is stated for them.
    """
    columns = [
        TableColumn("Result", words=True),
        TableColumn("At", words=True),
        TableColumn("Value"),
        TableColumn("Expanded uncertainty U"),
        TableColumn("k"),
    ]
    placed = evaluation["placements"]
    rows = [row for result in placed for row in _rows(result, budget, len(placed) > 1)]
    return PrintedTable("Result", columns, rows, stripe=0)


def _rows(result: dict[str, Any], budget: StoredBudget | None, several: bool) -> list[list[str]]:
    rows, head = result["faces"], f"Placement {result['placement']}: " if several else ""
    fewest, most = result["cycles"]
    cycles = f"{most} cycles" if fewest == most else f"{fewest} to {most} cycles"
    lines = [_error(result, name, budget) for name in NAMES]
    lines.append(_radius(result, budget))
    ends, length_mm = mean_error_extent(rows)
    extent = f"faces {ends[0]} to {ends[1]}, of {quantity(length_mm, 1, 'mm')}" if ends else "no face"
    lines.append(["Range of the mean error XM", extent, quantity(result["band_um"], 2, "µm"), UNDEFINED, UNDEFINED])
    two_s = quantity(result["worst_two_sigma_um"], 2, "µm")
    lines.append(["Largest 2s of a face", cycles, two_s, UNDEFINED, UNDEFINED])
    return [[head + line[0], *line[1:]] for line in lines]


def _error(result: dict[str, Any], name: str, budget: StoredBudget | None) -> list[str]:
    """The largest error by size, among faces that have it."""
    known = [row for row in result["faces"] if row[f"{name}_um"] is not None]
    if not known:
        return [NAMES[name], UNDEFINED, UNDEFINED, UNDEFINED, UNDEFINED]
    row = max(known, key=lambda one: abs(one[f"{name}_um"]))
    line = None if budget is None else budget.find(name, result["placement"], row["face"])
    where = f"face {row['face']}, {quantity(row['position_mm'], 1, 'mm')}"
    value, expanded = uncertain(row[f"{name}_um"], None if line is None else line.expanded_um)
    return [NAMES[name], where, f"{value} µm", *_sure(line, expanded)]


def _radius(result: dict[str, Any], budget: StoredBudget | None) -> list[str]:
    if not result["r_eff_blocks"]:
        return ["Tip radius of the correction", "", quantity(result["r_eff_mm"], 5, "mm"), "exact", UNDEFINED]
    line = None if budget is None else budget.find("r_eff", result["placement"], None)
    expanded = UNDEFINED if line is None else uncertainty(line.expanded_um)
    return ["Effective tip radius R_eff", "", quantity(result["r_eff_mm"], 5, "mm"), *_sure(line, expanded)]


def _sure(line: StoredLine | None, expanded: str) -> list[str]:
    return ["not evaluated", UNDEFINED] if line is None else [f"{expanded} µm", f"{line.k:.2f}"]


def warnings(
    evaluation: dict[str, Any], budget: StoredBudget | None, machine: Machine | None, laboratory: bool
) -> list[str]:
    """What page 1 must say beside the result: what prevents a statement, and where a temperature or the uncertainty is
    missing or incomplete."""
    prevented = stored_conditions(evaluation).no_statement
    return [
        *([prevented] if prevented else []),
        *_incomplete(budget, laboratory),
        *_cold(evaluation),
        *_contradicted(evaluation, machine),
    ]


def _contradicted(evaluation: dict[str, Any], machine: Machine | None) -> list[str]:
    """Where the machine file states another temperature of the scales than was recorded."""
    if machine is None:
        return []
    doubts = [machine.scales_doubt(one.get("scale_temperature_C")) for one in evaluation["placements"]]
    said = [f"{doubt}: the recorded temperature is used, and one of the two is wrong." for doubt in doubts if doubt]
    return [make_sentence(text, "") for text in dict.fromkeys(said)]


def _cold(evaluation: dict[str, Any]) -> list[str]:
    """Placements whose gauge temperature nobody recorded."""
    placed = evaluation["placements"]
    without = [str(one["placement"]) for one in placed if one["gauge_temperature_C"] is None]
    if not without or not needs_gauge_temperature(evaluation["comments"]):
        return []
    where = f" of placement {', '.join(without)}" if len(placed) > 1 else ""
    return [f"The temperature of the gauge{where} was not recorded: lengths are not corrected for it."]


def _incomplete(budget: StoredBudget | None, laboratory: bool) -> list[str]:
    tail = " This is a report of measurement, not a calibration certificate." if laboratory else ""
    if budget is None:
        return [f"Measurement uncertainty was not evaluated.{tail}"]
    gaps: Sequence[str] = [gap.what for gap in budget.not_included]
    if not gaps:
        return []
    return [
        f"The uncertainty budget is incomplete. Contributions not evaluated, and not in U: {'; '.join(gaps)}.{tail}"
    ]
