"""The residuals of a map as a problem: all quantities one after the other, each over the scatter of one reading.

The signature of a change of the probe is the difference of the predictions with and without it, over its size. It
depends on the size, so that the shapes on the grid are sizes, and the size that fits is computed exactly.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from stepgauge.diagnosis.maps.candidates import ProbeChange
from stepgauge.diagnosis.maps.data import surface
from stepgauge.diagnosis.maps.direction_functions import direction_candidates
from stepgauge.diagnosis.maps.model import ChangeTerm, MapModel
from stepgauge.diagnosis.priors import KindPrior, Priors
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.inference.nonlinear import Parameters, Response, fit_nonlinear
from stepgauge.inference.problem import Law, Problem, Refined, slices

SIZES = (0.2, 1.0, 4.0)
"""Sizes of a change on the grid, over the usual size."""
TURNS = 12
"""Directions of a vector on the grid."""
PHASES_DEG = np.arange(-58.0, 60.0, 4.0)
LOBES = ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
"""Amplitudes of triangular lobes of one phase: their height, and a constant."""
DIGITS = 3
"""Digits of a fitted size, so that computed signatures are used again."""
STEPS = 6
"""Most steps of the fit of a size."""
VARIES = 0.5
"""Least range over the largest value at which scatter may grow with the value."""
FAR = 10.0
"""Residuals larger than so many times their median are not used to fit a size: outliers."""


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


def make_problem(rows: MapRows, candidates: Sequence[ProbeChange], priors: Priors, interaction: Array) -> Problem:
    """The problem of a map.

    ``interaction (m,)``: what the changes that were found do together minus the sum of what each does alone.
    """
    data, n = rows.data, len(rows.data)
    ones = np.ones((1, len(rows.um)))
    of_gauge = np.kron(np.eye(len(rows.sigma)), np.ones(n)) * rows.nothing
    index = np.concatenate([data.direction + q * (int(data.direction.max()) + 1) for q in range(len(rows.sigma))])
    laws = _laws(rows, candidates, priors, ones)
    return Problem(
        residual_um=rows.um - interaction,
        scale_um=1.0,
        certified=of_gauge,
        certified_u=np.full(len(of_gauge), priors.maps.gauge_share),
        free=np.zeros((0, len(rows.um))),
        order=np.arange(len(rows.um)),
        gap=np.full(len(rows.um) - 1, np.inf),  # rows of a file stand in no order of probing
        growing=rows.growing,
        step_um=0.0,
        group=index,
        candidates=(*laws, *direction_candidates(data, priors, ones)),
    )


@dataclass(frozen=True)
class ProbeLaw:
    """All changes of one kind as one law: its points and their signatures ``(atoms, depth, m)``."""

    label: str
    points: tuple[Point, ...]
    pattern: Array

    @property
    def positive(self) -> bool:
        """Whether its size cannot be negative."""
        return all(p.size > 0.0 and p.candidate.knobs[0].none == p.candidate.knobs[0].low for p in self.points)


def _laws(rows: MapRows, candidates: Sequence[ProbeChange], priors: Priors, ones: Array) -> Iterator[Law]:
    """One law for all changes of one prior and kind: laws that exclude each other are shapes of one law."""
    by_name: dict[str, list[ProbeChange]] = {}
    for one in candidates:
        by_name.setdefault(one.prior or one.kind, []).append(one)
    for group in by_name.values():
        grid = _grid(rows, group, priors)
        if grid.points:
            yield _law(rows, group, grid, priors, ones)


def _law(rows: MapRows, group: Sequence[ProbeChange], grid: ProbeLaw, priors: Priors, ones: Array) -> Law:
    prior, usual = usual_of(group[0], priors)
    labels = [point.candidate.label for point in grid.points]
    return Law(
        group[0].kind,
        grid.label,
        True,
        float(np.log(priors.maps.laws.odds * prior.odds)),
        priors.sizes.about(usual),
        grid,
        pattern=grid.pattern,
        shares=ones,
        # equal for each choice, and for each size of a choice
        log_weight=-np.log([labels.count(label) * len(set(labels)) for label in labels]),
        positive=grid.positive,
        least=prior.least * group[0].nominal,
        refine=partial(_refined, rows, grid, priors) if group[0].shape != "line" else None,
        of_size=partial(_fitted_near, rows, grid, priors) if group[0].shape == "line" else None,
    )


def _grid(rows: MapRows, group: Sequence[ProbeChange], priors: Priors) -> ProbeLaw:
    points = [point for one in group for point in _points(one, usual_of(group[0], priors)[1])]
    atoms = [atom for point in points for atom in signature(rows, point)]
    depth = max((len(columns) for _, columns in atoms), default=0)
    label = group[0].label if len(group) == 1 else group[0].kind
    return ProbeLaw(
        label, tuple(point for point, _ in atoms), np.array([_deep(columns, depth) for _, columns in atoms])
    )


def _deep(columns: Array, depth: int) -> Array:
    """Columns ``(d, m)`` with as many of zeros as make ``depth``."""
    return np.vstack([columns, np.zeros((depth - len(columns), columns.shape[1]))])


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
        knob, sizes = candidate.knobs[0], (share * usual for share in (*(-one for one in reversed(SIZES)), *SIZES))
        yield from (Point(candidate, none, each, one) for one in sizes if knob.low <= knob.none + one <= knob.high)


def signature(rows: MapRows, point: Point) -> Iterator[tuple[Point, Array]]:
    """The signature of a point; none if the construction is impossible or has no influence."""
    unit = np.eye(len(point.step))
    moved = [rows.moved((ChangeTerm(point.candidate, point.values(one * point.size)),)) for one in unit]
    columns = np.array(moved) / point.size
    if np.isfinite(columns).all() and np.abs(columns).max() > 0.0:
        yield point, columns


def _refined(rows: MapRows, law: ProbeLaw, priors: Priors, atom: int, left: Array) -> Refined | None:
    """The signature in the direction, or at the phase, that fits best."""
    if law.points[atom].candidate.shape == "linear":
        return None
    used = np.abs(left) <= FAR * float(np.median(np.abs(left)))
    return _fitted_near(rows, law, priors, atom, left, lambda um: um[..., used])


def _fitted_near(
    rows: MapRows, law: ProbeLaw, priors: Priors, atom: int, left: Array, metric: Response
) -> Refined | None:
    """The signature of the values of all knobs that fit best, beginning at an atom; rounded, to be used again."""
    point, columns = law.points[atom], law.pattern[atom]
    candidate = point.candidate
    amplitudes = np.linalg.lstsq(metric(columns[: len(point.step)]).T, metric(left), rcond=None)[0]
    start = ChangeTerm(candidate, point.values(np.asarray(amplitudes, float)))
    (found,) = fit_changes((start,), rows, metric, priors, left, STEPS)
    moved = (float(f"{value - none:.{DIGITS}g}") for value, none in zip(found.values, candidate.none, strict=True))
    near = point_of(ChangeTerm(candidate, tuple(none + off for none, off in zip(candidate.none, moved, strict=True))))
    exact = () if near.size == 0.0 else signature(rows, near)
    return next((Refined(_deep(own, len(columns)), shape) for shape, own in exact), None)


def point_of(term: ChangeTerm) -> Point:
    """A change as the point of its own size, for which its signature is exact."""
    candidate, moved = term.candidate, np.array(term.values) - np.array(term.candidate.none)
    if candidate.shape == "lobes":
        return Point(candidate, (0.0, term.values[1], 0.0), LOBES)
    size = float(np.linalg.norm(moved)) * (1.0 if len(moved) > 1 else float(np.sign(moved[0])))
    return Point(candidate, candidate.none, (tuple(map(float, moved / (size or 1.0))),), size)


def fit_changes(
    terms: Sequence[ChangeTerm], rows: MapRows, metric: Response, priors: Priors, left: Array, steps: int = 30
) -> tuple[ChangeTerm, ...]:
    """All knobs of some changes fitted together to residuals ``left (m,)`` by the statics of the probe."""
    if not terms:
        return ()
    knobs = [knob for term in terms for knob in term.candidate.knobs]
    none, low, high = (np.array([getattr(k, name) for k in knobs]) for name in ("none", "low", "high"))
    scale = np.array([usual_of(term.candidate, priors)[1] for term in terms for _ in term.candidate.knobs])
    start, own = np.concatenate([term.values for term in terms]), slices(len(term.values) for term in terms)

    def changed(x: Array) -> tuple[ChangeTerm, ...]:
        return tuple(ChangeTerm(t.candidate, tuple(x[s].tolist())) for t, s in zip(terms, own, strict=True))

    known = Parameters(none, low, high, scale)
    found = fit_nonlinear(lambda x: rows.moved(changed(x)), left, start, known, metric, steps)
    return tuple(replace(t, covariance=found.covariance[s, s]) for t, s in zip(changed(found.values), own, strict=True))
