"""The length test as the files that leave the house: ``iso10360.json`` and ``iso10360.csv``.

What a length test by ISO 10360-2 says of the machine, and what it leaves open, in sentences.

The length test by other rules than ISO 10360-2: ASME B89.4.10360.2 and VDI/VDE 2617, from the same errors.

No text of either was at hand: what is taken from secondary sources is marked as unconfirmed wherever it goes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from stepgauge import __version__
from stepgauge.conditions import Conditions, gate
from stepgauge.conditions.decision import DECISION_SOURCE, ConformityDecision, Outcome, decision_of, prevented
from stepgauge.files.json_types import defined
from stepgauge.files.notation import make_sentence
from stepgauge.files.tables import csv_text
from stepgauge.recording.conventions import convention_words
from stepgauge.standards.gauge_table import gauge_to_dict
from stepgauge.standards.iso10360 import KINDS, REMEASURE_SOURCE, LengthTest
from stepgauge.standards.iso10360_positions import Position, TestLength
from stepgauge.standards.iso10360_rules import describe
from stepgauge.standards.iso10360_series import E0, E150
from stepgauge.standards.length_uncertainty import SOURCE as UNCERTAINTY_SOURCE
from stepgauge.standards.lengths import Kind
from stepgauge.standards.rules import incomplete, open_points

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


STANDARD = "ISO 10360-2:2009"
WORDS = {
    "conforms": "conformity is proven",
    "does not conform": "nonconformity is proven",
    "not decidable": "neither conformity nor nonconformity is proven: a value lies within U of the limit",
    "no statement": "no statement is made",
}
MACHINE: Mapping[Outcome, str] = {
    "conforms": "The machine conforms.",
    "does not conform": "The machine does not conform.",
    "not decidable": "Neither conformity nor nonconformity of the machine is proven.",
    "no statement": "No statement on the machine is made.",
}
NAMES = {
    "bidirectional": "{symbol}, bidirectional lengths",
    "unidirectional": "Unidirectional lengths",
}


def decide_test(tests: Sequence[LengthTest]) -> ConformityDecision:
    """The decision on E0, R0 and E150 together; ``tests``: the series E0 first."""
    parts: list[tuple[str, Outcome]] = []
    left: list[str] = []
    for test in tests:
        outcome, ranges = test.outcome("bidirectional"), test.repeatability_outcome("bidirectional")
        head = test.series.limit if test.series in (E0, E150) else f"{test.series.limit}, {test.series.name}"
        if outcome is not None:
            parts.append((f"{head} = ± {test.specification.mpe.to_text()}", outcome))
        if ranges is not None and test.series is E0:
            parts.append((f"R_0,MPL = {test.specification.repeatability_um:g} µm", ranges))
        named = f"{test.series.symbol}: " if len(tests) > 1 else ""
        left += [named + asks for asks in open_points(test.rules)]
        left += [f"contribution to U not stated: {what}" for what in test.missing]
    if tests[0].specification.repeatability_um is None:
        left.append("R_0: no limit stated")
    if all(test.series is not E150 for test in tests):
        left.append("E_150: not tested")
    why, left = sum((test.conditions for test in tests), Conditions()).no_statement, list(dict.fromkeys(left))
    if why:
        return prevented(why, parts, left)
    if tests[0].outcome("bidirectional") is None:
        why = "no bidirectional length was tested"
        text = f"No statement of conformity with {STANDARD}: {why}. Decision rule: {DECISION_SOURCE}."
        return ConformityDecision("no statement", text, why, tuple(parts), tuple(left))
    return decision_of(parts, MACHINE, "; ".join(f"{name}: {outcome}" for name, outcome in parts) + ".", left)


def statements(test: LengthTest) -> list[str]:
    """What can be said of the machine, and what the test leaves open, in sentences."""
    return verdicts(test) + [make_sentence(text) for text in incomplete(test.rules)]


def verdicts(test: LengthTest) -> list[str]:
    """What can be said of the machine, without the rules that were not met."""
    said = [make_sentence(note) for note in test.conditions.notes]
    said += [_verdict(test, kind) for kind in KINDS if test.lengths(kind)]
    said += [text for kind in KINDS for text in _repeatability(test, kind)]
    said += [text for kind in KINDS for text in _not_provable(test, kind)]
    said += [text for kind in KINDS for text in _remeasure(test, kind)]
    if test.missing:
        said.append(f"The test value uncertainty ({UNCERTAINTY_SOURCE}) is too small by what was not stated.")
    said += further_statements(test, test.specification.also)
    if test.series.unconfirmed:
        said.append(f"{test.series.symbol}: {test.series.unconfirmed}.")
    return said


def _verdict(test: LengthTest, kind: Kind) -> str:
    outcome = test.outcome(kind)
    if outcome is None:
        return f"{NAMES[kind]}: for information, none is decided on; {test.series.limit} is of bidirectional lengths."
    if test.missing and outcome == "not decidable":
        name, lacking = NAMES[kind].format(symbol=test.series.symbol), "; ".join(test.missing)
        return f"{name}: not decidable, for U lacks what was not stated: {lacking}."
    tail = "" if test.complete else ", for what was measured: the test is not complete"
    words = WORDS[outcome] if outcome != "conforms" or test.complete else "every error lies within the limit by U"
    return f"{NAMES[kind].format(symbol=test.series.symbol)}: {words}{tail}."


def _repeatability(test: LengthTest, kind: Kind) -> list[str]:
    outcome = test.repeatability_outcome(kind)
    if outcome is None:
        return []
    largest = max(one.range_um for one in test.lengths(kind) if not math.isnan(one.range_um))
    limit = test.specification.repeatability_um
    name = "R_0" if test.series is E0 else "Range of three repeats"
    return [f"{name}: largest {largest:.2f} µm, limit {limit:g} µm: {outcome}."]


def _not_provable(test: LengthTest, kind: Kind) -> list[str]:
    """Lengths without a conformance zone, for whatever was measured there could not prove conformity."""
    lengths = test.lengths(kind) if test.outcome(kind) is not None else []
    sizes = sorted({one.nominal_mm for one in lengths if one.expanded_um > one.mpe_um})
    if not sizes:
        return []
    where = ", ".join(f"{size:g}" for size in sizes)
    return [f"{kind.capitalize()} lengths: at {where} mm U is larger than the MPE: no error proves conformity there."]


def _remeasure(test: LengthTest, kind: Kind) -> list[str]:
    again = test.remeasure(kind)
    if not again:
        return []
    where = "; ".join(describe(one) for one in again)
    return [
        "The standard lets these lengths, with one repeat each outside the conformance zone, be measured again"
        f" ({REMEASURE_SOURCE}): {where}."
    ]


RATIO = 4.0
"""Least ratio of the permissible error to U, from which simple acceptance is allowed (ASME B89.7.3.1)."""
SHARE = 0.95
"""Of the values that VDI/VDE 2617-2 asks to lie within the length measuring uncertainty u."""
LABELS = {"b89": "ASME B89.4.10360.2", "vdi2617": "VDI/VDE 2617"}
NOTES = {
    "b89": (
        "simple acceptance: a value within the limit is accepted where U is at most a quarter of it (ASME B89.7.3.1);"
        " positions, lengths and repeats as ISO 10360-2: unconfirmed"
    ),
    "vdi2617": (
        "part 2.1 applies ISO 10360-2 and its decision rule; the older part 2 asks for 95 % of the values within"
        " u = A + K L <= B: unconfirmed"
    ),
}


def simple_acceptance(test: LengthTest) -> Outcome | None:
    """The decision on E0 without guard bands; not decidable where U is incomplete or above a quarter of the limit."""
    lengths = test.lengths("bidirectional")
    if not lengths:
        return None
    unsure = bool(test.missing) or any(RATIO * one.expanded_um > one.mpe_um for one in lengths)
    within = all(bool((np.abs(one.error_um) <= one.mpe_um).all()) for one in lengths)
    outcome: Outcome = "not decidable" if unsure else "conforms" if within else "does not conform"
    return gate(test.conditions, outcome)


def share_within(test: LengthTest) -> float | None:
    """Share of the errors of bidirectional lengths within the limit."""
    within = [np.abs(one.error_um) <= one.mpe_um for one in test.lengths("bidirectional")]
    return float(np.concatenate(within).mean()) if within else None


def further_to_dict(test: LengthTest, standards: Sequence[str]) -> dict[str, Any]:
    """By standard its outcome or share, and what is unconfirmed, as JSON types."""
    found: dict[str, dict[str, Any]] = {
        "b89": {"outcome": simple_acceptance(test)},
        "vdi2617": {"outcome": test.outcome("bidirectional"), "share_within": share_within(test)},
    }
    return {name: {**found[name], "note": NOTES[name]} for name in standards}


def further_statements(test: LengthTest, standards: Sequence[str]) -> list[str]:
    """The same in sentences."""
    said = []
    for name, one in further_to_dict(test, standards).items():
        share = one.get("share_within")
        tail = "" if share is None else f"; {100.0 * share:.0f} % of the values within the limit"
        said.append(f"{LABELS[name]}: {one['outcome'] or 'nothing to decide on'}{tail} ({one['note']}).")
    return said
