"""The result of a Monte Carlo as files: ``uncertainty.json`` and ``uncertainty.csv``."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from stepgauge import __version__
from stepgauge.files.json_types import defined
from stepgauge.files.tables import csv_text, result_cell
from stepgauge.files.text import write_files
from stepgauge.montecarlo.model import MonteCarloModel
from stepgauge.montecarlo.summary import COVERAGE, Summary

COLUMNS = ("quantity", "placement", "face", "value", "mean", "u", "low_95", "high_95")


def write_summary(folder: str | Path, model: MonteCarloModel, summary: Summary) -> list[Path]:
    """Write ``uncertainty.json`` and ``uncertainty.csv`` into a folder (made if missing); returns their paths."""
    said = {"uncertainty.json": summary_to_dict(model, summary), "uncertainty.csv": summary_csv(summary)}
    return write_files(folder, said)


def summary_to_dict(model: MonteCarloModel, summary: Summary) -> dict[str, Any]:
    """Everything as JSON types; what ``evaluate`` leaves undefined is left out."""
    return {
        "format": "stepgauge uncertainty 1",
        "stepgauge": __version__,
        "method": "JCGM 101:2008, propagation of distributions; contributions: one input varied at a time (B.1)",
        "of": "a program on the virtual CMM" if model.sign > 0 else "a recording",
        "source": model.nominal.path,
        "machine": model.machine.table.name,
        "gauge": f"{model.gauge.table.name}, serial {model.gauge.table.serial}",
        "runs": summary.runs,
        "contribution_runs": summary.contribution_runs,
        "probings_per_run": model.n_rows,
        "seed": summary.seed,
        "coverage": COVERAGE,
        "conditions": model.conditions.to_dicts(),
        "inputs": _inputs(model),
        "quantities": _rows(summary),
    }


def _inputs(model: MonteCarloModel) -> list[dict[str, Any]]:
    scalars: list[dict[str, Any]] = [
        {"name": x.key, "value": x.value, "u": x.u, "distribution": x.distribution, "dof": x.dof}
        for x in model.inputs.scalars
    ]
    groups: list[dict[str, Any]] = [
        {"name": "certificate", "u_um": [float(u) for u in model.gauge.u_um], "distribution": "normal"},
        {"name": "repeatability", "u_um": model.machine.table.repeatability_um, "distribution": "normal"},
    ]
    return scalars + [group for group in groups if group["name"] in model.inputs.names]


def _rows(summary: Summary) -> list[dict[str, Any]]:
    rows = []
    for i, quantity in enumerate(summary.quantities):
        if math.isnan(summary.mean[i]):
            continue
        numbers = (float(column[i]) for column in (summary.value, summary.mean, summary.u, summary.low, summary.high))
        identity = (quantity.name, quantity.placement, quantity.face)
        row: dict[str, Any] = dict(zip(COLUMNS, (*identity, *numbers), strict=True))
        row["value"] = defined(row["value"])
        row["contributions"] = {name: float(u[i]) for name, u in summary.contribution.items()}
        rows.append(row)
    return rows


def summary_csv(summary: Summary) -> str:
    """One row per quantity; the contribution of an input is the column ``u: INPUT``, in the unit of the quantity."""
    names = list(summary.contribution)
    rows = [
        [*(row[name] for name in COLUMNS), *(row["contributions"][name] for name in names)] for row in _rows(summary)
    ]
    return csv_text(
        [*COLUMNS, *(f"u: {name}" for name in names)], [[result_cell(cell) for cell in row] for row in rows]
    )
