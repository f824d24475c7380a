"""Where the disagreement lives, in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from stepgauge.diagnose.corners import SAWTOOTH, SQUARE, WaveLook
from stepgauge.diagnose.forms import AXES, MEMORY
from stepgauge.diagnose.library import Family
from stepgauge.diagnose.result import Located
from stepgauge.diagnose.search import Look
from stepgauge.diagnose.smooth import Forms
from stepgauge.diagnose.whitening import orthonormal

Array = NDArray[np.float64]
MOST_LOCATED = 4
FALSE_ALARM = 0.004
"""Chance that any form is seen in a recording without structure."""
UNDECIDED = 4.0
"""Forms whose logarithms of chance differ by less say the same."""
MOST_COMPARED = 40
MOST_SAME = 2
SAME = "in this recording the same as "
LEVEL = "level"
"""The form of levels that differ between placements."""
PER_PLACEMENT = ("placement", "azimuth", "side")
WITHIN_P = 0.01
"""Chance of what a form says within placements, beyond their levels, above which it says nothing there."""
COMMON = ("side", "azimuth", "position", "machine x", "machine y", "machine z", "time", "order", "cycle")
"""Covariates from the commonest to the rarest cause; any other one comes after them."""
SIDE_WORDS = {"approach": "both", "gauge": "both", "front": "front", "back": "back"}


def most_telling(forms: Forms, white: Array) -> tuple[Located, ...]:
    """The forms that, one beside the other, carry the structure of the whitened residuals, most surprising first."""
    whitening = forms.whitening
    found: list[Located] = []
    basis = np.zeros((len(white), 0))
    columns: list[Array] = []
    bar = np.log(FALSE_ALARM / max(len(forms.families), 1))
    total = max(float(white @ white) - whitening.dof, 1.0)
    while len(found) < MOST_LOCATED:
        left = white - basis @ (basis.T @ white)
        looks = forms.looks(left, basis, whitening.dof - basis.shape[1])
        best, *same = behind_placements(_telling(looks), looks, forms, left, basis)[: 1 + MOST_SAME]
        if best.log_p > bar:
            break
        found.append(describe(best, min(best.gain / total, 1.0)))
        for other in same if not columns else ():
            also = describe(other, min(other.gain / total, 1.0))
            found.append(replace(also, where=f"{also.where} ({SAME}{best.family.covariate})"))
        columns.append(whitening(forms.columns(best)))
        basis = orthonormal(np.concatenate(columns).T)
    return tuple(found)


def _telling(looks: Sequence[Look]) -> list[Look]:
    """The looks that tell most, one to a covariate: those nearly as telling as the best, commoner covariates first."""
    near = [look for look in looks[:MOST_COMPARED] if look.log_p <= looks[0].log_p + UNDECIDED]
    first = {look.family.covariate: look for look in reversed(near)}
    return sorted(first.values(), key=lambda look: _rank(look.family.covariate))[: 1 + MOST_SAME]


def behind_placements(
    telling: Sequence[Look], looks: Sequence[Look], forms: Forms, left: Array, basis: Array
) -> list[Look]:
    """The looks behind the levels of the placements, where the first of them says nothing within placements.

    A temperature, a time or a height that differs between placements and hardly within any numbers them, and anything
    else that differs between them would do as well. ``left (n,)``, ``basis (n, k)``: what a model leaves and moves.
    """
    level = next((look for look in looks if look.family.details["form"] == LEVEL), None)
    first = telling[0]
    if level is None or first.family.covariate in PER_PLACEMENT:
        return list(telling)
    white = forms.whitening
    beside = orthonormal(np.column_stack([basis, white(forms.columns(level)).T]))
    # of columns that say nothing beside the levels rounding would be left, were these taken out of them
    both = orthonormal(np.column_stack([beside, white(forms.columns(first)).T]))
    gain = float(((both.T @ left) ** 2).sum() - ((beside.T @ left) ** 2).sum())
    within = both.shape[1] - beside.shape[1]
    if within and stats.chi2.sf(gain, within) < WITHIN_P:
        return list(telling)
    return [level, *(look for look in telling if look.family is not level.family)]


def _rank(covariate: str) -> int:
    return COMMON.index(covariate) if covariate in COMMON else len(COMMON)


def describe(look: Look, share: float) -> Located:
    """A look at a form, in words a technician uses."""
    family = look.family
    form, side = str(family.details["form"]), str(family.details["side"])
    return Located(
        family.covariate,
        SIDE_WORDS.get(side, "both"),
        form,
        _words(family, form, side, look),
        round(float(share), 4),
        float(np.exp(look.log_p)),
        look.period if isinstance(look, WaveLook) else None,
    )


def _words(family: Family, form: str, side: str, look: Look) -> str:
    place = {"front": "on front faces only, ", "back": "on backward faces only, "}.get(side, "")
    covariate = family.covariate
    text = {
        "offset": "a constant along the approach" if covariate == "side" else f"a constant by {covariate}",
        "wander": f"wanders with {covariate}",
        "decay": f"decays with {covariate}, by a power law and not exponentially",
        "decay to a level": f"decays with {covariate} to a level, by a power law and not exponentially",
        "memory": f"every rest adds, and touches wear it off {_at(family, look)}",
        "power": f"grows with a power of the {covariate}",
        "two curves": "follows another curve along the gauge on fronts than on backs",
        "levels": "jumps from cycle to cycle",
        "loop": "another shape along the gauge on the way there than on the way back",
        "odd cycle": f"one cycle lies apart: cycle {_name(family, look)}",
        "odd length": f"one cycle has a length of its own: cycle {_name(family, look)}",
        "changing scale": "a length that changes with time",
        "growing length": f"a length that grows with {covariate}",
        "trend": f"grows with {covariate}" if covariate != "position" else "grows along the gauge",
        "bow": f"a bow over {covariate}",
        "free shape": f"changes with {covariate} in no simple form",
        "step": f"a step in {covariate} {_at(family, look)}",
        "period": f"repeats with {covariate} {_at(family, look)}",
        SAWTOOTH: f"repeats with {covariate} in a sawtooth {_at(family, look)}",
        SQUARE: f"repeats with {covariate} in a square wave {_at(family, look)}",
        "level": "the level differs between placements",
        "harmonics": "depends on the direction of approach",
    }[form]
    moved = ", along the gauge whatever the side" if side == "gauge" else ""
    moved = f", along machine {side}" if side in AXES else moved
    return place + text + moved


def _name(family: Family, look: Look) -> str:
    names = family.details.get("names")
    return names[look.atom] if names else ""


def _at(family: Family, look: Look) -> str:
    value = look.period if isinstance(look, WaveLook) else _value(family, look)
    unit = family.details.get("unit", "")
    word = {"step": "after", MEMORY: "over"}.get(family.details["form"], "with period")
    return f"{word} {value:.4g} {unit}".rstrip() if value is not None else ""


def _value(family: Family, look: Look) -> float | None:
    values = family.details.get("atoms")
    return None if values is None else float(values[look.atom])
