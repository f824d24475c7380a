"""The uncertainty budget as a report prints it: the table of sources, and U beside every error."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from stepgauge.figures.budget import budget_figure, farthest, label
from stepgauge.figures.style import figure_style
from stepgauge.report.numbers import UNDEFINED, aligned, clean, number, uncertain
from stepgauge.standards.budget_files import StoredBudget, StoredLine, StoredSource
from stepgauge.statements import dof_text, uncertainty_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ERRORS = ("xf", "xb", "xm", "xr")


def budget_content(budget: StoredBudget) -> dict[str, Any]:
    """The text of the section, and for each placement its table and figure."""
    placements = sorted({line.placement for line in budget.quantities})
    return {
        "text": uncertainty_text(budget, assumptions=False),
        "placements": [_placement(budget, placement) for placement in placements],
        "assumptions": [clean(one) for one in budget.assumptions],
        "not_included": [f"{clean(gap.what)}; to be stated by {clean(gap.state_by)}" for gap in budget.not_included],
    }


def _placement(budget: StoredBudget, placement: int) -> dict[str, Any]:
    found = [budget.find("r_eff", placement, None), *(farthest(budget, placement, name) for name in ERRORS)]
    lines = [line for line in found if line is not None]
    return {
        "number": str(placement),
        "heads": [label(line).split(" at ")[0] for line in lines],
        "places": [
            "" if line.face is None else f"face {line.face}, {number(line.position_mm, 0)} mm" for line in lines
        ],
        "sources": [_source(source, lines) for source in budget.sources],
        "totals": _totals(lines, budget),
        "figure": _svg(budget_figure(budget, placement)),
        "caption": f"Placement {placement}: what the uncertainty of R_eff and of the farthest XM is made of; "
        f"u and U of XM along the gauge{', with the Monte Carlo beside it' if budget.monte_carlo_runs else ''}",
    }


def _source(source: StoredSource, lines: Sequence[StoredLine]) -> dict[str, Any]:
    low, high = _short(source.u_min), _short(source.u_max)
    unit = source.unit.replace("um", "µm").replace("urad", "µrad")
    return {
        "name": clean(source.label),
        "type": source.type,
        "u": f"{low if low == high else f'{low} to {high}'} {unit}",
        "dof": dof_text(source.dof),
        "contributions": [number(line.contributions_um.get(source.name), 3) for line in lines],
    }


def _short(value: float) -> str:
    """Three digits; small values as powers of ten."""
    text = f"{value:.3g}"
    if "e" not in text:
        return text
    digits, power = text.split("e")
    return f"{digits} × 10{str(int(power)).translate(str.maketrans('-0123456789', '⁻⁰¹²³⁴⁵⁶⁷⁸⁹'))}"


def _totals(lines: Sequence[StoredLine], budget: StoredBudget) -> list[dict[str, Any]]:
    """Rows below the sources: of these through R_eff, u, effective degrees of freedom, k, U, and the Monte Carlo."""
    rows = [
        ("of these through R_eff", [number(line.through_r_eff_um, 3) for line in lines], False),
        ("Combined u", [number(line.u_um, 3) for line in lines], True),
        ("Effective degrees of freedom", [dof_text(line.dof) for line in lines], False),
        ("Coverage factor k", [f"{line.k:.2f}" for line in lines], False),
        (f"Expanded U ({budget.coverage_percent:g} %)", [number(line.expanded_um, 3) for line in lines], True),
    ]
    if any(line.monte_carlo for line in lines):
        runs = [UNDEFINED if line.monte_carlo is None else number(line.monte_carlo.u_um, 3) for line in lines]
        rows.append(("u of the sources that the Monte Carlo has", [number(x.same_terms_u_um, 3) for x in lines], False))
        rows.append((f"u by Monte Carlo, {budget.monte_carlo_runs} runs", runs, False))
    return [{"label": name, "values": values, "strong": strong} for name, values, strong in rows]


def uncertain_faces(result: dict[str, Any], budget: StoredBudget) -> list[dict[str, Any]]:
    """Errors with their expanded uncertainties by face, to two significant digits of these; dashes where none is."""
    rows = []
    for row in result["faces"]:
        cells: list[str] = []
        for name in ERRORS:
            line = budget.find(name, result["placement"], row["face"])
            cells += uncertain(row[f"{name}_um"], None if line is None else line.expanded_um)
        rows.append(
            {
                "face": str(row["face"]),
                "side": row["side"],
                "position": number(row["position_mm"], 5),
                "cells": cells,
            }
        )
    columns = [aligned(column) for column in zip(*(row["cells"] for row in rows), strict=True)]
    return [{**row, "cells": list(cells)} for row, cells in zip(rows, zip(*columns, strict=True), strict=True)]


def _svg(figure: Figure) -> str:
    buffer = io.StringIO()
    with figure_style():
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    return buffer.getvalue()
