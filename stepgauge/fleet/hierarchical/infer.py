"""Crossed inference: from the visits of a fleet to causes with owners."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from stepgauge.files.arrays import Array
from stepgauge.fleet.hierarchical import numbers
from stepgauge.fleet.hierarchical.answer import ExplainedNumber, FleetInference
from stepgauge.fleet.hierarchical.background import Background
from stepgauge.fleet.hierarchical.causes import Cause, VisitCandidates
from stepgauge.fleet.hierarchical.periodic import Periodic, find_periodic
from stepgauge.fleet.hierarchical.priors import FleetPriors, fleet_priors
from stepgauge.fleet.hierarchical.profiles import ProfileCandidates
from stepgauge.fleet.hierarchical.result import NamedCause, merged, named, told
from stepgauge.fleet.hierarchical.single_effects import SingleEffect, find_effects
from stepgauge.fleet.hierarchical.visits import Crossing, GaugeVisits, Visit, make_crossing, split_by_ladder
from stepgauge.gauge.certified import Gauge

ROUNDS = 2
"""Iterations of the variances between rounds of the search; each goes on from the last."""
EXPANSIONS, PROFILES = 3, 3
"""A gauge of another expansion also answers otherwise to a wrong temperature, so slopes are looked at again."""


def infer(visits: Sequence[Visit], gauges: Mapping[str, Gauge], priors: FleetPriors | None = None) -> FleetInference:
    """Causes in a fleet, with their owners.

    Parameters
    ----------
    visits : every placement of every recording, with its owners
    gauges : certificates by the names that the visits use
    priors : the shipped ones by default

    Returns
    -------
    FleetInference
        named causes; the expected share of false ones among them is at most that of the priors
    """
    priors = priors or fleet_priors()
    fleet = make_crossing(visits, gauges)
    ladders = _add_shape(fleet, priors)
    flat = np.concatenate([ladder.um.ravel() for ladder in ladders])
    shapes, periods, explained, tried = _profiles(fleet, ladders, flat, priors)
    left = split_by_ladder(ladders, flat - explained)
    slopes = _slopes(fleet, ladders, left, priors)
    sizes = _sizes(fleet, ladders, left, priors)
    found = merged([*shapes, *map(_period_told, periods), *slopes.found, *sizes.found])
    kept = named([one for one in found if one.owner_kind != "visit"], priors)
    false = float(np.mean([1.0 - one.probability for one in kept])) if kept else 0.0
    alone = tuple(one for one in found if one.owner_kind == "visit")
    looked = _looked_for(fleet, [*tried, *slopes.candidates.causes, *sizes.candidates.causes])
    scatter = {**slopes.scatter, **sizes.scatter}
    return FleetInference(tuple(kept), false, scatter, fleet, alone, slopes, sizes, looked_for=looked)


def _looked_for(fleet: Crossing, causes: Sequence[Cause]) -> dict[tuple[str, str], int]:
    """In how many owners each kind of cause was a candidate; periods and halls' days are looked for in all of them."""
    owners: dict[tuple[str, str], set[str]] = {}
    for one in causes:
        if one.owner_kind != "visit":
            owners.setdefault((one.owner_kind, one.kind), set()).add(one.owner)
    for owner_kind, kind in (("type", "periodic"), ("machine", "periodic"), ("hall", "temperature")):
        owners[owner_kind, kind] = set(fleet.names[owner_kind])
    return {key: len(owners[key]) for key in sorted(owners)}


def _add_shape(fleet: Crossing, priors: FleetPriors) -> list[GaugeVisits]:
    """The ladders with the scatter that the faces of a visit have beyond their readings, estimated over the fleet.

    From the middle half of all departures from the gauges' mean profiles, which causes at some faces do not move.
    """
    squares = []
    for ladder in fleet.ladders:
        weighted = ladder.weighted(ladder.um)
        profile = weighted.sum(axis=0) / np.maximum(ladder.weight.sum(axis=0), 1e-12)
        beside = ladder.um - profile
        beside = beside - ladder.coefficients(beside) @ ladder.frame.T
        read = ladder.weight > 0.0
        lost = max(1.0 - 3.0 / max(read.sum(axis=1).mean(), 4.0) - 1.0 / len(ladder.visits), 0.1)
        squares.append((beside[read] ** 2 / lost, ladder.variance[read]))
    square, variance = (np.concatenate([one[k] for one in squares]) for k in (0, 1))
    extra = float(np.median(square) / 0.4549 - np.median(variance))
    shape_um = float(np.sqrt(max(extra, priors.legitimate.shape_um**2)))
    return [ladder.add_shape(shape_um) for ladder in fleet.ladders]


def _profiles(
    fleet: Crossing, ladders: list[GaugeVisits], flat: Array, priors: FleetPriors
) -> tuple[list[NamedCause], list[Periodic], Array, Sequence[Cause]]:
    """Blocks, worn blocks, places of scales and periods, each with the others taken off, and what was tried."""
    candidates = ProfileCandidates(fleet, ladders, priors)
    mixture, stated = priors.sizes.mixture(), priors.decision.named
    dated: list[tuple[str, str, float]] = []
    periods, waves = find_periodic(fleet, ladders, partial(candidates.solve, free=True), flat, priors)
    for _ in range(PROFILES):
        effects = find_effects(flat - waves, candidates, mixture, stated)
        found = [told(e, candidates.causes, fleet, _visit_shares(fleet, ladders, e.fitted), priors) for e in effects]
        shapes = sum((effect.fitted for effect in effects), np.zeros_like(flat))
        known, before = {one.cause for one in periods}, dated
        periods, waves = find_periodic(fleet, ladders, candidates.solve, flat - shapes, priors)
        dated = sorted({(one.owner, one.where, one.begin[1]) for one in found if one.kind == "block" and one.begin})
        if {one.cause for one in periods} == known and dated == before:
            break
        if dated != before:
            candidates = ProfileCandidates(fleet, ladders, priors, dated)
    return found, periods, shapes + waves, candidates.causes


def _visit_shares(fleet: Crossing, ladders: Sequence[GaugeVisits], flat: Array) -> Array:
    """How much of departures each visit shows, in standard deviations."""
    shown = np.zeros(len(fleet))
    for ladder, um in zip(ladders, split_by_ladder(ladders, flat), strict=True):
        shown[ladder.visits] = np.sqrt((um * ladder.weighted(um)).sum(axis=1).clip(0.0))
    return shown


def _named_causes(
    effects: Sequence[SingleEffect], candidates: VisitCandidates, fleet: Crossing, priors: FleetPriors
) -> list[NamedCause]:
    root = np.sqrt(candidates.background.weight)
    return [told(one, candidates.causes, fleet, np.abs(one.fitted) * root, priors) for one in effects]


def _period_told(one: Periodic) -> NamedCause:
    probability = 1.0 / (1.0 + float(np.exp(-min(one.log_factor, 700.0))))
    cause, mean = one.cause, float(np.mean(list(one.amplitude_um.values())))
    where = cause.where
    visits = tuple(one.visits.tolist())
    return NamedCause(
        cause.owner_kind, cause.owner, "periodic", where, "always", None, mean, one.u_um, probability, (), visits
    )


def _slopes(fleet: Crossing, ladders: list[GaugeVisits], um: list[Array], priors: FleetPriors) -> ExplainedNumber:
    """Causes that are a slope along the gauge."""
    unit = {
        key: share
        for key, share in numbers.shares(fleet, numbers.machine_slopes(), numbers.SLOPE).items()
        if share.any()
    }
    value, variance = numbers.observed(fleet, numbers.SLOPE, ladders, um)
    expands = numbers.per_K(fleet)
    for _ in range(EXPANSIONS):
        background = numbers.slope_background(fleet, variance, unit, expands, priors)
        candidates = numbers.slope_candidates(fleet, unit, expands, background, priors)
        effects = _found(value, candidates, background, fleet, priors)
        found = _named_causes(effects, candidates, fleet, priors)
        as_found = numbers.per_K(fleet, {one.owner: one.size for one in found if one.kind == "gauge_expansion"})
        if np.allclose(as_found, expands, rtol=0.05):
            break
        expands = as_found
    left = value - sum((effect.fitted for effect in effects), np.zeros_like(value))
    halls = _halls(fleet, left, background, [one for one in found if one.kind == "temperature"], priors)
    return ExplainedNumber([*found, *halls], value, unit, background, candidates, effects, _scatter(background, "um/m"))


def _sizes(fleet: Crossing, ladders: list[GaugeVisits], um: list[Array], priors: FleetPriors) -> ExplainedNumber:
    """Causes that change the size of every block."""
    unit = {
        key: share for key, share in numbers.shares(fleet, numbers.machine_sizes(), numbers.SIZE).items() if share.any()
    }
    value, variance = numbers.observed(fleet, numbers.SIZE, ladders, um)
    background = numbers.size_background(fleet, variance, unit, priors)
    candidates = numbers.size_candidates(fleet, unit, background, priors)
    effects = _found(value, candidates, background, fleet, priors)
    found = _named_causes(effects, candidates, fleet, priors)
    return ExplainedNumber(found, value, unit, background, candidates, effects, _scatter(background, "um"))


def _found(
    value: Array, candidates: VisitCandidates, background: Background, fleet: Crossing, priors: FleetPriors
) -> list[SingleEffect]:
    """Effects, with the background estimated anew from what they leave.

    First all lines are taken to scatter alike, so that a line that is off as a whole is no line that scatters more.
    Then each has its own scatter, and the machines of a line that is off are looked at anew: they differ.
    """
    background.estimate(value, 2 * ROUNDS)

    def update(left: Array) -> None:
        background.estimate(left, ROUNDS)
        candidates.renew()

    effects: list[SingleEffect] = []
    for pooled in (True, False):
        background.pooled = pooled
        effects = _without_spread(effects, candidates, fleet)
        effects = find_effects(value, candidates, priors.sizes.mixture(), priors.decision.named, update, effects)
    return effects


def _without_spread(
    effects: Sequence[SingleEffect], candidates: VisitCandidates, fleet: Crossing
) -> list[SingleEffect]:
    """Effects but those of machines whose line has one of the same kind."""
    line = {visit.machine: visit.type for visit in fleet.visits}
    top = [candidates.causes[one.rows[one.share.argmax()]] for one in effects]
    off = {(one.owner, one.kind) for one in top if one.owner_kind == "type"}
    kept = [one.owner_kind != "machine" or (line[one.owner], one.kind) not in off for one in top]
    return [effect for effect, keep in zip(effects, kept, strict=True) if keep]


def _scatter(background: Background, unit: str) -> dict[str, float]:
    estimated = {f"{term.name}, {unit}": float(np.max(term.sd)) for term in background.terms if not term.known}
    return estimated | {f"visit, {unit}": background.scatter}


def _halls(
    fleet: Crossing, left: Array, background: Background, known: Sequence[NamedCause], priors: FleetPriors
) -> list[NamedCause]:
    """Halls whose days scatter more than thermometers do: the likelihood of their variance, over its prior."""
    found = []
    prior, sizes = priors.kinds["hall"]["temperature"], priors.sizes.mixture()
    for hall in fleet.names["hall"]:
        term = next((term for term in background.terms if term.name == f"days of {hall}"), None)
        if term is None:
            continue
        tried = np.hypot(prior.usual * sizes.steps, priors.legitimate.day_K)
        estimated, log_like = term.sd, []
        for sd in [priors.legitimate.day_K, *tried]:
            term.sd = float(sd)
            background.factor()
            log_like.append(background.log_likelihood(left))
        term.sd = estimated
        background.factor()
        gain = np.array(log_like[1:]) - log_like[0] + sizes.log_weight
        total = float(np.logaddexp.reduce(gain)) + float(np.log(prior.odds))
        probability = 1.0 / (1.0 + float(np.exp(-np.clip(total, -700, 700))))
        days = np.unique(np.floor(fleet.day[fleet.owner["hall"] == fleet.names["hall"].index(hall)])).size
        size = float(np.sqrt(np.sum([estimated**2, *(one.size**2 for one in known if one.owner == hall)])))
        u, shown = size / np.sqrt(2.0 * days), np.abs(background.expected(term, left))
        visits = tuple(np.argsort(-shown, kind="stable")[: int((shown > 0.0).sum())].tolist())
        found.append(NamedCause("hall", hall, "temperature", "", "days", None, size, u, probability, (), visits))
    return found
