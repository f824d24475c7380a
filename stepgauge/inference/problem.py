"""Residuals to be explained, nuisance columns, and candidates with their priors."""

from __future__ import annotations

import zlib
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import special
from scipy.linalg import solve_triangular

Array = NDArray[np.float64]
SAME, REPEATING = 0.05, 0.1
"""Difference of repeats over their scatter below which they are the same (a thirtieth of them by chance), and the share
of such from which readings are on steps."""
LEAST_SCATTER = 0.03
"""Least standard deviation of a reading over what is stated: with less than that nothing was measured."""
FEWEST_REPEATS = 8
"""Degrees of freedom of repeats from which their scatter is told."""


@dataclass(frozen=True)
class AmplitudePrior:
    """Prior of an amplitude: a mixture of normal distributions about zero.

    ``sd (t,)``: their standard deviations, um for a unit of the signature; ``log_weight (t,)``: logarithms of their
    shares, which sum to one.
    """

    sd: Array
    log_weight: Array

    def expected(self, log_evidence: Array) -> float:
        """The standard deviation whose precision is the mean over all sizes, of log evidences ``(t,)``."""
        return float((special.softmax(log_evidence) @ self.sd**-2.0) ** -0.5)


@dataclass(frozen=True)
class Refined:
    """A signature between the points of a grid: ``columns (d, n)`` and its shape parameters.

    ``gain``: logarithm of its prior over that of the point of the grid.
    """

    columns: Array
    shape: Any
    gain: float = 0.0


Refine = Callable[[int, Array], Refined | None]
"""From the number of an atom and residuals ``(n,)`` in um to the signature that fits them best near this atom.

The residuals are those without other terms; nuisance parameters are free.
"""


OfSize = Callable[[int, Array, Callable[[Array], Array]], Refined | None]
"""From the number of an atom to the signature that a law has at the size that fits best, near this atom.

To residuals ``(n,)``, beside all other terms and nuisance parameters: the last argument maps columns ``(..., n)`` to
independent variables without these.
"""


@dataclass(frozen=True, eq=False)
class Candidate:
    """Shapes under one prior: a law with its choices made, or a form over one covariate.

    ``kind``: a law's name, or the covariate of a form; ``label``: its unique name; ``named``: whether it
    is a law; ``log_odds``: log of its prior odds; ``sizes``: prior of its amplitudes; ``source``: the object that
    the candidate was made from; ``once``: whether a hypothesis has one candidate of its kind only; ``combined``:
    whether it is several laws at once, which fit whatever one of them does; ``again``: what its log odds rise by beside
    another one of its kind; ``first``: the candidate of which it is a second one, which it becomes without that.
    """

    kind: str
    label: str
    named: bool
    log_odds: float
    sizes: AmplitudePrior
    source: Any = None
    once: bool = False
    combined: bool = False
    again: float = 0.0
    first: Candidate | None = None

    @property
    def atoms(self) -> int:
        """Number of shapes that the candidate may have."""
        raise NotImplementedError

    def columns(self, atom: int) -> Array:
        """Signature of one shape, um for a unit of each amplitude, ``(d, n)``."""
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class Law(Candidate):
    """Few amplitudes, many shapes: a period, a position, a time constant on a grid.

    ``pattern (atoms, depth, n)`` times each of ``shares (k, n)``; candidates that differ only in the shares have the
    same pattern. ``log_weight (atoms,)``: prior of the shapes; ``positive``: whether amplitudes are; ``least``: the
    smallest magnitude of a single amplitude; ``refine``: see :data:`Refine`. ``of_size``: see
    :data:`OfSize`; of a law that is not linear in its size the shapes on the grid are sizes, its prior is that of the
    amplitude alone, and a term has the signature of its size. ``discrepancy``:
    from the number of an atom to columns ``(p, n)`` in which reality may depart from the signature, with amplitudes of
    the same size (model discrepancy; Kennedy and O'Hagan, J. R. Stat. Soc. B 63, 2001: 425). They are never reported.
    ``values (atoms,)``: what the shapes of the grid are, as periods, where it is stated; ``shape_at``: the columns of
    any value between them.
    """

    pattern: Array | NDArray[np.float32] = field(default_factory=lambda: np.zeros((0, 1, 0)))
    shares: Array = field(default_factory=lambda: np.zeros((1, 0)))
    log_weight: Array = field(default_factory=lambda: np.zeros(0))
    positive: bool = False
    least: float = 0.0
    refine: Refine | None = None
    of_size: OfSize | None = None
    discrepancy: Callable[[int], Array] | None = None
    values: Array | None = None
    shape_at: Callable[[float], Array] | None = None

    @property
    def atoms(self) -> int:
        return len(self.pattern)

    @property
    def dimension(self) -> int:
        """Number of amplitudes."""
        return int(self.pattern.shape[1]) * len(self.shares)

    @property
    def bounded(self) -> bool:
        """Whether the prior of an amplitude is a part of a normal distribution."""
        return self.positive or self.least > 0.0

    def columns(self, atom: int) -> Array:
        columns = np.concatenate([self.pattern[atom].astype(float) * share for share in self.shares])
        return columns if self.discrepancy is None else np.concatenate([columns, self.discrepancy(atom)])


@dataclass(frozen=True, eq=False)
class GaussianProcess(Candidate):
    """Many amplitudes, few shapes: random functions of one covariate, one set of ``features (d, n)`` per kernel.

    ``rough``: whether the least features of a kernel count, too, as those of a random walk far above the noise do.
    ``values (atoms,)``: the correlation lengths of the kernels, and ``covariate (n,)``, where they are stated.
    """

    features: tuple[Array, ...] = ()
    rough: bool = False
    values: Array | None = None
    covariate: Array | None = None

    @property
    def atoms(self) -> int:
        return len(self.features)

    def columns(self, atom: int) -> Array:
        return self.features[atom]


@dataclass(frozen=True, eq=False)
class Term:
    """A candidate with its shape and size chosen; ``log_prior``: log odds, and the volume of its shapes.

    ``columns (d, n)``: um for a unit of each amplitude; ``sd``: prior standard deviation of the amplitudes;
    ``discrepancy_sd``: that of its discrepancy, None for the same; ``correlated``: whether the volume is that beside
    correlated noise, which leaves other shapes possible.
    """

    candidate: Candidate
    atom: int
    columns: Array
    sd: float
    log_prior: float
    shape: Any = None
    correlated: bool = False
    discrepancy_sd: float | None = None

    @property
    def n_amplitudes(self) -> int:
        """Number of amplitudes without those of a discrepancy."""
        return self.candidate.dimension if isinstance(self.candidate, Law) else len(self.columns)

    @property
    def discrepancy(self) -> Array:
        """Columns ``(p, n)`` of the discrepancy."""
        return self.columns[self.n_amplitudes :]

    @property
    def sds(self) -> Array:
        """Prior standard deviations of all amplitudes ``(d,)``."""
        every = np.full(len(self.columns), self.sd)
        every[self.n_amplitudes :] = self.sd if self.discrepancy_sd is None else self.discrepancy_sd
        return every

    @property
    def nuisance(self) -> tuple[Array, Array]:
        """Columns ``(d, n)`` and their prior standard deviations ``(d,)``, for a fit of other terms."""
        return self.columns, self.sds

    @cached_property
    def key(self) -> tuple[str, int, float, bool, int]:
        """Identity of a term, whatever its size: all sizes are summed.

        Two waves in an even rhythm of touches may be equal in all their sums, so that the numbers themselves count.
        """
        numbers = zlib.crc32(np.ascontiguousarray(self.columns).data)
        return self.candidate.label, self.atom, round(self.log_prior, 6), self.correlated, numbers


@dataclass(frozen=True, eq=False)
class Problem:
    """Residuals with all candidates for their causes.

    Parameters
    ----------
    residual_um : residuals ``(n,)``
    scale_um : stated standard deviation of one reading
    certified, certified_u : nuisance columns ``(f, n)`` and the standard uncertainty stated of each, um
    free : nuisance columns ``(p, n)`` without prior knowledge
    known_um : nuisance columns ``(c, n)`` as large as their standard uncertainties, um; None for none
    order : rows in the order of reading
    gap : time between neighbours in that order over the typical one ``(n - 1,)``, infinite across a break
    growing : covariates from 0 to 1 with which the scatter may grow
    step_um : resolution to which the readings are rounded, 0 for none
    group : set of repeats that a row belongs to
    candidates : laws and forms
    in_part : from a law and the number of a shape, the same law in parts of the record only; None for no such laws
    latched_um : standard deviation of every row ``(n,)`` by the latch of its controller, which its repeats may share
    stated : variance of every row ``(n,)`` over ``scale_um`` squared, as far as it is known beforehand to differ
    """

    residual_um: Array
    scale_um: float
    certified: Array
    certified_u: Array
    free: Array
    order: NDArray[np.intp]
    gap: Array
    growing: Mapping[str, Array]
    step_um: float
    group: NDArray[np.intp]
    candidates: Sequence[Candidate]
    in_part: Callable[[Law, int], Sequence[Law]] | None = None
    latched_um: Array | float = 0.0
    stated: Array | float = 1.0
    known_um: Array | None = None

    def __len__(self) -> int:
        return len(self.residual_um)

    @cached_property
    def grouped(self) -> Array:
        """Columns ``(g, n)`` of the sets of repeats."""
        return (self.group == np.arange(self.group.max() + 1)[:, None]).astype(float)

    def flicker(self, share: float) -> Array:
        """What makes rows with this share of 1/f noise independent ``(n, n)``, in the order of reading.

        It is the inverse of the root of their correlation matrix.
        """
        if share not in self._flickers:
            correlation = share * self._relaxing + (1.0 - share) * np.eye(len(self))
            root = np.linalg.cholesky(correlation)
            self._flickers[share] = np.asarray(solve_triangular(root, np.eye(len(self)), lower=True))
        return self._flickers[share]

    @cached_property
    def _flickers(self) -> dict[float, Array]:
        return {}

    @cached_property
    def _relaxing(self) -> Array:
        """Correlation of 1/f noise between any two rows in the order of reading, none across a break.

        A sum of relaxations whose time constants are evenly spaced on a logarithmic scale (McWhorter, Semiconductor
        Surface Physics 1957: 207), from half a touch to the whole record.
        """
        after = np.r_[0.0, np.cumsum(np.where(np.isfinite(self.gap), self.gap, 0.0))]
        part = np.r_[0, np.cumsum(np.isinf(self.gap))]
        apart = np.abs(after[:, None] - after)
        times = 0.5 * 2.0 ** np.arange(2 + int(np.ceil(np.log2(max(apart.max(), 1.0)))))
        alike = np.zeros_like(apart)
        for time in times:  # one at a time: of three thousand rows each has 70 MB
            alike += np.exp(-apart / time)
        return np.asarray(alike / len(times) * (part[:, None] == part))

    @cached_property
    def rounded_um(self) -> Array:
        """Standard deviation of what the rows of a set of repeats have in common if they are rounded alike, ``(g,)``.

        That of a step of the display and of a latch. Zero where neither is known.
        """
        latched = np.bincount(self.group, np.broadcast_to(np.square(self.latched_um), self.group.shape))
        return np.sqrt(self.step_um**2 / 12.0 + latched / np.maximum(np.bincount(self.group), 1))

    @cached_property
    def steps_um(self) -> float:
        """The step in which repeats differ, 0 where they differ by anything, or not at all.

        Readings on the steps of a display repeat exactly, or differ by a step and more. They scatter by no less than a
        step over the root of twelve (GUM F.2.2.1): with tails for those that differ the scatter would vanish.
        """
        order = np.argsort(self.group, kind="stable")
        apart = np.abs(np.diff(self.residual_um[order]))[np.diff(self.group[order]) == 0]
        same = apart < SAME * self.scale_um
        few = same.all() or float(same.mean()) < REPEATING
        return 0.0 if few else float(np.median(apart[~same]))

    @cached_property
    def least_um(self) -> float:
        """The least standard deviation that a reading may have, um."""
        return max(self.steps_um / float(np.sqrt(12.0)), LEAST_SCATTER * self.scale_um)

    @property
    def typical(self) -> float:
        """Standard deviation of a typical row, as it is stated, over ``scale_um``."""
        return float(np.sqrt(np.median(self.stated)))

    @cached_property
    def within_um(self) -> float:
        """Standard deviation within the sets of repeats; that of all rows if there are too few repeats.

        Of rows that are known to scatter more, as they would scatter if they did not.
        """
        found = self.repeating_um(self.residual_um)
        return max(float((self.residual_um / np.sqrt(self.stated)).std()) if found is None else found, self.least_um)

    def repeating_um(self, um: Array, variance: Array | None = None) -> float | None:
        """Standard deviation of values ``(n,)`` within the sets of repeats, as :attr:`within_um`; None if too few.

        ``variance``: of every row, over that of an ordinary one; without it as it is stated.
        """
        weight = 1.0 / np.broadcast_to(self.stated if variance is None else variance, um.shape)
        dof = int((np.maximum(np.bincount(self.group), 1) - 1).sum())
        if dof < FEWEST_REPEATS:
            return None
        every = np.maximum(np.bincount(self.group, weight), 1e-300)
        mean = np.bincount(self.group, um * weight) / every
        return float(np.sqrt(((um - mean[self.group]) ** 2 * weight).sum() / dof))


def renumbered(terms: tuple[Term, ...]) -> tuple[Term, ...]:
    """The terms with second ones as first ones where these are not there."""
    there = {term.candidate.label for term in terms}
    return tuple(
        term
        if (first := term.candidate.first) is None or first.label in there
        else replace(term, candidate=first, log_prior=term.log_prior + first.log_odds - term.candidate.log_odds)
        for term in terms
    )


def residual_columns(columns: Array, others: Array) -> Array:
    """Columns ``(d, n)`` without what they have in common with others ``(m, n)``."""
    return np.asarray(columns - (columns @ np.linalg.pinv(others)) @ others)


def slices(counts: Iterable[int]) -> list[slice]:
    """The parts of an array that is put together of some, one after the other."""
    ends = np.cumsum([0, *counts]).tolist()
    return [slice(a, b) for a, b in pairwise(ends)]


def company_log_prior(terms: Iterable[Term]) -> float:
    """What the log prior of terms rises by where several are of a kind that comes together."""
    kinds = defaultdict[str, list[float]](list)
    for term in terms:
        if term.candidate.again:
            kinds[term.candidate.kind].append(term.candidate.again)
    return sum(sum(own) - min(own) for own in kinds.values() if len(own) > 1)
