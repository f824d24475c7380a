"""Structure over a map: functions of the direction without a law, as candidates beside the changes of the probe."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.maps.data import MapData
from stepgauge.diagnosis.priors import Priors
from stepgauge.files.arrays import Array
from stepgauge.inference.problem import Candidate, GaussianProcess, Law

ALL, POLAR, AZIMUTH, DIRECTION = "all directions", "polar", "azimuth", "direction"
SMOOTH, IRREGULAR, HARMONIC = "free shape", "irregular", "harmonic"
SEEN = 0.75
"""Least share of a period that distinguishes lobes from a trend; three lobes are symmetric in each 60 deg."""
MOST_EDGES, MOST_CENTRES = 24, 60
FEW_ROWS = 20_000
"""Number of rows above which half as many edges and centres are tried: signatures need memory."""
MOST_DIRECTIONS = 400
"""Largest number of directions for which irregular differences are tried."""
WIDTHS_DEG = (15.0, 30.0)
ALONE_DEG = 3.0
"""Width of a peak in one direction alone, which its repeats must confirm."""
FEWEST_ROWS = 4.0
"""Least number of rows of a shape: fewer are single readings, not structure."""
LOBES = ("one lobe", "two lobes", "three lobes", "four lobes", "five lobes", "six lobes", "seven lobes", "eight lobes")


@dataclass(frozen=True)
class DirectionFunction:
    """A function of a covariate: the words of each shape, and its columns ``(shapes, d, n)``.

    ``random``: with as many amplitudes as columns, of which those times the columns have one standard deviation;
    ``quantity``: index of its quantity.
    """

    covariate: str
    name: str
    words: tuple[str, ...]
    columns: Array
    random: bool = False
    quantity: int = 0


def direction_candidates(data: MapData, priors: Priors, ones: Array) -> list[Candidate]:
    """All functions of every quantity that the directions of a map can show; amplitudes in units of the scatter.

    ``ones (1, m)``: the share of a law in every row, the same for all candidates.
    """
    forms, quantities = list(_forms(data)), range(len(data.measured))
    irregular = list(_irregular(data))
    odds = float(np.log(priors.forms.odds / ((len(forms) + 1) * len(quantities))))
    return [_candidate(form, q, odds, data, priors, ones) for q in quantities for form in (*forms, *irregular)]


def _candidate(
    form: DirectionFunction, quantity: int, odds: float, data: MapData, priors: Priors, ones: Array
) -> Candidate:
    """A function in one quantity as a candidate over the rows of all."""
    own = DirectionFunction(form.covariate, form.name, form.words, form.columns, form.random, quantity)
    name = data.measured[quantity].name
    kind, label, sizes = f"{form.covariate} {name}", f"{form.name} {form.covariate} {name}", priors.forms.about(1.0)
    rows = np.zeros((*form.columns.shape[:2], len(data.measured), len(data)))
    rows[:, :, quantity] = form.columns
    pattern = rows.reshape(*form.columns.shape[:2], -1)
    if form.random:
        return GaussianProcess(kind, label, False, odds, sizes, own, features=tuple(pattern))
    flat = np.full(len(pattern), -np.log(len(pattern)))
    return Law(kind, label, False, odds, sizes, own, pattern=pattern, shares=ones, log_weight=flat)


def _irregular(data: MapData) -> Iterator[DirectionFunction]:
    """Irregular differences between directions; only repeats can show them."""
    index = data.direction
    count = int(index.max()) + 1
    if count <= MOST_DIRECTIONS and len(data) >= 2 * count:
        words = "differs from direction to direction by more than the repeats scatter, in no regular form"
        columns = (index == np.arange(count)[:, None]).astype(float)
        yield DirectionFunction(DIRECTION, IRREGULAR, (words,), columns[None], random=True)


def _forms(data: MapData) -> Iterator[DirectionFunction]:
    yield DirectionFunction(ALL, "offset", ("the same in all directions",), np.ones((1, 1, len(data))))
    yield from _over_polar(data)
    yield from _over_azimuth(data)
    yield from _sectors(data)
    yield from _spots(data)
    yield from _surface(data)


def _over_polar(data: MapData) -> Iterator[DirectionFunction]:
    polar, angles = data.polar_deg, np.unique(data.polar_deg)
    if len(angles) < 2:
        return
    centred, one = polar - polar.mean(), np.ones(len(data))
    yield DirectionFunction(POLAR, "trend", ("a trend over the polar angle",), centred[None, None])
    if len(angles) > 2:
        yield DirectionFunction(POLAR, "bow", ("a bow over the polar angle",), np.array([[centred, centred**2 / 30.0]]))
    if len(angles) > 3:
        edges = (angles[:-1] + angles[1:]) / 2.0
        words = tuple(f"a step at a polar angle of {e:.4g} deg" for e in edges)
        yield DirectionFunction(POLAR, "step", words, np.array([[one, polar >= edge] for edge in edges], float))
        waves = [np.cos(k * np.radians(polar)) / k for k in range(1, min(len(angles), 7))]
        smooth = np.array([[one, *waves]])
        yield DirectionFunction(POLAR, SMOOTH, ("a smooth function of the polar angle",), smooth, random=True)


def _waves(data: MapData, order: int) -> Array:
    angle = order * np.radians(data.azimuth_deg)
    return np.array([np.cos(angle), np.sin(angle)])


def _seen_orders(data: MapData) -> list[int]:
    """Numbers of lobes that the azimuths of a map can show."""
    spokes = int(data.spokes.max()) + 1
    span = float(np.ptp(data.azimuth_deg % 360.0)) * spokes / max(spokes - 1, 1)
    return [
        order
        for order in range(1, len(LOBES) + 1)
        if (spokes > 2 * order * min(span / 360.0, 1.0) and span >= SEEN * 360.0 / order) or (order == 3 < spokes)
    ]


def _over_azimuth(data: MapData) -> Iterator[DirectionFunction]:
    """Lobes of one height at all polar angles, or as high as the lateral component of the approach; any shape."""
    orders, rings = _seen_orders(data), int(data.rings.max()) + 1
    lateral = [np.ones(len(data)), np.sin(np.radians(data.polar_deg))][: 2 if rings > 1 else 1]
    for order in orders:
        words = f"{LOBES[order - 1]} in the azimuth"
        shapes = np.array([height * _waves(data, order) for height in lateral])
        yield DirectionFunction(
            AZIMUTH, f"{HARMONIC} {order}", (words, f"{words}, higher across the stylus")[: len(shapes)], shapes
        )
    if len(orders) > 2:
        smooth = np.concatenate([_waves(data, order) / order for order in orders])
        yield DirectionFunction(AZIMUTH, SMOOTH, ("a smooth function of the azimuth",), smooth[None], random=True)


def _sectors(data: MapData) -> Iterator[DirectionFunction]:
    """A step up at one azimuth and down at another."""
    azimuth = np.round(data.azimuth_deg % 360.0, 6)
    spokes = np.unique(azimuth)
    edges = (spokes + np.roll(spokes, -1) + 360.0 * (np.arange(len(spokes)) == len(spokes) - 1)) / 2.0 % 360.0
    if len(edges) < 5:
        return
    edges = np.sort(edges[_some(len(edges), MOST_EDGES, data)])
    inside = {(a, b): ((azimuth >= a) & (azimuth < b)).astype(float) for a, b in combinations(edges, 2)}
    # present on enough rows and absent on enough others
    seen = {pair: part for pair, part in inside.items() if min(part.sum(), len(data) - part.sum()) >= FEWEST_ROWS / 2.0}
    if seen:
        words = tuple(f"a step at azimuths of {low:.4g} and {high:.4g} deg" for low, high in seen)
        columns = np.array([[np.ones(len(data)), part] for part in seen.values()])
        yield DirectionFunction(AZIMUTH, "step", words, columns)


def _some(count: int, most: int, data: MapData) -> NDArray[np.intp]:
    """Evenly spaced indices."""
    most = most if len(data) <= FEW_ROWS else most // 2
    return np.unique(np.linspace(0, count - 1, min(most, count)).astype(int))


def _spots(data: MapData) -> Iterator[DirectionFunction]:
    """A peak about one direction, symmetric about it; with repeats also one in this direction alone."""
    index, normals = data.direction, data.normals
    count = int(index.max()) + 1
    if count < 2 * FEWEST_ROWS:
        return
    widths = (ALONE_DEG, *WIDTHS_DEG) if len(data) >= 2 * count else WIDTHS_DEG
    first = np.unique(index, return_index=True)[1]
    shapes = [(int(row), width) for row in first[_some(count, MOST_CENTRES, data)] for width in widths]
    columns = [np.exp((normals @ normals[row] - 1.0) / np.radians(width) ** 2) for row, width in shapes]
    angles = [(data.polar_deg[row], data.azimuth_deg[row] % 360.0, width) for row, width in shapes]
    words = tuple(f"a rise about polar {p:.4g}, azimuth {a:.4g} deg, {width:g} deg wide" for p, a, width in angles)
    yield DirectionFunction(DIRECTION, "spot", words, np.array(columns)[:, None])


def _surface(data: MapData) -> Iterator[DirectionFunction]:
    """Lobes whose height changes with the polar angle."""
    orders, rings = [k for k in _seen_orders(data) if k <= 5], int(data.rings.max()) + 1
    if rings < 3 or not orders:
        return
    height = [np.cos(j * np.radians(data.polar_deg)) / np.sqrt(1.0 + j) for j in range(min(rings, 4))]
    columns = np.concatenate([one * _waves(data, k) / np.sqrt(k) for k in orders for one in height])
    words = "lobes whose height changes with the polar angle"
    yield DirectionFunction(DIRECTION, SMOOTH, (words,), columns[None], random=True)
