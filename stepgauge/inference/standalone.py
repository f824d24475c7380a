"""Problems made of arrays alone, and their answers: how this package is used by itself (``docs/inference.md``)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from threadpoolctl import threadpool_limits

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
        a range that is none
    """
    if not 0.0 < smallest <= largest < np.inf:
        raise ValueError(f"standard deviations from {smallest} to {largest}, expected 0 < smallest <= largest")
    return AmplitudePrior(np.geomspace(smallest, largest, count), np.full(count, -np.log(count)))


def make_law(
    label: str, shapes: ArrayLike, prior: AmplitudePrior, odds: float = 0.1, values: ArrayLike | None = None
) -> Law:
    """A candidate with a few amplitudes and a grid of shapes, all equally likely.

    Parameters
    ----------
    label : its unique name
    shapes : for each point of a grid (a period, a time of onset ..) the columns for a unit of each amplitude, ``(m, d,
        n)``; ``(d, n)`` or ``(n,)`` for a single shape
    prior : of the amplitudes
    odds : prior odds that it is a cause
    values : what the shapes are (periods, times of onset ..), in order, ``(m,)``: for :meth:`Posterior.shape`

    Raises
    ------
    ValueError
        shapes of more than three dimensions, or values that are not one for each shape
    """
    pattern = np.asarray(shapes, float)
    if pattern.ndim > 3:
        raise ValueError(f"shapes of {label} have {pattern.ndim} dimensions, expected at most 3")
    pattern = pattern.reshape((1,) * (3 - pattern.ndim) + pattern.shape)
    weight = np.full(len(pattern), -np.log(len(pattern)))
    shares = np.ones((1, pattern.shape[2]))
    stated = None if values is None else np.asarray(values, float)
    if stated is not None and (stated.shape != (len(pattern),) or len({*np.sign(np.diff(stated))} - {0.0}) > 1):
        raise ValueError(f"values of {label} are {stated.shape}, expected {len(pattern)} in order, one for each shape")
    known: dict[str, Any] = {"pattern": pattern, "shares": shares, "log_weight": weight, "values": stated}
    return Law(label, label, True, float(np.log(odds)), prior, **known)


def make_gaussian_process(
    label: str, covariate: ArrayLike, lengths: Sequence[float], prior: AmplitudePrior, odds: float = 0.1
) -> GaussianProcess:
    """A random function of a covariate ``(n,)`` that is twice differentiable (Matern 5/2, :mod:`kernels`).

    ``lengths``: its correlation lengths, all equally likely, in the unit of the covariate, of which
    :meth:`Posterior.shape` tells one. ``prior``: of the standard deviation of the function.
    """
    x = np.asarray(covariate, float)
    features = [matern(x, length / float(np.ptp(x))) for length in lengths]
    known: dict[str, Any] = {"features": tuple(features), "values": np.asarray(lengths, float), "covariate": x}
    return GaussianProcess(label, label, False, float(np.log(odds)), prior, **known)


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
        residuals that are no finite numbers, a standard deviation that is not positive, candidates, nuisances or times
        of another number of rows, or two candidates of one label
    """
    if not 0.0 < sd < np.inf:
        raise ValueError(f"the standard deviation of a reading is {sd}, expected a positive number")
    values = np.asarray(residuals, float)
    n = len(values)
    wrong = np.flatnonzero(~np.isfinite(values))
    if len(wrong):
        raise ValueError(f"residual {wrong[0] + 1} of {n} is no finite number: {values[wrong[0]]}; leave such rows out")
    free = np.ones((1, n)) if nuisance is None else np.atleast_2d(np.asarray(nuisance, float))
    when = np.arange(float(n)) if time is None else np.asarray(time, float)
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


def _rows(candidate: Candidate) -> int:
    return int(candidate.columns(0).shape[1])
