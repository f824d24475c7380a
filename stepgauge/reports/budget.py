"""The uncertainty budget as a report prints it: a table of sources for each placement, with its figure."""

from __future__ import annotations

from collections.abc import Sequence

from stepgauge.figures.budget import budget_figure
from stepgauge.files.notation import UNDEFINED, number, printed_unit, quantity, uncertainty
from stepgauge.reports.page import PrintedTable, TableColumn
from stepgauge.standards.budget_files import StoredBudget, StoredLine, StoredSource, dof_text, farthest, label

ERRORS = ("xf", "xb", "xm", "xr")
NOTE = (
    "Contributions to the standard uncertainty, each with the sensitivity of its quantity; ν: effective degrees of"
    " freedom. R_eff is found from readings and certified positions that the errors need, too: its share is part of"
    " theirs, not a further one."
)


def budget_tables(budget: StoredBudget | None) -> list[PrintedTable]:
    """A table per placement; none without a budget."""
    if budget is None:
        return []
    return [_placement(budget, number) for number in sorted({line.placement for line in budget.quantities})]


def _placement(budget: StoredBudget, placement: int) -> PrintedTable:
    found = [budget.find("r_eff", placement, None), *(farthest(budget, placement, name) for name in ERRORS)]
    lines = [line for line in found if line is not None]
    columns = [
        TableColumn("Source", words=True),
        TableColumn("Type", words=True),
        TableColumn("Standard uncertainty", words=True),
        TableColumn("ν", words=True),
        *(TableColumn(label(line).split(" at ")[0], "µm", place=_place(line)) for line in lines),
    ]
    sources, totals = [_source(source, lines) for source in budget.sources], _totals(lines, budget)
    return PrintedTable(
        f"Uncertainty budget, placement {placement}",
        columns,
        [*sources, *([name, "", "", "", *values] for name, values, _ in totals)],
        NOTE + _range_note(budget, placement),
        strong=[len(sources) + i for i, (_, _, strong) in enumerate(totals) if strong],
        ruled=[len(sources)],
        stripe=0,
        figure=(budget_figure(budget, placement), _caption(budget, placement)),
    )


def _place(line: StoredLine) -> str:
    return "" if line.face is None else f"face\u00a0{line.face}, {number(line.position_mm, 0)}\u00a0mm"


def _caption(budget: StoredBudget, placement: int) -> str:
    tail = ", with the Monte Carlo beside it" if budget.monte_carlo_runs else ""
    return (
        f"Placement {placement}: contributions to the uncertainty of R_eff and of the farthest XM; u and U of XM"
        " along the"
        f" gauge{tail}"
    )


def _range_note(budget: StoredBudget, placement: int) -> str:
    """The range is no linear quantity; what the Monte Carlo says of it."""
    found = next((band for band in budget.bands if band.placement == placement), None)
    if found is None:
        return ""
    return (
        f" Range of XM: {quantity(found.value_um, 2, 'µm')} observed; 95 % coverage interval by Monte Carlo"
        f" {number(found.low_95_um, 2)} µm to {quantity(found.high_95_um, 2, 'µm')}. Noise biases a range upwards: the"
        " interval need not contain the observed value."
    )


def _source(source: StoredSource, lines: Sequence[StoredLine]) -> list[str]:
    low, high = _short(source.u_min), _short(source.u_max)
    unit = printed_unit(source.unit)
    u = f"{low if low == high else f'{low} to {high}'} {unit}"
    return [
        source.label,
        source.type,
        u,
        dof_text(source.dof),
        *(number(line.contributions_um.get(source.name), 3) for line in lines),
    ]


def _short(value: float) -> str:
    """Three digits; small values as powers of ten."""
    text = f"{value:.3g}"
    if "e" not in text:
        return text
    digits, power = text.split("e")
    return f"{digits} × 10{str(int(power)).translate(str.maketrans('-0123456789', '⁻⁰¹²³⁴⁵⁶⁷⁸⁹'))}"


def _totals(lines: Sequence[StoredLine], budget: StoredBudget) -> list[tuple[str, list[str], bool]]:
    """Rows below the sources, and whether they are bold: via R_eff, u, degrees of freedom, k, U, Monte Carlo."""
    rows = [
        ("of which via R_eff", [number(line.through_r_eff_um, 3) for line in lines], False),
        ("Combined u", [uncertainty(line.u_um) for line in lines], True),
        ("Effective degrees of freedom", [dof_text(line.dof) for line in lines], False),
        ("Coverage factor k", [f"{line.k:.2f}" for line in lines], False),
        (f"Expanded U ({budget.coverage_percent:g} %)", [uncertainty(line.expanded_um) for line in lines], True),
    ]
    if any(line.monte_carlo for line in lines):
        runs = [UNDEFINED if line.monte_carlo is None else uncertainty(line.monte_carlo.u_um) for line in lines]
        rows.append(("u of the sources in the Monte Carlo", [uncertainty(x.same_terms_u_um) for x in lines], False))
        rows.append((f"u by Monte Carlo, {budget.monte_carlo_runs} runs", runs, False))
    return rows
