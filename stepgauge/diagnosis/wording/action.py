"""What is to be done about each finding: one rule, which every text of it follows.

A number is entered where it is larger than its expanded uncertainty, nothing else may be the cause, it makes the
readings fit, and none of them is to be taken again; its uncertainty allows for what is not settled beside it. What is
smaller than its uncertainty is left as it is; so is, on a machine that is set by its steps, what is neither sure nor
larger than the noise of a reading.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

from stepgauge.conditions import stored_conditions
from stepgauge.diagnosis.wording.findings import STEPPERS, Subject, states_value, subject
from stepgauge.diagnosis.wording.limits import misfits
from stepgauge.diagnosis.wording.notation import is_determined, members_of, told_numbers
from stepgauge.diagnosis.wording.structure import SCATTER

Said = Mapping[str, Any]
Action = Literal["enter", "repair", "check", "misfit", "wait", "small", "noise"]
"""Enter a number; repair what has none; check which cause it is; do nothing since it does not fit; wait until what is
repaired was measured again; leave what is smaller than its uncertainty, or than the noise of a reading."""
LEFT = ("small", "noise")
SPOILS = ("gauge_reversed", "block_shift", "tip_change", "step_change", "repeatability")
"""Findings that are settled, and the gauge measured or diagnosed again, before numbers are entered."""
COURSE = ("order", "time", "cycle")
"""What structure without a law depends on that came in the course of the measurement, and is settled first, too."""


def actions(said: Said) -> list[Action]:
    """What is to be done about each finding, in their order."""
    first = [_action(one, said) for one in said["effects"]]
    found = zip(first, said["effects"], strict=True)
    spoilt = any(what not in LEFT and spoils(one) for what, one in found) or any(map(spoils, said["unexplained"]))
    return ["wait" if spoilt and what == "enter" else what for what in first]


def _action(effect: Said, said: Said) -> Action:
    at, numbers = subject(said), [one for _, one in told_numbers(effect)]
    is_set = states_value(effect["kind"], at.of)
    if is_set and numbers and not any(map(is_determined, numbers)):
        return "small"
    unsure: Action | None = "misfit" if misfits(said) else "check" if has_rivals(effect) else None
    if unsure is not None:
        return "noise" if _is_within_noise(effect, said, at) else unsure
    return "enter" if is_set else "repair"


def has_rivals(effect: Said) -> bool:
    """Whether something else may be in the place of a finding."""
    several = len(members_of(effect)) > 1 or effect["confounded_with"] or effect["alternatives"]
    return bool(several or effect.get("aliases"))


def _is_within_noise(effect: Said, said: Said, at: Subject) -> bool:
    seen_um = effect.get("seen_um", 0.0)
    return at.machine in STEPPERS and 0.0 < seen_um <= said["fit"]["noise_um"]


def spoils(effect: Said) -> bool:
    """Whether a finding, or structure without a law, is settled before any number is entered."""
    if "covariate" in effect:
        return effect["covariate"] in COURSE and effect.get("form") not in SCATTER
    numbers = effect["parameters"]
    smaller = effect["kind"] == "repeatability" and numbers["repeatability_um"]["value"] < numbers["stated_um"]["value"]
    return effect["kind"] in SPOILS and not smaller


def is_good_enough(said: Said) -> bool:
    """Whether there is nothing to do: nothing is there, or nothing that matters, and no run is worth it.

    Where nothing is stated what may remain must not move readings by more than one of them may be off.
    """
    if said["unexplained"] or not said.get("may_remain"):
        return False
    if said["verdict"] != "insufficient":
        return all(what in LEFT for what in actions(said))
    if stored_conditions(said).preventing or said["further"]["commands"] or not said["noise"]["from_repeats"]:
        return False
    return all(one["seen_um"] <= said["fit"]["noise_um"] for one in said["may_remain"])
