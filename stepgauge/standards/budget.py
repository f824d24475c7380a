"""Uncertainty budget of what ``evaluate`` reports (JCGM 100:2008, "GUM"), propagated with GTC.

Every quantity of the evaluation is linear in the mean readings of the faces, so that its sensitivities are found by
evaluating unit readings with the same equations (Pahk & Kim, 1 to 13). Each source of uncertainty moves the readings:
alone (certificate, repeatability, probing, resolution: by face) or together (temperatures, expansion, alignment,
effects of the machine file: one number for all faces, its response taken through the virtual CMM).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from stepgauge.errors import InputError, naming
from stepgauge.evaluation.face_errors import face_errors
from stepgauge.files.arrays import Array
from stepgauge.montecarlo.model import ModelQuantity, MonteCarloModel, PlacementReadings
from stepgauge.montecarlo.summary import Summary
from stepgauge.recording.face_readings import FaceStatistics
from stepgauge.standards.budget_sources import BudgetOptions, assumptions, terms
from stepgauge.standards.budget_terms import BudgetTerm, UncertaintySource
from stepgauge.standards.budget_unstated import UnstatedSource, missing
from stepgauge.standards.coverage import Expanded, expand

Progress = Callable[[int, int], None]
RADIUS_SHARE = {"xf_um": 0.0, "xb_um": -2.0, "xm_um": -1.0, "xr_um": -2.0}
"""How each error changes with the effective radius, by definition."""
NEGLIGIBLE = 1e-12


@dataclass(frozen=True)
class BudgetLine:
    """One quantity; ``contribution`` by source and all else in um. ``through_radius`` is part of the others, too.

    ``same_terms_u``: of the sources that the Monte Carlo knows; ``monte_carlo``: u, low and high from there.
    """

    name: str
    placement: int
    face: int | None
    position_mm: float | None
    value: float
    expanded: Expanded
    contribution: dict[str, float]
    through_radius: float
    same_terms_u: float
    monte_carlo: tuple[float, float, float] | None


@dataclass(frozen=True)
class Band:
    """The range of XM (its largest minus its smallest value) of a placement, um: no linear quantity, by Monte Carlo."""

    placement: int
    value: float
    u: float
    low: float
    high: float


@dataclass(frozen=True)
class UncertaintyBudget:
    """All lines, the sources they come from, the assumptions, and the contributions not stated (and how to state them).

    ``bands``: one per placement, where there is a Monte Carlo.
    """

    sources: tuple[UncertaintySource, ...]
    lines: tuple[BudgetLine, ...]
    assumptions: tuple[str, ...]
    not_included: tuple[UnstatedSource, ...]
    percent: float
    bands: tuple[Band, ...] = ()


def make_budget(
    model: MonteCarloModel,
    asked: BudgetOptions | None = None,
    monte_carlo: Summary | None = None,
    progress: Progress | None = None,
) -> UncertaintyBudget:
    """The budget of R_eff and of XF, XB, XM and XR at every face of every placement.

    Parameters
    ----------
    model : of a recording or a program, from :mod:`stepgauge.montecarlo`
    asked : what else is stated
    monte_carlo : of the same model, to stand beside the budget
    progress : called with the quantities done and the quantities in all

    Raises
    ------
    InputError
        another number of placements than the model has, a model without any uncertainty
    """
    asked = asked or BudgetOptions()
    if asked.placements and len(asked.placements) != len(model.parts):
        expected = f"{len(model.parts)} or none"
        raise InputError(
            naming("placements"), "one placement file per placement", found=len(asked.placements), expected=expected
        )
    lines: list[BudgetLine] = []
    sources: dict[str, UncertaintySource] = {}
    count = itertools.count(1)
    total = sum(1 + len(RADIUS_SHARE) * len(part.readings.faces) for part in model.parts)

    def step() -> None:
        if progress is not None:
            progress(next(count), total)

    for index, part in enumerate(model.parts):
        sources_of = terms(model, part, asked, asked.placements[index] if asked.placements else None)
        sources |= {term.source.name: _wider(sources.get(term.source.name), term.source) for term in sources_of}
        lines += _lines(model, part, sources_of, asked, monte_carlo, step)
    if not sources:
        raise InputError(model.machine.path, "nothing that counts has an uncertainty")
    return UncertaintyBudget(
        tuple(sources.values()),
        tuple(lines),
        tuple(assumptions(model, asked)),
        tuple(missing(model, asked)),
        asked.percent,
        () if monte_carlo is None else tuple(_band(monte_carlo, part.placement) for part in model.parts),
    )


def _band(monte_carlo: Summary, placement: int) -> Band:
    i = monte_carlo.index("band_um", None, placement)
    columns = (monte_carlo.value, monte_carlo.u, monte_carlo.low, monte_carlo.high)
    value, u, low, high = (float(column[i]) for column in columns)
    return Band(placement, value, u, low, high)


def _wider(one: UncertaintySource | None, other: UncertaintySource) -> UncertaintySource:
    if one is None:
        return other
    u = (min(one.u[0], other.u[0]), max(one.u[1], other.u[1]))
    return UncertaintySource(
        other.name, other.label, other.kind, u, other.unit, min(one.dof, other.dof), other.stated_by
    )


def sensitivities(model: MonteCarloModel, part: PlacementReadings) -> dict[str, Array]:
    """Change of every quantity in um per um of the mean reading of every face.

    ``xf_um`` ... ``xr_um`` with shape ``(faces read, faces)``, ``r_eff_mm`` (in um) with ``(faces read,)``.
    """
    faces = part.readings.faces
    count = np.bincount(part.readings.face, minlength=int(faces[-1]) + 1)[faces]
    unit = np.where(count > 0, np.eye(len(faces)), np.nan) * 1e-3
    seen = FaceStatistics(faces, count, unit, np.full_like(unit, np.nan))
    errors = face_errors(seen, np.zeros(len(faces)), model.origin)
    by_face = {name: np.asarray(getattr(errors, name)) for name in RADIUS_SHARE}
    return {**by_face, "r_eff_mm": errors.r_eff_mm * 1e3}


@dataclass(frozen=True)
class _Balance:
    """What all lines of one placement share; ``u_radius``: standard uncertainty of R_eff, um."""

    model: MonteCarloModel
    part: PlacementReadings
    terms: Sequence[BudgetTerm]
    u_radius: float
    percent: float
    monte_carlo: Summary | None
    column: dict[ModelQuantity, int]

    def line(self, quantity: ModelQuantity, weights: Array, through: float, value: float) -> BudgetLine:
        """A line; the sources are independent of each other, so that their contributions add in quadrature."""
        from GTC import uncertainty

        parts = _weighed(self.terms, weights)
        contribution = {name: float(uncertainty(number)) for name, number in parts.items()}
        face = quantity.face
        return BudgetLine(
            quantity.name,
            quantity.placement,
            face,
            None if face is None else float(self.model.gauge.position_mm[face - 1]),
            value * (1e3 if face is None else 1.0),
            expand(_total(parts.values()), self.percent),
            contribution,
            abs(through) * self.u_radius,
            math.hypot(*(u for name, u in contribution.items() if name in self.model.inputs.names)),
            self._monte_carlo_result(quantity),
        )

    def _monte_carlo_result(self, quantity: ModelQuantity) -> tuple[float, float, float] | None:
        """u, low and high of the Monte Carlo, um."""
        if self.monte_carlo is None:
            return None
        i, scale = self.column[quantity], 1e3 if quantity.face is None else 1.0
        u, low, high = (scale * float(v[i]) for v in (self.monte_carlo.u, self.monte_carlo.low, self.monte_carlo.high))
        return u, low, high


def _lines(
    model: MonteCarloModel,
    part: PlacementReadings,
    terms: Sequence[BudgetTerm],
    asked: BudgetOptions,
    monte_carlo: Summary | None,
    progress: Callable[[], None],
) -> list[BudgetLine]:
    share = sensitivities(model, part)
    radius = expand(_total(_weighed(terms, share["r_eff_mm"]).values()), asked.percent)
    column = {} if monte_carlo is None else {quantity: i for i, quantity in enumerate(monte_carlo.quantities)}
    balance = _Balance(model, part, terms, radius.u, asked.percent, monte_carlo, column)
    best = dict(zip(model.quantities, model.best(), strict=True))
    lines = []
    for quantity, weights, through in _wanted(part, share):
        value = float(best[quantity])
        if not math.isnan(value) and _defined(weights, part):
            lines.append(balance.line(quantity, weights, through, value))
        progress()
    return lines


def _wanted(part: PlacementReadings, share: dict[str, Array]) -> list[tuple[ModelQuantity, Array, float]]:
    """Every quantity with its sensitivities to the readings and to R_eff."""
    radius = [(ModelQuantity("r_eff_mm", part.placement), share["r_eff_mm"], 1.0)]
    found = radius if share["r_eff_mm"].any() else []  # what the readings had been corrected with is exact
    for name, through in RADIUS_SHARE.items():
        for i, face in enumerate(part.readings.faces):
            found.append((ModelQuantity(name, part.placement, int(face)), share[name][:, i], through))
    return found


def _defined(weights: Array, part: PlacementReadings) -> bool:
    """Whether all faces that a quantity needs were measured; NaN stands at those that were not measured at all."""
    return bool(np.isfinite(weights[np.isin(part.readings.faces, part.readings.face)]).all())


def _weighed(terms: Sequence[BudgetTerm], weights: Array) -> dict[str, Any]:
    """The quantity with one source at a time, as GTC numbers."""
    needed = np.flatnonzero(np.abs(np.nan_to_num(weights)) > NEGLIGIBLE)
    return {term.source.name: _total(float(weights[i]) * term.um[i] for i in needed) for term in terms}


def _total(numbers: Any) -> Any:
    return sum(numbers, 0.0)
