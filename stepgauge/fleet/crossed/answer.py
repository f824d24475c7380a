"""The answer of an inference: in a line, as a table, as JSON for other programs, as a report to read."""

from __future__ import annotations

import datetime
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stepgauge import __version__
from stepgauge.files.shown import Summarized, as_lines
from stepgauge.files.text import write_json, write_text
from stepgauge.fleet.crossed.background import Background
from stepgauge.fleet.crossed.causes import Cause, VisitCandidates
from stepgauge.fleet.crossed.priors import fleet_priors
from stepgauge.fleet.crossed.result import Found, Rival
from stepgauge.fleet.crossed.single_effects import SingleEffect
from stepgauge.fleet.crossed.visits import Crossing, Visit

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]
FORMAT = "stepgauge fleet inference 1"
DAY_0 = datetime.date(1970, 1, 1)
COUNTERPART = {"machine": "gauge", "gauge": "machine", "type": "gauge", "hall": "gauge", "probe": "machine"}
"""Who changes while an owner stays, so that a cause is seen to be the owner's."""
SHOWN = 4
WORDS = {
    "scale": "scale of {where}",
    "squareness": "squareness of {where}",
    "reversal": "reversal of {where}",
    "periodic": "periodic error of {where}",
    "local_scale": "place of the scale of {where}",
    "certificate_scale": "length of the gauge as a whole",
    "gauge_expansion": "expansion of the gauge",
    "block": "block {where}",
    "wear": "wear of the {where}",
    "temperature": "temperature of the gauges",
    "radius": "radius of the tip",
}
WORN = {"fronts": "fronts", "used": "used blocks"}


@dataclass(frozen=True)
class Number:
    """One number of every visit (its slope, its block size), and how it was explained.

    ``value (visits,)``; ``unit``: by kind and place, what a unit of a machine's error makes of it ``(visits,)``.
    """

    found: list[Found]
    value: Array
    unit: Mapping[tuple[str, str], Array]
    background: Background
    candidates: VisitCandidates
    effects: Sequence[SingleEffect]
    scatter: Mapping[str, float]

    def explained(self, which: Callable[[Cause], bool] = lambda _: True) -> Array:
        """What some causes make of every visit."""
        total = np.zeros(len(self.value))
        for effect in self.effects:
            kept = np.array([which(self.candidates.causes[row]) for row in effect.rows])
            if kept.any():
                total += self.candidates.fit(effect.rows, effect.probability * effect.share * effect.mean * kept)
        return total


@dataclass(frozen=True)
class FleetInference(Summarized):
    """``causes``: named ones, the likeliest first; ``false_share``: expected share of false ones among them;
    ``scatter``: standard deviations of what is nothing wrong, by name; ``alone``: single visits that are wrong;
    ``left_out``: why some recordings are not in it, a line each."""

    causes: tuple[Found, ...]
    false_share: float
    scatter: Mapping[str, float]
    fleet: Crossing = field(repr=False)
    alone: tuple[Found, ...] = field(default=(), repr=False)
    slopes: Number | None = field(default=None, repr=False)
    sizes: Number | None = field(default=None, repr=False)
    left_out: tuple[str, ...] = ()

    def summary(self) -> str:
        """How many visits, and every cause in a line."""
        names = self.fleet.names
        first = (
            f"{len(self.fleet)} visits of {len(names['gauge'])} gauges to {len(names['machine'])} machines: "
            f"{len(self.causes)} causes, of which {self.false_share * len(self.causes):.1f} are expected to be false"
        )
        return as_lines(first, *map(cause_line, self.causes))

    def to_frame(self) -> pd.DataFrame:
        """One row per cause."""
        import pandas as pd

        rows = [
            {name: value for name, value in cause_dict(one, self.fleet).items() if not isinstance(value, list | dict)}
            for one in self.causes
        ]
        return pd.DataFrame(rows)

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON types."""
        return {
            "format": FORMAT,
            "stepgauge": __version__,
            "visits": len(self.fleet),
            "expected_false_share": self.false_share,
            "causes": [cause_dict(one, self.fleet) for one in self.causes],
            "alone": [_alone(one, self.fleet) for one in self.alone],
            "in_order": dict(self.scatter),
        }

    def write(self, path: str | Path) -> list[Path]:
        """Write the JSON file and, beside it, the report as Markdown; returns their paths."""
        paths = [Path(path), Path(path).with_suffix(".md")]
        write_json(paths[0], self.as_dict())
        write_text(paths[1], "\n".join(report_lines(self)) + "\n")
        return paths


def unit_of(owner_kind: str, kind: str) -> str:
    """The unit of a cause's size."""
    return fleet_priors().kinds[owner_kind][kind].unit


def words_of(kind: str, where: str) -> str:
    """What is wrong, in words."""
    return WORDS[kind].format(where=WORN.get(where, where))


def cause_line(one: Found) -> str:
    """Owner, what is wrong, size with U (k = 2), since when, probability."""
    size = f"{one.size:+.3g} {unit_of(one.owner_kind, one.kind)} (U = {2.0 * one.u:.2g})"
    others = ", ".join(
        f"{rival.owner_kind} {rival.owner} ({words_of(rival.kind, rival.where)})" for rival in one.instead
    )
    either = f"; or instead: {others}" if others else ""
    head = f"{one.owner_kind} {one.owner}: {words_of(one.kind, one.where)} {size}{_when(one)}"
    return f"{head}, probability {one.probability:.3f}{either}"


def _when(one: Found) -> str:
    if one.begin is None:
        return ""
    first, last = map(date_text, one.begin)
    return f", growing from {first} on" if one.course == "growing" else f", since {first} to {last}"


def date_text(day: float) -> str:
    """The ISO date of a day."""
    return (DAY_0 + datetime.timedelta(days=int(day))).isoformat()


def cause_dict(one: Found, fleet: Crossing) -> dict[str, Any]:
    """A cause in JSON types; ``where`` and ``instead`` only where there is something to say."""
    first, last = (None, None) if one.begin is None else map(date_text, one.begin)
    said: dict[str, Any] = {"owner_kind": one.owner_kind, "owner": one.owner, "kind": one.kind}
    if one.where:
        said["where"] = one.where.split()[0] if one.kind == "local_scale" else one.where
        if one.kind == "local_scale":
            said["at"] = one.where.partition(" ")[2]
    numbers = {"size": one.size, "u": one.u, "unit": unit_of(one.owner_kind, one.kind), "probability": one.probability}
    said |= {"course": one.course, "from": first, "to": last, **numbers}
    if one.instead:
        said["instead"] = [_rival(rival) for rival in one.instead]
        said["would_settle"] = would_settle(one)
    said["settled_by"] = settled_by(one, fleet)
    return said


def _rival(rival: Rival) -> dict[str, Any]:
    where = {"where": rival.where} if rival.where else {}
    named = {"owner_kind": rival.owner_kind, "owner": rival.owner, "kind": rival.kind}
    return {**named, **where, "probability": rival.probability}


def _alone(one: Found, fleet: Crossing) -> dict[str, Any]:
    visit = fleet.visits[int(one.owner)]
    named = {"recording": visit.recording, "placement": visit.statistics.placement, "kind": one.kind}
    return {**named, "size": one.size, "u": one.u, "probability": one.probability}


def settled_by(one: Found, fleet: Crossing) -> dict[str, list[dict[str, str]]]:
    """``with``: the most telling visit of the owner with each counterpart; ``without``: counterparts elsewhere.

    What shows with several counterparts, and not where these are without the owner, is the owner's.
    """
    counterpart = COUNTERPART[one.owner_kind]
    best: dict[str, Visit] = {}
    for number in one.visits:
        visit = fleet.visits[number]
        best.setdefault(getattr(visit, counterpart), visit)
    there = list(best.items())[:SHOWN]
    elsewhere = [_elsewhere(name, counterpart, one, fleet) for name, _ in there]
    return {
        "with": [_said(visit) for _, visit in there],
        "without": [_said(visit) for visit in elsewhere if visit is not None],
    }


def _elsewhere(name: str, counterpart: str, one: Found, fleet: Crossing) -> Visit | None:
    rows = fleet.of(counterpart, name)
    return next((fleet.visits[row] for row in rows if getattr(fleet.visits[row], one.owner_kind) != one.owner), None)


def _said(visit: Visit) -> dict[str, str]:
    return {"recording": visit.recording, "machine": visit.machine, "gauge": visit.gauge, "date": date_text(visit.day)}


def would_settle(one: Found) -> str:
    """The measurement that would tell the cause from its rivals."""
    kinds = {one.owner_kind: one.owner} | {rival.owner_kind: rival.owner for rival in one.instead}
    if len(kinds) == 1:
        return f"measure each {one.owner_kind} of them without the others"
    ways = [f"{kind} {owner} without {_others(kinds, kind)}" for kind, owner in kinds.items()]
    return f"measure {' or '.join(ways)}"


def _others(kinds: Mapping[str, str], mine: str) -> str:
    return " and ".join(f"{kind} {owner}" for kind, owner in kinds.items() if kind != mine)


def report_lines(found: FleetInference) -> Iterator[str]:
    """The report as Markdown."""
    names = found.fleet.names
    count = ", ".join(f"{len(names[kind])} {kind}s" for kind in ("machine", "type", "hall", "gauge", "probe"))
    yield "# What the fleet tells"
    yield ""
    yield f"{len(found.fleet)} visits; {count}. Of the {len(found.causes)} causes below, "
    yield f"{found.false_share * len(found.causes):.1f} are expected to be false. U: expanded uncertainty, k = 2."
    yield ""
    yield "| owner | what is wrong | size | U | unit | began | probability |"
    yield "|---|---|---|---|---|---|---|"
    for one in found.causes:
        began = _when(one).removeprefix(", ") or "before the first visit"
        cells = (f"{one.size:+.3g}", f"{2.0 * one.u:.2g}", unit_of(one.owner_kind, one.kind), began)
        wrong = words_of(one.kind, one.where)
        yield f"| {one.owner_kind} {one.owner} | {wrong} | {' | '.join(cells)} | {one.probability:.3f} |"
    yield from _open_lines([one for one in found.causes if one.instead])
    yield from _settled_lines(found)
    yield from _order_lines(found)


def _open_lines(left: Sequence[Found]) -> Iterator[str]:
    if left:
        yield from ("", "## What the fleet cannot tell apart", "")
    for one in left:
        rivals = ", ".join(f"{rival.owner_kind} {rival.owner} ({rival.probability:.2f})" for rival in one.instead)
        mine = f"{one.owner_kind} {one.owner}, {words_of(one.kind, one.where)}"
        yield f"- {mine}, or {rivals}. To settle it, {would_settle(one)}."


def _settled_lines(found: FleetInference) -> Iterator[str]:
    yield from ("", "## By which recordings", "")
    for one in found.causes:
        both = settled_by(one, found.fleet)
        seen, unseen = (", ".join(f"{v['recording']} ({v['machine']}, {v['gauge']})" for v in both[k]) for k in both)
        without = f"; without it: {unseen}" if unseen else ""
        yield f"- {one.owner_kind} {one.owner}, {words_of(one.kind, one.where)}: {seen}{without}"


def _order_lines(found: FleetInference) -> Iterator[str]:
    yield from ("", "## What is nothing wrong", "", "Standard deviations, estimated over the fleet.", "")
    for name, sd in found.scatter.items():
        yield f"- {name}: {sd:.2g}"
