"""The two numbers of a visit that everything linear acts on: the slope along the gauge, and the size of a block.

A scale, a squareness, an expansion, a temperature are one slope in any single visit: the crossing of machines, gauges
and directions tells them apart. So are a tip radius, a reversal, and worn fronts one block size.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

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


def slope_candidates(
    fleet: Crossing, unit: dict[tuple[str, str], Array], expands: Array, background: Background, priors: FleetPriors
) -> VisitCandidates:
    """Machines and lines by axis and plane, gauges as a whole and by temperature, halls by date and season."""
    columns = CandidateColumns(len(fleet))
    for (kind, where), share in unit.items():
        _constant(columns, fleet, "machine", kind, where, share, priors)
        if kind in priors.kinds["type"]:
            _always(columns, fleet, "type", kind, share, priors, where)
    _constant(columns, fleet, "gauge", "certificate_scale", "", np.ones(len(fleet)), priors)
    _always(columns, fleet, "gauge", "gauge_expansion", fleet.temperature_K, priors)
    _constant(columns, fleet, "hall", "temperature", "", expands, priors)
    _seasons(columns, fleet, expands, priors)
    _alone(columns, fleet, "temperature", expands, 0.3, priors)
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
    columns = CandidateColumns(len(fleet))
    for (kind, where), share in unit.items():
        _constant(columns, fleet, "machine", kind, where, share, priors)
    _constant(columns, fleet, "probe", "radius", "", np.ones(len(fleet)), priors)
    _wear(columns, fleet, priors)
    _alone(columns, fleet, "radius", np.ones(len(fleet)), 1.0, priors)
    return VisitCandidates(columns, background)


def _each(
    columns: CandidateColumns,
    fleet: Crossing,
    owner_kind: str,
    kind: str,
    where: str,
    share: Array,
    priors: FleetPriors,
    courses_of: Callable,
) -> None:
    prior = priors.kinds[owner_kind][kind]
    for name, rows in owner_visits(fleet.owner[owner_kind], fleet.names[owner_kind]):
        rows = rows[share[rows] != 0.0]
        if not len(rows):
            continue
        for course, day, factor, part in courses_of(fleet.day[rows]):
            seen = factor != 0.0
            cause = Cause(owner_kind, name, kind, where, course, day)
            columns.add(cause, rows[seen], (factor * share[rows])[seen], prior.odds * part, prior.usual)


def _constant(
    columns: CandidateColumns,
    fleet: Crossing,
    owner_kind: str,
    kind: str,
    where: str,
    share: Array,
    priors: FleetPriors,
) -> None:
    _each(columns, fleet, owner_kind, kind, where, share, priors, lambda day: courses(day, priors))


def _always(
    columns: CandidateColumns,
    fleet: Crossing,
    owner_kind: str,
    kind: str,
    share: Array,
    priors: FleetPriors,
    where: str = "",
) -> None:
    """Causes that an owner is made with: they have no date."""
    _each(columns, fleet, owner_kind, kind, where, share, priors, _made_with)


def _made_with(day: Array) -> list[tuple[str, float, Array, float]]:
    return [("always", np.nan, np.ones(len(day)), 1.0)]


def _wear(columns: CandidateColumns, fleet: Crossing, priors: FleetPriors) -> None:
    begin = float(fleet.day.min())
    _each(
        columns,
        fleet,
        "gauge",
        "wear",
        "fronts",
        np.full(len(fleet), 0.5),
        priors,
        lambda day: growth(day, priors, begin),
    )


def _seasons(columns: CandidateColumns, fleet: Crossing, expands: Array, priors: FleetPriors) -> None:
    """A temperature that follows the year, at some phases."""

    def phases(day: Array) -> list[tuple[str, float, Array, float]]:
        """Courses as :func:`courses` gives them: a sine of one year at each of ``PHASES`` phases."""
        turns = np.arange(PHASES) / (2.0 * PHASES)
        angle = 2.0 * np.pi * (day / YEAR_DAYS - turns[:, None])
        return [
            ("season", float(turn), np.sin(one), priors.time.season / PHASES)
            for turn, one in zip(turns, angle, strict=True)
        ]

    _each(columns, fleet, "hall", "temperature", "", expands, priors, phases)


def _alone(
    columns: CandidateColumns, fleet: Crossing, kind: str, share: Array, usual: float, priors: FleetPriors
) -> None:
    """Every visit may be wrong by itself."""
    for row, visit in enumerate(fleet.visits):
        cause = Cause("visit", str(row), kind, "", "once", visit.day)
        columns.add(cause, np.array([row]), share[[row]], priors.time.alone, usual)
