"""What a diagnosis calls its effects and covariates, in the words of the truth."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any, TypeGuard

AXIS_KINDS = (
    "scale_error",
    "scale_curvature",
    "scale_temperature",
    "periodic_scale_error",
    "local_scale_defect",
    "reversal_error",
    "reversal_wear",
    "stick_slip",
    "scale_warm_up",
)
"""Kinds that say nothing else of where they are than their axis."""
_WHERE: dict[str, tuple[tuple[str, ...], ...]] = {
    "squareness": (("plane",),),
    "angular_error": (("travel", "travel_axis", "axis"), ("rotation", "rotation_axis", "about")),
    "block_defect": (("face",),),
    "block_shift": (("block",),),
    "misalignment": (("placement",),),
    "tip_change": (("placement",),),
    "scale_joint": (("axis",), ("order",)),
    "error_motion": (("axis",), ("component",), ("order",)),
    "gauge_soaking": (("warmed",),),
    "thermal_shift": (("column",),),
    "thermal_expansion_of": (("column",), ("of",)),
    "thermal_bending": (("column",), ("axis",), ("component",)),
}
"""Choices that say where the other kinds are, in the order of the truth; each with the names that it may have."""
_COVARIATES: tuple[tuple[str, str], ...] = (
    (r"humidity", "humidity_pct"),
    (r"azimuth", "azimuth"),
    (r"pause|dwell|wait|rest|first.?touch|since|gap", "pause"),
    (r"time|elapsed", "time"),
    (r"order|sequence|history|memory", "order"),
    (r"cycle", "cycle"),
    (r"placement|placing", "placement"),
    (r"direction|approach|travel", "direction"),
    (r"machine|scale_position|^[xyz](_mm)?$|[xyz]_mm", "machine"),
    (r"gauge_position|position|along|face|block|^a(_mm)?$", "gauge"),
    (r"side|front|back", "side"),
    (r"speed", "speed"),
)


def value_of(effect: Mapping[str, Any], *names: str) -> Any:
    """A parameter by its first known name, from ``parameters`` or the effect itself; ``value`` of a table."""
    for source in (effect.get("parameters") or {}, effect):
        for name in names:
            if name in source:
                found = source[name]
                return found.get("value") if isinstance(found, Mapping) else found
    return None


def key_of(effect: Mapping[str, Any]) -> str:
    """``kind`` or ``kind:where`` of a diagnosed effect, spelt as in the truth.

    A drift that says when it begins is ``thermal_drift:late``, and so is one that does not say: it means any time.
    """
    kind = str(effect.get("kind"))
    if kind in AXIS_KINDS:
        return f"{kind}:{str(value_of(effect, 'axis')).lower()}"
    if kind == "thermal_drift":
        return kind if value_of(effect, "start_s") == 0.0 else f"{kind}:late"
    if kind in _WHERE:
        return f"{kind}:{'/'.join(_word(effect, *names) for names in _WHERE[kind])}"
    return kind


def _word(effect: Mapping[str, Any], *names: str) -> str:
    """One choice of an effect as the truth spells it."""
    value = value_of(effect, *names)
    if names[0] == "plane":
        return "".join(sorted(str(value).lower()))
    if names[0] == "column":
        minus = value_of(effect, "minus")
        return "-".join(sorted((str(value), str(minus)))) if minus else str(value)
    if is_number(value) or str(value).isdigit():
        return str(int(value))
    return str(value).lower()


def axis_of(key: str) -> str:
    """The axis of a key whose kind lies along one; empty for others."""
    kind, _, where = key.partition(":")
    return where.partition("/")[0] if kind in AXIS_KINDS or kind == "scale_joint" else ""


def kinds_of(effect: Mapping[str, Any]) -> set[str]:
    """The kind named and all kinds it is said to be confounded with, those of combinations too."""
    return {str(effect.get("kind"))}.union(*alternatives_of(effect))


def alternatives_of(effect: Mapping[str, Any]) -> set[tuple[str, ...]]:
    """What an effect is said to be confounded with: kinds, or combinations (``A + B``, ``A + A``), each sorted."""
    others = effect.get("confounded_with") or []
    names = [other.get("kind") if isinstance(other, Mapping) else other for other in others]
    terms = [re.split(r"\s*\+\s*|\s+and\s+", str(name)) for name in names]
    return {tuple(sorted(re.split(r"[\s:(\[]", term.strip())[0] for term in several)) for several in terms}


def covariate(text: str) -> str:
    """A located covariate in the words of the truth; an unknown one comes back as it is."""
    plain = str(text).strip().lower().replace(" ", "_")
    return next((name for pattern, name in _COVARIATES if re.search(pattern, plain)), plain)


def is_number(value: object) -> TypeGuard[float]:
    """Whether this is a finite number, and not true or false."""
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
