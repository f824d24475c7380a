"""Page 1 of the report of an evaluation: the largest errors with their U, and the contributions not in U."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from stepgauge.conditions import stored_conditions
from stepgauge.evaluation.files import mean_error_extent
from stepgauge.files.notation import UNDEFINED, aligned, make_sentence, number, quantity, uncertain, uncertainty
from stepgauge.machine.file import Machine
from stepgauge.recording.conventions import needs_gauge_temperature
from stepgauge.reports.page import BETWEEN, PrintedTable, TableColumn
from stepgauge.standards.budget_files import StoredBudget, StoredLine
from stepgauge.standards.conformity import Conformity

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


ERRORS = ("xf", "xb", "xm", "xr")
NOTE = (
    "* interpolated from the two neighbouring faces of the same side. – not defined. n: probings of the face. "
    "2s: twice the standard deviation over the cycles. "
    "XR: a scale error c alone shows as −c P / 2, P: pitch of the blocks."
)
U_NOTE = (
    " U: expanded uncertainty, two significant digits at most, the error rounded to the same place; zero where the"
    " error"
    " is zero by construction (reference face, block of R_eff)."
)


def faces_table(result: dict[str, Any], budget: StoredBudget | None, judged: Conformity | None = None) -> PrintedTable:
    """All faces of a placement; pairs of rows are the two faces of a block."""
    title = f"Errors by face, placement {result['placement']}"
    columns, rows = _plain(result) if budget is None else _add_uncertainty(result, budget)
    note = NOTE + ("" if budget is None else U_NOTE)
    if judged is not None:
        columns = [*columns, TableColumn("MPE", "µm"), TableColumn("Decision", words=True)]
        rows = [[*row, *_decision(judged, result["placement"], int(row[0]))] for row in rows]
        note += " Decision on the error that was probed, XF at fronts and XB at backs."
    return PrintedTable(title, columns, rows, note, stripe=2)


def _decision(judged: Conformity, placement: int, face: int) -> list[str]:
    one = judged.of(placement, face)
    return [UNDEFINED, UNDEFINED] if one is None else [number(one.limit_um, 2), one.word]


def _head() -> list[TableColumn]:
    return [TableColumn("Face"), TableColumn("Block"), TableColumn("Side", words=True)]


def _plain(result: dict[str, Any]) -> tuple[list[TableColumn], list[list[str]]]:
    columns = [*_head(), TableColumn("Nominal", "mm"), TableColumn("Certified", "mm")]
    columns += [TableColumn(name, "µm") for name in ("XF", "2s forw.", "XB", "2s backw.", "XM", "XR")]
    rows = []
    for row in result["faces"]:
        errors = {name: number(row[f"{name}_um"], 2) for name in ERRORS}
        cells = [errors["xf"], _two_s(row, "sf"), errors["xb"], _two_s(row, "sb"), errors["xm"], errors["xr"]]
        places = [number(row["nominal_mm"], 3), number(row["position_mm"], 5)]
        rows.append([*_identity(row), *places, *_marked(row, cells, (0, 1), (2, 3)), str(row["count"])])
    return [*columns, TableColumn("n")], rows


def _add_uncertainty(result: dict[str, Any], budget: StoredBudget) -> tuple[list[TableColumn], list[list[str]]]:
    columns = [*_head(), TableColumn("Certified", "mm")]
    columns += [
        column for name in ("XF", "XB", "XM", "XR") for column in (TableColumn(name, "µm"), TableColumn("U", "µm"))
    ]
    columns += [TableColumn("2s forw.", "µm"), TableColumn("2s backw.", "µm"), TableColumn("n")]
    cells = [
        [*_errors(row, result["placement"], budget), _two_s(row, "sf"), _two_s(row, "sb")] for row in result["faces"]
    ]
    even = list(zip(*(aligned(column) for column in zip(*cells, strict=True)), strict=True))
    rows = [
        [*_identity(row), number(row["position_mm"], 5), *_marked(row, list(line), (0, 8), (2, 9)), str(row["count"])]
        for row, line in zip(result["faces"], even, strict=True)
    ]
    return columns, rows


def _identity(row: dict[str, Any]) -> list[str]:
    return [str(row["face"]), str(row["block"]), row["side"]]


def _errors(row: dict[str, Any], placement: int, budget: StoredBudget) -> list[str]:
    """Each error with its expanded uncertainty; dashes where none is."""
    cells: list[str] = []
    for name in ERRORS:
        line = budget.find(name, placement, row["face"])
        cells += uncertain(row[f"{name}_um"], None if line is None else line.expanded_um, most=2)
    return cells


def _two_s(row: dict[str, Any], name: str) -> str:
    value = row[f"{name}_um"]
    return number(None if value is None else 2.0 * value, 2)


def _marked(row: dict[str, Any], cells: list[str], forward: tuple[int, int], backward: tuple[int, int]) -> list[str]:
    """A face is probed from one side: what stands there for the other one is interpolated."""
    between = backward if row["face"] % 2 else forward
    return [f"{cell}{BETWEEN}" if i in between and cell != UNDEFINED else cell for i, cell in enumerate(cells)]
