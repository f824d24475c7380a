"""The one table of all faces: errors, beside each its expanded uncertainty where there is a budget, and 2s."""

from __future__ import annotations

from typing import Any

from stepgauge.files.notation import UNDEFINED, aligned, number, uncertain
from stepgauge.reports.page import BETWEEN, PrintedTable, TableColumn
from stepgauge.standards.budget_files import StoredBudget
from stepgauge.standards.conformity import Conformity

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
