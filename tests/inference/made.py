"""Problems made of numbers alone: residuals over a made coordinate and time, and no gauge, probe or file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.inference.metric import FREE_UM
from stepgauge.inference.noise_models import NoiseModel
from stepgauge.inference.problem import AmplitudePrior, Candidate, GaussianProcess, Law, Problem, Term

Array = NDArray[np.float64]
NOISE_UM = 0.3
FACES, REPEATS = 12, 5
ROWS = FACES * REPEATS
SIZES = AmplitudePrior(np.array([0.1, 0.5, 2.0]), np.log([0.3, 0.4, 0.3]))


def coordinate() -> Array:
    """Place of every row from -1 to 1, the same in all repeats."""
    return np.tile(np.linspace(-1.0, 1.0, FACES), REPEATS)


def turns() -> Array:
    """Time of every row from 0 to 1, one row after the other."""
    return np.arange(ROWS) / (ROWS - 1.0)


def problem(um: Array, candidates: Sequence[Candidate] = (), seed: int = 1, **changed: Any) -> Problem:
    """Faces of alternate sides probed again and again, in an order with a break, one origin."""
    random = np.random.default_rng(seed)
    face = np.tile(np.arange(FACES), REPEATS)
    side = np.where(face % 2 == 0, 1.0, -1.0)
    gap = random.uniform(0.5, 2.0, ROWS - 1)
    gap[ROWS // 2] = np.inf
    values: dict[str, Any] = {
        "residual_um": um,
        "scale_um": NOISE_UM,
        "certified": (face == np.arange(FACES)[:, None]) * side,
        "certified_u": np.full(FACES, 0.1),
        "free": side[None],
        "order": random.permutation(ROWS),
        "gap": gap,
        "growing": {"position": (coordinate() + 1.0) / 2.0, "time": turns()},
        "step_um": 0.2,
        "group": face.astype(np.intp),
        "candidates": candidates,
    }
    return Problem(**(values | changed))


def noise(seed: int = 2) -> Array:
    """Even scatter."""
    return np.random.default_rng(seed).normal(0.0, NOISE_UM, ROWS)


def law(label: str, pattern: Array, shares: Array | None = None, **changed: Any) -> Law:
    """A law of shapes ``(atoms, depth, n)``, all equally likely."""
    values: dict[str, Any] = {
        "pattern": pattern,
        "shares": np.ones((1, ROWS)) if shares is None else shares,
        "log_weight": np.full(len(pattern), -np.log(len(pattern))),
    }
    return Law(label, label, True, float(np.log(0.03)), SIZES, **(values | changed))


def waves(values: Array, counts: Sequence[float]) -> Array:
    """Sine and cosine of so many turns over the values, ``(atoms, 2, n)``."""
    angle = 2.0 * np.pi * np.array(counts)[:, None] * values
    return np.stack([np.sin(angle), np.cos(angle)], axis=1)


def random_function(values: Array, lengths: Sequence[float] = (0.3, 1.0)) -> GaussianProcess:
    """Normal processes with a Gaussian covariance, by the roots of the covariance itself."""
    features = []
    for length in lengths:
        covariance = np.exp(-0.5 * ((values[:, None] - values) / length) ** 2)
        value, vector = np.linalg.eigh(covariance)
        keep = value > 1e-9 * value[-1]
        features.append((vector[:, keep] * np.sqrt(value[keep])).T[::-1])
    return GaussianProcess(
        "somewhere", "a random function", False, float(np.log(0.05)), SIZES, features=tuple(features)
    )


def term(candidate: Candidate, atom: int = 0, sd: float = 0.5, log_prior: float = -3.0) -> Term:
    """A candidate with one of its shapes, and with one size only."""
    candidate = replace(candidate, sizes=AmplitudePrior(np.array([sd]), np.zeros(1)))
    return Term(candidate, atom, candidate.columns(atom), sd, log_prior)


def dense_covariance(
    one: Problem, scatter: NoiseModel, terms: Sequence[Term], sigma_um: float, alike: bool = True
) -> Array:
    """Covariance of the rows ``(n, n)``, written out element by element from what each part of a hypothesis says.

    ``alike``: with what rounded repeats have in common.
    """
    n = len(one)
    place = np.empty(n, int)
    place[one.order] = np.arange(n)
    after = np.concatenate([[0.0], np.cumsum(np.minimum(one.gap, 1e6))])[place]
    apart = np.abs(after[:, None] - after)
    correlation = np.where(apart == 0.0, 1.0, scatter.correlation**apart) if scatter.correlation else np.eye(n)
    if scatter.flicker:
        times = 0.5 * 2.0 ** np.arange(2 + np.ceil(np.log2(one.gap[np.isfinite(one.gap)].sum())))
        alike = np.mean([np.exp(-apart / time) for time in times], axis=0)
        correlation = scatter.flicker * alike + (1.0 - scatter.flicker) * np.eye(n)
    variance, latched_um = np.broadcast_to(one.stated, n), np.broadcast_to(one.latched_um, n)
    if scatter.rounded:
        variance = variance - (latched_um / one.scale_um) ** 2
    if scatter.growth is not None:
        name, rate = scatter.growth
        variance = variance + np.median(one.stated) * (rate * one.growing[name]) ** 2
    if scatter.burst is not None:
        first, end, factor = scatter.burst
        variance = np.array([v * factor**2 if first <= at < end else v for v, at in zip(variance, place, strict=True)])
    deviation = np.sqrt(variance / scatter.weight)
    found = sigma_um**2 * correlation * np.outer(deviation, deviation)
    for column, u in zip(one.certified, one.certified_u, strict=True):
        found += (u * scatter.certificate) ** 2 * np.outer(column, column)
    for column in one.free:
        found += FREE_UM**2 * np.outer(column, column)
    if scatter.rounded and alike:
        found += (one.step_um**2 / 12.0 + latched_um**2) * (one.group[:, None] == one.group)
    for own in terms:
        found += own.sd**2 * own.columns.T @ own.columns
    return found
