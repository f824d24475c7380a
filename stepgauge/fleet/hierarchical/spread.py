"""How far owners in order differ, for statements about one of them.

The inference takes the likeliest spread (empirical Bayes). Few machines do not determine it, and the likeliest one is
then often its least: taken for known it would say of every machine that it is as good, whatever was measured of it. A
statement about one machine is made over all spreads that the fleet leaves possible. Prior of a spread: half-Cauchy,
which Gelman, Bayesian Analysis 1 (2006) 515, recommends for few groups, with the usual size of a cause as its scale.
"""

from __future__ import annotations

from copy import copy
from dataclasses import replace

import numpy as np
from scipy import special

from stepgauge.files.arrays import Array
from stepgauge.fleet.hierarchical.background import Background, RandomEffect
from stepgauge.fleet.hierarchical.priors import fleet_priors

STEPS, LARGEST = 60, 3.0
"""Spreads that are tried, evenly by their logarithm; the largest of them over the usual size of a cause."""
ROUNDS = 4
"""What is known of one spread depends on the others: each round goes on from the last."""


def believed(background: Background, um: Array) -> Background:
    """A background whose spreads are the roots of their expected squares, from what causes leave of visits ``(n,)``.

    Coefficients of a spread that is not determined are then as uncertain as their own visits leave them.
    """
    wide = copy(background)
    wide.terms = [replace(term) for term in background.terms]
    for _ in range(ROUNDS):
        value, variance = _own(wide, um)
        for term, low, high in zip(wide.terms, wide.ends[:-1], wide.ends[1:], strict=True):
            usual = _usual(term)
            if usual is not None:
                term.sd = _expected(value[low:high], variance[low:high], term.least, usual)
        wide.factor()
    return wide


def _usual(term: RandomEffect) -> float | None:
    """Of machines and probes; the days of halls are many, and what a certificate states is known."""
    owner_kind, kind = term.name.split()[:2]
    prior = fleet_priors().kinds.get(owner_kind, {}).get(kind)
    return None if term.known or prior is None else prior.usual


def _own(background: Background, um: Array) -> tuple[Array, Array]:
    """What every coefficient is by the visits alone, and its variance ``(q,)``: of its posterior less its prior."""
    prior2 = background.prior**2
    share = np.maximum(1.0 - np.diag(background.inverse) / prior2, 1e-9)
    at = background.inverse @ (background.weighted.T @ um)
    return at / share, prior2 * (1.0 - share) / share


def _expected(value: Array, variance: Array, least: float, usual: float) -> float:
    """Root of the expected square of a spread, of which coefficients with these variances are known ``(q,)``."""
    spread = np.geomspace(least, max(LARGEST * usual, 2.0 * least), STEPS)
    total = spread[:, None] ** 2 + variance
    log = -0.5 * (np.log(total) + value**2 / total).sum(axis=1)
    weight = special.softmax(log + np.log(spread) - np.log1p((spread / usual) ** 2))
    return float(np.sqrt(weight @ spread**2))
