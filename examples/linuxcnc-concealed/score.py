"""What a diagnosis found against what was hidden."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from truth import TrueEffect, read_truth

from stepgauge.diagnosis.result import Diagnosis

COVERAGE = 4.0
"""A value counts as right within this many of its standard uncertainties: every run draws anew what the latch does,
and five values are judged in each; at 3 one run in seventy would fail by chance."""
LATCH = ("noise_growth", "speed")
"""Always true where two speeds were measured: a latch scatters by the way travelled in its period."""

AXES = ("x", "y", "z")
NEAR_DEG = 4.0
"""A fitted direction that is nearer to an axis is that axis: a second motion of a fifteenth does not show in a run."""
CHOICES = ("axis", "direction", "per")
"""Parameters that say which one of its kind an effect is."""


@dataclass(frozen=True)
class Score:
    """One case: what was hidden, what was said, and whether that is right.

    ``named``: the effect is named with its axis, or stands in the set of an effect that this recording cannot tell from
    it; ``value``, ``u``: what was found, None where the effect is only in the set; ``false_alarms``: effects named
    that are not there.
    """

    case: str
    truth: TrueEffect | None
    verdict: str
    said: str
    named: bool
    false_alarms: tuple[str, ...]
    value: float | None = None
    u: float | None = None

    @property
    def within(self) -> bool:
        """Whether the value is right, where there is one."""
        if self.truth is None or self.value is None:
            return True
        return self.u is not None and abs(self.value - self.truth.value) <= COVERAGE * self.u

    @property
    def right(self) -> bool:
        """Named, the value within its uncertainty, nothing else said."""
        verdict = "adequate" if self.truth is None else "effects"
        return self.named and self.within and not self.false_alarms and self.verdict == verdict


def score(case: str, diagnosis: Path) -> Score:
    """Open the truth of a case and judge its ``diagnosis.json``."""
    truth, found = read_truth(case).effect, Diagnosis.read(diagnosis).contents
    laws = [effect for effect in found["effects"] if (effect["kind"], _choice(effect)) != LATCH]
    said = "; ".join(_words(effect) for effect in found["effects"]) or "-"
    hits = [effect for effect in laws if truth and _names(effect, truth)]
    in_set = [effect for effect in laws if truth and truth.kind in effect["confounded_with"]]
    meant = (hits or in_set)[:1]
    alarms = tuple(effect["kind"] for effect in laws if effect not in meant)
    value = hits[0]["parameters"][truth.parameter] if truth and hits else {"value": None, "u": None}
    named = bool(meant) or truth is None
    return Score(case, truth, found["verdict"], said, named, alarms, value["value"], value["u"])


def _names(effect: dict[str, Any], truth: TrueEffect) -> bool:
    if effect["kind"] != truth.kind:
        return False
    return _choice(effect) == truth.choice or _points_along(effect, truth.choice)


def _points_along(effect: dict[str, Any], axis: str) -> bool:
    """Whether the effect has a fitted direction, and this agrees with a machine axis."""
    direction = effect["parameters"].get("direction", {}).get("value")
    if not isinstance(direction, list) or axis not in AXES:
        return False
    return math.degrees(math.acos(min(direction[AXES.index(axis)] / math.hypot(*direction), 1.0))) < NEAR_DEG


def _choice(effect: dict[str, Any]) -> str:
    """The axis, direction or covariate of an effect, empty where its kind has none."""
    keys = [key for key in CHOICES if key in effect["parameters"]]
    return str(effect["parameters"][keys[0]]["value"]) if keys else ""


def _words(effect: dict[str, Any]) -> str:
    others = [*effect["confounded_with"], *effect["alternatives"]]
    return f"{effect['kind']} {_choice(effect)}".strip() + (f" (or {', '.join(others)})" if others else "")


def table(scores: list[Score]) -> list[str]:
    """One line per case."""
    lines = [f"{'case':<10} {'hidden':<32} {'found':<20} {'right':<5}  verdict: what is said"]
    for one in scores:
        hidden = f"{one.truth.kind} {one.truth.choice} {one.truth.value:g}" if one.truth else "nothing"
        found = "-" if one.value is None else f"{one.value:.4g} +- {one.u:.2g}" if one.u else f"{one.value:.4g}"
        right = "yes" if one.right else "NO"
        lines.append(f"{one.case:<10} {hidden:<32} {found:<20} {right:<5}  {one.verdict}: {one.said}")
    return lines
