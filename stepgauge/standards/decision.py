"""The decision rule of ISO 14253-1: the uncertainty counts against the party that proves its claim."""

from __future__ import annotations

from typing import Literal

Outcome = Literal["conforms", "does not conform", "not decidable"]
DECISION_SOURCE = "ISO 14253-1, decision rules for proving conformity or nonconformity"


def decide(value_um: float, limit_um: float, expanded_um: float) -> Outcome:
    """Whether a test value proves conformity with plus and minus a limit, nonconformity, or neither (ISO 14253-1).

    ``expanded_um`` is the expanded uncertainty of the test value: it narrows the zone in which conformity is proven,
    and widens that beyond which nonconformity is.
    """
    size = abs(value_um)
    if size <= limit_um - expanded_um:
        return "conforms"
    return "does not conform" if size > limit_um + expanded_um else "not decidable"


def together(outcomes: list[Outcome]) -> Outcome:
    """The outcome of several test values: one that does not conform decides, then one that is not decidable."""
    for worst in ("does not conform", "not decidable"):
        if worst in outcomes:
            return worst
    return "conforms"
