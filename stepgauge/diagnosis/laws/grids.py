"""What a search tries of a law in a recording: its choices (axis, face, column, ..), and its shapes with their priors.

A choice that a recording hardly tells is not left out: how rare it is, is a prior (:meth:`.Effect.rarity`).
The values of a parameter are those of its declaration (:mod:`stepgauge.effects.grids`). Of one that is declared by its
sensible range alone they are as dense as the recording tells them apart.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np

from stepgauge.diagnosis.residuals import Residuals
from stepgauge.effects import Effect, Parameter
from stepgauge.effects.grids import (
    LEADS_MM,
    MOST_PERIODS,
    PERIOD_STEPS,
    lie_level,
    most_periods,
    periods_along,
    travelled_mm,
)
from stepgauge.effects.grids import temperatures as recorded_temperatures
from stepgauge.files.arrays import Array
from stepgauge.machine.file import Machine

Signatures = Callable[[Sequence[dict[str, Any]]], Array]
"""From shapes to their signatures ``(atoms, d, n)``."""
SPREAD, COARSE_SPREAD = np.linspace(-2.0, 2.0, 5), np.linspace(-1.5, 1.5, 3)
"""Points about what is usual, in standard deviations; of level gauges, which hardly show it, fewer."""
STYLUS_MM = 50.0
"""Stylus of which the declared compliance is."""
ALIKE = 0.6
"""Cosine between the signatures of neighbours from which nothing is tried between them."""
FIRST, MOST_VALUES, MOST_SHAPES = 9, 1200, 20_000
ALL = "all"
"""The choice of an axis that means all of them."""
IN_A_PLACEMENT = {"misalignment", "gauge_reversed"}
"""Kinds of one placement, or of all."""
NEEDS_TIME = {"time", "order"}
FEWEST_BACK = 0.2
"""Share of the touches each way from which a difference between the ways can be told from single touches."""


def choices_of(law: type[Effect], data: Residuals) -> Iterator[dict[str, Any]]:
    """All choices of a law in this recording; what is None is unset."""
    if NEEDS_TIME & set(law.covariates) and not data.has_time:
        return
    chosen = [p for p in law.parameters() if p.role == "choice" or (p.role == "fixed" and p.grid is not None)]
    for choices in _choose(law, chosen, {}, data):
        if law.is_own(choices, data.probings):
            yield choices


def _choose(
    law: type[Effect], left: Sequence[Parameter], chosen: dict[str, Any], data: Residuals
) -> Iterator[dict[str, Any]]:
    """The choices that are made, with every combination of those that are left."""
    if not left:
        yield chosen
        return
    for value in _options(law, left[0], chosen, data):
        yield from _choose(law, left[1:], chosen if value is None else {**chosen, left[0].name: value}, data)


def _options(law: type[Effect], parameter: Parameter, chosen: Mapping[str, Any], data: Residuals) -> Sequence[Any]:
    if parameter.name == law.free_direction():
        return ["approach"]  # what it is along the approach is known by then; the direction takes a share of it
    if parameter.grid is not None:
        return list(parameter.grid(data.probings, chosen))
    return parameter.choices or (parameter.default,)


def is_common(kind: str, choices: Mapping[str, Any]) -> bool:
    """Whether a law is of all axes, or of all placements, at once."""
    return choices.get("axis") == ALL or (kind in IN_A_PLACEMENT and "placement" not in choices)


def temperatures(data: Residuals) -> list[str]:
    """Recorded temperatures that change, by the unit in their names."""
    return recorded_temperatures(data.probings, {})


def goes_both_ways(data: Residuals) -> bool:
    """Whether enough touches were made each way to tell the ways apart."""
    way = data.probings.way()
    return data.is_ordered and bool(min((way > 0).sum(), (way < 0).sum()) >= FEWEST_BACK * len(data))


def shapes_of(
    law: type[Effect], choices: Mapping[str, Any], data: Residuals, signatures: Signatures, leads: float = 0.0
) -> tuple[list[dict[str, Any]], Array]:
    """All shapes of a law with these choices, and the logarithms of their prior ``(atoms,)``.

    ``leads``: share of the prior of a period along an axis that is of usual leads of screws.
    """
    shaped = [p for p in law.parameters() if p.role == "nonlinear"]
    values = [_values(law, p, choices, data) for p in shaped]
    has_leads = [leads > 0.0 and p.grid is periods_along for p in shaped]
    values = [_add_leads(v) if has else v for has, v in zip(has_leads, values, strict=True)]
    undeclared = [i for i, one in enumerate(values) if one is None]
    for i in undeclared:
        most = (MOST_SHAPES / max(_count(values), 1)) ** (1.0 / len(undeclared))
        values[i] = _told_apart(
            shaped, values, i, signatures, min(int(most), MOST_VALUES), _finest(law, shaped[i], data)
        )
    weights = [log_weights(p, v, law, data, choices) for p, v in zip(shaped, values, strict=True)]
    weights = [_prior_leads(w, v, leads) if has else w for has, v, w in zip(has_leads, values, weights, strict=True)]
    names = [p.name for p in shaped]
    atoms = [dict(zip(names, one, strict=True)) for one in product(*(list(one or ()) for one in values))]
    return atoms, np.array([sum(one) for one in product(*(w.tolist() for w in weights))])


def _values(law: type[Effect], p: Parameter, choices: Mapping[str, Any], data: Residuals) -> list[Any] | None:
    """Values by the declaration; None where there is none but a range."""
    usual = usual_shape(p, data.machine)
    if usual is not None:
        return list(usual[0] * np.exp(usual[1] * (COARSE_SPREAD if lie_level(data.probings) else SPREAD)))
    if p.grid is not None:
        return [value for value in p.grid(data.probings, choices) if value is not None or not p.required]
    return [p.default] if p.sensible is None else None


def _add_leads(periods: list[Any] | None) -> list[float]:
    """Periods with the usual leads of screws among them, the longest first; none where no period can be told."""
    if not periods:
        return []
    return sorted({*periods, *(lead for lead in LEADS_MM if lead < max(periods))}, reverse=True)


def _prior_leads(log_weight: Array, periods: list[Any] | None, share: float) -> Array:
    """The prior of periods ``(k,)`` of which a share is of usual leads of screws."""
    of_lead = np.isin(np.array(periods, float), LEADS_MM) * (share / len(LEADS_MM))
    return np.asarray(np.log((1.0 - share) * np.exp(log_weight) + of_lead))


def _count(values: Sequence[list[Any] | None]) -> int:
    return int(np.prod([len(one) for one in values if one is not None]))


def _finest(law: type[Effect], p: Parameter, data: Residuals) -> float:
    """Least value of a length or time that places or times of reading resolve, 0 for anything else."""
    if p.unit == "mm" and "coordinate" in law.covariates:
        x = travelled_mm(data.probings, max("xyz", key=lambda a: np.ptp(data.probings.coordinate_mm(a))))
        return float(np.ptp(x)) / most_periods(x, data.probings.setting.step_mm)
    if p.unit == "s" and data.has_time and not p.clock:
        return float(np.ptp(data.probings.time_s)) / most_periods(data.probings.time_s)
    return 0.0


def _told_apart(
    shaped: Sequence[Parameter],
    every: Sequence[list[Any] | None],
    own: int,
    signatures: Signatures,
    most: int,
    finest: float,
) -> list[float]:
    """Values over the sensible range of a parameter, halved until the signatures of neighbours are alike."""
    low, high = shaped[own].sensible or (0.0, 1.0)
    by_ratio = low > 0.0
    low = max(low, min(finest, 0.5 * high)) if by_ratio else low
    at = np.linspace(np.log(low), np.log(high), FIRST) if by_ratio else np.linspace(low, high, FIRST)
    others = {p.name: _middle(p, v) for i, (p, v) in enumerate(zip(shaped, every, strict=True)) if i != own}

    def unit(places: Array) -> Array:
        shown = np.exp(places) if by_ratio else places
        found = signatures([{**others, shaped[own].name: float(value)} for value in shown])[:, 0]
        length = np.linalg.norm(found, axis=1, keepdims=True)
        return np.asarray(found / np.maximum(length, np.finfo(length.dtype).tiny))

    seen = unit(at)
    while len(at) < most:
        apart = np.flatnonzero(np.einsum("an,an->a", seen[1:], seen[:-1]) < ALIKE)[: most - len(at)]
        apart = apart[np.diff(at)[apart] > 1e-6 * (at[-1] - at[0])]
        if not apart.size:
            break
        between = (at[apart] + at[apart + 1]) / 2.0
        order = np.argsort(np.r_[at, between], kind="stable")
        at, seen = np.r_[at, between][order], np.concatenate([seen, unit(between)])[order]
    return [float(value) for value in (np.exp(at) if by_ratio else at)]


def _middle(p: Parameter, values: list[Any] | None) -> Any:
    if values is not None:
        return values[len(values) // 2]
    assert p.sensible is not None
    low, high = p.sensible
    return float(np.sqrt(low * high)) if low > 0.0 else low + 0.4 * (high - low)


def log_weights(
    p: Parameter, values: list[Any] | None, law: type[Effect], data: Residuals, choices: Mapping[str, Any]
) -> Array:
    """Logarithms of the prior of the values of one parameter.

    Where every decade of its range is as likely, each has the share of its step. Of what is usual it is log-normal;
    else all are equally likely, except that all together have declared odds over None.
    """
    values = values or []
    if not values:
        return np.zeros(0)
    if (usual := usual_shape(p, data.machine)) is not None:
        weight = -0.5 * np.square(np.log(np.array(values) / usual[0]) / usual[1])
        return np.asarray(weight - np.logaddexp.reduce(weight))
    is_log = p.decades or (p.grid is None and p.sensible is not None and p.sensible[0] > 0.0)
    if is_log and len(values) > 1:
        logs = np.log(np.array(values, float))
        low, high = shape_range(p, data.machine, str(choices.get("axis", "")))
        whole = max(np.log(high), logs.max()) - min(np.log(low), logs.min())
        return np.asarray(np.log(np.minimum(np.abs(np.gradient(logs)), 1.0) / whole))
    late = np.array([value is not None for value in values])
    if p.odds is not None and late.any() and not late.all():
        return np.asarray(np.log(np.where(late, p.odds / late.sum(), 1.0 / (~late).sum()) / (1.0 + p.odds)))
    return np.full(len(values), -np.log(len(values)))


def finest_period_mm(data: Residuals) -> float | None:
    """Shortest period along an axis that is tried, mm; None where places lie evenly: a shorter one is an alias."""
    step_mm, x = data.probings.setting.step_mm, data.probings.certified_mm()
    if data.probings.setting.recording != "linear" or step_mm is not None or not np.ptp(x):
        return None
    return float(np.ptp(x)) / min(most_periods(x), MOST_PERIODS / PERIOD_STEPS)


def share_below(p: Parameter, value: float, data: Residuals) -> float:
    """Share of the prior of a shape, of which every decade is as likely, that lies below a value."""
    low, high = shape_range(p, data.machine)
    return float(np.clip(np.log(value / low) / np.log(high / low), 0.0, 1.0))


def usual_shape(p: Parameter, machine: Machine | None = None) -> tuple[float, float] | None:
    """Median of a shape's log-normal prior and the logarithm of its factor; None for a shape without one."""
    if p.usual is None:
        return None
    stylus_mm = machine.probe.shank_length_mm if machine is not None else STYLUS_MM
    return p.usual.median + stylus_mm * p.usual.beyond_stylus, float(np.log(p.usual.factor))


def shape_range(p: Parameter, machine: Machine | None = None, axis: str = "") -> tuple[float, float]:
    """Range of a shape in which every decade is as likely.

    A period along an axis is not longer than its travel, and not shorter than two steps of its resolution.
    """
    assert p.sensible is not None
    low, high = p.sensible
    if p.unit != "mm" or machine is None:
        return low, high
    if axis in ("x", "y", "z"):
        high = float(np.ptp(getattr(machine.table.travel_mm, axis)))
    step_um = machine.stated.resolution_um
    return (low if step_um is None else 2.0 * step_um * 1e-3), high
