"""What is to be done about each finding: one rule, which every text of it follows.

Good enough is what can do no harm: whatever of its set a finding is, its size with its U moves no reading by more than
the machine is meant to hold. Nothing is good enough since it is not known: that is measured until it is.

What is sure is acted on: a number is entered where it is larger than its U, nothing else may be the cause, it makes the
readings fit, and none of them is to be taken again; its uncertainty allows for what is not settled beside it. Where all
numbers are entered, what is left is a limit of the machine.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Literal

from stepgauge.conditions import stored_conditions
from stepgauge.diagnosis.gaussian_processes.random_function import PERIODIC
from stepgauge.diagnosis.wording.findings import STEPPERS, states_value, subject
from stepgauge.diagnosis.wording.limits import misfits
from stepgauge.diagnosis.wording.notation import COVERAGE, is_determined, members_of, told_numbers
from stepgauge.diagnosis.wording.structure import SCATTER
from stepgauge.effects import effect_kinds

Said = Mapping[str, Any]
Action = Literal["enter", "repair", "check", "misfit", "wait", "unknown", "left"]
"""Enter a number; repair what has none; check which cause it is; do nothing since it does not fit; wait until what is
repaired was measured again; measure what is not known well enough; leave what can do no harm."""
SURE = 0.95
"""Probability from which a finding is acted on however small it is: that with which a value is within its U (k = 2)."""
SPOILS = ("gauge_reversed", "block_shift", "tip_change", "step_change", "repeatability")
"""Findings that are settled, and the gauge measured or diagnosed again, before numbers are entered."""
MECHANICAL = (
    *("straightness", "angular_error", "roll", "error_motion", "scale_curvature", "periodic_scale_error"),
    *("local_scale_defect", "scale_joint", "screw_error", "reversal_wear", "reversal_slope", "stick_slip"),
)
"""Findings of guideways, screws and drives, which a machine that is set by its steps has no number for."""
COURSE = ("order", "time", "cycle")
"""What structure without a law depends on that came in the course of the measurement, and is settled first, too: of two
states of a machine no value is that of both. What repeats has a mean, of which the values and their U are."""


def actions(said: Said) -> list[Action]:
    """What is to be done about each finding, in their order."""
    first = [_action(one, said) for one in said["effects"]]
    found = zip(first, said["effects"], strict=True)
    spoilt = any(what != "left" and spoils(one) for what, one in found) or any(map(spoils, said["unexplained"]))
    return ["wait" if spoilt and what == "enter" else what for what in first]


def _action(effect: Said, said: Said) -> Action:
    is_set, rivals, unfit = states_value(effect["kind"], subject(said).of), has_rivals(effect), bool(misfits(said))
    open_ = is_set and not any(is_determined(one) for _, one in told_numbers(effect))
    is_sure = effect["probability"] >= SURE and not (open_ or rivals or unfit)
    if not is_sure and 0.0 < most_um(effect, said) <= held_um(said):
        return "left"
    if unfit or rivals:
        return "misfit" if unfit else "check"
    return "unknown" if open_ else "enter" if is_set else "repair"


def held(kind: str | None, noise: float) -> float:
    """What a machine that is set by its steps is meant to hold: U of a reading (k = 2), in its unit; of others 0.

    There the mean of many readings counts.
    """
    return COVERAGE * noise if kind in STEPPERS else 0.0


def held_um(said: Said) -> float:
    """The same of what was diagnosed, in its unit: the maximum permissible error where its machine file states one."""
    limit = said["inputs"].get("machine", {}).get("mpe_um")
    at = subject(said)
    return float(limit or held(at.machine, said.get("fit", {}).get(at.key("noise_um"), 0.0)))


def most_um(effect: Said, said: Said) -> float:
    """By how much a finding moves a reading at most, whatever of its set it is, in the unit of what was diagnosed."""
    at = subject(said)
    return max(float(one.get(at.key("seen_um"), 0.0)) * _most(one) for one in members_of(effect))


def _most(one: Said) -> float:
    """A size with its U over the size: of several the largest; of one that is a lower bound infinite."""
    known = effect_kinds(every=True).get(one["kind"])
    parameters = () if known is None else known.parameters()
    shapes = {each.name for each in parameters if each.role != "linear"}
    sizes = [p for name, p in told_numbers(one) if name not in shapes]
    if any(p.get("bound") == "least" or not p["value"] for p in sizes):
        return math.inf
    return max((1.0 + COVERAGE * p["u"] / abs(p["value"]) for p in sizes), default=1.0)


def has_rivals(effect: Said) -> bool:
    """Whether something else may be in the place of a finding."""
    several = len(members_of(effect)) > 1 or effect["confounded_with"] or effect["alternatives"]
    return bool(several or effect.get("aliases"))


def spoils(effect: Said) -> bool:
    """Whether a finding, or structure without a law, is settled before any number is entered."""
    if "covariate" in effect:
        return effect["covariate"] in COURSE and effect.get("form") not in (*SCATTER, *PERIODIC)
    numbers = effect["parameters"]
    smaller = effect["kind"] == "repeatability" and numbers["repeatability_um"]["value"] < numbers["stated_um"]["value"]
    return effect["kind"] in SPOILS and not smaller


def is_of_file(effect: Said, action: Action) -> bool:
    """Whether a finding is mended in the machine file alone: what was measured is diagnosed again with that."""
    return action == "enter" and effect["kind"] == "effective_radius"


def is_good_enough(said: Said) -> bool:
    """Whether there is nothing to do: nothing is there, or nothing that can do harm, and no run is worth it."""
    if said["unexplained"] or not said.get("may_remain"):
        return False
    if said["verdict"] != "insufficient":
        return all(what == "left" for what in actions(said))
    if stored_conditions(said).preventing or said["further"]["commands"] or not said["noise"]["from_repeats"]:
        return False
    return all(COVERAGE * one["seen_um"] <= held_um(said) for one in said["may_remain"])


def limits_of_machine(said: Said) -> list[Said]:
    """The findings that stay where all numbers of a machine that is set by its steps are entered: its limits."""
    todo = actions(said)
    all_done = not said["unexplained"] and {*todo} <= {"repair", "left"}
    if not all_done or subject(said).machine not in STEPPERS:
        return []
    found = [one for one, what in zip(said["effects"], todo, strict=True) if what == "repair"]
    return found if all(one["kind"] in MECHANICAL for one in found) else []
