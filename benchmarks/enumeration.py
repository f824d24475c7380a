"""The search and its averages against sums over all sets of terms, computed without shortcuts.

    python -m benchmarks.enumeration --problems 20 --candidates 14 --most 4

Random small problems: residuals of some faces, repeated; candidates with signatures that partly coincide, some with
several shapes, one a Gaussian process. For each, the log posterior of every set of up to ``--most`` terms with every
model of the noise is computed from the covariance matrix of the rows: shapes and sizes of the amplitudes are summed
over all their combinations, the standard deviation of the noise by quadrature. Compared are the inclusion probabilities
of all candidates and the log posterior of the most probable sets. Models of the noise whose marginal likelihood has no
closed form (outliers, heavy tails), or whose stretches are too many to be summed (a noisy one), have odds of 1e-12 here
on both sides.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy import special
from scipy.linalg import solve_triangular
from threadpoolctl import threadpool_limits

from stepgauge.inference.metric import FREE_UM
from stepgauge.inference.noise_models import NoiseModel, NoiseModels
from stepgauge.inference.noise_priors import NoisePriors
from stepgauge.inference.posterior import Posterior
from stepgauge.inference.problem import AmplitudePrior, Candidate, GaussianProcess, Law, Problem
from stepgauge.inference.search import Search

Array = NDArray[np.float64]
FACES, REPEATS = 8, 5
NOISE_UM = 0.3
SIZES = AmplitudePrior(np.array([0.15, 1.0]), np.log([0.5, 0.5]))
PRIORS = NoisePriors(outliers=1e-12, heavy=1e-12, burst=1e-12)
LOG_SIGMA = np.linspace(-0.75, 1.2, 14)
"""Nodes of the quadrature about the stated standard deviation, 0.15 of a logarithm apart: 1.3 times the standard
deviation of the logarithm in forty readings, with which the sum over a normal density is off by 1e-5."""
PROBABLE = 3.0
"""Sets whose log posterior is compared: those within so many nats of the best."""


@dataclass(frozen=True)
class Exact:
    """``labels (s,)``: sets of terms; ``log_posterior (s,)``: with their priors, over all models of the noise."""

    labels: list[frozenset[str]]
    log_posterior: Array

    def inclusion(self, label: str) -> float:
        """Probability that a candidate is a term."""
        weight = special.softmax(self.log_posterior)
        return float(sum(w for w, one in zip(weight, self.labels, strict=True) if label in one))


def random_problem(seed: int, count: int) -> Problem:
    """Residuals with none to three of the candidates in them, of whose signatures some nearly coincide."""
    random = np.random.default_rng(seed)
    n = FACES * REPEATS
    face = np.tile(np.arange(FACES), REPEATS)
    place, time = np.tile(np.linspace(-1.0, 1.0, FACES), REPEATS), np.linspace(0.0, 1.0, n)
    candidates = [*_laws(random, count - 1, place, time), _smooth(place)]
    um = random.normal(0.0, NOISE_UM, n)
    for one in random.choice(len(candidates) - 1, random.integers(0, 4), replace=False):
        columns = candidates[one].columns(int(random.integers(candidates[one].atoms)))
        um = um + random.normal(0.0, 0.4, len(columns)) @ columns
    return Problem(
        residual_um=um,
        scale_um=NOISE_UM,
        certified=(face == np.arange(FACES)[:, None]).astype(float),
        certified_u=np.full(FACES, 0.05),
        free=np.ones((1, n)),
        order=np.arange(n),
        gap=np.ones(n - 1),
        growing={"place": (place + 1.0) / 2.0},
        step_um=0.0,
        group=face.astype(np.intp),
        candidates=candidates,
    )


def _laws(random: np.random.Generator, count: int, place: Array, time: Array) -> Iterator[Law]:
    for i in range(count):
        mix = random.normal(size=3)
        base = mix[0] * place + mix[1] * time + 0.3 * mix[2] * place * time
        shapes = [base] if i % 3 else [np.sin(turns * np.pi * place + mix[2]) for turns in (1.0, 1.7, 2.6)]
        pattern = np.array(shapes)[:, None, :] / np.std(shapes, axis=1)[:, None, None]
        weight = np.full(len(pattern), -np.log(len(pattern)))
        yield Law(
            f"law {i}", f"law {i}", True, float(np.log(0.1)), SIZES,
            pattern=pattern, shares=np.ones((1, len(place))), log_weight=weight,
        )  # fmt: skip


def _smooth(place: Array) -> GaussianProcess:
    value, vector = np.linalg.eigh(np.exp(-0.5 * (np.subtract.outer(place, place) / 0.5) ** 2))
    keep = value > 1e-8 * value[-1]
    features = ((vector[:, keep] * np.sqrt(value[keep])).T[::-1],)
    return GaussianProcess("place", "a function of the place", False, float(np.log(0.1)), SIZES, features=features)


def enumerated(problem: Problem, most: int, priors: NoisePriors = PRIORS) -> Exact:
    """Every set of up to ``most`` terms, by the covariance matrix of the rows."""
    noises = list(_noise_models(problem, priors))
    sums = _Sums(problem, [(noise, log_sigma) for noise in noises for log_sigma in LOG_SIGMA], most)
    spread, step = np.log(priors.sigma_factor), LOG_SIGMA[1] - LOG_SIGMA[0]
    sigma = np.tile(-0.5 * (LOG_SIGMA / spread) ** 2, len(noises)) + np.log(step)
    prior = np.repeat([noise.log_prior for noise in noises], len(LOG_SIGMA)) + sigma + sums.log_empty
    top = prior.max()
    odds = {one.label: one.log_odds for one in problem.candidates}
    labels = list(sums.found)
    every = [np.log(np.exp(prior - top) @ sums.found[one]) + sum(odds[label] for label in one) for one in labels]
    return Exact(labels, np.array(every) + top)


def _noise_models(problem: Problem, priors: NoisePriors) -> Iterator[NoiseModel]:
    models = NoiseModels(problem, priors)
    growths = [None, *((name, rate) for name in problem.growing for rate in priors.growth_rates)]
    related = [(one, 0.0) for one in (0.0, *priors.correlations)] + [(0.0, one) for one in priors.flicker_shares]
    for growth, (correlation, flicker), factor in product(growths, related, [1.0, *priors.certificate_factors]):
        yield models.changed(
            models.plain(), growth=growth, correlation=correlation, flicker=flicker, certificate=factor
        )


@dataclass(frozen=True)
class _Shapes:
    """A candidate: where the columns of each shape are among all, and all sizes with their weights."""

    label: str
    shapes: list[tuple[slice, float]]
    sizes: list[tuple[float, float]]


@dataclass
class _Sums:
    """Densities of the residuals ``(b,)`` for each set of terms, for all noises and sigmas ``b`` at once.

    One term after the other is eliminated from the products of all columns (the Schur complement), so that sets with
    terms in common share the work; no set, shape or size is left out. ``log_empty``: logarithm of the determinants
    without any term; the squares are in ``found``, which are at most one.
    """

    problem: Problem
    settings: Sequence[tuple[NoiseModel, float]]
    most: int
    found: dict[frozenset[str], Array] = field(default_factory=dict)

    def __post_init__(self) -> None:
        # what has many columns is eliminated first, so that all later ones are single
        candidates = sorted(self.problem.candidates, key=lambda one: isinstance(one, Law))
        columns, self.every = _columns_and_shapes(candidates)
        log, gram = [], []
        for noise, log_sigma in self.settings:
            root = np.linalg.cholesky(_covariance(self.problem, noise, NOISE_UM * float(np.exp(log_sigma))))
            mapped = solve_triangular(root, np.vstack([columns, self.problem.residual_um]).T, lower=True)
            gram.append(mapped.T @ mapped)
            log.append(-np.log(np.diag(root)).sum())
        self.log_empty = np.array(log)
        # the residual is the last column, so that its products are eliminated with those of the columns
        products = np.ascontiguousarray(np.moveaxis(np.array(gram), 0, 2))
        self._grow(frozenset(), 0, 0, products, -0.5 * products[-1, -1])

    def _grow(self, labels: frozenset[str], number: int, first: int, gram: Array, log: Array) -> None:
        """All sets with further candidates, from a number on; ``first``: which column is the first of ``gram``."""
        self.found[labels] = self.found.get(labels, 0.0) + np.exp(log)
        if len(labels) == self.most:
            return
        for place, one in enumerate(self.every[number:], number + 1):
            more = labels | {one.label}
            for (columns, weight), (sd, share) in product(one.shapes, one.sizes):
                own = slice(columns.start - first, columns.stop - first)
                end = one.shapes[-1][0].stop
                if len(labels) == self.most - 1:
                    factor = _log_factor(gram[own, own], gram[own, -1], sd)
                    self.found[more] = self.found.get(more, 0.0) + np.exp(log + factor + weight + share)
                else:
                    factor, left = _eliminated(gram, own, end - first, sd)
                    self._grow(more, place, end, left, log + factor + weight + share)


def _columns_and_shapes(candidates: Sequence[Candidate]) -> tuple[Array, list[_Shapes]]:
    columns: list[Array] = []
    every: list[_Shapes] = []
    for one in candidates:
        weight = one.log_weight if isinstance(one, Law) else np.full(one.atoms, -np.log(one.atoms))
        shapes = []
        for atom in range(one.atoms):
            first = sum(map(len, columns))
            columns.append(one.columns(atom))
            shapes.append((slice(first, first + len(columns[-1])), float(weight[atom])))
        sizes = zip(one.sizes.sd.tolist(), one.sizes.log_weight.tolist(), strict=True)
        every.append(_Shapes(one.label, shapes, list(sizes)))
    return np.vstack(columns), every


def _log_factor(own: Array, dot: Array, sd: float) -> Array:
    """Logarithm of what the density is multiplied with by a term ``(b,)``, its amplitudes integrated."""
    if len(own) == 1:
        inside = 1.0 + sd**2 * own[0, 0]
        return 0.5 * np.asarray(sd**2 * dot[0] ** 2 / inside - np.log(inside))
    stacked = np.eye(len(own)) + sd**2 * np.moveaxis(own, 2, 0)
    explained = sd**2 * (dot.T * np.linalg.solve(stacked, dot.T[..., None])[..., 0]).sum(axis=1)
    return 0.5 * np.asarray(explained - np.linalg.slogdet(stacked)[1])


def _eliminated(gram: Array, own: slice, end: int, sd: float) -> tuple[Array, Array]:
    """That factor, and the products of what follows from the column ``end`` on, conditional on the term's size."""
    inner, beside = gram[own, own], gram[own, end:]
    if len(inner) == 1:
        left = gram[end:, end:] - beside[0][:, None] * (beside[0] / (sd**-2.0 + inner[0, 0]))
    else:
        stacked = np.eye(len(inner)) * sd**-2.0 + np.moveaxis(inner, 2, 0)
        share = np.moveaxis(np.linalg.solve(stacked, np.moveaxis(beside, 2, 0)), 0, 2)
        left = gram[end:, end:] - np.einsum("ikb,ilb->klb", beside, share)
    return _log_factor(inner, gram[own, -1], sd), left


def _covariance(problem: Problem, noise: NoiseModel, sigma_um: float) -> Array:
    """Of the rows without terms ``(n, n)``, element by element."""
    n = len(problem)
    apart = np.abs(np.subtract.outer(np.arange(n), np.arange(n)))
    correlation = noise.correlation**apart if noise.correlation else np.eye(n)
    if noise.flicker:
        times = 0.5 * 2.0 ** np.arange(2 + int(np.ceil(np.log2(n - 1))))
        relaxing = np.mean([np.exp(-apart / one) for one in times], axis=0)
        correlation = noise.flicker * relaxing + (1.0 - noise.flicker) * np.eye(n)
    deviation = np.ones(n)
    if noise.growth is not None:
        name, rate = noise.growth
        deviation = np.sqrt(1.0 + (rate * problem.growing[name]) ** 2)
    found = sigma_um**2 * correlation * np.outer(deviation, deviation)
    found += (noise.certificate * problem.certified_u[0]) ** 2 * problem.certified.T @ problem.certified
    return np.asarray(found + FREE_UM**2 * problem.free.T @ problem.free)


@dataclass(frozen=True)
class Compared:
    """Largest differences from the exact sums; ``loss``: of the best set found from the exact best one, nats."""

    inclusion: float
    log_posterior: float
    loss: float


def compared(problem: Problem, most: int, priors: NoisePriors = PRIORS) -> Compared:
    """Inclusion of every candidate, and log posterior of every probable set over that of no term."""
    exact, search = enumerated(problem, most, priors), Search(problem, priors)
    best = search.run()
    posterior = Posterior(search, best)
    wanted = dict(zip(exact.labels, exact.log_posterior, strict=True))
    own = {one: log for one, log in posterior.log_posterior.items() if len(one) <= most}
    found = Exact(list(own), np.array(list(own.values())))
    off = max(abs(found.inclusion(one.label) - exact.inclusion(one.label)) for one in problem.candidates)
    top = exact.log_posterior.max()
    near = [one for one in exact.labels if wanted[one] > top - PROBABLE]
    apart = [own.get(one, -np.inf) - own[best.labels] - wanted[one] + wanted[best.labels] for one in near]
    return Compared(off, float(np.abs(apart).max(initial=0.0)), float(top - wanted[best.labels]))


@threadpool_limits.wrap(limits=1, user_api="blas")
def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--problems", type=int, default=20)
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--candidates", type=int, default=14)
    parser.add_argument("--most", type=int, default=4, help="largest number of terms of a set")
    chosen = parser.parse_args()
    rows = []
    for seed in range(chosen.first_seed, chosen.first_seed + chosen.problems):
        began = time.perf_counter()
        rows.append(one := compared(random_problem(seed, chosen.candidates), chosen.most))
        print(
            f"{seed:4d}  inclusion off by {one.inclusion:.3f}  log posterior off by {one.log_posterior:.2f}"
            f"  best set loses {one.loss:.2f}  {time.perf_counter() - began:.0f} s",
            flush=True,
        )
    table = np.array([(one.inclusion, one.log_posterior, one.loss) for one in rows])
    print(f"inclusion within 0.02: {(table[:, 0] <= 0.02).sum()} of {len(table)}, worst {table[:, 0].max():.3f}")
    print(f"log posterior within 0.1: {(table[:, 1] <= 0.1).sum()} of {len(table)}, worst {table[:, 1].max():.2f} nats")
    print(f"best set found: {(table[:, 2] < 0.05).sum()} of {len(table)}, worst loss {table[:, 2].max():.2f} nats")


if __name__ == "__main__":
    main()
