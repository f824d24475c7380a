"""Residuals and what explains them, against a covariate."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stepgauge.inference.problem import GaussianProcess, Term

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from stepgauge.inference.posterior import Posterior

Array = NDArray[np.float64]


def draw_posterior(posterior: Posterior, axes: Axes | None, x: ArrayLike | None) -> Axes:
    """As :meth:`Posterior.plot`; ``ValueError`` for an ``x`` that is not one number for each residual."""
    problem, best = posterior.search.problem, posterior.best
    along, name = _known_covariate(posterior) if x is None else (np.asarray(x, float), getattr(x, "name", None) or "")
    if along.shape != problem.residual_um.shape:
        raise ValueError(f"x has the shape {along.shape}, expected {problem.residual_um.shape}")
    if axes is None:
        from matplotlib import pyplot

        axes = pyplot.subplots()[1]
    order = np.argsort(along, kind="stable")
    explained = ", ".join(sorted(_words(posterior, one) for one in best.terms)) or "no term"
    axes.plot(along, problem.residual_um, ".", label="residuals")
    axes.plot(along[order], (problem.residual_um - best.residual_um)[order], label=explained)
    axes.set(xlabel=str(name), ylabel="residual")
    axes.legend()
    return axes


def _known_covariate(posterior: Posterior) -> tuple[Array, str]:
    """That of the first Gaussian process, else the rows."""
    problem = posterior.search.problem
    for one in problem.candidates:
        if isinstance(one, GaussianProcess) and one.covariate is not None:
            return one.covariate, f"covariate of {one.label}"
    return np.arange(float(len(problem.residual_um))), "row"


def _words(posterior: Posterior, term: Term) -> str:
    """Its label, with its shape (a period, a correlation length) as the table has it, where values were stated."""
    label = term.candidate.label
    if getattr(term.candidate, "values", None) is None:
        return label
    return f"{label} ({posterior.shape(label)[0]:.4g})"
