"""Grids of shapes by a value (a period, a time of onset): as fine as neighbours must be, and shapes between them.

The rule is that of :data:`KEPT`: a shape halfway between two neighbours is then theirs to about a hundredth, which the
fit between the points takes up; with less in common a law would be found wrong, or not at all, and nothing would show
it. Readings do not come into it, for a grid that is too coarse may hide what it was made to find.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy import special

from stepgauge.inference.problem import Refined

Array = NDArray[np.float64]
Shape = Callable[[float], Array]
"""From a value to the columns ``(d, n)`` of a law."""
KEPT = 0.9
"""Least share of a shape, as the root of its sum of squares beside an offset, that its neighbour has, too."""
SAME = 1.0 - 1e-9
MOST = 20_000
"""Shapes of a grid that is made finer by itself."""
LOOKED = 17
"""Values between the neighbours of a point that are looked at before one is fitted."""
ZOOMS, POINTS, AROUND, FINE = 8, 25, 6.0, 2.0
"""Times that a shape is looked at more closely, at so many values over so many standard uncertainties on both sides,
until one of these is so many steps."""
NEGLIGIBLE = 1e-6
"""Size of a column over the largest, below which it is none."""


def shape_grid(label: str, shape: Shape, values: Array) -> tuple[Array, Array]:
    """Values, and their shapes ``(m, d, n)``, such that neighbours keep :data:`KEPT` of each other.

    A shape that jumps at a value (an onset between two readings) has nothing between. ``ValueError`` for more than
    :data:`MOST` shapes.
    """
    found, shapes = [float(values[0])], [shape(float(values[0]))]
    waiting = [(float(one), shape(float(one))) for one in values[:0:-1]]
    while waiting:
        value, columns = waiting[-1]
        middle = (found[-1] + value) / 2.0
        if kept(shapes[-1], columns) >= KEPT or _jumps(shapes[-1], between := shape(middle), columns):
            found.append(value)
            shapes.append(columns)
            waiting.pop()
        else:
            waiting.append((middle, between))
        if len(found) + len(waiting) > MOST:
            raise ValueError(f"the grid of {label} needs more than {MOST} shapes; expected a shorter range of values")
    return np.array(found), np.array(shapes)


def _jumps(before: Array, between: Array, after: Array) -> bool:
    return max(kept(before, between), kept(between, after)) > SAME


def check_grid(label: str, values: Array, pattern: Array) -> None:
    """``ValueError`` where neighbours of a grid ``(m, d, n)`` have less than :data:`KEPT` in common."""
    shares = [kept(one, other) for one, other in pairwise(pattern)]
    if shares and min(shares) < KEPT:
        worst = int(np.argmin(shares))
        raise ValueError(
            f"the grid of {label} is too coarse: the shapes of {values[worst]:.6g} and {values[worst + 1]:.6g} have"
            f" {min(shares):.2f} in common, expected {KEPT:g} or more; give the function from a value to its columns as"
            " shapes, which makes the grid as fine"
        )


def grid_weights(values: Array, stated: Array) -> Array:
    """Log prior of shapes: as much between two stated values as between any two others."""
    rising = np.sign(stated[-1] - stated[0]) or 1.0
    place = np.interp(rising * values, rising * stated, np.arange(float(len(stated))))
    share = np.abs(np.gradient(place)) if len(values) > 1 else np.ones(1)
    return np.asarray(np.log(share / share.sum()))


def interpolated(values: Array, pattern: Array, value: float) -> Array:
    """Columns ``(d, n)`` of a value between those of a grid, by straight lines."""
    rising = values if values[-1] > values[0] else values[::-1]
    place = np.interp(value, rising, np.arange(float(len(values))))
    place = place if rising is values else len(values) - 1.0 - place
    low = min(int(place), len(values) - 2)
    return np.asarray((low + 1.0 - place) * pattern[low] + (place - low) * pattern[low + 1])


def fitted_between(shape: Shape, values: Array, atom: int, residual: Array) -> Refined | None:
    """The shape between the neighbours of a point that explains most of residuals, with an offset."""
    from scipy.optimize import minimize_scalar  # takes a third of a second to import, and a diagnosis needs none

    low, high = sorted((values[max(atom - 1, 0)], values[min(atom + 1, len(values) - 1)]))
    if high <= low:
        return None
    about = residual - residual.mean()

    def left(value: float) -> float:
        """What a shape explains, less of it being more."""
        return -_explained(shape(float(value)), about)

    looked = np.linspace(low, high, LOOKED)  # of what jumps, a search alone would see one side
    first = int(np.argmin([left(value) for value in looked]))
    bounds = looked[max(first - 1, 0)], looked[min(first + 1, LOOKED - 1)]
    found = float(minimize_scalar(left, bounds=bounds, method="bounded").x)
    best = min((found, float(looked[first]), float(values[atom])), key=left)
    return Refined(shape(best), best)


def fit_of(shape: Shape, values: Array) -> Callable[[int, Array], Refined | None]:
    """What fits a shape near a point of a grid (:data:`.problem.Refine`)."""
    return partial(fitted_between, shape, values)


def locate_shape(
    values: Array, log: Array, shape: Shape | None, log_with: Callable[[Array], float]
) -> tuple[float, float]:
    """Mean and standard uncertainty of a value by the log posteriors of a grid, about the likeliest between its points.

    ``log_with``: log posterior with other columns of the term.
    """
    mean, u = _moments(values, log)
    about = slice(max(int(np.argmax(log)) - 1, 0), int(np.argmax(log)) + 2)
    step = float(np.abs(np.diff(values[about])).max(initial=0.0))
    for _ in range(ZOOMS):
        if shape is None or FINE * step < u:
            break
        reach = max(AROUND * u, step)
        low, high = max(mean - reach, values.min()), min(mean + reach, values.max())
        closer = np.linspace(low, high, POINTS)
        mean, u = _moments(closer, np.array([log_with(shape(float(one))) for one in closer]))
        step = (high - low) / (POINTS - 1)
    return mean, u


def _moments(values: Array, log: Array) -> tuple[float, float]:
    """Mean and standard uncertainty of values by their log weights, each standing for those about it."""
    weight = np.asarray(special.softmax(log))
    mean = float(weight @ values)
    width = np.abs(np.gradient(values)) if len(values) > 1 else np.zeros(1)
    return mean, float(np.sqrt(weight @ ((values - mean) ** 2 + width**2 / 12.0)))


def _explained(columns: Array, residual: Array) -> float:
    return float(np.sum((_basis(columns) @ residual) ** 2))


def _basis(columns: Array) -> Array:
    """Orthonormal rows that span columns ``(d, n)`` without their means."""
    centred = columns - columns.mean(axis=1, keepdims=True)
    _, size, rows = np.linalg.svd(centred, full_matrices=False)
    return np.asarray(rows[size > NEGLIGIBLE * max(size.max(initial=0.0), 1e-300)])


def kept(one: Array, other: Array) -> float:
    """Least share of the columns of a shape that another one can have."""
    centred = one - one.mean(axis=1, keepdims=True)
    size = np.linalg.norm(centred, axis=1)
    there = size > NEGLIGIBLE * max(size.max(initial=0.0), 1e-300)
    inside = np.linalg.norm(centred[there] @ _basis(other).T, axis=1)
    return float(min(inside / size[there], default=1.0))
