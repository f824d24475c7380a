"""Problems made of arrays alone, and their answers: how this package is used by itself (``docs/inference.md``)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from threadpoolctl import threadpool_limits

from stepgauge.inference.grids import check_grid, fit_of, grid_weights, interpolated, shape_grid
from stepgauge.inference.kernels import matern
from stepgauge.inference.noise_priors import NoisePriors
from stepgauge.inference.posterior import Posterior
from stepgauge.inference.problem import AmplitudePrior, Candidate, GaussianProcess, Law, Problem
from stepgauge.inference.search import Search

Array = NDArray[np.float64]


def amplitude_prior(smallest: float, largest: float, count: int = 5) -> AmplitudePrior:
    """Normal amplitudes about zero whose standard deviation is unknown within a range.

    Parameters
    ----------
    smallest, largest : of the standard deviation, in the unit of the residuals; every ratio is equally likely
    count : number of standard deviations that are summed

    Raises
    ------
    ValueError
        a range that is none, or what is no number
    """
    smallest, largest = float(_floats("smallest", smallest)), float(_floats("largest", largest))
    if not 0.0 < smallest <= largest < np.inf:
        raise ValueError(f"standard deviations from {smallest} to {largest}, expected 0 < smallest <= largest")
    return AmplitudePrior(np.geomspace(smallest, largest, count), np.full(count, -np.log(count)))


def make_law(
    label: str,
    shapes: ArrayLike | Callable[[float], ArrayLike],
    prior: AmplitudePrior,
    odds: float = 0.1,
    values: ArrayLike | None = None,
) -> Law:
    """A candidate with a few amplitudes and a grid of shapes, all equally likely.

    It is in the residuals once or not at all. For two of a kind, as two steps, make two candidates of these shapes:
    :meth:`Posterior.probability` of both labels is that of there being one at least.

    A grid with ``values`` is one of a quantity that may have any value between them, and shapes between its points are
    fitted. It must be so fine that neighbours have 0.9 of each other, beside an offset (:data:`.grids.KEPT`): a period
    in steps of less than a quarter over all cycles in the readings. From a function the grid is made as fine as that.
    Without ``values`` the shapes are all there are.

    Parameters
    ----------
    label : its unique name
    shapes : for each point of a grid (a period, a time of onset ..) the columns for a unit of each amplitude, ``(m, d,
        n)``; ``(d, n)`` or ``(n,)`` for a single shape; or a function from a value to the columns ``(d, n)``
    prior : of the amplitudes
    odds : prior odds that it is a cause
    values : what the shapes are (periods, times of onset ..), in order, ``(m,)``: for :meth:`Posterior.shape`. Of a
        function two or more, the first and the last being the range: as likely between any two neighbours

    Raises
    ------
    ValueError
        more than three dimensions of shapes, values that are not one for each, too coarse a grid, what is no number
    """
    stated = None if values is None else _numbers(f"values of {label}", values)
    if callable(shapes):
        return _law_of_function(label, shapes, prior, odds, stated)
    pattern = _numbers(f"shapes of {label}", shapes)
    if pattern.ndim > 3:
        raise ValueError(f"shapes of {label} have {pattern.ndim} dimensions, expected at most 3")
    pattern = pattern.reshape((1,) * (3 - pattern.ndim) + pattern.shape)
    if stated is None:
        return _law(label, pattern, prior, odds, np.full(len(pattern), -np.log(len(pattern))))
    if stated.shape != (len(pattern),) or not _is_ordered(stated):
        raise ValueError(f"values of {label} are {stated.shape}, expected {len(pattern)} in order, one for each shape")
    check_grid(label, stated, pattern)
    shape = partial(interpolated, stated, pattern) if len(stated) > 1 else None
    return _law(label, pattern, prior, odds, np.full(len(pattern), -np.log(len(pattern))), stated, shape)


def _law_of_function(
    label: str, function: Callable[[float], ArrayLike], prior: AmplitudePrior, odds: float, stated: Array | None
) -> Law:
    """A law whose shapes a function gives, on a grid of its own."""
    if stated is None or stated.ndim != 1 or len(stated) < 2 or not _is_ordered(stated):
        raise ValueError(f"values of {label} are {stated}, expected two or more in order, the range of the function")

    def shape(value: float) -> Array:
        """Its columns, of one amplitude too."""
        return np.atleast_2d(_numbers(f"shapes of {label}", function(value)))

    grid, pattern = shape_grid(label, shape, stated)
    return _law(label, pattern, prior, odds, grid_weights(grid, stated), grid, shape)


def _is_ordered(values: Array) -> bool:
    return len({*np.sign(np.diff(values))}) <= 1


def _law(
    label: str,
    pattern: Array,
    prior: AmplitudePrior,
    odds: float,
    weight: Array,
    values: Array | None = None,
    shape: Callable[[float], Array] | None = None,
) -> Law:
    known: dict[str, Any] = {"pattern": pattern, "shares": np.ones((1, pattern.shape[2])), "log_weight": weight}
    if values is not None and shape is not None:
        known |= {"refine": fit_of(shape, values), "shape_at": shape}
    return Law(label, label, True, _log_odds(label, odds), _sizes(label, prior), values=values, **known)


def make_gaussian_process(
    label: str, covariate: ArrayLike, lengths: Sequence[float], prior: AmplitudePrior, odds: float = 0.1
) -> GaussianProcess:
    """A random function of a covariate ``(n,)`` that is twice differentiable (Matern 5/2, :mod:`kernels`).

    ``lengths``: its correlation lengths, all equally likely, in the unit of the covariate, of which
    :meth:`Posterior.shape` tells one. ``prior``: of the standard deviation of the function.

    Raises
    ------
    ValueError
        a covariate that does not vary, lengths that are not positive, or what is no number
    """
    x, scales = _numbers(f"covariate of {label}", covariate), _numbers(f"lengths of {label}", lengths)
    if x.ndim != 1 or not np.ptp(x):
        raise ValueError(f"covariate of {label} has the shape {x.shape}, expected (n,), and that it varies")
    if scales.ndim != 1 or not len(scales) or scales.min() <= 0.0:
        raise ValueError(f"lengths of {label} are {lengths!r}, expected one or more that are positive")
    features = [matern(x, float(length / np.ptp(x))) for length in scales]
    known: dict[str, Any] = {"features": tuple(features), "values": scales, "covariate": x}
    return GaussianProcess(label, label, False, _log_odds(label, odds), _sizes(label, prior), **known)


def make_problem(
    residuals: ArrayLike,
    sd: float,
    candidates: Sequence[Candidate],
    nuisance: ArrayLike | None = None,
    time: ArrayLike | None = None,
    growing: Mapping[str, Array] | None = None,
) -> Problem:
    """Residuals and all candidates for their causes.

    Parameters
    ----------
    residuals : ``(n,)``, in any one unit, which is that of all amplitudes and standard deviations
    sd : stated standard deviation of one reading; it may be off by a factor of three
    candidates : what may be in the residuals
    nuisance : columns ``(p, n)`` of which nothing is known and nothing is asked; one offset by default
    time : of every row ``(n,)``, for noise that is correlated from one reading to the next; that of the rows by default
    growing : covariates from 0 to 1 with which the noise may grow

    Raises
    ------
    ValueError
        what is no finite number, a standard deviation that is not positive, candidates that are none, nuisances or
        times of another number of rows, or two candidates of one label
    """
    sd, values = float(_floats("sd", sd)), np.atleast_1d(_numbers("residual", residuals))
    if not 0.0 < sd < np.inf:
        raise ValueError(f"the standard deviation of a reading is {sd}, expected a positive number")
    n = len(values)
    free = np.ones((1, n)) if nuisance is None else np.atleast_2d(_numbers("nuisance", nuisance))
    when = np.arange(float(n)) if time is None else np.atleast_1d(_numbers("time", time))
    strange = [one for one in candidates if not isinstance(one, Law | GaussianProcess)]
    if strange:
        raise ValueError(f"candidates: {strange[0]!r} is none, expected what make_law or make_gaussian_process made")
    for what, rows in [("nuisance", free.shape[1]), ("time", len(when)), *((c.label, _rows(c)) for c in candidates)]:
        if rows != n:
            raise ValueError(f"{what} has {rows} rows, expected {n}")
    if len({one.label for one in candidates}) < len(candidates):
        raise ValueError("two candidates have the same label")
    order = np.argsort(when, kind="stable")
    gap = np.diff(when[order])
    return Problem(
        residual_um=values,
        scale_um=sd,
        certified=np.zeros((0, n)),
        certified_u=np.zeros(0),
        free=free,
        order=order,
        gap=np.maximum(gap / max(float(np.median(gap)), 1e-300), 1e-3),
        growing=dict(growing or {}),
        step_um=0.0,
        group=np.arange(n),
        candidates=tuple(candidates),
    )


@threadpool_limits.wrap(limits=1, user_api="blas")
def infer(problem: Problem, priors: NoisePriors | None = None) -> Posterior:
    """The posterior of a problem: :attr:`Posterior.best`, and probabilities over its neighbourhood."""
    search = Search(problem, priors or NoisePriors())
    return Posterior(search, search.run())


def _numbers(what: str, values: ArrayLike) -> Array:
    """Finite numbers; :class:`ValueError` says of what there are none, and which is the first."""
    found = _floats(what, values)
    wrong = np.argwhere(~np.isfinite(found))
    if len(wrong):
        place = ", ".join(f"{index + 1} of {count}" for index, count in zip(wrong[0], found.shape, strict=True))
        raise ValueError(f"{what} {place} is no finite number: {found[tuple(wrong[0])]}; leave such rows out")
    return found


def _floats(what: str, values: ArrayLike) -> Array:
    """Numbers as they are given, not texts that may be read as such."""
    try:
        given = np.asarray(values)
        if given.dtype.kind in "USMm":
            raise TypeError
        return np.asarray(given, float)
    except (TypeError, ValueError):
        raise ValueError(f"{what}: no numbers: {values!r:.80}; expected numbers or an array of them") from None


def _log_odds(label: str, odds: float) -> float:
    if not 0.0 < float(_floats(f"odds of {label}", odds)) < np.inf:
        raise ValueError(f"odds of {label} are {odds}, expected a positive number")
    return float(np.log(odds))


def _sizes(label: str, prior: AmplitudePrior) -> AmplitudePrior:
    if not isinstance(prior, AmplitudePrior):
        raise ValueError(f"prior of {label} is {prior!r:.80}, expected what amplitude_prior made")
    return prior


def _rows(candidate: Candidate) -> int:
    return int(candidate.columns(0).shape[1])
