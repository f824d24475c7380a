"""Sizes of terms, and amplitudes that cannot be negative or small, from the posterior of the amplitudes.

Of its amplitudes the likelihood is normal: their posterior without their prior.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

from stepgauge.inference.hypothesis import Hypothesis
from stepgauge.inference.problem import Law, Term

Array = NDArray[np.float64]
MOST_TOGETHER, MOST_AMPLITUDES = 64, 16
"""Most combinations of sizes that are summed one by one, and of how many amplitudes."""
FINE = 2.0
"""Ratio of neighbouring measures of what a law moves beside its signature."""


def size_log_evidence(hypothesis: Hypothesis) -> Iterator[Array]:
    """Log evidence of each size of each term, its weight included, over that of the size that the term has."""
    if not hypothesis.terms:
        return
    every, covariance = hypothesis.term_posterior
    for term, whole in zip(hypothesis.terms, hypothesis.parts, strict=True):
        own = slice(whole.start, whole.start + term.n_amplitudes)
        sizes = term.candidate.sizes
        if len(sizes.sd) == 1 and sizes.sd[0] == term.sd:
            yield sizes.log_weight
        else:
            evidence = _evidence(np.append(sizes.sd, term.sd), term.sd, every[own], covariance[own, own])
            yield evidence[:-1] - evidence[-1] + sizes.log_weight


def _evidence(sd: Array, present: float, mean: Array, covariance: Array) -> Array:
    """Log evidence of some sizes ``(t,)`` from the posterior of amplitudes that have one of these."""
    if len(mean) == 1:
        value, product = max(float(covariance[0, 0]), 1e-300), float(mean[0])
        precision = max(1.0 / value - present**-2.0, 0.0)
        return np.asarray(0.5 * ((product / value) ** 2 / (precision + sd**-2.0) - np.log1p(precision * sd**2)))
    axes, turn = np.linalg.eigh(covariance)
    axes = np.maximum(axes, 1e-300)
    precision, s2 = np.maximum(1.0 / axes - present**-2.0, 0.0), sd[:, None] ** 2
    products = turn.T @ mean / axes
    return np.asarray(0.5 * (products**2 / (precision + 1.0 / s2) - np.log1p(precision * s2)).sum(axis=1))


def summed_sizes_gain(hypothesis: Hypothesis) -> float:
    """What the log evidence rises by if the sizes of each term are summed at the present ones of the others.

    What a size would gain that is not reached yet does not count: with it the others would change as well. Few are
    summed in all their combinations.
    """
    count = math.prod(len(one) for one in hypothesis.size_log_evidence)
    size = sum(len(term.columns) for term in hypothesis.terms)
    if len(hypothesis.terms) > 1 and count <= MOST_TOGETHER and size <= MOST_AMPLITUDES:
        with contextlib.suppress(np.linalg.LinAlgError):
            return _summed_together(hypothesis)
    return sum(float(np.logaddexp.reduce(one - max(one.max(), 0.0))) for one in hypothesis.size_log_evidence)


def _summed_together(hypothesis: Hypothesis) -> float:
    """The same over all combinations of the sizes of all terms.

    Without their prior the amplitudes ``a`` have the log likelihood ``h'a - a'Pa / 2``; with the standard deviations
    ``S`` of their prior its integral is ``h'S (1 + SPS)^-1 Sh / 2 - log det(1 + SPS) / 2``.
    """
    mean, covariance = hypothesis.term_posterior
    whole = np.linalg.inv(covariance)
    present = np.concatenate([term.sds for term in hypothesis.terms])
    precision, dot = whole - np.diag(present**-2.0), whole @ mean
    sd, weight = [], []
    for sizes in product(*(range(len(one)) for one in hypothesis.size_log_evidence)):
        chosen = zip(hypothesis.terms, sizes, strict=True)
        terms = [replace(term, sd=float(term.candidate.sizes.sd[i])) for term, i in chosen]
        sd.append(np.concatenate([one.sds for one in terms]))
        weight.append(sum(float(t.candidate.sizes.log_weight[i]) for t, i in zip(terms, sizes, strict=True)))
    every = np.array([*sd, present])
    inside = np.eye(len(mean)) + every[:, :, None] * precision * every[:, None, :]
    sign, log_det = np.linalg.slogdet(inside)
    if (sign <= 0.0).any():
        raise np.linalg.LinAlgError("amplitudes are known beyond all rounding")
    scaled = every * dot
    log = 0.5 * ((scaled * np.linalg.solve(inside, scaled[..., None])[..., 0]).sum(axis=1) - log_det)
    gain = log[:-1] - log[-1] + np.array(weight)
    return float(np.logaddexp.reduce(gain)) - max(float(gain.max()), 0.0)


def resized(hypothesis: Hypothesis) -> Term | None:
    """The term that gains most by another size, with that size; None if all have their most probable ones."""
    found, most = None, 0.0
    for term, evidence in zip(hypothesis.terms, hypothesis.size_log_evidence, strict=True):
        sd = term.candidate.sizes.sd
        best = int(evidence.argmax())
        present = np.flatnonzero(sd == term.sd)
        gain = float(evidence[best] - evidence[present[0]]) if present.size else np.inf
        if gain > most:
            found, most = replace(term, sd=float(sd[best])), gain
    return found


def discrepancy_resized(hypothesis: Hypothesis) -> Term | None:
    """A term that moves beside its signature by another measure than that of its amplitude, with that one; or None."""
    for place, term in enumerate(hypothesis.terms):
        if len(term.discrepancy):
            least = term.candidate.least if isinstance(term.candidate, Law) else 0.0
            near = FINE ** round(math.log(max(hypothesis.size(place), least, 1e-300), FINE))
            if near != term.discrepancy_sd:
                return replace(term, discrepancy_sd=near)
    return None


def log_inside(mean: ArrayLike, u: ArrayLike, sd: ArrayLike, least: ArrayLike, positive: ArrayLike) -> Array:
    """What the log evidence rises by if the amplitude is known to be ``least`` or more.

    The share of the posterior inside the bound over that of the prior, both normal without the bound; any shapes that
    match.

    Parameters
    ----------
    mean, u : of the amplitude without the bound
    sd : standard deviation of its prior, which has the mean zero
    least : the smallest magnitude that it may have
    positive : whether it is above zero; else its sign is free
    """
    mean, u, sd, least = (np.asarray(one, float) for one in (mean, u, sd, least))
    above, below = special.log_ndtr((mean - least) / u), special.log_ndtr((-mean - least) / u)
    prior = special.log_ndtr(-least / sd)
    return np.asarray(np.where(positive, above - prior, np.logaddexp(above, below) - prior - np.log(2.0)))
