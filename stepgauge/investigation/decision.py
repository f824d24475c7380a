"""What is known after a run, and which run would tell most per minute: the rules by which an investigation goes on.

It ends when the answer stands (its odds are at least those asked for, the gauge was laid in two directions, and no run
within reach tells enough of what is hidden so far and matters), or when no run within reach tells enough.

What could be there and not have shown yet: laws of usual size to which the recording so far is blind.

A law whose amplitude is normal with variance s (in units of what the readings tell) moves new readings by an amount
that has this variance. The Bhattacharyya distance to readings without the law is then

    B = ln(1 + s / 2) / 2 - ln(1 + s) / 4

for every amplitude, s being what the new readings add to what the old ones have told. exp(-B) bounds the chance to
mistake one for the other.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import special

from stepgauge.diagnosis.design import LEAST_NATS
from stepgauge.diagnosis.engine import diagnose_with_search
from stepgauge.diagnosis.further_runs import ExtendedRecording, FurtherRun, extended, independent_metric
from stepgauge.diagnosis.hypotheses import RivalHypothesis, hypotheses
from stepgauge.diagnosis.laws.candidates import law_candidates
from stepgauge.diagnosis.priors import Priors, shipped_priors
from stepgauge.diagnosis.residuals import make_residuals
from stepgauge.diagnosis.result import GaugeDiagnosis
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.inference.design import expected_information_gain
from stepgauge.inference.metric import Metric
from stepgauge.inference.problem import Law
from stepgauge.investigation.feasible_runs import Costed, Reach, cost_runs, directions, possible_runs, run_json
from stepgauge.investigation.relevance import Foreseen, Foresight, foresee
from stepgauge.machine.file import Machine
from stepgauge.recording import Recording

TINY = 1e-300
SHAPES = 12
"""Shapes of a law that are looked at, spread over all: a mean over them is asked for, no more."""


@dataclass(frozen=True)
class Unseen:
    """Laws with the odds that they are there and have not shown, and how far a run would show each.

    ``odds (k,)`` against nothing more being there; ``overlap (k,)``: chance to mistake its readings, 1 where the run is
    blind to the law, too.
    """

    kinds: tuple[str, ...]
    odds: Array
    overlap: Array

    @property
    def chance(self) -> float:
        """Chance that the run shows a law that has not shown yet."""
        return float((self.odds * (1.0 - self.overlap)).sum() / (1.0 + self.odds.sum()))

    @property
    def nats(self) -> float:
        """Least expected information about whether one of them is there, nats."""
        p = np.r_[1.0, self.odds] / (1.0 + self.odds.sum())
        mixed = np.r_[p[0] + p[1:] @ self.overlap, p[0] * self.overlap + p[1:].sum()]
        return float(max(-(p * np.log(mixed)).sum(), 0.0))

    def most(self, count: int) -> list[str]:
        """The kinds that the run would most probably show."""
        weight = self.odds * (1.0 - self.overlap)
        ranked: dict[str, float] = {}
        for kind, value in zip(self.kinds, weight, strict=True):
            ranked[kind] = ranked.get(kind, 0.0) + float(value)
        return sorted(ranked, key=lambda kind: -ranked[kind])[:count]


def unseen(
    more: ExtendedRecording,
    n_old: int,
    priors: Priors,
    without: Collection[str] = (),
    named: Collection[str] = (),
    least_um: float = 0.0,
) -> Unseen:
    """Laws that a run may show, where the recording so far is its first ``n_old`` rows.

    ``without``: kinds that are known not to be there; ``named``: labels of laws that are there; ``least_um``: laws that
    displace no reading by more do not count.
    """
    old = np.arange(len(more.data)) < n_old
    before = independent_metric(more.data.at(old), more.metric.sigma_um)
    laws = [law for law in law_candidates(more.data, priors, more.metric, without) if law.label not in named]
    told = [_told(law, more, before, old, least_um) for law in laws]
    odds = [np.exp(law.log_odds) * one[0] for law, one in zip(laws, told, strict=True)]
    return Unseen(tuple(law.kind for law in laws), np.array(odds), np.array([one[1] for one in told]))


def _told(
    law: Law, more: ExtendedRecording, before: Metric, old: NDArray[np.bool_], least_um: float
) -> tuple[float, float]:
    """By how much the old rows have lowered the odds of a law that matters, and how far the new ones overlap."""
    shown = np.unique(np.linspace(0, law.atoms - 1, min(law.atoms, SHAPES)).astype(int))
    columns = np.stack([law.columns(int(atom))[: law.dimension] for atom in shown])  # without its tolerance
    whole, first = (more.metric(columns) ** 2).sum(axis=2), (before(columns[:, :, old]) ** 2).sum(axis=2)
    weight = np.exp(law.sizes.log_weight)
    s_old = first[..., None] * law.sizes.sd**2
    s_new = np.maximum((1.0 + whole[..., None] * law.sizes.sd**2) / (1.0 + s_old) - 1.0, 0.0)
    # a law that would have shown and did not is less probable by its evidence, on average the square root of 1 + s
    kept = (1.0 + s_old).prod(axis=1) ** -0.5
    overlap = np.exp(-0.5 * np.log1p(s_new / 2.0) + 0.25 * np.log1p(s_new)).prod(axis=1)
    largest_um = np.abs(more.data.without_origins(columns)).max(axis=2)[..., None] * law.sizes.sd / np.sqrt(1.0 + s_old)
    matters = 1.0 - special.erf(least_um / np.maximum(np.sqrt(2.0) * largest_um, TINY)).prod(axis=1)
    share = kept * weight * matters
    total = float(share.sum())
    return total / len(shown), float((share * overlap).sum()) / max(total, TINY)


TOLD_APART = 9.0
"""Chi-square from which a run is said to tell two hypotheses apart."""
SHOWN = 4
"""Hypotheses, kinds and runs that are told of a step."""
TIME_OVER = "the time is over"
"""Why an investigation ends that goes on when it is given more minutes."""

NOTHING = Unseen((), np.zeros(0), np.zeros(0))


@dataclass(frozen=True)
class Case:
    """What is investigated, and how far.

    ``odds``: at which an answer stands; ``minutes``: of machine and hands in all; ``without``: kinds of effects that
    are known not to be there.
    """

    gauge: Gauge
    machine: Machine
    reach: Reach = field(default_factory=Reach)
    odds: float = 20.0
    minutes: float = 60.0
    without: tuple[str, ...] = ()
    priors: Priors = field(default_factory=shipped_priors)

    @property
    def sure(self) -> float:
        """The probability that these odds are."""
        return self.odds / (1.0 + self.odds)


@dataclass(frozen=True)
class Rated:
    """A run with its cost, and what it is expected to tell: of the rivals, and of what has not shown yet (nats)."""

    run: FurtherRun
    machine_minutes: float
    minutes: float
    rivals_nats: float
    told: tuple[str, ...]
    hidden: Unseen

    @property
    def nats(self) -> float:
        """What the run is expected to tell in all, nats."""
        return self.rivals_nats + self.hidden.nats

    def to_dict(self) -> dict[str, Any]:
        """For the journal and the story."""
        return {
            "run": run_json(self.run),
            "machine_minutes": round(self.machine_minutes, 2),
            "minutes": round(self.minutes, 2),
            "nats": self.nats,
            "rivals_nats": self.rivals_nats,
            "tells_apart": list(self.told),
            "chance_hidden": self.hidden.chance,
            "may_show": self.hidden.most(SHOWN),
        }


@dataclass(frozen=True)
class InvestigationState:
    """The diagnosis of all runs so far, and the further runs, the one that tells most per minute first.

    ``late``: runs that the time left is too short for, which are not rated; ``settled``: probability of the most
    probable answer; ``matters_um``: what displaces no reading by more makes no other answer of it.
    """

    diagnosis: GaugeDiagnosis
    possible: tuple[RivalHypothesis, ...]
    rated: tuple[Rated, ...]
    late: tuple[FurtherRun, ...] = ()
    settled: float = 0.0
    matters_um: float = 0.0


def learn(
    case: Case, recording: Recording, placements: Sequence[Placement], done: Collection[str], spent_minutes: float = 0.0
) -> InvestigationState:
    """Diagnose everything that was measured, and rate the runs that are within reach.

    Parameters
    ----------
    recording : of all runs, joined
    placements : how the gauge was laid, in that order; the last one is how it lies
    done : words of the runs that were made or declined
    spent_minutes : of the case's minutes
    """
    data = make_residuals(recording, case.gauge, case.machine)
    diagnosis, found = diagnose_with_search(data, case.without, case.priors)
    runs = [run for run in possible_runs(data, placements, case.machine, case.reach) if run.words not in done]
    costed = list(cost_runs(runs, case.gauge, case.machine, case.reach))
    left_minutes = case.minutes - spent_minutes
    in_time = [one for one in costed if one.minutes <= left_minutes]
    late = tuple(one.run for one in costed if one.minutes > left_minutes)
    if found is None:
        return InvestigationState(diagnosis, (), tuple(_unrated(in_time)), late)
    more = extended(data, found.model.state.sigma_um, [one.run for one in in_time])
    foresight = foresee(found, hypotheses(found), case.priors, more)
    rated = sorted(rate(case, foresight, len(data), in_time), key=lambda one: -one.nats / one.minutes)
    return InvestigationState(
        diagnosis, foresight.possible, tuple(rated), late, foresight.settled, foresight.matters_um
    )


def _unrated(runs: Sequence[Costed]) -> list[Rated]:
    """Of too few readings nothing can be said but that more are needed: any run of whole cycles, the cheapest first."""
    rated = [Rated(*one, 1.0, (), NOTHING) for one in runs if one.run.blocks is None]
    return sorted(rated, key=lambda one: one.minutes)


def rate(case: Case, foresight: Foresight, n_old: int, runs: Sequence[Costed]) -> list[Rated]:
    """What each run would tell that follows ``n_old`` readings; runs that cannot be computed are left out."""
    costs = {one.run.words: one for one in runs}
    named = {part.candidate.label for part in foresight.possible[0].parts}
    rated = []
    for one in foresight.runs:
        nats, told = _expected_information(foresight, one)
        try:
            hidden = _find_unseen(case, foresight, one, n_old, named)
        except InputError:
            continue
        rated.append(Rated(*costs[one.more.run.words], nats, told, hidden))
    return rated


def _find_unseen(case: Case, foresight: Foresight, one: Foreseen, n_old: int, named: Collection[str]) -> Unseen:
    """What a run may show that those before were blind to: elsewhere, or at another speed."""
    run = one.more.run
    if run.stays and run.speed_mm_s is None:
        return NOTHING
    return unseen(one.more, n_old, case.priors, case.without, named, foresight.matters_um)


def _expected_information(foresight: Foresight, one: Foreseen) -> tuple[float, tuple[str, ...]]:
    """Expected information about the answer, nats, and the rivals that the run tells from the leading one."""
    p = np.array([each.probability for each in foresight.possible])
    distance = np.where(foresight.same, 0.0, one.distance)
    told = tuple(rival.words for rival, d in zip(foresight.possible, distance[0], strict=True) if d > TOLD_APART)
    return expected_information_gain(p, distance), told[:SHOWN]


@dataclass(frozen=True)
class End:
    """How an investigation ends: ``how`` is ``cause``, ``set``, ``adequate``, ``unknown`` or ``insufficient``."""

    how: str
    why: str
    stands: bool


def decide(case: Case, learnt: InvestigationState, placements: Sequence[Placement]) -> End | list[Rated]:
    """The end, or the runs to propose, the best first."""
    stands = _stands(case, learnt) and directions(placements) > 1
    worth = [one for one in learnt.rated if one.nats >= LEAST_NATS]
    shown = any(one.hidden.nats >= LEAST_NATS for one in learnt.rated)
    if stands and learnt.settled >= case.sure and not shown:
        return End(how(learnt.diagnosis), "the answer stands", True)
    if worth:
        return worth
    turned = [one for one in learnt.rated if not one.run.stays and directions([*placements, one.run.placement]) > 1]
    if directions(placements) < 2 and turned:
        return turned
    why = TIME_OVER if learnt.late else "no run within reach tells enough"
    return End(how(learnt.diagnosis), why, stands)


def _stands(case: Case, learnt: InvestigationState) -> bool:
    """Whether everything that is said, and matters, has the odds that were asked for."""
    diagnosis = learnt.diagnosis
    if diagnosis.verdict == "adequate":
        return bool(diagnosis.probabilities["adequate"] >= case.sure)
    if diagnosis.verdict != "effects":
        return False
    largest_um = (np.abs(diagnosis.data.without_origins(one.share_um)).max() for one in diagnosis.findings)
    told = zip(diagnosis.findings, largest_um, strict=True)
    return all(one.own >= case.sure or 0.0 < um < learnt.matters_um for one, um in told)


def how(diagnosis: GaugeDiagnosis) -> str:
    """``cause`` where everything that was found is named alone, ``set`` where rivals are left; else the verdict."""
    if diagnosis.verdict != "effects":
        return diagnosis.verdict
    alone = all(not (one.confounded_with or one.alternatives) for one in diagnosis.findings)
    return "cause" if alone else "set"
