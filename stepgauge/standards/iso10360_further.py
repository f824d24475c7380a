"""The length test by other rules than ISO 10360-2: ASME B89.4.10360.2 and VDI/VDE 2617, from the same errors.

No text of either was at hand: what is taken from secondary sources is marked as unconfirmed wherever it goes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from stepgauge.conditions import gate
from stepgauge.conditions.decision import Outcome
from stepgauge.standards.iso10360 import LengthTest

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
