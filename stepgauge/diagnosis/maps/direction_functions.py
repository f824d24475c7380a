"""Forms over a map: sums of terms of the direction, which can be written to a probe file.

Every form is a sum of terms of a formula (:data:`stepgauge.probes.empirical.DIRECTION`), so that it can be
written to the probe file and simulated. Only irregular differences between directions have no formula.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.maps.data import QUANTITIES, MapData
from stepgauge.diagnosis.priors import Priors
from stepgauge.files.arrays import Array
from stepgauge.inference.problem import Candidate, GaussianProcess, Law
from stepgauge.probes.empirical import directions, parse

ALL, POLAR, AZIMUTH, DIRECTION = "all directions", "polar", "azimuth", "direction"
SMOOTH, IRREGULAR = "free shape", "irregular"
MOST_LOBES = 8
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
_LOBES = ("one lobe", "two lobes", "three lobes", "four lobes", "five lobes", "six lobes", "seven lobes", "eight lobes")


@dataclass(frozen=True)
class DirectionFunction:
    """A form over a covariate, with the words and the terms of the formula of each shape.

    ``weight``: of each term, the standard deviation of its amplitude over that of the form; ``quantity``: index of
    its quantity.
    """

    covariate: str
    name: str
    words: tuple[str, ...]
    terms: tuple[tuple[str, ...], ...]
    weight: tuple[float, ...] = ()
    quantity: int = field(default=0)


def direction_candidates(data: MapData, priors: Priors, ones: Array) -> list[Candidate]:
    """All forms of every quantity that the directions of a map can show; amplitudes in units of the scatter.

    ``ones (1, m)``: the share of a law in every row, the same for all candidates.
    """
    forms = list(_forms(data))
    count = (len(forms) + 1) * len(data.measured)
    odds = float(np.log(priors.forms.odds / count))
    found = []
    columns = [_columns(form, data) for form in forms]
    for quantity in range(len(data.measured)):
        for form, values in zip(forms, columns, strict=True):
            found.append(_candidate(form, values, quantity, odds, data, priors, ones))
        found += _irregular(quantity, odds, data, priors, ones)
    return found


def _candidate(
    form: DirectionFunction, values: Array, quantity: int, odds: float, data: MapData, priors: Priors, ones: Array
) -> Candidate:
    """``values (shapes, d, n)`` of one quantity as a candidate over the rows of all."""
    own = DirectionFunction(form.covariate, form.name, form.words, form.terms, form.weight, quantity)
    name = data.measured[quantity].name
    kind, label, sizes = f"{form.covariate} {name}", f"{form.name} {form.covariate} {name}", priors.forms.about(1.0)
    rows = np.zeros((*values.shape[:2], len(data.measured), len(data)))
    rows[:, :, quantity] = values
    pattern = rows.reshape(*values.shape[:2], -1)
    if form.weight:
        return GaussianProcess(kind, label, False, odds, sizes, own, features=tuple(pattern))
    flat = np.full(len(pattern), -np.log(len(pattern)))
    return Law(kind, label, False, odds, sizes, own, pattern=pattern, shares=ones, log_weight=flat)


def _irregular(quantity: int, odds: float, data: MapData, priors: Priors, ones: Array) -> Iterator[Candidate]:
    """Irregular differences between directions; only repeats can show them."""
    index = data.direction
    count = int(index.max()) + 1
    if count > MOST_DIRECTIONS or len(data) < 2 * count:
        return
    words = "differs from direction to direction by more than the repeats scatter, in no regular form"
    form = DirectionFunction(DIRECTION, IRREGULAR, (words,), ((),), (1.0,) * count)
    yield _candidate(form, (index == np.arange(count)[:, None]).astype(float)[None], quantity, odds, data, priors, ones)


def _columns(form: DirectionFunction, data: MapData) -> Array:
    """Values ``(shapes, d, n)`` of a form's terms over the rows of a map, times their weights."""
    at = directions(data.normals)
    values = [[np.broadcast_to(parse(term)(at), (len(data),)) for term in terms] for terms in form.terms]
    return np.asarray(values, float) * (np.array(form.weight)[:, None] if form.weight else 1.0)


def _forms(data: MapData) -> Iterator[DirectionFunction]:
    yield DirectionFunction(ALL, "offset", ("the same in all directions",), (("1",),))
    yield from _over_polar(data)
    yield from _over_azimuth(data)
    yield from _sectors(data)
    yield from _spots(data)
    yield from _surface(data)


def _over_polar(data: MapData) -> Iterator[DirectionFunction]:
    angles = np.unique(data.polar_deg)
    if len(angles) < 2:
        return
    centred = f"(polar_deg - {data.polar_deg.mean():.6g})"
    yield DirectionFunction(POLAR, "trend", ("a trend over the polar angle",), ((centred,),))
    if len(angles) > 2:
        yield DirectionFunction(POLAR, "bow", ("a bow over the polar angle",), ((centred, f"{centred}**2 / 30"),))
    if len(angles) > 3:
        edges = (angles[:-1] + angles[1:]) / 2.0
        steps = [("1", f"(polar_deg >= {edge:.6g})") for edge in edges]
        yield DirectionFunction(
            POLAR, "step", tuple(f"a step at a polar angle of {e:.4g} deg" for e in edges), tuple(steps)
        )
        most = min(len(angles) - 1, 6)
        waves = tuple(f"cos({k} * polar_rad)" for k in range(1, most + 1))
        weight = tuple(1.0 / k for k in range(1, most + 1))
        yield DirectionFunction(
            POLAR, SMOOTH, ("a smooth function of the polar angle",), (("1", *waves),), (1.0, *weight)
        )


def _wave(order: int) -> tuple[str, str]:
    angle = "azimuth_rad" if order == 1 else f"{order} * azimuth_rad"
    return f"cos({angle})", f"sin({angle})"


def _seen_orders(data: MapData) -> list[int]:
    """Numbers of lobes that the azimuths of a map can show."""
    spokes = int(data.spokes.max()) + 1
    span = float(np.ptp(data.azimuth_deg % 360.0)) * spokes / max(spokes - 1, 1)
    return [
        order
        for order in range(1, MOST_LOBES + 1)
        if (spokes > 2 * order * min(span / 360.0, 1.0) and span >= SEEN * 360.0 / order) or (order == 3 < spokes)
    ]


def _over_azimuth(data: MapData) -> Iterator[DirectionFunction]:
    """Lobes of one height at all polar angles, or as high as the lateral component of the approach; any shape."""
    orders, rings = _seen_orders(data), int(data.rings.max()) + 1
    for order in orders:
        shapes, words = [_wave(order)], [f"{_LOBES[order - 1]} in the azimuth"]
        if rings > 1:
            shapes.append((f"sin(polar_rad) * {_wave(order)[0]}", f"sin(polar_rad) * {_wave(order)[1]}"))
            words.append(f"{words[0]}, higher across the stylus")
        yield DirectionFunction(AZIMUTH, f"harmonic {order}", tuple(words), tuple(shapes))
    if len(orders) > 2:
        waves = tuple(wave for order in orders for wave in _wave(order))
        weight = tuple(1.0 / order for order in orders for _ in range(2))
        yield DirectionFunction(AZIMUTH, SMOOTH, ("a smooth function of the azimuth",), (waves,), weight)


def _sectors(data: MapData) -> Iterator[DirectionFunction]:
    """A step up at one azimuth and down at another."""
    spokes = np.unique(np.round(data.azimuth_deg % 360.0, 6))
    edges = (spokes + np.roll(spokes, -1) + 360.0 * (np.arange(len(spokes)) == len(spokes) - 1)) / 2.0 % 360.0
    if len(edges) < 5:
        return
    edges = np.sort(edges[_some(len(edges), MOST_EDGES, data)])
    azimuth = np.round(data.azimuth_deg % 360.0, 6)
    pairs = [(a, b) for a, b in combinations(edges, 2) if _enough(((azimuth >= a) & (azimuth < b)).astype(float))]
    words = tuple(f"a step at azimuths of {low:.4g} and {high:.4g} deg" for low, high in pairs)
    terms = tuple(("1", f"(azimuth_deg >= {low:.6g}) * (azimuth_deg < {high:.6g})") for low, high in pairs)
    if pairs:
        yield DirectionFunction(AZIMUTH, "step", words, terms)


def _some(count: int, most: int, data: MapData) -> NDArray[np.intp]:
    """Evenly spaced indices."""
    most = most if len(data) <= FEW_ROWS else most // 2
    return np.unique(np.linspace(0, count - 1, min(most, count)).astype(int))


def _enough(part: Array) -> bool:
    """Whether a shape between 0 and 1 is present on enough rows and absent on enough others."""
    return min(float((part**2).sum()), float(((1.0 - part) ** 2).sum())) >= FEWEST_ROWS / 2.0


def _spots(data: MapData) -> Iterator[DirectionFunction]:
    """A peak about one direction, symmetric about it; with repeats also one in this direction alone."""
    index = data.direction
    count = int(index.max()) + 1
    if count < 2 * FEWEST_ROWS:
        return
    widths = (ALONE_DEG, *WIDTHS_DEG) if len(data) >= 2 * count else WIDTHS_DEG
    first = np.unique(index, return_index=True)[1]
    some = first[_some(count, MOST_CENTRES, data)]
    places = [(float(data.polar_deg[i]), float(data.azimuth_deg[i] % 360.0)) for i in some]
    shapes = [(polar, azimuth, width) for polar, azimuth in places for width in widths]
    terms = tuple((_spot(*shape),) for shape in shapes)
    words = tuple(f"a rise about polar {p:.4g}, azimuth {a:.4g} deg, {width:g} deg wide" for p, a, width in shapes)
    yield DirectionFunction(DIRECTION, "spot", words, terms)


def _spot(polar: float, azimuth: float, width_deg: float) -> str:
    c, s = np.cos(np.radians(polar)), np.sin(np.radians(polar))
    cosine = f"{c:.6f} * cos(polar_rad) + {s:.6f} * sin(polar_rad) * cos(azimuth_rad - {np.radians(azimuth):.6f})"
    return f"exp(({cosine} - 1) / {np.radians(width_deg) ** 2:.6f})"


def _surface(data: MapData) -> Iterator[DirectionFunction]:
    """Lobes whose height changes with the polar angle."""
    orders, rings = [k for k in _seen_orders(data) if k <= 5], int(data.rings.max()) + 1
    if rings < 3 or not orders:
        return
    powers = range(min(rings, 4))
    pairs = [(k, j) for k in orders for j in powers]
    terms = tuple(_times(j, wave) for k, j in pairs for wave in _wave(k))
    weight = tuple(1.0 / np.sqrt(k * (1.0 + j)) for k, j in pairs for _ in range(2))
    yield DirectionFunction(DIRECTION, SMOOTH, ("lobes whose height changes with the polar angle",), (terms,), weight)


def _times(order: int, wave: str) -> str:
    return wave if order == 0 else f"cos({order} * polar_rad) * {wave}"


def quantity_words(name: str) -> str:
    """A quantity in words: ``trigger_force_N`` is the trigger force."""
    assert name in QUANTITIES
    return {"pretravel_um": "pre-travel"}.get(name, name.rsplit("_", 1)[0].replace("_", " "))
