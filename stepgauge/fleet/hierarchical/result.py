"""What an inference over a fleet says: causes with owner, size, date, probability, and what else they may be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from stepgauge.files.arrays import Array
from stepgauge.fleet.hierarchical.causes import Cause
from stepgauge.fleet.hierarchical.priors import FleetPriors
from stepgauge.fleet.hierarchical.single_effects import SingleEffect
from stepgauge.fleet.hierarchical.visits import Crossing

MOST_RIVALS = 3
"""What more owners share is not stated as a set: it only makes the cause less probable."""


@dataclass(frozen=True)
class AlternativeCause:
    """Another cause that explains the same, with its probability."""

    owner_kind: str
    owner: str
    kind: str
    where: str
    probability: float


@dataclass(frozen=True)
class NamedCause:
    """A cause that was named.

    ``begin``: first and last day on which it may have begun, None where it was there in the first visit; ``u``:
    standard uncertainty of ``size``; ``instead``: rivals that the fleet cannot exclude; ``visits``: numbers of those
    that show it, the most telling first.
    """

    owner_kind: str
    owner: str
    kind: str
    where: str
    course: str
    begin: tuple[float, float] | None
    size: float
    u: float
    probability: float
    instead: tuple[AlternativeCause, ...] = ()
    visits: tuple[int, ...] = ()

    @property
    def key(self) -> tuple[str, str, str, str]:
        """Whose, what and where."""
        return (
            self.owner_kind,
            self.owner,
            self.kind,
            self.where.split()[0] if self.kind == "local_scale" else self.where,
        )


def told(
    effect: SingleEffect, causes: Sequence[Cause], fleet: Crossing, shown: Array, priors: FleetPriors
) -> NamedCause:
    """One effect as a cause: its likeliest owner, and who else it may be.

    ``shown (visits,)``: how much of it a visit shows, in standard deviations of the visit.
    """
    own = [causes[row] for row in effect.rows]
    owners: dict[tuple[str, str], float] = {}
    for cause, share in zip(own, effect.share, strict=True):
        key = (cause.owner_kind, cause.owner)
        owners[key] = owners.get(key, 0.0) + float(share)
    best = max(owners, key=lambda key: owners[key])
    mine = np.array([(cause.owner_kind, cause.owner) == best for cause in own])
    top = _top(own, effect.share * mine)
    same = mine & np.array([(c.kind, c.where) == (top.kind, top.where) for c in own])
    weight = effect.share * same / (effect.share * same).sum()
    size = float(weight @ effect.mean)
    u = float(np.sqrt(max(weight @ (effect.u**2 + effect.mean**2) - size**2, 0.0)))
    rivals = _rivals(own, effect, owners, best, priors)
    day = fleet.day[fleet.of(top.owner_kind, top.owner)]
    begin = _begin(own, weight, day, float(fleet.day.min()), priors)
    held = owners[best] + sum(owners[rival.owner_kind, rival.owner] for rival in rivals)
    probability = min(effect.probability * held, 1.0)
    visits = np.argsort(-shown, kind="stable")[: int((shown > 0.0).sum())]
    named = (top.owner_kind, top.owner, top.kind, top.where, top.course)
    return NamedCause(*named, begin, size, u, probability, rivals, tuple(visits.tolist()))


def _top(own: Sequence[Cause], share: Array) -> Cause:
    """The likeliest kind and place of an owner, over all dates, and of it the likeliest course."""
    total: dict[tuple[str, str], float] = {}
    for cause, part in zip(own, share, strict=True):
        total[cause.kind, cause.where] = total.get((cause.kind, cause.where), 0.0) + float(part)
    kind, where = max(total, key=lambda key: total[key])
    rows = [row for row, cause in enumerate(own) if share[row] > 0.0 and (cause.kind, cause.where) == (kind, where)]
    return own[max(rows, key=lambda row: share[row])]


def _rivals(
    own: Sequence[Cause],
    effect: SingleEffect,
    owners: dict[tuple[str, str], float],
    best: tuple[str, str],
    priors: FleetPriors,
) -> tuple[AlternativeCause, ...]:
    """Other owners, until those that are told hold enough of the probability."""
    rivals, held = list[AlternativeCause](), owners[best]
    for owner in sorted(owners, key=lambda key: -owners[key]):
        if held >= priors.decision.settled or len(rivals) == MOST_RIVALS:
            break
        if owner == best or owner[0] == "visit":
            continue
        mine = np.array([(cause.owner_kind, cause.owner) == owner for cause in own])
        top = _top(own, effect.share * mine)
        rivals.append(AlternativeCause(*owner, top.kind, top.where, effect.probability * owners[owner]))
        held += owners[owner]
    return tuple(rivals)


def _begin(
    own: Sequence[Cause], weight: Array, day: Array, first: float, priors: FleetPriors
) -> tuple[float, float] | None:
    """Between which days it began: of the dates of its course those that hold enough of the probability."""
    dated = np.array(
        [cause.day if cause.course in ("since", "growing") and cause.day > first else -np.inf for cause in own]
    )
    if weight[np.isinf(dated)].sum() > 0.5:
        return None
    order = np.argsort(np.where(np.isinf(dated), np.inf, dated))
    part = np.where(np.isinf(dated), 0.0, weight)[order]
    total = np.cumsum(part) / part.sum()
    tail = (1.0 - priors.decision.interval) / 2.0
    low = dated[order][int(np.searchsorted(total, tail))]
    high = dated[order][min(int(np.searchsorted(total, 1.0 - tail)), len(order) - 1)]
    earlier = day[day < low]
    return (float(earlier.max()) if earlier.size else float(low)), float(high if np.isfinite(high) else low)


def merged(found: Sequence[NamedCause]) -> list[NamedCause]:
    """One entry for every owner, kind and place: effects that share them are one cause that changed more than once."""
    by_key: dict[tuple[str, str, str, str], NamedCause] = {}
    for one in sorted(found, key=lambda entry: -entry.probability):
        known = by_key.get(one.key)
        if known is None:
            by_key[one.key] = one
        else:
            by_key[one.key] = replace(known, probability=1.0 - (1.0 - known.probability) * (1.0 - one.probability))
    return list(by_key.values())


def named(found: Sequence[NamedCause], priors: FleetPriors) -> list[NamedCause]:
    """The likeliest causes, as many as keep the expected share of false ones within what is stated."""
    likely = sorted(
        (one for one in found if one.probability >= priors.decision.named), key=lambda one: -one.probability
    )
    false = np.cumsum([1.0 - one.probability for one in likely])
    return [one for number, one in enumerate(likely) if false[number] / (number + 1) <= priors.decision.false_share]
