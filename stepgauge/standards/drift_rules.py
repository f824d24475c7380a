"""What ISO 230-3:2020 asks of a drift test, checked one by one; limits that could not be confirmed say so."""

from __future__ import annotations

import numpy as np

from stepgauge.files.notation import percent
from stepgauge.standards.drift import LONGEST_AXIS_MM, SETTLED_SHARE, STANDARD, DriftTest
from stepgauge.standards.rules import Rule

ETVE_H = 24.0
LARGEST_STEP_S = 300.0


def rules_of(test: DriftTest) -> tuple[Rule, ...]:
    """Every rule of the kind of test."""
    return (_temperatures(test), *(_etve(test) if test.kind == "etve" else _axis(test)))


def _temperatures(test: DriftTest) -> Rule:
    names = list(test.drift.temperature_C)
    found = ", ".join(names) if names else "none in the table"
    return Rule(f"{STANDARD}, instrumentation", "temperatures recorded beside the displacements", found, bool(names))


def _etve(test: DriftTest) -> tuple[Rule, ...]:
    hours = test.duration_s / 3600.0
    step = float(np.diff(test.drift.time_s).max())
    source = f"{STANDARD}, ETVE test (unconfirmed)"
    return (
        Rule(source, f"a test of {ETVE_H:g} h at least", f"{hours:.1f} h", hours >= ETVE_H - 1e-6),
        Rule(source, f"a reading every {LARGEST_STEP_S:g} s at least", f"up to {step:.0f} s", step <= LARGEST_STEP_S),
    )


def _axis(test: DriftTest) -> tuple[Rule, ...]:
    source = f"{STANDARD}, test of linear axes"
    known = test.settled
    share = "less than two hours measured" if known is None else percent(known)
    settled = Rule(
        f"{source} (unconfirmed)",
        f"moved until the last 60 min change less than {percent(SETTLED_SHARE)} of the first 60 min",
        share,
        known is not None and known < SETTLED_SHARE,
    )
    span = test.drift.span_mm
    if span is None:
        return (settled,)
    asks = f"a representative length of {LONGEST_AXIS_MM:g} mm at most"
    return settled, Rule(f"{source}, clause 7", asks, f"{span:.1f} mm", span <= LONGEST_AXIS_MM)
