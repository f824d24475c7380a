"""A probing test as files: ``iso10360-5.json`` and ``iso10360-5.csv`` (a row per point)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from stepgauge import __version__
from stepgauge.conditions.decision import DECISION_SOURCE, NO_LIMIT, ConformityDecision, Outcome, decision_of, prevented
from stepgauge.files.tables import csv_text
from stepgauge.standards.iso10360_5 import STANDARD, UNCONFIRMED, ProbingTest, Value, rules_of
from stepgauge.standards.rules import open_points

CSV_COLUMNS = ("stylus", "point", "x_mm", "y_mm", "z_mm", "radial_deviation_um")
WORDS: Mapping[Outcome, str] = {
    "conforms": "The probing performance conforms.",
    "does not conform": "The probing performance does not conform.",
    "not decidable": "Neither conformity nor nonconformity of the probing performance is proven.",
    "no statement": "No statement on the probing performance is made.",
}


def probing_to_dict(test: ProbingTest) -> dict[str, Any]:
    """Everything the test says, as JSON types."""
    rules = rules_of(test)
    return {
        "format": "stepgauge test iso10360-5 1",
        "stepgauge": __version__,
        "standard": STANDARD,
        "recording": ", ".join(one.path for one in test.styli),
        "comments": test.comments,
        "sphere": {
            "diameter_mm": test.sphere.diameter_mm,
            "u_diameter_um": test.sphere.u_diameter_um,
            "form_um": test.sphere.form_um,
            "u_form_um": test.sphere.u_form_um,
        },
        "decision_rule": DECISION_SOURCE,
        "coverage_factor": test.limits.coverage_factor,
        "conditions": test.conditions.to_dicts(),
        "complete": all(rule.met for rule in rules),
        "decision": decide_test(test).to_dict(),
        "values": [_value(one) for one in test.values],
        "centre_ranges_um": test.ranges_um().tolist() if test.multiple else None,
        "styli": [
            {
                "file": Path(one.path).name,
                "points": len(one.surface_mm),
                "tip_diameter_mm": one.tip_diameter_mm,
                "from_sphere": one.from_sphere.tolist(),
                "centre_mm": one.fit.centre_mm.tolist(),
                "diameter_mm": 2.0 * one.fit.radius_mm - one.tip_diameter_mm,
                "form_um": one.fit.form_error_um,
            }
            for one in test.styli
        ],
        "rules": [rule.to_dict() for rule in rules],
        "uncertainty_not_stated": test.missing,
        "unconfirmed": list(UNCONFIRMED if test.multiple else UNCONFIRMED[-1:]),
    }


def _value(one: Value) -> dict[str, Any]:
    return {
        "name": one.name,
        "symbol": one.symbol,
        "value_um": one.value_um,
        "limit_um": one.limit_um,
        "expanded_uncertainty_um": one.expanded_um,
        "outcome": one.outcome,
    }


def decide_test(test: ProbingTest) -> ConformityDecision:
    """The decision on all values that have a limit."""
    limited = [one for one in test.values if one.limit_um is not None]
    if test.conditions.preventing or not limited:
        return prevented(test.conditions.no_statement) if test.conditions.preventing else NO_LIMIT
    parts = [(one.name, one.outcome) for one in limited if one.outcome is not None]
    if test.outcome is None:
        why = f"the uncertainty of the test is incomplete ({'; '.join(test.missing)})"
        text = f"Conformity is not proven: {why}. Decision rule: {DECISION_SOURCE}."
        return ConformityDecision("not decidable", text, why, tuple(parts))
    said = "; ".join(f"{one.name}, MPE {one.limit_um:g} µm: {one.outcome}" for one in limited)
    return decision_of(parts, WORDS, f"{said}.", left_open(test))


def left_open(test: ProbingTest) -> list[str]:
    """What keeps the test from being complete: rules not met or not checked, and values without a limit."""
    return [
        *open_points(rules_of(test)),
        *(f"{one.name}: no limit stated" for one in test.values if one.limit_um is None),
    ]


def probing_csv(test: ProbingTest) -> str:
    """One row per surface point, with its distance from the sphere through all points."""
    rows: list[list[object]] = []
    start = 0
    for number, one in enumerate(test.styli, 1):
        residuals = test.fit.residuals_um[start : start + len(one.surface_mm)]
        start += len(one.surface_mm)
        for point, (place, off) in enumerate(zip(np.round(one.surface_mm, 7), residuals, strict=True), 1):
            rows.append([number, point, *place.tolist(), f"{off:.4f}"])
    return csv_text(CSV_COLUMNS, rows)
