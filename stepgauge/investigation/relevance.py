"""What matters beside an answer: a companion too small to change it does not make another answer of it.

A part of a hypothesis matters where it displaces a reading, somewhere within reach, by a third of what the leading
hypothesis displaces one, or by more than a reading is uncertain, whichever is less: a third adds 5 % in quadrature.
Beside the answer that there is nothing, everything matters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.further_runs import ExtendedRecording
from stepgauge.diagnosis.hypotheses import Predicting, RivalHypothesis, Searched
from stepgauge.diagnosis.priors import Priors
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.inference.design import Prediction, distances

Answer = tuple[frozenset[str], bool]
"""The laws that are there, and whether there is something else."""
SHARE = 1.0 / 3.0
"""Share of what the answer displaces from which on a companion of it matters."""
NOTHING = RivalHypothesis((), 0.0)


@dataclass(frozen=True)
class Foreseen:
    """A run that can be made, and how far what two hypotheses predict is apart, each ``(h, h)``.

    ``distance``: chi-square of the readings of the run; ``apart_um``: at most in a reading, those so far included,
    beside the origins.
    """

    more: ExtendedRecording
    distance: Array
    apart_um: Array


@dataclass(frozen=True)
class Foresight:
    """All runs within reach; ``matters_um``: the least displacement that matters; ``answers``: see :func:`answers`."""

    runs: tuple[Foreseen, ...]
    possible: tuple[RivalHypothesis, ...]
    matters_um: float
    answers: tuple[Answer, ...]

    @property
    def settled(self) -> float:
        """Probability of the most probable answer."""
        sums: dict[Answer, float] = {}
        for answer, one in zip(self.answers, self.possible, strict=True):
            sums[answer] = sums.get(answer, 0.0) + one.probability
        return max(sums.values(), default=0.0)

    @property
    def same(self) -> NDArray[np.bool_]:
        """Which hypotheses are one answer, ``(h, h)``."""
        return np.array([[one == other for other in self.answers] for one in self.answers])


def foresee(
    found: Searched, possible: Sequence[RivalHypothesis], priors: Priors, runs: Sequence[ExtendedRecording]
) -> Foresight:
    """What the hypotheses predict for each run, and which of them are one answer; runs that cannot be computed go."""
    predicting, every = Predicting(found, [*possible, NOTHING], priors), list[Foreseen]()
    for more in runs:
        try:
            every.append(_foreseen(more, predicting(more), len(found.data)))
        except InputError:
            continue
    h = len(possible)
    apart_um = np.max([one.apart_um for one in every], axis=0) if every else np.zeros((h + 1, h + 1))
    least_um = min(SHARE * float(apart_um[0, -1]), _uncertain_um(found)) if possible[0].parts else 0.0
    return Foresight(tuple(every), tuple(possible), least_um, answers(possible, apart_um, least_um))


def _foreseen(more: ExtendedRecording, predictions: Sequence[Prediction], n_old: int) -> Foreseen:
    """Of all hypotheses and, the last one, of nothing, from which the distance is not asked for."""
    means = more.data.without_origins(np.array([one.mean_um for one in predictions]))
    apart_um = np.array([np.abs(means - one).max(axis=1) for one in means])
    new = np.arange(len(more.data)) >= n_old
    return Foreseen(more, distances(predictions[:-1], new, more.metric), apart_um)


def _uncertain_um(found: Searched) -> float:
    """Standard uncertainty of a typical reading against the certificate, um."""
    problem = found.search.problem
    return float(np.hypot(found.model.state.sigma_um * problem.typical, np.median(problem.certified_u)))


def answers(possible: Sequence[RivalHypothesis], apart_um: Array, least_um: float) -> tuple[Answer, ...]:
    """The answer that each hypothesis is: that of the most probable one that has some of its parts, and no others.

    Only one that is less than ``least_um`` apart counts; which form an unknown rest has is not asked for.
    """
    labels = [frozenset(part.candidate.label for part in one.parts) for one in possible]
    found = []
    for i, own in enumerate(labels):
        inside = [j for j, other in enumerate(labels) if other < own and apart_um[i, j] < least_um]
        found.append(_answer(possible[max(inside, key=lambda j: possible[j].probability, default=i)]))
    return tuple(found)


def _answer(one: RivalHypothesis) -> Answer:
    laws = frozenset(part.candidate.source.label for part in one.parts if part.candidate.named)
    return laws, any(not part.candidate.named for part in one.parts)
