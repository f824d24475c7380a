"""The length test as the files that leave the house: ``iso10360.json`` and ``iso10360.csv``."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from stepgauge import __version__
from stepgauge.conditions.decision import DECISION_SOURCE
from stepgauge.files.json_types import defined
from stepgauge.files.tables import csv_text
from stepgauge.files.text import write_files
from stepgauge.recording.conventions import convention_words
from stepgauge.standards.gauge_table import gauge_to_dict
from stepgauge.standards.iso10360 import KINDS, LengthTest
from stepgauge.standards.iso10360_further import further_to_dict
from stepgauge.standards.iso10360_positions import Position, TestLength
from stepgauge.standards.iso10360_rules import describe
from stepgauge.standards.iso10360_series import E0
from stepgauge.standards.iso10360_statements import STANDARD, decide_test, statements
from stepgauge.standards.length_uncertainty import SOURCE as UNCERTAINTY_SOURCE
from stepgauge.standards.lengths import Kind

CSV_COLUMNS = (
    "position",
    "kind",
    "first_face",
    "second_face",
    "nominal_mm",
    "certified_mm",
    "repeat",
    "cycle",
    "error_um",
    "mpe_um",
    "expanded_uncertainty_um",
    "outcome",
    "range_um",
)


def length_test_to_dict(test: LengthTest, further: Sequence[LengthTest] = ()) -> dict[str, Any]:
    """Everything the test says, as JSON types (undefined values are None); ``further`` series in the same form."""
    specification, tip = test.specification, test.tip
    return {
        "format": "stepgauge test iso10360 1",
        "stepgauge": __version__,
        "standard": STANDARD,
        "series": {
            "key": test.series.key,
            "symbol": test.series.symbol,
            "name": test.series.name,
            "unconfirmed": test.series.unconfirmed,
        },
        "recording": test.path,
        "comments": dict(test.comments),
        "gauge": gauge_to_dict(test.gauge),
        "mpe": {
            "text": specification.mpe.to_text(),
            "constant_um": specification.mpe.constant_um,
            "um_per_mm": specification.mpe.um_per_mm,
            "cap_um": defined(specification.mpe.cap_um),
        },
        "repeatability_limit_um": specification.repeatability_um,
        "tip_diameter": None
        if tip is None
        else {"diameter_mm": tip.diameter_mm, "u_um": tip.u_um, "origin": tip.origin},
        "decision_rule": DECISION_SOURCE,
        "coverage_factor": test.stated.coverage_factor,
        "uncertainty_source": UNCERTAINTY_SOURCE,
        "uncertainty_not_stated": test.missing,
        "temperature_convention": convention_words(
            test.comments, all(one.table.temperature_C is not None for one in test.positions)
        ),
        "conditions": test.conditions.to_dicts(),
        "complete": test.complete,
        "rules": [rule.to_dict() for rule in test.rules],
        "excluded": [part.to_dict() for part in test.excluded],
        "results": {kind: _result(test, kind) for kind in KINDS},
        "decision": decide_test([test, *further]).to_dict() if test.series is E0 else None,
        "also": further_to_dict(test, specification.also),
        "statements": statements(test),
        "positions": [_position(position) for position in test.positions],
        "lengths": [_length(one) for kind in KINDS for one in test.lengths(kind)],
        "further": [length_test_to_dict(one) for one in further],
    }


def _result(test: LengthTest, kind: Kind) -> dict[str, Any] | None:
    lengths = test.lengths(kind)
    if not lengths:
        return None
    worst = max(lengths, key=lambda one: float(abs(one.error_um).max()) / one.mpe_um)
    ranges = [one.range_um for one in lengths if not math.isnan(one.range_um)]
    probabilities = [p for one in lengths if (p := one.conformity_probability) is not None]
    return {
        "outcome": test.outcome(kind),
        "conformity_probability": min(probabilities, default=None),
        "errors": sum(len(one.error_um) for one in lengths),
        "largest_error_um": max((float(e) for one in lengths for e in one.error_um), key=abs),
        "largest_share_of_mpe": float(abs(worst.error_um).max()) / worst.mpe_um,
        "worst": describe(worst),
        "largest_range_um": max(ranges, default=None),
        "repeatability_outcome": test.repeatability_outcome(kind),
        "remeasure": [describe(one) for one in test.remeasure(kind)],
    }


def _position(position: Position) -> dict[str, Any]:
    longest = position.longest_mm()
    return {
        "position": position.number,
        "axis": [float(v) for v in position.table.axis],
        "orientation": position.orientation,
        "mandatory": position.mandatory,
        "orientation_off_deg": position.off_deg,
        "line_mm": position.line_mm,
        "longest_mm": longest,
        "longest_share": longest / position.line_mm if position.line_mm else None,
        "gauge_temperature_C": position.table.temperature_C,
    }


def _length(one: TestLength) -> dict[str, Any]:
    return {
        "position": one.position,
        "kind": one.kind,
        "faces": list(one.faces),
        "nominal_mm": one.nominal_mm,
        "certified_mm": one.length_mm,
        "cycles": list(one.cycles),
        "errors_um": [float(error) for error in one.error_um],
        "range_um": defined(one.range_um),
        "mpe_um": one.mpe_um,
        "uncertainty_um": one.uncertainty.parts_um,
        "standard_uncertainty_um": one.uncertainty.standard_um,
        "expanded_uncertainty_um": one.expanded_um,
        "outcomes": one.outcomes,
        "conformity_probability": one.conformity_probability,
    }


def length_test_csv(test: LengthTest) -> str:
    """One row per error."""
    lengths = [one for kind in KINDS for one in test.lengths(kind)]
    return csv_text(CSV_COLUMNS, [_row(one, repeat) for one in lengths for repeat in range(len(one.error_um))])


def _row(one: TestLength, repeat: int) -> list[str]:
    numbers = (one.nominal_mm, one.length_mm)
    values = (float(one.error_um[repeat]), one.mpe_um, one.expanded_um)
    cells = [str(one.position), one.kind, str(one.faces[0]), str(one.faces[1]), *(f"{v:.12g}" for v in numbers)]
    cells += [
        str(repeat + 1),
        str(one.cycles[repeat]),
        *(f"{value:.6g}" for value in values),
        one.outcomes[repeat] or "",
    ]
    return [*cells, "" if math.isnan(one.range_um) else f"{one.range_um:.6g}"]


def write_length_test(folder: str | Path, test: LengthTest, further: Sequence[LengthTest] = ()) -> list[Path]:
    """Write ``iso10360.json``, ``iso10360.csv`` and ``iso10360-SERIES.csv`` of further series; returns their paths."""
    more = {f"iso10360-{one.series.key}.csv": length_test_csv(one) for one in further}
    said = {"iso10360.json": length_test_to_dict(test, further), "iso10360.csv": length_test_csv(test)}
    return write_files(folder, said | more)
