"""What a length test by ISO 10360-2 says of the machine, and what it leaves open, in sentences."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from stepgauge.conditions import Conditions
from stepgauge.conditions.decision import DECISION_SOURCE, ConformityDecision, Outcome, decision_of, prevented
from stepgauge.files.notation import make_sentence
from stepgauge.standards.iso10360 import KINDS, REMEASURE_SOURCE, LengthTest
from stepgauge.standards.iso10360_further import further_statements
from stepgauge.standards.iso10360_rules import describe
from stepgauge.standards.iso10360_series import E0, E150
from stepgauge.standards.length_uncertainty import SOURCE as UNCERTAINTY_SOURCE
from stepgauge.standards.lengths import Kind
from stepgauge.standards.rules import incomplete, open_points

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
