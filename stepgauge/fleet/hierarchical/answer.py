"""The answer of an inference: in a line, as a table, as JSON for other programs, as a report to read."""

from __future__ import annotations

import datetime
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stepgauge import __version__
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.files.display import Plotted, join_lines
from stepgauge.files.notation import counted, rounded
from stepgauge.files.stored import WrittenResult
from stepgauge.files.text import write_json, write_text
from stepgauge.fleet.hierarchical.background import Background
from stepgauge.fleet.hierarchical.causes import Cause, VisitCandidates
from stepgauge.fleet.hierarchical.priors import fleet_priors
from stepgauge.fleet.hierarchical.result import AlternativeCause, NamedCause
from stepgauge.fleet.hierarchical.single_effects import SingleEffect
from stepgauge.fleet.hierarchical.visits import Crossing, Visit

if TYPE_CHECKING:
    import pandas as pd

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
class ExplainedNumber:
    """One number of every visit (its slope, its block size), and how it was explained.

    ``value (visits,)``; ``unit``: by kind and place, what a unit of a machine's error makes of it ``(visits,)``.
    """

    found: list[NamedCause]
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


@dataclass(frozen=True, repr=False)
class FleetInference(WrittenResult, Plotted):
    """``causes``: named ones, the likeliest first; ``false_share``: expected share of false ones among them;
    ``scatter``: standard deviations of what is nothing wrong, by name; ``alone``: single visits that are wrong;
    ``left_out``: why some recordings are not in it, a line each; ``looked_for``: by kinds of owner and cause, in how
    many owners."""

    causes: tuple[NamedCause, ...]
    false_share: float
    scatter: Mapping[str, float]
    fleet: Crossing = field(repr=False)
    alone: tuple[NamedCause, ...] = field(default=(), repr=False)
    slopes: ExplainedNumber | None = field(default=None, repr=False)
    sizes: ExplainedNumber | None = field(default=None, repr=False)
    left_out: tuple[str, ...] = ()
    looked_for: Mapping[tuple[str, str], int] = field(default_factory=dict, repr=False)
    simulated: bool = False
    """Whether any recording is of a virtual machine."""

    def summary(self) -> str:
        """How many visits, and every cause in a line."""
        names = self.fleet.names
        visits, causes = counted(len(self.fleet), "visit"), counted(len(self.causes), "cause")
        gauges, machines = counted(len(names["gauge"]), "gauge"), counted(len(names["machine"]), "machine")
        false = self.false_share * len(self.causes)
        first = f"{visits} of {gauges} to {machines}: {causes}, of which {false:.1f} are expected to be false"
        return join_lines(first, *(cause_line(cause_dict(one)) for one in self.causes))

    def to_frame(self) -> pd.DataFrame:
        """One row per cause."""
        import pandas as pd

        rows = map(cause_dict, self.causes)
        return pd.DataFrame([{name: value for name, value in row.items() if name != "instead"} for row in rows])

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON types."""
        return {
            "format": FORMAT,
            "stepgauge": __version__,
            "visits": len(self.fleet),
            "owners": {kind: len(names) for kind, names in self.fleet.names.items()},
            "expected_false_share": self.false_share,
            "causes": [cause_dict(one) | {"settled_by": settled_by(one, self.fleet)} for one in self.causes],
            "looked_for": [_looked_for(*key, count, self.causes) for key, count in self.looked_for.items()],
            "alone": [_alone(one, self.fleet) for one in self.alone],
            "in_order": dict(self.scatter),
            "left_out": list(self.left_out),
            "simulated": self.simulated,
        }

    def write(self, path: str | Path) -> list[Path]:
        """Write the JSON file and, beside it, the report; returns their paths.

        The suffix says which report: ``.html``, ``.pdf``, or Markdown for ``.json`` and ``.md``.
        """
        from stepgauge.reports.fleet import fleet_story
        from stepgauge.reports.render import markdown, write_report

        places, said = report_places(path), self.to_dict()
        with self.keeping():
            write_json(places[0], said)
            if places[1].suffix.lower() == ".md":
                write_text(places[1], markdown(fleet_story(said, drawn=False)))
            else:
                write_report(places[1], fleet_story(said))
        return places


def report_places(path: str | Path) -> list[Path]:
    """Where the JSON file and the report go (:class:`InputError` for a suffix that says neither)."""
    target = Path(path)
    if target.suffix.lower() not in (".json", ".md", ".html", ".pdf"):
        raise InputError(path, "not a kind of report", found=repr(target.suffix), expected=".json, .md, .html or .pdf")
    as_report = target.with_suffix(".md") if target.suffix.lower() == ".json" else target
    return [target.with_suffix(".json"), as_report]


def unit_of(owner_kind: str, kind: str) -> str:
    """The unit of a cause's size."""
    return fleet_priors().kinds[owner_kind][kind].unit


def words_of(said: Mapping[str, Any]) -> str:
    """What is wrong, in words, from a cause or a rival in JSON types."""
    where = " at ".join(str(said[name]) for name in ("where", "at") if name in said)
    return WORDS[said["kind"]].format(where=WORN.get(where, where))


def owner_of(said: Mapping[str, Any]) -> str:
    """``machine M3``, likewise."""
    return f"{said['owner_kind']} {said['owner']}"


def began(said: Mapping[str, Any]) -> str:
    """Since when, likewise; empty where it was there in the first visit."""
    if said["from"] is None:
        return ""
    if said["course"] == "growing":
        return f"grows from {said['from']} on"
    return f"between {said['from']} and {said['to']}"


def cause_line(said: Mapping[str, Any]) -> str:
    """Owner, what is wrong, size with U (k = 2), since when, probability, of a cause in JSON types."""
    size = f"{rounded(said['size'], 3, plus=True)} {said['unit']} (U = {rounded(2.0 * said['u'], 2)})"
    others = ", ".join(f"{owner_of(rival)} ({words_of(rival)})" for rival in said.get("instead", ()))
    either = f"; or instead: {others}" if others else ""
    since = f", {'' if said['course'] == 'growing' else 'began '}{began(said)}" if began(said) else ""
    return f"{owner_of(said)}: {words_of(said)} {size}{since}, probability {said['probability']:.3f}{either}"


def date_text(day: float) -> str:
    """The ISO date of a day."""
    return (DAY_0 + datetime.timedelta(days=int(day))).isoformat()


def cause_dict(one: NamedCause) -> dict[str, Any]:
    """A cause in JSON types; ``where`` and ``instead`` only where there is something to say."""
    first, last = (None, None) if one.begin is None else map(date_text, one.begin)
    said = _named(one)
    numbers = {"size": one.size, "u": one.u, "unit": unit_of(one.owner_kind, one.kind), "probability": one.probability}
    said |= {"course": one.course, "from": first, "to": last, **numbers}
    if one.instead:
        said["instead"] = [_rival(rival) for rival in one.instead]
        said["would_settle"] = would_settle(one)
    return said


def _named(one: NamedCause | AlternativeCause) -> dict[str, Any]:
    """Whose, what and where; of a place of a scale the axis is ``where`` and the coordinate ``at``."""
    said: dict[str, Any] = {"owner_kind": one.owner_kind, "owner": one.owner, "kind": one.kind}
    where, _, at = one.where.partition(" ") if one.kind == "local_scale" else (one.where, "", "")
    return said | ({"where": where} if where else {}) | ({"at": at} if at else {})


def _rival(rival: AlternativeCause) -> dict[str, Any]:
    return _named(rival) | {"probability": rival.probability}


def _looked_for(owner_kind: str, kind: str, count: int, causes: Sequence[NamedCause]) -> dict[str, Any]:
    """In how many owners a kind of cause was looked for, its usual size, and in how many it was named."""
    prior = fleet_priors().kinds[owner_kind][kind]
    named = {one.owner for one in causes if (one.owner_kind, one.kind) == (owner_kind, kind)}
    place = {"owner_kind": owner_kind, "kind": kind, "owners": count, "named": len(named)}
    return {**place, "usual": prior.usual, "unit": prior.unit}


def _alone(one: NamedCause, fleet: Crossing) -> dict[str, Any]:
    visit = fleet.visits[int(one.owner)]
    named = {"recording": visit.recording, "placement": visit.statistics.placement, "kind": one.kind}
    return {**named, "size": one.size, "u": one.u, "probability": one.probability}


def settled_by(one: NamedCause, fleet: Crossing) -> dict[str, list[dict[str, str]]]:
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


def _elsewhere(name: str, counterpart: str, one: NamedCause, fleet: Crossing) -> Visit | None:
    rows = fleet.of(counterpart, name)
    return next((fleet.visits[row] for row in rows if getattr(fleet.visits[row], one.owner_kind) != one.owner), None)


def _said(visit: Visit) -> dict[str, str]:
    return {"recording": visit.recording, "machine": visit.machine, "gauge": visit.gauge, "date": date_text(visit.day)}


def would_settle(one: NamedCause) -> str:
    """The measurement that would tell the cause from its rivals."""
    kinds = {one.owner_kind: one.owner} | {rival.owner_kind: rival.owner for rival in one.instead}
    if len(kinds) == 1:
        return f"measure each {one.owner_kind} of them without the others"
    ways = [f"{kind} {owner} without {_others(kinds, kind)}" for kind, owner in kinds.items()]
    return f"measure {' or '.join(ways)}"


def _others(kinds: Mapping[str, str], mine: str) -> str:
    return " and ".join(f"{kind} {owner}" for kind, owner in kinds.items() if kind != mine)
