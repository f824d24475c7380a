"""A map's residuals as a problem: all quantities one behind the other, each over the scatter of one reading.

A law's signature is what a construction with the change in it says less what the file's says, for a unit of the change.
It depends on the size of the change, so that its shapes stand for sizes; one that was fitted is among them exactly.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnose.maps.candidates import Candidate
from stepgauge.diagnose.maps.data import MapData
from stepgauge.diagnose.maps.forms import form_candidates
from stepgauge.diagnose.maps.model import MapModel, Term
from stepgauge.diagnose.maps.scatter import surface
from stepgauge.diagnose.posterior.priors import KindPrior, Priors
from stepgauge.diagnose.posterior.problem import Law, Problem, Refined
from stepgauge.errors import InputError

Array = NDArray[np.float64]
SIZES = (0.2, 1.0, 4.0)
"""Sizes of a change that are tried, over the usual one."""
TURNS = 12
"""Directions in which a vector is tried."""
PHASES_DEG = np.arange(-58.0, 60.0, 4.0)
LOBES = ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
"""Amplitudes of triangular lobes of a phase: their height, and the mean beside them."""
PARTS = 8
"""Steps between neighbouring sizes: what is computed once serves again."""
VARIES = 0.5
"""Share of the largest value over which values must spread for scatter to grow with them."""
FAR = 10.0
"""Residuals larger than so many times their median do not take part where a shape is fitted: bad readings."""


@dataclass(frozen=True)
class Point:
    """Values of a candidate's knobs for given amplitudes: ``base (k,)`` plus amplitudes ``(d,)`` times ``step (d, k)``.

    ``size``: the amplitude that the signature was computed for.
    """

    candidate: Candidate
    base: tuple[float, ...]
    step: tuple[tuple[float, ...], ...]
    size: float = 1.0

    def values(self, amplitudes: Array) -> tuple[float, ...]:
        """Values of the knobs, within their bounds."""
        found = np.array(self.base) + amplitudes @ np.array(self.step)
        return tuple(float(np.clip(v, k.low, k.high)) for v, k in zip(found, self.candidate.knobs, strict=True))


Atom = tuple[Point, Array]
"""A point and its signature ``(d, m)``."""


class MapRows:
    """The rows of a map, quantity after quantity, over the standard deviation ``sigma`` of one reading of each."""

    def __init__(self, model: MapModel, sigma: Sequence[float]) -> None:
        self.model, self.data, self.sigma = model, model.data, tuple(sigma)
        self.um = self.stacked(model.residuals(()))

    def stacked(self, values: Sequence[Array]) -> Array:
        """Values ``(n,)`` of each quantity in its unit, as one row of ``(m,)`` scatters."""
        return np.concatenate([each / s for each, s in zip(values, self.sigma, strict=True)])

    def parts(self, row: Array) -> list[Array]:
        """The other way round."""
        return [each * s for each, s in zip(np.split(row, len(self.sigma)), self.sigma, strict=True)]

    @cached_property
    def nothing(self) -> Array:
        """What the probe file says."""
        return self.stacked(self.model.predict(()))

    def moved(self, terms: Sequence[Term]) -> Array:
        """What changes add to what the file says ``(m,)``; not finite for a construction that cannot be."""
        try:
            return self.stacked(self.model.predict(terms)) - self.nothing
        except InputError:
            return np.full(len(self.um), np.nan)

    @cached_property
    def growing(self) -> dict[str, Array]:
        """The size of a quantity's value from nought to one; nought where it is nearly the same everywhere.

        It is smoothed over the directions, lest a bad reading explains its own size.
        """
        found = []
        for m in self.data.measured:
            size, _ = surface(self.data, m.values)
            span = float(np.ptp(size))
            found.append((size - size.min()) / span if span > VARIES * float(size.max()) else np.zeros(len(size)))
        return {"value": np.concatenate(found)}


def usual_of(candidate: Candidate, priors: Priors) -> tuple[KindPrior, float]:
    """Prior of a change and its usual size in the unit of its knob."""
    prior = priors.maps.laws.of(candidate.prior or candidate.kind)
    return prior, prior.usual * candidate.nominal


def make_problem(
    rows: MapRows,
    candidates: Sequence[Candidate],
    priors: Priors,
    remainder: Array,
    fitted: Mapping[str, Sequence[Point]],
) -> Problem:
    """The problem of a map.

    Parameters
    ----------
    rows : the map's rows
    candidates : changes of the construction
    priors : what is usual
    remainder : what several changes together do beyond what each does alone, ``(m,)``: signatures add up
    fitted : sizes of changes, by kind, that are tried besides those of the grid
    """
    data, n = rows.data, len(rows.data)
    ones = np.ones((1, len(rows.um)))
    of_gauge = np.kron(np.eye(len(rows.sigma)), np.ones(n)) * rows.nothing
    index = np.concatenate([data.direction + q * (int(data.direction.max()) + 1) for q in range(len(rows.sigma))])
    laws = _laws(rows, candidates, priors, fitted, ones)
    return Problem(
        um=rows.um - remainder,
        scale_um=1.0,
        certified=of_gauge,
        certified_u=np.full(len(of_gauge), priors.maps.gauge_share),
        free=np.zeros((0, len(rows.um))),
        order=np.arange(len(rows.um)),
        gap=np.full(len(rows.um) - 1, np.inf),  # rows of a file stand in no order of probing
        growing=rows.growing,
        step_um=0.0,
        group=index,
        candidates=(*laws, *form_candidates(data, priors, ones)),
    )


def _laws(
    rows: MapRows,
    candidates: Sequence[Candidate],
    priors: Priors,
    fitted: Mapping[str, Sequence[Point]],
    ones: Array,
) -> Iterator[Law]:
    """One law for all changes of a prior and a kind: laws that replace each other are shapes of one."""
    by_name: dict[str, list[Candidate]] = {}
    for one in candidates:
        by_name.setdefault(one.prior or one.kind, []).append(one)
    for name, group in by_name.items():
        prior, usual = usual_of(group[0], priors)
        atoms = [atom for one in group for atom in _grid(rows, one, usual)]
        atoms += [atom for point in fitted.get(name, ()) for atom in signature(rows, point)]
        if not atoms:
            continue
        depth = max(len(columns) for _, columns in atoms)
        pattern = np.array([np.vstack([c, np.zeros((depth - len(c), c.shape[1]))]) for _, c in atoms])
        odds = float(np.log(priors.maps.laws.odds * prior.odds))
        points = [point for point, _ in atoms]
        positive = all(p.size > 0.0 and p.candidate.knobs[0].none == p.candidate.knobs[0].low for p in points)
        label = group[0].label if len(group) == 1 else group[0].kind
        refine = partial(_between, rows, points, pattern)
        yield Law(
            group[0].kind,
            label,
            True,
            odds,
            priors.sizes.about(usual),
            points,
            pattern=pattern,
            shares=ones,
            log_weight=_weights(points),
            positive=positive,
            refine=refine,
        )


def _weights(points: Sequence[Point]) -> Array:
    """Logarithms of the prior of each shape: as likely for each choice, and in it for each size."""
    labels = [point.candidate.label for point in points]
    return -np.log([labels.count(label) * len(set(labels)) for label in labels])


def _grid(rows: MapRows, candidate: Candidate, usual: float) -> Iterator[Atom]:
    for point in _points(candidate, usual):
        yield from signature(rows, point)


def _points(candidate: Candidate, usual: float) -> Iterator[Point]:
    """Sizes of a change to try."""
    none, count = candidate.none, len(candidate.knobs)
    each = tuple(tuple(float(i == j) for j in range(count)) for i in range(count))
    if candidate.shape == "linear":
        yield Point(candidate, none, each)
    elif candidate.shape == "plane":
        for share in SIZES:
            for turn in np.arange(TURNS) * 2.0 * np.pi / TURNS:
                yield Point(candidate, none, ((float(np.cos(turn)), float(np.sin(turn))),), share * usual)
    elif candidate.shape == "lobes":
        yield from (Point(candidate, (0.0, float(phase), 0.0), LOBES) for phase in PHASES_DEG)
    else:
        yield from (Point(candidate, none, each, sign * share * usual) for sign, share in _both_ways(candidate, usual))


def _both_ways(candidate: Candidate, usual: float) -> list[tuple[float, float]]:
    """Signs and sizes over the usual one that lie within the bounds of the only knob, in their order."""
    knob = candidate.knobs[0]
    tried = [(-1.0, share) for share in reversed(SIZES)] + [(1.0, share) for share in SIZES]
    return [(sign, s) for sign, s in tried if knob.low <= knob.none + sign * s * usual <= knob.high]


def signature(rows: MapRows, point: Point) -> Iterator[Atom]:
    """Nothing where the construction cannot be or does not show."""
    unit = np.eye(len(point.step))
    moved = [rows.moved((Term(point.candidate, point.values(one * point.size)),)) for one in unit]
    columns = np.array(moved) / point.size
    if np.isfinite(columns).all() and np.abs(columns).max() > 0.0:
        yield point, columns


def _between(rows: MapRows, points: Sequence[Point], pattern: Array, atom: int, left_um: Array) -> Refined | None:
    """The signature in the direction or phase between two neighbours that residuals speak for, to an eighth."""
    used = np.abs(left_um) <= FAR * float(np.median(np.abs(left_um)))
    point = _mixed_with_a_neighbour(points, pattern, atom, left_um, used)
    found = [] if point is points[atom] else list(signature(rows, point))
    return Refined(found[0][1], point) if found else None


def _mixed_with_a_neighbour(
    points: Sequence[Point], pattern: Array, atom: int, left_um: Array, used: NDArray[np.bool_]
) -> Point:
    """The point between an atom and its neighbour of which a mixture of both signatures leaves least."""
    here, beside = points[atom], pattern[atom][1:]
    best = (np.inf, here)
    for other in (atom - 1, atom + 1):
        if not 0 <= other < len(points) or not _neighbours(here, points[other]):
            continue
        columns = np.vstack([*(pattern[i][0] * points[i].size for i in (atom, other)), *beside])
        share = np.linalg.lstsq(columns[:, used].T, left_um[used], rcond=None)[0]
        rest = left_um[used] - share @ columns[:, used]
        if min(share[:2]) > 0.0 and rest @ rest < best[0]:
            best = float(rest @ rest), _mixed(here, points[other], float(share[1] / share[:2].sum()))
    return best[1]


def _neighbours(one: Point, other: Point) -> bool:
    """Whether shapes between two points are like a mixture of both."""
    return one.candidate is other.candidate and one.candidate.shape in ("plane", "lobes") and one.size == other.size


def _mixed(one: Point, other: Point, share: float) -> Point:
    t = round(share * PARTS) / PARTS
    size = (1.0 - t) * one.size + t * other.size
    base = (1.0 - t) * np.array(one.base) + t * np.array(other.base)
    step = ((1.0 - t) * np.array(one.step) * one.size + t * np.array(other.step) * other.size) / size
    return Point(one.candidate, tuple(map(float, base)), tuple(tuple(map(float, row)) for row in step), float(size))


def lacking(data: MapData) -> tuple[str, ...]:
    """What a map that cannot tell should have had; empty if nothing is missing."""
    directions, azimuths = int(data.direction.max()) + 1, int(data.spokes.max()) + 1
    found = []
    if len(data) < FEWEST_ROWS or directions < FEWEST_DIRECTIONS:
        found.append(
            f"at least {FEWEST_ROWS} rows in {FEWEST_DIRECTIONS} directions, better several polar angles and azimuths:"
            f" the map has {len(data)} rows in {directions} directions"
        )
    if azimuths < FEWEST_AZIMUTHS:
        found.append(
            f"at least {FEWEST_AZIMUTHS} azimuths, better a full turn: the map has {azimuths}, and what changes about"
            " the stylus (lobes, their phase, eccentricity) passes for what is the same all around"
        )
    if all(np.ptp(m.values) == 0.0 for m in data.measured):
        found.append(
            "values that differ: all are the same to the last digit, so they are printed too coarsely, copied or"
            " simulated, and their scatter cannot be judged"
        )
    return tuple(found)


FEWEST_ROWS = 8
FEWEST_DIRECTIONS = 6
FEWEST_AZIMUTHS = 3
