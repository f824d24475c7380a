"""Decisions by ISO 14253-1 and JCGM 106: the uncertainty counts against the party that proves its claim.

Conformity with a standard is stated only of a complete test; one value is enough to prove nonconformity. An uncertainty
that lacks contributions proves neither: it would be larger with them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Literal

Outcome = Literal["conforms", "does not conform", "not decidable", "no statement"]
"""``no statement``: a condition of the readings prevents any (:func:`stepgauge.conditions.gate`)."""
DECISION_SOURCE = "ISO 14253-1, decision rules for proving conformity or nonconformity"


def decide(value_um: float, limit_um: float, expanded_um: float, missing: Sequence[str] = ()) -> Outcome:
    """Whether a test value proves conformity with plus and minus a limit, nonconformity, or neither (ISO 14253-1).

    ``expanded_um`` is the expanded uncertainty of the test value, the guard band: it narrows the zone in which
    conformity is proven, and widens that beyond which nonconformity is. ``missing``: contributions that it lacks.
    """
    if missing:
        return "not decidable"
    size = abs(value_um)
    if size <= limit_um - expanded_um:
        return "conforms"
    return "does not conform" if size > limit_um + expanded_um else "not decidable"


def conformity_probability(value_um: float, limit_um: float, u_um: float) -> float:
    """Probability that what was measured lies within plus and minus a limit (JCGM 106:2012, 7.4, a normal measurand).

    ``u_um``: standard uncertainty of the value, from which nothing is missing; 0: the value itself decides.
    """
    if u_um == 0.0:
        return float(abs(value_um) <= limit_um)
    below, above = ((end - value_um) / (u_um * math.sqrt(2.0)) for end in (-limit_um, limit_um))
    return (math.erf(above) - math.erf(below)) / 2.0


WORST_FIRST: tuple[Outcome, ...] = ("no statement", "does not conform", "not decidable")
"""Without a statement on one value there is none on all; then one that does not conform decides."""


def together(outcomes: list[Outcome]) -> Outcome:
    """The outcome of several test values: the worst of them, see :data:`WORST_FIRST`."""
    return next((worst for worst in WORST_FIRST if worst in outcomes), "conforms")


INCOMPLETE = "No statement of conformity is made, for the test is not complete."


def stated(outcome: Outcome, words: Mapping[Outcome, str], said: str, left: Sequence[str]) -> str:
    """What is stated of a test: its outcome in ``words``, ``said`` of its values, and what is ``left`` open."""
    head = INCOMPLETE if outcome == "conforms" and left else words[outcome]
    return f"{head} {said}" + (f" Open: {'; '.join(left)}." if left else "")
