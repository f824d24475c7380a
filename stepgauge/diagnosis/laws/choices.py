"""What a recording leaves to choose of a law (axis, face, column, ...), and whether it can show the law at all.

A law whose values a recording does not determine would be a name for whatever else is there: it is no candidate.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.laws.usual import PART_OF
from stepgauge.diagnosis.priors import Priors
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.effects import Effect, Parameter
from stepgauge.effects.base import Axis, Vector
from stepgauge.effects.following import Following
from stepgauge.probes import MechanicalProbe

Array = NDArray[np.float64]
ALL = "all"
"""The choice of an axis that means all of them."""
NEEDS_TIME = {"time", "order"}
MOST_PAUSES = 4
PAUSE_JUMP = 1.25
MOST_PAUSED = 0.15
"""Largest share of touches that follow a pause: what every touch follows is none."""
SHORT_PAUSE_S = 10.0
MOST_REVERSED_MM = 1.0
"""Largest difference of a face to its mirror image at which a probe that searches still finds it."""
LEAST_VARIED = 0.1
"""Share of a temperature above that at which a law is zero that must be variation, both root mean square."""
TEMPERATURES = ("_C", "_K", "_degC")
FEWEST_SPEEDS = 3
FEWEST_BACK = 0.2
"""Share of the touches each way from which a difference between the ways can be told from single touches."""
LIKE_DIRECTIONS = 0.1
TOLD_APART = 0.3
"""Share of the placements' own levels that must be left beside what they have in common."""
SPANNED = 0.02
"""Share of the largest of a law's patterns from which another one counts as a pattern of its own."""


def choices_of(law: type[Effect], data: Residuals) -> Iterator[dict[str, Any]]:
    """All choices of a law that this recording could tell, none where it cannot show the law; what is None is unset."""
    if NEEDS_TIME & set(law.covariates) and not data.has_time:
        return
    if not _SHOWN.get(law.kind, _always)(data):
        return
    names = [p for p in law.parameters() if p.role == "choice" or p.name == "pause_s"]
    for combination in product(*(_values_of(p, data, law) for p in names)):
        choices = {p.name: value for p, value in zip(names, combination, strict=True) if value is not None}
        if _is_own(law, choices, data) and _varies(law, choices, data):
            yield choices | _about(law, choices, data)


def _is_own(law: type[Effect], choices: dict[str, Any], data: Residuals) -> bool:
    """Whether a choice is none that another law is made for, or another choice of the same law."""
    if "minus" in choices and choices["column"] >= choices["minus"]:
        return False
    if choices.get("axis") == ALL and not _moves_along_several(data):
        return False
    if "component" not in choices:
        return True
    turns, own_axis = choices["component"].startswith("r"), choices["component"].endswith(choices["axis"])
    if law.kind == "error_motion":
        return bool(choices["order"] == (2 if turns else 3))  # lower orders have laws of their own
    return bool(choices["order"] == (1 if turns else 2) and not own_axis)  # a beam bends, it grows elsewhere


def _moves_along_several(data: Residuals) -> bool:
    """Whether the gauge lay along more than one axis: along one of them its scale is all that shows."""
    seen = np.abs(list(data.probings.setting.axis.values())).max(axis=0)
    return bool((seen > LIKE_DIRECTIONS).sum() > 1)


def _varies(law: type[Effect], choices: dict[str, Any], data: Residuals) -> bool:
    """Whether the temperature that a law follows varies: a length or an angle that follows a constant one is wrong.

    It would be another name of a scale error or a pitch. Constants of a shift are origins.
    """
    if law.kind not in ("thermal_expansion_of", "thermal_bending"):
        return True
    column = Following.model_construct(column=choices["column"], minus=choices.get("minus"), lag_s=0.0, from_C=None)
    warmer_K = column.warmer_K(data.probings)
    return bool(warmer_K.std() >= LEAST_VARIED * np.sqrt(np.mean(warmer_K**2)))


def _about(law: type[Effect], choices: dict[str, Any], data: Residuals) -> dict[str, Any]:
    """Powers of a coordinate count from the middle of the travel: about another place a power holds lower ones."""
    if "about_mm" not in law.model_fields:
        return {}
    return {"about_mm": float(data.probings.setting.travel_mm["xyz".index(choices["axis"])].mean())}


def _values_of(parameter: Parameter, data: Residuals, law: type[Effect]) -> Sequence[Any]:
    if parameter.name == "placement" and not parameter.required:
        every = [int(one) for one in np.unique(data.frame["placement"])]
        return [None, *(every if len(every) > 1 else ())]
    if parameter.name in _BY_RECORDING:
        return _BY_RECORDING[parameter.name](data)
    if parameter.name == "direction" and has_free_direction(law):
        return ["approach"]  # what it is along the approach is known by then; the direction takes a share of it
    if parameter.name == "minus":
        return [None, *temperatures(data)] if law.kind == "thermal_bending" else [None]
    if parameter.name == "order":
        return _ORDERS[law.kind]
    if parameter.name == "warmed":
        return parameter.choices if data.placement.max() > 0 else ["once"]  # of one placement both are the same
    if parameter.name == "arm":
        return ["first"]  # the azimuth says which one
    return parameter.choices or (parameter.default,)


def _faces(data: Residuals) -> list[int]:
    return [int(face) for face in np.unique(data.face)]


def _blocks(data: Residuals) -> list[int]:
    """Blocks that were probed on both sides: a defect of one face has its own law."""
    met = set(_faces(data))
    return sorted(face // 2 for face in met if face % 2 == 0 and face - 1 in met)


def _beside_others(data: Residuals) -> list[int]:
    """Placements that are not the only one with their stylus, whose radius is its own anyway."""
    numbers = data.frame["placement"].to_numpy()
    with_each = [np.unique(numbers[data.stylus == one]).tolist() for one in np.unique(data.stylus)]
    return sorted({one for with_one in with_each if len(with_each) == 1 or len(with_one) > 1 for one in with_one})


def choice_odds(kind: str, choices: Mapping[str, Any], priors: Priors) -> float:
    """How much likelier a law with these choices is than with another choice of its kind.

    A thermometer tells of the part that it is on. A part bends by a difference of temperature within itself; that
    between two parts, or one temperature alone, bends it only as far as it stands for such a difference. And a scale
    grows by its own temperature, not by that of the gauge or of another scale, of which columns are documented. The
    mean pre-travel of a tripod is in the effective radius of its qualification, so that only the rest shows.
    """
    if kind == "kinematic_pretravel" and choices["part"] == "whole":
        return priors.laws.unqualified
    if kind == "thermal_bending" and on_one_part(choices["column"], choices.get("minus", "")):
        return priors.laws.same_part
    part = choices.get("of") if kind == "thermal_expansion_of" else choices.get("axis")
    read = {PART_OF.get(choices.get(name, ""), part) for name in ("column", "minus")}
    return 1.0 if part is None or read == {part} else 1.0 / priors.laws.same_part


def is_common(kind: str, choices: Mapping[str, Any]) -> bool:
    """Whether a law is of all axes, or of all placements, at once."""
    return choices.get("axis") == ALL or (kind == "misalignment" and "placement" not in choices)


def on_one_part(one: str, other: str) -> bool:
    """Whether two thermometers are on the same part of a machine, as far as names tell: they begin with the same word.

    The documented columns of gauge and scales are of different parts, and a name that begins with the quantity tells
    of none.
    """
    first, second = (name.split("_")[0].lower() for name in (one, other))
    return first == second and not first.startswith(("temp", "gauge", "scale"))


def temperatures(data: Residuals) -> list[str]:
    """Recorded temperatures that change, by the unit in their names."""
    return [name for name in data.frame.columns if name.endswith(TEMPERATURES) and data.frame[name].nunique() > 1]


def has_free_direction(law: type[Effect]) -> bool:
    """Whether an effect moves the readings along any direction of the machine."""
    return "direction" in law.model_fields and law.model_fields["direction"].annotation == Axis | Vector


def pauses_s(data: Residuals) -> list[float]:
    """What may count as a pause, s: between the sizes into which the times between touches fall, the clearest first."""
    gaps = np.sort(np.diff(np.sort(data.frame["time_s"].to_numpy(float))))
    gaps = np.unique(gaps[len(gaps) - int(MOST_PAUSED * len(gaps)) :])
    jump = gaps[1:] / np.maximum(gaps[:-1], 1e-9)
    places = [i for i in np.argsort(-jump)[:MOST_PAUSES] if jump[i] > PAUSE_JUMP and gaps[i + 1] > SHORT_PAUSE_S]
    found = [float(np.sqrt(gaps[i] * gaps[i + 1])) for i in places]
    return [float(f"{pause:.3g}") for pause in found] or [60.0]


_BY_RECORDING: dict[str, Callable[[Residuals], Sequence[Any]]] = {
    "face": _faces,
    "block": _blocks,
    "pause_s": pauses_s,
    "column": temperatures,
    "placement": _beside_others,
}
"""Choices by what there is in the recording."""


def _always(_: Residuals) -> bool:
    return True


def _has_modelled_pretravel(data: Residuals) -> bool:
    """Of a lever that is longer nothing shows on a pre-travel that nobody modelled."""
    return data.machine.probe.model != "constant"


def _may_show_a_tripod(data: Residuals) -> bool:
    """Of a probe that is modelled by its construction a part may be different; it is not another tripod.

    Its compliance, lever and azimuth are three numbers: so many directions must be left beside the origins. With
    another stylus a direction is another one.
    """
    met = np.column_stack([data.probings.approaches()[1], data.stylus])
    directions = len(np.unique(met, axis=0)) - len(data.origins)
    return directions >= 3 and not isinstance(data.machine.sensor, MechanicalProbe)


def _may_lie_reversed(data: Residuals) -> bool:
    """Of a gauge that is not symmetrical a program would have missed the faces."""
    faces = data.gauge.position_mm
    return bool(np.abs(faces[-1] - faces[::-1] - faces).max() < MOST_REVERSED_MM)


def _has_speeds(data: Residuals) -> bool:
    """Two speeds tell a constant and a proportion, a square needs a third."""
    return len(np.unique(data.speed)) >= FEWEST_SPEEDS


def _has_like_placements(data: Residuals) -> bool:
    """Whether placements tell a radius of their own from radii and reversals that all have in common.

    Directions that differ by less than a tenth do not count as different: no reversal shows that little and is that
    large.
    """
    own = (data.placement == np.arange(data.placement.max() + 1)[:, None]).astype(float)
    shared = np.vstack([np.ones(len(data)), np.abs([data.probings.approach(axis) for axis in "xyz"]), data.radii])
    return share_beside(own, shared) > TOLD_APART


def share_beside(columns: Array, shared: Array) -> float:
    """Share of the norm of columns ``(k, n)`` that is left beside what others ``(m, n)`` have in common with them.

    The others count as different where they differ by more than a tenth.
    """
    left = columns - np.linalg.lstsq(shared.T, columns.T, rcond=LIKE_DIRECTIONS)[0].T @ shared
    return float(np.linalg.norm(left) / np.linalg.norm(columns))


def goes_both_ways(data: Residuals) -> bool:
    """Whether enough touches were made each way to tell the ways apart."""
    way = data.probings.way()
    return bool(min((way > 0).sum(), (way < 0).sum()) >= FEWEST_BACK * len(data))


_ORDERS = {"scale_joint": (0, 1), "error_motion": (2, 3), "thermal_bending": (1, 2)}
_SHOWN: dict[str, Callable[[Residuals], bool]] = {
    "lever_arm": _has_modelled_pretravel,
    "pretravel_scale": _has_modelled_pretravel,
    "kinematic_pretravel": _may_show_a_tripod,
    "seat_defect": _may_show_a_tripod,
    "servo_lag": _has_speeds,
    "gauge_reversed": _may_lie_reversed,
    "stick_slip": goes_both_ways,
    "tip_change": _has_like_placements,
}
"""What a recording or the machine file must have for a law of this kind to show."""


def is_spanned(law: type[Effect], atoms: Sequence[dict[str, Any]], columns: Array, priors: Priors) -> bool:
    """Whether signatures ``(atoms, d, n)`` beside the origins have as many patterns as the law has parameters.

    Asked of laws of the direction of approach or of the way to the touch, of which few may occur. A parameter that
    may be left out counts where it is varied and nothing is usual of it.
    """
    if law.kind not in _SPANNED:
        return True
    patterns = columns.reshape(-1, columns.shape[-1])
    value = np.linalg.eigvalsh(patterns @ patterns.T)
    varied = {name for name in atoms[0] if any(atom[name] != atoms[0][name] for atom in atoms)}
    varied -= set(priors.usual_shapes)
    shaped = [p for p in law.parameters() if p.role == "nonlinear" and (p.required or p.name in varied)]
    free = len(shaped) + sum(p.role == "linear" for p in law.parameters())
    return bool((value > SPANNED**2 * value[-1]).sum() >= free)


_SPANNED = ("kinematic_pretravel", "seat_defect", "stick_slip")
