"""The residuals of a map as a problem: all quantities one after the other, each over the scatter of one reading.

The signature of a law is the difference of the predictions with and without the change, over the change. It depends on
the size of the change, so the shapes of a law are sizes; a fitted size is one of them exactly.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.maps.candidates import ProbeChange
from stepgauge.diagnosis.maps.data import MapData
from stepgauge.diagnosis.maps.forms import form_candidates
from stepgauge.diagnosis.maps.model import ChangeTerm, MapModel
from stepgauge.diagnosis.maps.scatter import surface
from stepgauge.diagnosis.priors import KindPrior, Priors
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.inference.problem import Law, Problem, Refined

SIZES = (0.2, 1.0, 4.0)
"""Sizes of a change that are tried, over the usual size."""
TURNS = 12
"""Directions in which a vector is tried."""
PHASES_DEG = np.arange(-58.0, 60.0, 4.0)
LOBES = ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
"""Amplitudes of triangular lobes of one phase: their height, and a constant."""
PARTS = 8
"""Steps between neighbouring sizes, so that computed signatures can be used again."""
VARIES = 0.5
"""Least range over the largest value at which scatter may grow with the value."""
FAR = 10.0
"""Residuals larger than so many times their median are not used to fit a shape: outliers."""


@dataclass(frozen=True)
class Point:
    """Values of a candidate's knobs for given amplitudes: ``base (k,)`` plus amplitudes ``(d,)`` times ``step (d, k)``.

    ``size``: the amplitude that the signature was computed for.
    """

    candidate: ProbeChange
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
        """The inverse of :meth:`stacked`."""
        return [each * s for each, s in zip(np.split(row, len(self.sigma)), self.sigma, strict=True)]

    @cached_property
    def nothing(self) -> Array:
        """Prediction of the probe file."""
        return self.stacked(self.model.predict(()))

    def moved(self, terms: Sequence[ChangeTerm]) -> Array:
        """Difference of the predictions with and without changes ``(m,)``; not finite if impossible."""
        try:
            return self.stacked(self.model.predict(terms)) - self.nothing
        except InputError:
            return np.full(len(self.um), np.nan)

    @cached_property
    def growing(self) -> dict[str, Array]:
        """The value of a quantity scaled to 0 to 1; 0 if it is nearly constant.

        It is smoothed over the directions, so that an outlier does not explain itself.
        """
        found = []
        for m in self.data.measured:
            size, _ = surface(self.data, m.values)
            span = float(np.ptp(size))
            found.append((size - size.min()) / span if span > VARIES * float(size.max()) else np.zeros(len(size)))
        return {"value": np.concatenate(found)}


def usual_of(candidate: ProbeChange, priors: Priors) -> tuple[KindPrior, float]:
    """Prior of a change and its usual size in the unit of its knob."""
    prior = priors.maps.laws.of(candidate.prior or candidate.kind)
    return prior, prior.usual * candidate.nominal


def make_problem(
    rows: MapRows,
    candidates: Sequence[ProbeChange],
    priors: Priors,
    remainder: Array,
    fitted: Mapping[str, Sequence[Point]],
) -> Problem:
    """The problem of a map.

    Parameters
    ----------
    rows : the map's rows
    candidates : changes of the construction
    priors : the table of priors
    remainder : joint influence of several changes minus the sum of their single ones, ``(m,)``
    fitted : sizes of changes, by kind, that are tried in addition to the grid
    """
    data, n = rows.data, len(rows.data)
    ones = np.ones((1, len(rows.um)))
    of_gauge = np.kron(np.eye(len(rows.sigma)), np.ones(n)) * rows.nothing
    index = np.concatenate([data.direction + q * (int(data.direction.max()) + 1) for q in range(len(rows.sigma))])
    laws = _laws(rows, candidates, priors, fitted, ones)
    return Problem(
        residual_um=rows.um - remainder,
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
    candidates: Sequence[ProbeChange],
    priors: Priors,
    fitted: Mapping[str, Sequence[Point]],
    ones: Array,
) -> Iterator[Law]:
    """One law for all changes of one prior and kind: laws that exclude each other are shapes of one law."""
    by_name: dict[str, list[ProbeChange]] = {}
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
            least=prior.least * group[0].nominal,
            refine=refine,
        )


def _weights(points: Sequence[Point]) -> Array:
    """Logarithms of the prior of each shape: equal for each choice, and for each size of a choice."""
    labels = [point.candidate.label for point in points]
    return -np.log([labels.count(label) * len(set(labels)) for label in labels])


def _grid(rows: MapRows, candidate: ProbeChange, usual: float) -> Iterator[Atom]:
    for point in _points(candidate, usual):
        yield from signature(rows, point)


def _points(candidate: ProbeChange, usual: float) -> Iterator[Point]:
    """Sizes of a change that are tried."""
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


def _both_ways(candidate: ProbeChange, usual: float) -> list[tuple[float, float]]:
    """Signed sizes over the usual one within the bounds of the single knob, in order."""
    knob = candidate.knobs[0]
    tried = [(-1.0, share) for share in reversed(SIZES)] + [(1.0, share) for share in SIZES]
    return [(sign, s) for sign, s in tried if knob.low <= knob.none + sign * s * usual <= knob.high]


def signature(rows: MapRows, point: Point) -> Iterator[Atom]:
    """The signature of a point; none if the construction is impossible or has no influence."""
    unit = np.eye(len(point.step))
    moved = [rows.moved((ChangeTerm(point.candidate, point.values(one * point.size)),)) for one in unit]
    columns = np.array(moved) / point.size
    if np.isfinite(columns).all() and np.abs(columns).max() > 0.0:
        yield point, columns


def _between(rows: MapRows, points: Sequence[Point], pattern: Array, atom: int, left_um: Array) -> Refined | None:
    """The signature in the best direction or phase between two neighbours, to an eighth of a step."""
    used = np.abs(left_um) <= FAR * float(np.median(np.abs(left_um)))
    point = _mixed_with_a_neighbour(points, pattern, atom, left_um, used)
    found = [] if point is points[atom] else list(signature(rows, point))
    return Refined(found[0][1], point) if found else None


def _mixed_with_a_neighbour(
    points: Sequence[Point], pattern: Array, atom: int, left_um: Array, used: NDArray[np.bool_]
) -> Point:
    """The point between an atom and its neighbour at which a mixture of both signatures fits best."""
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
    """Whether shapes between two points are approximately a mixture of both."""
    return one.candidate is other.candidate and one.candidate.shape in ("plane", "lobes") and one.size == other.size


def _mixed(one: Point, other: Point, share: float) -> Point:
    t = round(share * PARTS) / PARTS
    size = (1.0 - t) * one.size + t * other.size
    base = (1.0 - t) * np.array(one.base) + t * np.array(other.base)
    step = ((1.0 - t) * np.array(one.step) * one.size + t * np.array(other.step) * other.size) / size
    return Point(one.candidate, tuple(map(float, base)), tuple(tuple(map(float, row)) for row in step), float(size))


def lacking(data: MapData) -> tuple[str, ...]:
    """What an insufficient map lacks; empty if nothing is missing."""
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
