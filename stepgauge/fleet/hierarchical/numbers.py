"""The two numbers of a visit that everything linear acts on: the slope along the gauge, and the size of a block.

A scale, a squareness, an expansion, a temperature are one slope in any single visit: the crossing of machines, gauges
and directions tells them apart. So are a tip radius, a reversal, and worn fronts one block size.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from stepgauge.effects import Effect, along_approach_um
from stepgauge.effects.geometry import Squareness
from stepgauge.effects.reversal import ReversalError
from stepgauge.effects.scales import ScaleError
from stepgauge.files.arrays import Array
from stepgauge.files.dates import YEAR_DAYS
from stepgauge.fleet.hierarchical.background import Background, RandomEffect
from stepgauge.fleet.hierarchical.causes import CandidateColumns, Cause, VisitCandidates, courses, growth, owner_visits
from stepgauge.fleet.hierarchical.priors import FleetPriors
from stepgauge.fleet.hierarchical.visits import Crossing, GaugeVisits

SLOPE, SIZE = 1, 2
SEEN_SHARE = 0.03
"""Least share of an error that a visit must see: a gauge that is not quite level tells nothing of z."""
PHASES = 6
"""Phases of a season that are tried, over half a year: its size has a sign."""


def machine_slopes() -> dict[tuple[str, str], Effect]:
    """Effects of a machine that are a slope along any straight line, by kind and place, of unit size."""
    scales = {("scale", axis): ScaleError(axis=axis, ppm=1.0) for axis in "xyz"}  # type: ignore[arg-type]
    planes = ("xy", "xz", "yz")
    return scales | {("squareness", plane): Squareness(plane=plane, urad=1.0) for plane in planes}  # type: ignore


def machine_sizes() -> dict[tuple[str, str], Effect]:
    """Effects of a machine that change the size of every block alike."""
    return {("reversal", axis): ReversalError(axis=axis, um=1.0) for axis in "xyz"}  # type: ignore[arg-type]


def shares(fleet: Crossing, effects: dict[tuple[str, str], Effect], number: int) -> dict[tuple[str, str], Array]:
    """What a unit of every effect makes of one number of every visit: ``(visits,)`` for each."""
    found = {key: np.zeros(len(fleet)) for key in effects}
    for ladder in fleet.ladders:
        probings, inverse = ladder.probings(ladder.setting()), np.linalg.pinv(ladder.frame)[number]
        for key, effect in effects.items():
            um = along_approach_um(effect, probings).reshape(ladder.um.shape) * ladder.side
            found[key][ladder.visits] = um @ inverse
    return {key: np.where(np.abs(share) > SEEN_SHARE, share, 0.0) for key, share in found.items()}


def observed(fleet: Crossing, number: int, ladders: list[GaugeVisits], um: list[Array]) -> tuple[Array, Array]:
    """One number of every visit and its variance, from departures by gauge ``(n, f)``."""
    value, variance = np.zeros(len(fleet)), np.zeros(len(fleet))
    for ladder, own in zip(ladders, um, strict=True):
        value[ladder.visits] = ladder.coefficients(own)[:, number]
        variance[ladder.visits] = ladder.normal[:, number, number]
    return value, variance


def certified_sd(ladder: GaugeVisits, number: int) -> float:
    """Standard uncertainty of a slope or size from the certificate alone.

    Where no correlation is stated, any is possible: errors that grow along the gauge, or differ from fronts to backs.
    """
    weight = np.linalg.pinv(ladder.frame)[number]
    u, r = ladder.gauge.u_um, ladder.gauge.correlation
    if r is not None:
        return float(np.sqrt((weight * u) @ r @ (weight * u)))
    metres = float(ladder.gauge.position_mm[-1]) * 1e-3
    return float(u.max() / metres if number == SLOPE else u.mean() / 2.0)


def owner_columns(number: NDArray[np.intp], share: Array) -> sparse.csc_matrix:
    """A coefficient of every owner times the share of every visit."""
    rows = np.flatnonzero(share)
    shape = (len(number), int(number.max()) + 1)
    columns = sparse.csc_matrix((share[rows], (rows, number[rows])), shape=shape)
    return columns[:, np.flatnonzero(np.diff(columns.indptr))]


def line_effects(fleet: Crossing, name: str, shares_of: list[Array], sd: float, least: float) -> list[RandomEffect]:
    """Coefficients of machines; the machines of every line have a standard deviation of their own."""
    line, machine = fleet.owner["type"], fleet.owner["machine"]
    terms = []
    for number, words in enumerate(fleet.names["type"]):
        blocks = [owner_columns(machine, np.where(line == number, share, 0.0)) for share in shares_of]
        terms.append(
            RandomEffect(f"{name} of {words}", sparse.hstack(blocks, format="csc"), sd, least=least, pool=name)
        )
    return terms


def slope_background(
    fleet: Crossing, variance: Array, unit: dict[tuple[str, str], Array], expands: Array, priors: FleetPriors
) -> Background:
    """Of slopes: certificates, machines in order, and the days of every hall."""
    own, least = fleet.owner, priors.legitimate.scale_um_m
    kinds: dict[str, list[Array]] = {}
    for (kind, _), share in unit.items():
        kinds.setdefault(kind, []).append(share)
    terms = [
        term for kind, several in kinds.items() for term in line_effects(fleet, f"machine {kind}", several, 3.0, least)
    ]
    ones = np.ones(len(fleet))
    certified = np.array([max(certified_sd(ladder, SLOPE), 1e-3) for ladder in fleet.ladders])
    terms.append(RandomEffect("gauge certificate", owner_columns(own["gauge"], ones), certified, known=True))
    spread = np.array([ladder.gauge.table.expansion_uncertainty_per_K for ladder in fleet.ladders]) * 1e6
    columns = owner_columns(own["gauge"], fleet.temperature_K)
    warm = np.unique(own["gauge"][np.flatnonzero(fleet.temperature_K)])
    terms.append(RandomEffect("gauge expansion", columns, np.maximum(spread[warm], 1e-3), known=True))
    terms += [_days(expands, fleet, hall, rows) for hall, rows in owner_visits(own["hall"], fleet.names["hall"])]
    return Background(variance, terms, 1.0)


def per_K(fleet: Crossing, wrong: Mapping[str, float] | None = None) -> Array:
    """Slope of every visit for a gauge that is 1 K warmer than stated, um/m.

    ``wrong``: by gauge, expansion beyond what its certificate states, um/(m K).
    """
    found = np.zeros(len(fleet))
    for ladder, name in zip(fleet.ladders, fleet.names["gauge"], strict=True):
        found[ladder.visits] = ladder.gauge.table.expansion_per_K * 1e6 + (wrong or {}).get(name, 0.0)
    return found


def _days(expands: Array, fleet: Crossing, hall: str, rows: NDArray[np.intp]) -> RandomEffect:
    """The common error of all visits in a hall on a day, K."""
    _, day = np.unique(np.floor(fleet.day[rows]), return_inverse=True)
    columns = sparse.csc_matrix((expands[rows], (rows, day.ravel())), shape=(len(fleet), int(day.max()) + 1))
    return RandomEffect(f"days of {hall}", columns, 0.05, least=1e-3)


Course = tuple[str, float, Array, float]
"""How a cause goes on over the days: its name, since when, a factor for each day, and its part of the odds."""


class OwnerColumns(CandidateColumns):
    """Candidates of owners: one for each owner and course of days, over the visits that see it."""

    def __init__(self, fleet: Crossing, priors: FleetPriors) -> None:
        super().__init__(len(fleet))
        self.fleet, self.priors = fleet, priors

    def add_owners(
        self,
        owner_kind: str,
        kind: str,
        share: Array,
        where: str = "",
        of_days: Callable[[Array], Iterable[Course]] | None = None,
    ) -> None:
        """A kind of cause of all owners of a kind; ``share``: what each visit sees of it; by default on any course."""
        fleet, prior = self.fleet, self.priors.kinds[owner_kind][kind]
        for name, rows in owner_visits(fleet.owner[owner_kind], fleet.names[owner_kind]):
            rows = rows[share[rows] != 0.0]
            if not len(rows):
                continue
            days = fleet.day[rows]
            for course, day, factor, part in of_days(days) if of_days else courses(days, self.priors):
                seen = factor != 0.0
                cause = Cause(owner_kind, name, kind, where, course, day)
                self.add(cause, rows[seen], (factor * share[rows])[seen], prior.odds * part, prior.usual)

    def add_visits(self, kind: str, share: Array, usual: float) -> None:
        """Every visit may be wrong by itself."""
        for row, visit in enumerate(self.fleet.visits):
            cause = Cause("visit", str(row), kind, "", "once", visit.day)
            self.add(cause, np.array([row]), share[[row]], self.priors.time.alone, usual)


def slope_candidates(
    fleet: Crossing, unit: dict[tuple[str, str], Array], expands: Array, background: Background, priors: FleetPriors
) -> VisitCandidates:
    """Machines and lines by axis and plane, gauges as a whole and by temperature, halls by date and season."""
    columns = OwnerColumns(fleet, priors)
    for (kind, where), share in unit.items():
        columns.add_owners("machine", kind, share, where)
        if kind in priors.kinds["type"]:
            columns.add_owners("type", kind, share, where, _made_with)
    columns.add_owners("gauge", "certificate_scale", np.ones(len(fleet)))
    columns.add_owners("gauge", "gauge_expansion", fleet.temperature_K, of_days=_made_with)
    columns.add_owners("hall", "temperature", expands)
    columns.add_owners("hall", "temperature", expands, of_days=lambda day: _seasons(day, priors))
    columns.add_visits("temperature", expands, 0.3)
    return VisitCandidates(columns, background)


def size_background(
    fleet: Crossing, variance: Array, unit: dict[tuple[str, str], Array], priors: FleetPriors
) -> Background:
    """Of block sizes: certificates, machines and probes in order."""
    own, least = fleet.owner, priors.legitimate.size_um
    terms = line_effects(fleet, "machine reversal", list(unit.values()), 0.5, least)
    ones = np.ones(len(fleet))
    terms.append(RandomEffect("probe radius", owner_columns(own["probe"], ones), 0.5, least=least))
    certified = np.array([max(certified_sd(ladder, SIZE), 1e-3) for ladder in fleet.ladders])
    terms.append(RandomEffect("gauge certificate", owner_columns(own["gauge"], ones), certified, known=True))
    return Background(variance, terms, 0.3)


def size_candidates(
    fleet: Crossing, unit: dict[tuple[str, str], Array], background: Background, priors: FleetPriors
) -> VisitCandidates:
    """Reversal of machines by axis, radius of probes, worn fronts of gauges."""
    columns, ones, begin = OwnerColumns(fleet, priors), np.ones(len(fleet)), float(fleet.day.min())
    for (kind, where), share in unit.items():
        columns.add_owners("machine", kind, share, where)
    columns.add_owners("probe", "radius", ones)
    columns.add_owners("gauge", "wear", 0.5 * ones, "fronts", lambda day: growth(day, priors, begin))
    columns.add_visits("radius", ones, 1.0)
    return VisitCandidates(columns, background)


def _made_with(day: Array) -> list[Course]:
    """What an owner is made with has no date."""
    return [("always", np.nan, np.ones(len(day)), 1.0)]


def _seasons(day: Array, priors: FleetPriors) -> list[Course]:
    """A temperature that follows the year: a sine at each of ``PHASES`` phases."""
    turns = np.arange(PHASES) / (2.0 * PHASES)
    angle = 2.0 * np.pi * (day / YEAR_DAYS - turns[:, None])
    part = priors.time.season / PHASES
    return [("season", float(turn), np.sin(one), part) for turn, one in zip(turns, angle, strict=True)]
