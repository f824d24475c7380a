"""Shapes without physics over a map: what is searched for to say where disagreement lives, and in what form.

Every form is a sum of terms of a formula in the direction (:data:`stepgauge.probes.empirical.DIRECTION`), so that one
that has no name can be written into the probe file and simulated.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnose.maps.data import MapData
from stepgauge.probes.empirical import directions, parse

Array = NDArray[np.float64]
MOST_LOBES = 8
SEEN = 0.75
"""Share of a period that must be there for lobes to be told from a trend; three lobes mirror each sixth of a turn."""
MOST_STEPS = 4
"""Levels in which a free shape may stand over an angle, less one."""
MOST_EDGES = 24
FEW_ROWS = 20_000
"""Above so many rows sectors are looked for between half as many edges."""
WIDTHS_DEG = (15.0, 30.0)
MOST_CENTRES = 60
FEWEST_ROWS = 4.0
"""Rows that must share a shape: fewer are single readings, not structure."""
_LOBES = ("one lobe", "two lobes", "three lobes", "four lobes", "five lobes", "six lobes", "seven lobes", "eight lobes")


@dataclass(frozen=True)
class Located:
    """Where disagreement lives: covariate, side, form in words, share of the structure, significance."""

    covariate: str
    side: str
    form: str
    where: str
    share: float
    p_value: float


@dataclass(frozen=True)
class Shape:
    """One shape over the directions: its words and the terms of its formula."""

    words: str
    terms: tuple[str, ...]


@dataclass(frozen=True)
class Family:
    """Shapes of one form over one covariate that differ in a place or a width; ``columns (shapes, d, n)``."""

    covariate: str
    form: str
    shapes: tuple[Shape, ...]
    columns: Array


def families(data: MapData) -> list[Family]:
    """All forms that the directions of a map can show."""
    found = [_family("all directions", "offset", [Shape("the same in all directions", ("1",))], data)]
    return [*found, *_over_polar(data), *_harmonics(data), *_sectors(data), *_spots(data), *_free(data)]


def _over_polar(data: MapData) -> Iterator[Family]:
    angles = np.unique(data.polar_deg)
    if len(angles) < 2:
        return
    centred = f"(polar_deg - {data.polar_deg.mean():.6g})"
    yield _family("polar_deg", "trend", [Shape("a trend over the polar angle", (centred,))], data)
    if len(angles) > 2:
        bow = Shape("a bow over the polar angle", (centred, f"{centred}**2"))
        yield _family("polar_deg", "bow", [bow], data)
    edges = (angles[:-1] + angles[1:]) / 2.0
    steps = [Shape(f"a step at a polar angle of {e:.4g} deg", (f"(polar_deg >= {e:.6g})",)) for e in edges]
    if len(angles) > 3:
        yield from _beside_level(_family("polar_deg", "step", steps, data))


def _harmonics(data: MapData) -> Iterator[Family]:
    """Lobes of the same height at all polar angles, or as high as the approach is across the stylus."""
    spokes, rings = int(data.spokes.max()) + 1, int(data.rings.max()) + 1
    span = float(np.ptp(data.azimuth_deg % 360.0)) * spokes / max(spokes - 1, 1)
    for order in range(1, MOST_LOBES + 1):
        seen = spokes > 2 * order * min(span / 360.0, 1.0) and span >= SEEN * 360.0 / order
        if not seen and not (order == 3 and spokes > 3):
            continue
        angle = "azimuth_rad" if order == 1 else f"{order} * azimuth_rad"
        waves = (f"cos({angle})", f"sin({angle})")
        words = f"{_LOBES[order - 1]} in the azimuth"
        shapes = [Shape(words, waves)]
        if rings > 1:
            level = tuple(f"sin(polar_rad) * {wave}" for wave in waves)
            shapes.append(Shape(f"{words}, higher across the stylus", level))
        yield _family("azimuth_deg", f"harmonic {order}", shapes, data)


def _sectors(data: MapData) -> Iterator[Family]:
    """A step up at one azimuth and down at another."""
    spokes = np.unique(np.round(data.azimuth_deg % 360.0, 6))
    edges = (spokes + np.roll(spokes, -1) + 360.0 * (np.arange(len(spokes)) == len(spokes) - 1)) / 2.0 % 360.0
    most = MOST_EDGES if len(data) < FEW_ROWS else MOST_EDGES // 2
    if len(edges) < 5:
        return
    edges = np.sort(edges[np.unique(np.linspace(0, len(edges) - 1, min(most, len(edges))).astype(int))])
    shapes = [_sector(low, high) for low, high in combinations(edges, 2)]
    yield from _beside_level(_family("azimuth_deg", "step", shapes, data))


def _sector(low: float, high: float) -> Shape:
    words = f"a step at azimuths of {low:.4g} and {high:.4g} deg"
    return Shape(words, (f"(azimuth_deg >= {low:.6g}) * (azimuth_deg < {high:.6g})",))


def _spots(data: MapData) -> Iterator[Family]:
    """A rise about one direction, the same all around it."""
    places = np.unique(np.column_stack([data.polar_deg, data.azimuth_deg % 360.0]), axis=0)
    if len(places) < 2 * FEWEST_ROWS:
        return
    places = places[np.unique(np.linspace(0, len(places) - 1, min(MOST_CENTRES, len(places))).astype(int))]
    shapes = [_spot(polar, azimuth, width) for polar, azimuth in places for width in WIDTHS_DEG]
    yield from _beside_level(_family("direction", "spot", shapes, data))


def _spot(polar: float, azimuth: float, width_deg: float) -> Shape:
    c, s = np.cos(np.radians(polar)), np.sin(np.radians(polar))
    cosine = f"{c:.6f} * cos(polar_rad) + {s:.6f} * sin(polar_rad) * cos(azimuth_rad - {np.radians(azimuth):.6f})"
    words = f"a rise about polar {polar:.4g}, azimuth {azimuth:.4g} deg, {width_deg:g} deg wide"
    return Shape(words, (f"exp(({cosine} - 1) / {np.radians(width_deg) ** 2:.6f})",))


def _free(data: MapData) -> Iterator[Family]:
    """Levels over an angle, where there are directions enough for them."""
    for name, angle in (("polar_deg", data.polar_deg), ("azimuth_deg", data.azimuth_deg % 360.0)):
        places = np.unique(np.round(angle, 6))
        count = min(MOST_STEPS, len(places) - 1)
        if count < 3 or len(places) > len(data) // 3:
            continue
        edges = np.quantile(places, np.linspace(0.0, 1.0, count + 2)[1:-1], method="averaged_inverted_cdf")
        words = f"levels that change with the {'polar angle' if name == 'polar_deg' else 'azimuth'}"
        terms = tuple(f"({name} >= {edge:.6g})" for edge in np.unique(edges))
        yield _family(name, "free shape", [Shape(words, ("1", *terms))], data)


def _family(covariate: str, form: str, shapes: list[Shape], data: MapData) -> Family:
    at = directions(data.normals)
    columns = [[np.broadcast_to(parse(term)(at), (len(data),)) for term in shape.terms] for shape in shapes]
    return Family(covariate, form, tuple(shapes), np.asarray(columns, float))


def _beside_level(family: Family) -> Iterator[Family]:
    """The shapes in which enough rows have a part and enough others have none, alone and beside a level for all."""
    column = family.columns[:, 0]
    weight = np.minimum((column**2).sum(axis=1), ((column - 1.0) ** 2).sum(axis=1))
    spread = column.sum(axis=1) ** 2 / np.maximum((column**2).sum(axis=1), 1e-300)
    enough = np.flatnonzero((weight >= FEWEST_ROWS / 2.0) & (spread >= FEWEST_ROWS))
    if len(enough):
        shapes, columns = tuple(family.shapes[i] for i in enough), family.columns[enough]
        yield Family(family.covariate, family.form, shapes, columns)
        levelled = tuple(Shape(shape.words, ("1", *shape.terms)) for shape in shapes)
        yield Family(family.covariate, family.form, levelled, np.concatenate([np.ones_like(columns), columns], axis=1))
