"""Decisions by ISO 14253-1 and JCGM 106: the uncertainty counts against the party that proves its claim.

Conformity with a standard is stated only of a complete test; one value is enough to prove nonconformity. An uncertainty
that lacks contributions proves neither: it would be larger with them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

Outcome = Literal["conforms", "does not conform", "not decidable", "no statement"]
"""``no statement``: a condition of the readings prevents any (:func:`stepgauge.conditions.gate`)."""
DECISION_SOURCE = "ISO 14253-1, decision rules for proving conformity or nonconformity"


def decide(value_um: float, limit_um: float, expanded_um: float, missing: Sequence[object] = ()) -> Outcome:
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


@dataclass(frozen=True)
class ConformityDecision:
    """What is decided of a result as a whole by the rule of ISO 14253-1: the ``decision`` of every result with limits.

    ``text``: the sentence of page 1; ``reason``: why neither conformity nor nonconformity is stated, empty where one
    is; ``parts``: the outcome of each characteristic, by its name; ``open``: what a complete test would need besides.
    """

    outcome: Outcome
    text: str
    reason: str = ""
    parts: tuple[tuple[str, Outcome], ...] = field(default=(), repr=False)
    open: tuple[str, ...] = ()

    @property
    def passed(self) -> bool | None:
        """True: conformity is proven; False: nonconformity is; None: neither, and ``reason`` says why."""
        return {"conforms": True, "does not conform": False}.get(self.outcome)

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON types."""
        parts = [{"characteristic": name, "outcome": outcome} for name, outcome in self.parts]
        said = {"outcome": self.outcome, "passed": self.passed, "reason": self.reason}
        return {**said, "parts": parts, "open": list(self.open), "text": self.text}

    @classmethod
    def read(cls, stored: Mapping[str, Any]) -> ConformityDecision:
        """What :meth:`to_dict` has written."""
        parts = tuple((one["characteristic"], one["outcome"]) for one in stored["parts"])
        return cls(stored["outcome"], stored["text"], stored["reason"], parts, tuple(stored["open"]))


NO_LIMIT = ConformityDecision(
    "no statement",
    "No statement of conformity is made: no limit was stated. Decision rule: none applied.",
    "no limit was stated",
)


def decision_of(
    parts: Sequence[tuple[str, Outcome]], words: Mapping[Outcome, str], said: str, left: Sequence[str] = ()
) -> ConformityDecision:
    """The decision on all ``parts``: the worst of them in ``words``, ``said`` of their values, and what is ``left``
    open, without which nothing conforms."""
    outcome, head = together([one for _, one in parts]), ""
    if outcome == "conforms" and left:
        outcome, head = "no statement", INCOMPLETE
    open_ = "; ".join(left)
    reason = {"no statement": open_, "not decidable": open_ or "a value lies within U of its limit"}.get(outcome, "")
    text = [head or words[outcome], said, *([f"Open: {open_}."] if left else []), f"Decision rule: {DECISION_SOURCE}."]
    return ConformityDecision(outcome, " ".join(text), reason, tuple(parts), tuple(left))


def prevented(why: str, parts: Sequence[tuple[str, Outcome]] = (), left: Sequence[str] = ()) -> ConformityDecision:
    """No statement, for a condition of the readings prevents it."""
    return ConformityDecision("no statement", why, why, tuple(parts), tuple(left))
