"""What was measured, and under which conditions: asked once, before any number is decided on or passed on."""

from __future__ import annotations

from stepgauge.conditions.condition import (
    NO_STATEMENT,
    NOTHING,
    STATES,
    Condition,
    Conditions,
    State,
    gate,
    require_statement,
    stored_conditions,
)

__all__ = [
    "NOTHING",
    "NO_STATEMENT",
    "STATES",
    "Condition",
    "Conditions",
    "State",
    "gate",
    "require_statement",
    "stored_conditions",
]
