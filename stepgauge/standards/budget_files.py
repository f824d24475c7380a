"""A budget as files: ``budget.json`` and ``budget.csv``, and the JSON read back for reports and certificates."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from pydantic import ConfigDict, Field

from stepgauge import __version__
from stepgauge.errors import InputError
from stepgauge.files.config import Table, check_table
from stepgauge.files.tables import csv_text, result_cell
from stepgauge.files.text import in_folder, read_result, write_json, write_text
from stepgauge.montecarlo.model import Model
from stepgauge.standards.budget import Budget, Line, Source

FORMAT = "stepgauge budget 1"
COLUMNS = ("quantity", "placement", "face", "position_mm", "value_um", "u_um", "dof", "k", "expanded_um")
RUN_COLUMNS = ("same_terms_u_um", "monte_carlo_u_um", "monte_carlo_low_95_um", "monte_carlo_high_95_um")
METHOD = (
    "JCGM 100:2008 (GUM): linear propagation and effective degrees of freedom (Welch-Satterthwaite) with GTC; "
    "sensitivities by evaluating unit readings and by central differences through the virtual CMM"
)
SAME_VALUE_UM = 0.005
"""Values of one measurement evaluated twice agree at least so well."""


def write_budget(folder: str | Path, model: Model, budget: Budget, runs: int) -> list[Path]:
    """Write ``budget.json`` and ``budget.csv`` into a folder (made if missing); returns their paths."""
    json_path, csv_path = Path(folder) / "budget.json", Path(folder) / "budget.csv"
    write_json(json_path, budget_to_dict(model, budget, runs))
    write_text(csv_path, budget_csv(budget))
    return [json_path, csv_path]


def budget_to_dict(model: Model, budget: Budget, runs: int) -> dict[str, Any]:
    """Everything as JSON types; lengths in um (also of R_eff), infinite degrees of freedom are null."""
    return {
        "format": FORMAT,
        "stepgauge": __version__,
        "method": METHOD,
        "of": "a program on the virtual CMM" if model.sign > 0 else "a recording",
        "source": model.nominal.path,
        "machine": model.machine.table.name,
        "gauge_serial": model.gauge.table.serial,
        "certificate": model.gauge.certificate.number,
        "r_eff_origin": model.origin,
        "coverage_percent": budget.percent,
        "monte_carlo_runs": runs,
        "sources": [_source(source) for source in budget.sources],
        "assumptions": list(budget.assumptions),
        "not_included": [{"what": what, "state_by": how} for what, how in budget.not_included],
        "bands": [
            {"placement": b.placement, "value_um": b.value, "u_um": b.u, "low_95_um": b.low, "high_95_um": b.high}
            for b in budget.bands
            if math.isfinite(b.value)
        ],
        "quantities": [_line(line) for line in budget.lines],
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _source(source: Source) -> dict[str, Any]:
    return {
        "name": source.name,
        "label": source.label,
        "type": source.kind,
        "u_min": source.u[0],
        "u_max": source.u[1],
        "unit": source.unit,
        "dof": _finite(source.dof),
        "stated_by": source.stated_by,
    }


def _line(line: Line) -> dict[str, Any]:
    runs = line.monte_carlo
    return {
        "quantity": line.name.removesuffix("_mm").removesuffix("_um"),
        "placement": line.placement,
        "face": line.face,
        "position_mm": line.position_mm,
        "value_um": line.value,
        "u_um": line.expanded.u,
        "dof": _finite(line.expanded.dof),
        "k": line.expanded.k,
        "expanded_um": line.expanded.expanded,
        "contributions_um": line.contribution,
        "through_r_eff_um": line.through_radius,
        "same_terms_u_um": line.same_terms_u,
        "monte_carlo": None if runs is None else {"u_um": runs[0], "low_95_um": runs[1], "high_95_um": runs[2]},
    }


def budget_csv(budget: Budget) -> str:
    """One row per quantity, um; the contribution of a source is the column ``u: SOURCE``."""
    names = [source.name for source in budget.sources]
    rows = []
    for line in budget.lines:
        row = _line(line)
        cells = [row[name] for name in COLUMNS] + [line.contribution.get(name, 0.0) for name in names]
        cells += [line.through_radius, line.same_terms_u, *(line.monte_carlo or ("", "", ""))]
        rows.append(["inf" if i == 6 and cell is None else result_cell(cell) for i, cell in enumerate(cells)])
    header = [*COLUMNS, *(f"u: {name}" for name in names), "of which via r_eff", *RUN_COLUMNS]
    return csv_text(header, rows)


class _Stored(Table):
    """A table of the JSON file; keys that later versions add are left alone."""

    model_config = ConfigDict(extra="ignore")


class StoredRuns(_Stored):
    """What the Monte Carlo says of a quantity."""

    u_um: float
    low_95_um: float
    high_95_um: float


class StoredLine(_Stored):
    """One quantity of a budget."""

    quantity: str
    placement: int
    face: int | None
    position_mm: float | None
    value_um: float
    u_um: float = Field(ge=0)
    dof: float | None = Field(ge=0)
    k: float = Field(ge=1)
    expanded_um: float = Field(ge=0)
    contributions_um: dict[str, float]
    through_r_eff_um: float
    same_terms_u_um: float
    monte_carlo: StoredRuns | None


class StoredSource(_Stored):
    """One source of uncertainty."""

    name: str
    label: str
    type: str
    u_min: float
    u_max: float
    unit: str
    dof: float | None
    stated_by: str


class StoredBand(_Stored):
    """The range of XM of one placement, by Monte Carlo."""

    placement: int
    value_um: float
    u_um: float
    low_95_um: float
    high_95_um: float


class StoredGap(_Stored):
    """A contribution that was not evaluated."""

    what: str
    state_by: str


class StoredBudget(_Stored):
    """The whole ``budget.json``."""

    format: str
    method: str
    gauge_serial: str
    certificate: str
    r_eff_origin: str
    coverage_percent: float = Field(gt=0, lt=100)
    monte_carlo_runs: int
    sources: list[StoredSource] = Field(min_length=1)
    assumptions: list[str]
    not_included: list[StoredGap]
    bands: list[StoredBand] = Field(default_factory=list)
    quantities: list[StoredLine] = Field(min_length=1)

    def find(self, quantity: str, placement: int, face: int | None) -> StoredLine | None:
        """The line of a quantity, e.g. ``("xm", 1, 21)``; None where the budget has none."""
        wanted = (quantity, placement, face)
        return next((q for q in self.quantities if (q.quantity, q.placement, q.face) == wanted), None)


def read_budget(path: str | Path) -> StoredBudget:
    """A ``budget.json``, given by its path or its folder (:class:`InputError` where it is not one)."""
    file = in_folder(path, "budget.json")
    return check_table(StoredBudget, read_result(file, "budget"), file)


def check_budget(budget: StoredBudget, evaluation: dict[str, Any], path: str | Path) -> None:
    """:class:`InputError` where a budget is not that of an evaluation: gauge, radius, or the values themselves."""
    gauge = evaluation["gauge"]
    for what, found, expected in (
        ("gauge", budget.gauge_serial, gauge["serial"]),
        ("certificate", budget.certificate, gauge["certificate"]),
        ("origin of R_eff (--r-eff)", budget.r_eff_origin, evaluation["r_eff_origin"]),
    ):
        if found != expected:
            raise InputError(path, f"budget of another evaluation: its {what}", found=found, expected=expected)
    for result in evaluation["placements"]:
        _check_value(budget, path, ("r_eff", result["placement"], None), result["r_eff_mm"] * 1e3)
        for row in result["faces"]:
            for name in ("xf", "xb", "xm", "xr"):
                if row[f"{name}_um"] is not None:
                    _check_value(budget, path, (name, result["placement"], row["face"]), row[f"{name}_um"])


def _check_value(budget: StoredBudget, path: str | Path, key: tuple[str, int, int | None], value_um: float) -> None:
    line = budget.find(*key)
    name = f"{key[0]} of placement {key[1]}" + ("" if key[2] is None else f", face {key[2]}")
    if line is None:
        raise InputError(path, f"budget of another evaluation: {name} is missing", expected=f"{value_um:.3f} um")
    if abs(line.value_um - value_um) > SAME_VALUE_UM:
        found, expected = f"{line.value_um:.3f} um", f"{value_um:.3f} um"
        raise InputError(path, f"budget of another evaluation: {name}", found=found, expected=expected)
