"""All geometric errors of a machine at once, as of one that was never compensated or whose error map is void.

A machine has 21 error motions (ISO 230-1:2012), and a recording in a few placements cannot tell them all apart: which
three of them "explain" what twenty do is chance. So one hypothesis has all of them, each in proportion to what its own
law usually is, times a factor that they have in common. What the readings tell of each follows from the posterior, in
which each kind of error has a factor of its own.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from stepgauge.diagnosis.fits.solve import Estimate
from stepgauge.diagnosis.laws.library import Family, family_signatures, fixed_values, signatures, whole
from stepgauge.diagnosis.laws.usual import odds_of, usual_size
from stepgauge.diagnosis.priors import Priors
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.effects import Effect, along_approach_um
from stepgauge.files.arrays import Array
from stepgauge.inference.metric import Metric
from stepgauge.inference.problem import Law

KIND = "geometric_errors"
PARTS = {"angular_error", "error_motion", "roll", "scale_curvature", "scale_error", "squareness", "straightness"}
"""Kinds of laws that are errors of the machine's geometry, smooth over its travel."""
FEWEST_PLACEMENTS = 4
"""Along three lines all errors together are hardly another curve than one of them."""
FURTHER = 2
"""Powers beyond those that are laws of their own: guideways are no cubics, and what is large shows it."""
SPREAD = float(np.log(3.0))
"""Logarithmic standard deviation of the size of one kind of error, over that of all: a factor of three."""
OWN_SPREADS = np.log([1.25, 2.0, 3.2])
"""Those of one error over those of its kind, each as likely: what is told of some holds for others to a factor."""
STEPS = np.linspace(-4.0, 4.0, 81)
"""Of the logarithm of a factor, in its standard deviations."""
UNUSED, DRAWS = 50, 200
"""Draws of the factors: those until the first one is forgotten, and those that count."""
ONE_LINE = 0.1
"""Component across a line from which placements are not all along it."""
UNSEEN = 1e-8
"""Share of the largest variance of what the errors have together below which a combination of them is rounding."""


@dataclass(frozen=True)
class Geometry:
    """Laws of the machine's geometry: families of one shape and one amplitude.

    ``usual (m,)``: usual size of each, in the unit of its linear parameter; ``turn (m, d)``: what of each of these is
    in the ``d`` orthogonal combinations that this recording shows.
    """

    families: tuple[Family, ...]
    usual: Array
    turn: Array
    kind: str = KIND
    label: str = KIND

    def columns(self, data: Residuals) -> Array:
        """The combinations in another recording, ``(d, n)``; origins are left in."""
        units = np.concatenate([family_signatures(one, one.atoms[0], data) for one in self.families])
        return np.asarray(self.turn.T @ (self.usual[:, None] * units))

    def posterior(self, metric: Metric, left_um: Array, sd: float) -> tuple[Array, Array]:
        """Mean sizes ``(m,)`` and their covariance, from residuals ``(n,)`` without other laws.

        Each kind of error has a spread of its own, ``sd`` times a factor that is log-normal about one, and each error
        another factor, whose spread is found as well, for machines differ in what is wrong with them. The factors are
        integrated by Gibbs sampling: sizes by the factors, factors by the sizes (Gelfand and Smith, J. Am. Stat. Assoc.
        85, 1990: 398).
        """
        columns = metric(np.concatenate([one.signature(0) for one in self.families]) * self.usual[:, None])
        kinds = sorted({one.kind for one in self.families})
        of = np.array([kinds.index(one.kind) for one in self.families])
        mean, covariance = integrated_sizes(columns @ columns.T, columns @ metric(left_um), of, sd)
        return self.usual * mean, covariance * np.outer(self.usual, self.usual)

    def made(self, sizes: Array) -> tuple[Effect, ...]:
        """The laws with these sizes ``(m,)``."""
        return tuple(
            one.law.model_construct(**{**fixed_values(one.law), **one.choices, _linear(one).name: size})
            for one, size in zip(self.families, sizes.tolist(), strict=True)
        )

    def estimates(self, sizes: Array, covariance: Array) -> dict[str, Estimate]:
        """Size and standard uncertainty of each law by its label, the best determined first."""
        u = np.sqrt(np.diag(covariance))
        every = [
            (family.label, Estimate(float(v), float(s), _unit(family)))
            for family, v, s in zip(self.families, sizes, u, strict=True)
        ]
        return dict(sorted(every, key=lambda one: -abs(one[1].value) / (one[1].u or 1.0)))


def integrated_sizes(gram: Array, dot: Array, of: NDArray[np.intp], sd: float) -> tuple[Array, Array]:
    """Mean ``(m,)`` and covariance of sizes over the factors of their kinds; ``of (m,)``: the kind of each.

    ``gram (m, m)``, ``dot (m,)``: normal equations. The same draws every time.
    """
    random, logs, own = np.random.default_rng(1), np.zeros(int(of.max()) + 1), np.zeros(len(of))
    own_spread = OWN_SPREADS[1]
    means, spread = [], np.zeros_like(gram)
    for step in range(UNUSED + DRAWS):
        scale = sd * np.exp(logs[of] + own)
        root = np.linalg.cholesky(np.eye(len(scale)) + scale[:, None] * gram * scale)
        half = solve_triangular(root, np.diag(scale), lower=True)
        mean = half.T @ (half @ dot)
        sizes = mean + half.T @ random.normal(size=len(scale))
        logs = _drawn_factors(sizes / np.exp(own), of, sd, SPREAD, random)
        own = _drawn_factors(sizes / np.exp(logs[of]), np.arange(len(of)), sd, own_spread, random)
        log_spread = -len(own) * np.log(OWN_SPREADS) - 0.5 * np.sum(own**2) / OWN_SPREADS**2
        own_spread = float(OWN_SPREADS[(log_spread + random.gumbel(size=len(OWN_SPREADS))).argmax()])
        logs = _interwoven_factors(sizes, logs, of, (gram, dot), random)
        if step >= UNUSED:
            means.append(mean)
            spread += half.T @ half / DRAWS
    return np.mean(means, axis=0), spread + np.cov(np.array(means).T)


def _drawn_factors(sizes: Array, of: NDArray[np.intp], sd: float, spread: float, random: np.random.Generator) -> Array:
    """Logarithms of the factors of all kinds, drawn from what sizes tell of them ``(kinds,)``."""
    logs, square, count = spread * STEPS, np.bincount(of, (sizes / sd) ** 2), np.bincount(of)
    log_posterior = -0.5 * STEPS**2 - np.outer(count, logs) - 0.5 * np.outer(square, np.exp(-2.0 * logs))
    return np.asarray(logs[(log_posterior + random.gumbel(size=log_posterior.shape)).argmax(axis=1)])


def _interwoven_factors(
    sizes: Array, logs: Array, of: NDArray[np.intp], equations: tuple[Array, Array], random: np.random.Generator
) -> Array:
    """The factors drawn once more, now with all sizes of a kind in their ratios (interweaving: Yu and Meng 2011).

    Given the sizes a factor hardly moves where there are many of a kind; given their ratios it moves as far as the
    readings let it, and over its whole prior where they say nothing.
    """
    gram, dot = equations
    logs, factor = logs.copy(), np.exp(SPREAD * STEPS)
    for kind in range(len(logs)):
        own = np.where(of == kind, sizes, 0.0) / np.exp(logs[kind])
        rest = np.where(of == kind, 0.0, sizes)
        log_likelihood = factor * (own @ (dot - gram @ rest)) - 0.5 * factor**2 * (own @ gram @ own)
        log_posterior = log_likelihood - 0.5 * STEPS**2
        logs[kind] = SPREAD * STEPS[(log_posterior + random.gumbel(size=len(STEPS))).argmax()]
        sizes = rest + own * np.exp(logs[kind])
    return logs


def moved_um(effects: Sequence[Effect], data: Residuals) -> Array:
    """Displacement along the approach by some effects together, without origins, ``(n,)``."""
    return data.without_origins(np.sum([along_approach_um(effect, data.probings) for effect in effects], axis=0))


def geometry_of(laws: Sequence[Law], data: Residuals, priors: Priors) -> Law | None:
    """All laws of the machine's geometry as one candidate; None where gauges lay along too few lines."""
    own = [law.source for law in laws if law.kind in PARTS]
    span_mm = float(np.ptp(data.probings.certified_mm()))
    known = (usual_size(one.law, priors, data.gauge, data.machine, span_mm, one.choices) for one in own)
    parts = [(one, usual.size) for one, usual in zip(own, known, strict=True)]
    parts += [finer for one, size in parts if one.kind == "error_motion" for finer in _further(one, size, data)]
    axes = np.array(list(data.probings.setting.axis.values()))
    if len(parts) < 2 or len(axes) < FEWEST_PLACEMENTS:
        return None
    if np.linalg.svd(axes, compute_uv=False)[1:2].sum() < ONE_LINE * np.sqrt(len(axes)):
        return None
    families, usual = tuple(one for one, _ in parts), np.array([size for _, size in parts])
    columns = usual[:, None] * np.concatenate([one.signature(0) for one in families])
    value, vector = np.linalg.eigh(columns @ columns.T)
    turn = vector[:, value > UNSEEN * value[-1]]
    return Law(
        KIND,
        KIND,
        True,
        float(np.log(odds_of(KIND, priors))),
        priors.sizes.about(priors.laws.of(KIND).usual),
        Geometry(families, usual, turn),
        combined=True,
        pattern=(turn.T @ columns)[None],
        shares=whole(len(data)),
        log_weight=np.zeros(1),
    )


def _further(family: Family, usual: float, data: Residuals) -> Iterator[tuple[Family, float]]:
    """Error motions of higher powers with their usual sizes: each moves the end of the travel as far as the first."""
    half_m = float(np.ptp(data.probings.setting.travel_mm["xyz".index(family.choices["axis"])])) * 5e-4
    for more in range(1, FURTHER + 1):
        choices = {**family.choices, "order": family.choices["order"] + more}
        pattern = data.without_origins(signatures(family.law, choices, family.atoms, data))
        label = family.law.model_construct(**(fixed_values(family.law) | choices)).label
        yield replace(family, label=label, choices=choices, pattern=pattern), usual / half_m**more


def _linear(family: Family) -> Any:
    return next(p for p in family.law.parameters() if p.role == "linear")


def _unit(family: Family) -> str:
    """The unit of a size; of the two of an error motion that of its component."""
    if "component" not in family.choices:
        return str(_linear(family).unit)
    return "urad" if family.choices["component"].startswith("r") else "um"
