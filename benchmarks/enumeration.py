"""The search and its averages against sums over all sets of terms, computed without shortcuts.

    python -m benchmarks.enumeration --problems 40 --candidates 10 --most 4

Random small problems: residuals of some faces, repeated; candidates with signatures that partly coincide, some with
several shapes, one a Gaussian process. For each, the log evidence of every set of up to ``--most`` terms with every
model of the noise is computed from the covariance matrix of the rows: shapes and sizes of the amplitudes are summed
over all their combinations, the standard deviation of the noise by quadrature. Compared are the inclusion probabilities
of all candidates and the log evidence of the best set. Models of the noise whose marginal likelihood has no closed form
(outliers, heavy tails, a noisy stretch) have odds of 1e-12 here on both sides.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray
from scipy import special
from scipy.linalg import solve_triangular
from threadpoolctl import threadpool_limits

from stepgauge.inference.metric import FREE_UM
from stepgauge.inference.noise_models import NoiseModel, NoiseModels
from stepgauge.inference.posterior import Posterior
from stepgauge.inference.priors import NoisePriors
from stepgauge.inference.problem import AmplitudePrior, Candidate, GaussianProcess, Law, Problem
from stepgauge.inference.search import Search

Array = NDArray[np.float64]
FACES, REPEATS = 8, 5
NOISE_UM = 0.3
SIZES = AmplitudePrior(np.array([0.15, 1.0]), np.log([0.5, 0.5]))
PRIORS = NoisePriors(outliers=1e-12, heavy=1e-12, burst=1e-12, flicker=1e-12)
LOG_SIGMA = np.linspace(-1.2, 1.2, 25)
"""Nodes of the quadrature about the stated standard deviation: 0.1 of a logarithm apart, a third of its uncertainty."""


@dataclass(frozen=True)
class Exact:
    """``labels (s,)``: sets of terms; ``log_evidence (s,)``: with their priors, over all models of the noise."""

    labels: list[frozenset[str]]
    log_evidence: Array

    def inclusion(self, label: str) -> float:
        """Probability that a candidate is a term."""
        weight = special.softmax(self.log_evidence)
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


def enumerated(problem: Problem, most: int) -> Exact:
    """Every set of up to ``most`` terms, by the covariance matrix of the rows."""
    candidates = list(problem.candidates)
    sets = [one for size in range(most + 1) for one in combinations(range(len(candidates)), size)]
    noises = list(_noise_models(problem))
    every = np.array([_by_set(problem, candidates, sets, most, noise) for noise in noises])
    labels = [frozenset(candidates[i].label for i in one) for one in sets]
    return Exact(labels, np.asarray(special.logsumexp(every, axis=0)))


def _noise_models(problem: Problem) -> Iterator[NoiseModel]:
    models = NoiseModels(problem, PRIORS)
    growths = [None, *(("place", rate) for rate in PRIORS.growth_rates)]
    for growth, correlation, factor in product(
        growths, [0.0, *PRIORS.correlations], [1.0, *PRIORS.certificate_factors]
    ):
        yield models.changed(models.plain(), growth=growth, correlation=correlation, certificate=factor)


def _by_set(
    problem: Problem, candidates: Sequence[Candidate], sets: Sequence[tuple[int, ...]], most: int, noise: NoiseModel
) -> Array:
    """Log evidence with the prior of each set ``(s,)`` for one model of the noise, over sigma by quadrature."""
    spread = np.log(PRIORS.sigma_factor)
    logs = []
    for log_sigma in LOG_SIGMA:
        root = np.linalg.cholesky(_covariance(problem, noise, NOISE_UM * float(np.exp(log_sigma))))
        white = solve_triangular(root, problem.residual_um, lower=True)
        base = -np.log(np.diag(root)).sum() - 0.5 * white @ white - 0.5 * (log_sigma / spread) ** 2
        shapes = [_shapes(root, one) for one in candidates]
        logs.append(base + np.array([_log_evidence(white, [shapes[i] for i in one]) for one in sets]))
    prior = np.array([sum(candidates[i].log_odds for i in one) for one in sets])
    step = np.log(LOG_SIGMA[1] - LOG_SIGMA[0])
    return np.asarray(special.logsumexp(logs, axis=0) + step + prior + noise.log_prior)


def _covariance(problem: Problem, noise: NoiseModel, sigma_um: float) -> Array:
    """Of the rows without terms ``(n, n)``, element by element."""
    n = len(problem)
    apart = np.abs(np.subtract.outer(np.arange(n), np.arange(n)))
    correlation = noise.correlation**apart if noise.correlation else np.eye(n)
    deviation = np.ones(n)
    if noise.growth is not None:
        deviation = np.sqrt(1.0 + (noise.growth[1] * problem.growing["place"]) ** 2)
    found = sigma_um**2 * correlation * np.outer(deviation, deviation)
    found += (noise.certificate * problem.certified_u[0]) ** 2 * problem.certified.T @ problem.certified
    return np.asarray(found + FREE_UM**2 * problem.free.T @ problem.free)


def _shapes(root: Array, candidate: Candidate) -> list[tuple[Array, float]]:
    """Every shape and size of a candidate: whitened columns times the size, and the log of their prior weight."""
    weights = candidate.log_weight if isinstance(candidate, Law) else np.full(candidate.atoms, -np.log(candidate.atoms))
    found = []
    for atom in range(candidate.atoms):
        columns = solve_triangular(root, candidate.columns(atom).T, lower=True).T
        for sd, weight in zip(candidate.sizes.sd, candidate.sizes.log_weight, strict=True):
            found.append((sd * columns, float(weights[atom] + weight)))
    return found


def _log_evidence(white: Array, terms: Sequence[list[tuple[Array, float]]]) -> float:
    """Of a set of terms over that of none: all shapes and sizes of all terms, each with its exact determinant."""
    logs = []
    for chosen in product(*terms):
        weight = sum(one[1] for one in chosen)
        if not chosen:
            return 0.0
        columns = np.vstack([one[0] for one in chosen])
        root = np.linalg.cholesky(np.eye(len(columns)) + columns @ columns.T)
        explained = solve_triangular(root, columns @ white, lower=True, check_finite=False)
        logs.append(weight - np.log(np.diag(root)).sum() + 0.5 * explained @ explained)
    return float(special.logsumexp(logs))


def compared(seed: int, count: int, most: int) -> tuple[float, float, float]:
    """Largest difference of an inclusion probability, that of the log evidence of the best set, and its rank's loss."""
    problem = random_problem(seed, count)
    exact = enumerated(problem, most)
    search = Search(problem, PRIORS)
    best = search.run()
    posterior = Posterior(search, best)
    off = max(abs(posterior.probability([one.label]) - exact.inclusion(one.label)) for one in problem.candidates)
    of_set = dict(zip(exact.labels, exact.log_evidence, strict=True))
    own = [one.log_posterior for one in posterior.hypotheses if one.labels == best.labels]
    nothing = [one.log_posterior for one in posterior.hypotheses if not one.labels]
    gain = float(special.logsumexp(own) - special.logsumexp(nothing))
    wanted = float(of_set[best.labels] - of_set[frozenset()])
    return off, gain - wanted, float(exact.log_evidence.max() - of_set[best.labels])


@threadpool_limits.wrap(limits=1, user_api="blas")
def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--problems", type=int, default=20)
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--candidates", type=int, default=8)
    parser.add_argument("--most", type=int, default=3, help="largest number of terms of a set")
    chosen = parser.parse_args()
    rows = []
    for seed in range(chosen.first_seed, chosen.first_seed + chosen.problems):
        rows.append(compared(seed, chosen.candidates, chosen.most))
        off, evidence, lost = rows[-1]
        print(
            f"{seed:4d}  inclusion off by {off:.3f}  log evidence off by {evidence:+.2f}  best set loses {lost:.2f}",
            flush=True,
        )
    table = np.abs(np.array(rows))
    print(f"inclusion within 0.02: {(table[:, 0] <= 0.02).sum()} of {len(table)}, worst {table[:, 0].max():.3f}")
    print(f"log evidence within 0.1: {(table[:, 1] <= 0.1).sum()} of {len(table)}, worst {table[:, 1].max():.2f} nats")
    print(f"best set found: {(table[:, 2] < 0.05).sum()} of {len(table)}, worst loss {table[:, 2].max():.2f} nats")


if __name__ == "__main__":
    main()
