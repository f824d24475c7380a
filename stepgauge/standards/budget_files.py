"""A budget as files: ``budget.json`` and ``budget.csv``, and the JSON read back for reports and certificates."""

from __future__ import annotations

import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import pandas as pd
from pydantic import ConfigDict, Field

from stepgauge import __version__
from stepgauge.conditions import Conditions
from stepgauge.errors import InputError
from stepgauge.files.config import TomlTable, check_table
from stepgauge.files.display import Plotted, figures, join_lines
from stepgauge.files.json_types import defined
from stepgauge.files.notation import uncertain, uncertainty
from stepgauge.files.outputs import open_set
from stepgauge.files.tables import csv_text, result_cell
from stepgauge.files.text import read_result, result_file, write_files
from stepgauge.recording.conventions import calibrated_object
from stepgauge.recording.simulated import is_simulated
from stepgauge.standards.budget import BudgetLine, UncertaintyBudget, UncertaintySource

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from stepgauge.montecarlo.model import MonteCarloModel

FORMAT = "stepgauge budget 1"
COLUMNS = ("quantity", "placement", "face", "position_mm", "value_um", "u_um", "dof", "k", "expanded_um")
RUN_COLUMNS = ("same_terms_u_um", "monte_carlo_u_um", "monte_carlo_low_95_um", "monte_carlo_high_95_um")
METHOD = (
    "JCGM 100:2008 (GUM): linear propagation and effective degrees of freedom (Welch-Satterthwaite) with GTC; "
    "sensitivities by evaluating unit readings and by central differences through the virtual CMM"
)
"""By whether it is that at the reference temperature."""
SAME_VALUE_UM = 0.005
"""Values of one measurement evaluated twice agree at least so well."""


def write_budget(folder: str | Path, budget: StoredBudget) -> list[Path]:
    """Write ``budget.json`` and ``budget.csv`` into a folder (made if missing); returns their paths."""
    return write_files(folder, {"budget.json": budget.model_dump(), "budget.csv": budget_csv(budget)})


def stored_budget(model: MonteCarloModel, budget: UncertaintyBudget, runs: int) -> StoredBudget:
    """The budget as its file holds it; ``runs``: of the Monte Carlo beside it."""
    return StoredBudget.model_validate(budget_to_dict(model, budget, runs))


def budget_to_dict(model: MonteCarloModel, budget: UncertaintyBudget, runs: int) -> dict[str, Any]:
    """Everything as JSON types; lengths in um (also of R_eff), infinite degrees of freedom are null."""
    return {
        "format": FORMAT,
        "stepgauge": __version__,
        "method": METHOD,
        "of": "a program on the virtual CMM" if model.sign > 0 else "a recording",
        "source": model.nominal.path,
        "simulated": model.sign < 0 and is_simulated(model.nominal.comments),
        "machine": model.machine.table.name,
        "gauge_serial": model.gauge.table.serial,
        "certificate": model.gauge.certificate.number,
        "r_eff_origin": model.origin,
        "measurand": calibrated_object(model.nominal.comments, model.at_reference),
        "coverage_percent": budget.percent,
        "monte_carlo_runs": runs,
        "sources": [_source(source) for source in budget.sources],
        "conditions": model.conditions.to_dicts(),
        "assumptions": list(budget.assumptions),
        "not_included": [asdict(one) for one in budget.not_included],
        "bands": [
            {"placement": b.placement, "value_um": b.value, "u_um": b.u, "low_95_um": b.low, "high_95_um": b.high}
            for b in budget.bands
            if math.isfinite(b.value)
        ],
        "quantities": [_line(line) for line in budget.lines],
    }


def _source(source: UncertaintySource) -> dict[str, Any]:
    return {
        "name": source.name,
        "label": source.label,
        "type": source.kind,
        "u_min": source.u[0],
        "u_max": source.u[1],
        "unit": source.unit,
        "dof": defined(source.dof),
        "stated_by": source.stated_by,
    }


def _line(line: BudgetLine) -> dict[str, Any]:
    runs = line.monte_carlo
    return {
        "quantity": line.name.removesuffix("_mm").removesuffix("_um"),
        "placement": line.placement,
        "face": line.face,
        "position_mm": line.position_mm,
        "value_um": line.value,
        "u_um": line.expanded.u,
        "dof": defined(line.expanded.dof),
        "k": line.expanded.k,
        "expanded_um": line.expanded.expanded,
        "contributions_um": line.contribution,
        "through_r_eff_um": line.through_radius,
        "same_terms_u_um": line.same_terms_u,
        "monte_carlo": None if runs is None else {"u_um": runs[0], "low_95_um": runs[1], "high_95_um": runs[2]},
    }


def budget_csv(budget: StoredBudget) -> str:
    """One row per quantity, um; the contribution of a source is the column ``u: SOURCE``."""
    header, rows = _table(budget)
    place = header.index("dof")
    said = [["inf" if i == place and cell is None else result_cell(cell) for i, cell in enumerate(row)] for row in rows]
    return csv_text(header, said)


def _table(budget: StoredBudget) -> tuple[list[str], list[list[Any]]]:
    """Header and rows of the table of all quantities; None where there is no number."""
    names = [source.name for source in budget.sources]
    rows = []
    for line in budget.quantities:
        cells = [getattr(line, name) for name in COLUMNS] + [line.contributions_um.get(name, 0.0) for name in names]
        runs = line.monte_carlo
        from_runs = [None] * 3 if runs is None else [runs.u_um, runs.low_95_um, runs.high_95_um]
        rows.append([*cells, line.through_r_eff_um, line.same_terms_u_um, *from_runs])
    return [*COLUMNS, *(f"u: {name}" for name in names), "of which via r_eff", *RUN_COLUMNS], rows


class _StoredBudget(TomlTable):
    """A table of the JSON file; keys that later versions add are left alone."""

    model_config = ConfigDict(extra="ignore")


class StoredRuns(_StoredBudget):
    """What the Monte Carlo says of a quantity."""

    u_um: float
    low_95_um: float
    high_95_um: float


class StoredLine(_StoredBudget):
    """One quantity of a budget."""

    quantity: str
    placement: int
    face: int | None
    position_mm: float | None
    value_um: float
    u_um: float = Field(ge=0)
    dof: float | None = Field(ge=0)
    k: float = Field(gt=0)
    expanded_um: float = Field(ge=0)
    contributions_um: dict[str, float]
    through_r_eff_um: float
    same_terms_u_um: float
    monte_carlo: StoredRuns | None


class StoredSource(_StoredBudget):
    """One source of uncertainty."""

    name: str
    label: str
    type: str
    u_min: float
    u_max: float
    unit: str
    dof: float | None
    stated_by: str


class StoredBand(_StoredBudget):
    """The range of XM of one placement, by Monte Carlo."""

    placement: int
    value_um: float
    u_um: float
    low_95_um: float
    high_95_um: float


class StoredGap(_StoredBudget):
    """A contribution that was not evaluated; ``source``: as it would be named among the sources."""

    source: str = ""
    what: str
    state_by: str


class StoredBudget(_StoredBudget, Plotted):
    """The whole ``budget.json``."""

    drawn_by: ClassVar[str] = "budget.draw_along"
    format: str
    stepgauge: str = ""
    method: str
    of: str = ""
    source: str = ""
    simulated: bool = False
    machine: str = ""
    gauge_serial: str
    certificate: str
    r_eff_origin: str
    measurand: str = ""
    coverage_percent: float = Field(gt=0, lt=100)
    monte_carlo_runs: int
    sources: list[StoredSource] = Field(min_length=1)
    assumptions: list[str]
    not_included: list[StoredGap]
    conditions: list[dict[str, Any]] = Field(default_factory=list)
    given: dict[str, Any] | None = None
    bands: list[StoredBand] = Field(default_factory=list)
    quantities: list[StoredLine] = Field(min_length=1)

    __repr__ = Plotted.__repr__

    def _stated(self) -> dict[str, Any]:
        return self.model_dump()

    def summary(self) -> str:
        """Notes on the readings, what was not evaluated, and by placement R_eff and XM at the farthest face."""
        missing = [f"not evaluated: {gap.what}; state it by {gap.state_by}" for gap in self.not_included]
        lines = [
            f"placement {placement}: {label(line)}: {_said(line, self.coverage_percent)}"
            for placement in self.placements
            for line in (self.find("r_eff", placement, None), farthest(self, placement))
            if line is not None
        ]
        notes = (f"note: {note}" for note in Conditions.read_dicts(self.conditions).notes)
        return join_lines(*notes, *missing, *lines)

    def to_frame(self) -> pd.DataFrame:
        """One row per quantity: value, u, U and the contribution of every source in um; NaN where there is none."""
        header, rows = _table(self)
        found = pd.DataFrame(rows, columns=header)
        numbers = [name for name in header if name not in ("quantity", "placement", "face")]
        return found.astype({**dict.fromkeys(numbers, float), "face": "Int64"}).fillna({"dof": math.inf})

    def plot(self, axes: Axes | None = None, placement: int | None = None) -> Axes:
        """Standard and expanded uncertainty of XM in um along the gauge, of a placement (the first)."""
        return self._drawn(axes, placement=self.placements[0] if placement is None else placement)

    def write(self, folder: str | Path, figure: str = "png") -> list[Path]:
        """Write ``budget.json``, ``budget.csv`` and a figure per placement (png, svg, pdf); returns the paths."""
        with open_set():
            drawn = figures("budget").draw_budget(folder, self, figure)
            return [*write_budget(folder, self), *drawn]

    @property
    def placements(self) -> list[int]:
        """Numbers of the placements, rising."""
        return sorted({line.placement for line in self.quantities})

    def find(self, quantity: str, placement: int, face: int | None) -> StoredLine | None:
        """The line of a quantity, e.g. ``("xm", 1, 21)``; None where the budget has none."""
        wanted = (quantity, placement, face)
        return next((q for q in self.quantities if (q.quantity, q.placement, q.face) == wanted), None)


NAMES = {"r_eff": "R_eff", "xf": "XF", "xb": "XB", "xm": "XM", "xr": "XR"}


def farthest(budget: StoredBudget, placement: int, quantity: str = "xm") -> StoredLine | None:
    """The line of a quantity at the last face that has it."""
    lines = [q for q in budget.quantities if q.quantity == quantity and q.placement == placement]
    return max(lines, key=lambda line: line.face or 0, default=None)


def label(line: StoredLine) -> str:
    """``XM at face 21 (200 mm)``."""
    name = NAMES.get(line.quantity, line.quantity)
    return name if line.face is None else f"{name} at face {line.face} ({line.position_mm:.0f} mm)"


def _said(line: StoredLine, coverage: float) -> str:
    runs = f"; Monte Carlo u {uncertainty(line.monte_carlo.u_um)} um" if line.monte_carlo else ""
    value, expanded = uncertain(line.value_um, line.expanded_um)
    return (
        f"{value.replace('−', '-')} um, u {uncertainty(line.u_um)} um, effective dof {dof_text(line.dof, 'infinite')},"
        f" U {expanded} um (k = {line.k:.2f}, {coverage:g} %){runs}"
    )


def dof_text(dof: float | None, infinite: str = "∞") -> str:
    """Degrees of freedom, without digits that say nothing."""
    return infinite if dof is None else "> 9999" if dof > 9999 else f"{dof:.0f}"


def read_budget(path: str | Path) -> StoredBudget:
    """A ``budget.json``, given by its path or its folder (:class:`InputError` where it is not one)."""
    file = result_file(path, "budget.json")
    return check_table(StoredBudget, read_result(file, "budget"), file)


def resolve_budget(budget: str | Path | StoredBudget, evaluation: dict[str, Any]) -> StoredBudget:
    """A budget, or that of a file or folder, checked to be that of an evaluation (:func:`check_budget`)."""
    found = budget if isinstance(budget, StoredBudget) else read_budget(budget)
    check_budget(found, evaluation, "budget" if found is budget else str(budget))
    return found


def check_budget(budget: StoredBudget, evaluation: dict[str, Any], path: str | Path) -> None:
    """:class:`InputError` where a budget is not that of an evaluation: gauge, radius, or the values themselves."""
    gauge = evaluation["gauge"]
    for what, found, expected in (
        ("gauge", budget.gauge_serial, gauge["serial"]),
        ("certificate", budget.certificate, gauge["certificate"]),
        ("origin of R_eff", budget.r_eff_origin, evaluation["r_eff_origin"]),
    ):
        if found != expected:
            raise InputError(path, f"budget of another evaluation: its {what}", found=found, expected=expected)
    for result in evaluation["placements"]:
        if result["r_eff_blocks"]:
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
