"""Rules of a standard as data: what is asked, where it is asked, what was found, and whether it is met.

A clause is named only where its number is sure; otherwise the standard and the rule's subject are named.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Rule:
    """One rule; ``met`` is None if the data do not decide it."""

    source: str
    asks: str
    found: str
    met: bool | None

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON types."""
        return {"source": self.source, "asks": self.asks, "found": self.found, "met": self.met}


@dataclass(frozen=True)
class Excluded:
    """Something that was recorded and is not used, with the rule that says why."""

    what: str
    reason: str
    source: str

    def to_dict(self) -> dict[str, str]:
        """Plain JSON types."""
        return {"what": self.what, "reason": self.reason, "source": self.source}


def open_points(rules: Iterable[Rule]) -> list[str]:
    """What is asked by the rules that are not met or could not be checked, each once."""
    return list(dict.fromkeys(rule.asks for rule in rules if not rule.met))


def incomplete(rules: Iterable[Rule]) -> list[str]:
    """One statement per rule that is not met or could not be checked."""
    words = {False: "incomplete", None: "not checked"}
    return [f"{words[rule.met]}: {rule.source}: {rule.asks}; {rule.found}" for rule in rules if not rule.met]
