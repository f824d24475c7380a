"""What is watched as a feed for other programs: ``watch.json`` with a schema, and ``watch.csv``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from stepgauge import __version__
from stepgauge.conditions.decision import Outcome
from stepgauge.files.config import TomlTable
from stepgauge.files.tables import csv_text, result_cell
from stepgauge.files.text import write_files
from stepgauge.fleet.hierarchical.answer import date_text
from stepgauge.fleet.hierarchical.watch import Watched

FORMAT = "stepgauge fleet watch 1"


class DatedLevel(TomlTable):
    """A level on a day."""

    date: str = Field(description="ISO date of the visits")
    level: float = Field(description="level, in the unit of the quantity")
    u: float = Field(ge=0.0, description="standard uncertainty")


class Change(TomlTable):
    """A change with its days."""

    first: str = Field(description="ISO date of the last visit before it")
    last: str = Field(description="ISO date of the first visit that surely shows it")


class Peers(TomlTable):
    """The machines of the same line, or the other gauges."""

    middle: float = Field(description="median of their levels")
    spread: float = Field(ge=0.0, description="standard deviation of their levels")
    by_chance: float = Field(ge=0.0, le=1.0, description="probability of lying so far out by chance")
    leaves: bool = Field(description="whether it leaves them; at most 5 % of those that do are expected to be false")


class Limit(TomlTable):
    """A limit and what follows from it."""

    size: float = Field(gt=0.0, description="maximum permissible size")
    outcome: Outcome = Field(description="ISO 14253-1, U with k = 2")
    out_now: float = Field(ge=0.0, le=1.0, description="probability of being out of limits on the last day")
    due: str | None = Field(description="ISO date on which the accepted risk is reached; null: beyond the horizon")


class VisitQuantity(TomlTable):
    """One quantity of one machine or gauge."""

    owner_kind: Literal["machine", "gauge"]
    owner: str
    quantity: str = Field(description="kind and place, such as 'scale x'")
    unit: str
    level: float = Field(description="on the last day")
    u: float = Field(ge=0.0)
    rate: float = Field(description="in a year")
    u_rate: float = Field(ge=0.0)
    drifts: bool = Field(description="whether it is a finding among all rates: noise gives any in at most 5 % of feeds")
    history: list[DatedLevel]
    changes: list[Change]
    peers: Peers | None
    limit: Limit | None


class MachineDrift(TomlTable):
    """A drift of what a machine showed with one gauge, as ``stepgauge history`` finds it in the same evaluations."""

    machine: str
    gauge: str
    direction: str
    quantity: str
    unit: str
    per_year: float
    u_per_year: float = Field(ge=0.0, description="standard uncertainty")
    by_chance: float = Field(ge=0.0, le=1.0, description="probability that noise alone gives so large a drift")


class Feed(TomlTable):
    """``watch.json``."""

    format: Literal["stepgauge fleet watch 1"]
    stepgauge: str = Field(description="version that wrote it")
    risk: float = Field(gt=0.0, lt=1.0, description="accepted probability of being out of limits")
    limits: dict[str, float]
    quantities: list[VisitQuantity]
    histories: list[MachineDrift] = Field(default_factory=list)
    result: dict[str, Any] = Field(default_factory=dict, description="its lines and its table")
    checksum: str = Field("", description="SHA-256 of the rest, as in every JSON file of stepgauge")


def feed_schema() -> dict[str, Any]:
    """The JSON schema (draft 2020-12) of ``watch.json``."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **Feed.model_json_schema()}


def make_feed(
    watched: Sequence[Watched], limits: Mapping[str, float], risk: float, histories: Sequence[MachineDrift] = ()
) -> Feed:
    """The feed, checked against its own schema."""
    rows = [_quantity(one) for one in watched]
    return Feed(
        format="stepgauge fleet watch 1",
        stepgauge=__version__,
        risk=risk,
        limits=dict(limits),
        quantities=rows,
        histories=list(histories),
    )


def _quantity(one: Watched) -> VisitQuantity:
    history = [
        DatedLevel(date=date_text(day), level=level, u=u)
        for day, level, u in zip(one.days, one.level, one.u, strict=True)
    ]
    return VisitQuantity(
        owner_kind=one.owner_kind,
        owner=one.owner,
        quantity=one.quantity,
        unit=one.unit,
        level=one.level[-1],
        u=one.u[-1],
        rate=one.rate,
        u_rate=one.u_rate,
        drifts=one.drifts,
        history=history,
        changes=[Change(first=date_text(first), last=date_text(last)) for first, last in one.changes],
        peers=_peers(one),
        limit=_limit(one),
    )


def _peers(one: Watched) -> Peers | None:
    if one.peers is None:
        return None
    return Peers(middle=one.peers[0], spread=one.peers[1], by_chance=one.by_chance, leaves=one.leaves_peers)


def _limit(one: Watched) -> Limit | None:
    if one.limit is None or one.outcome is None or one.out_now is None:
        return None
    due = None if one.due is None else date_text(one.due)
    return Limit(size=one.limit, outcome=one.outcome, out_now=one.out_now, due=due)


def write_feed(folder: str | Path, feed: Feed) -> list[Path]:
    """Write ``watch.json``, its schema and ``watch.csv`` into a folder (made if missing); returns their paths."""
    said = feed.model_dump(exclude={"result", "checksum"})
    return write_files(folder, {"watch.json": said, "watch.schema.json": feed_schema(), "watch.csv": _csv(feed)})


def _csv(feed: Feed) -> str:
    names = ["owner_kind", "owner", "quantity", "unit", "level", "u", "rate", "u_rate", "drifts"]
    return csv_text(names, [[result_cell(getattr(row, name)) for name in names] for row in feed.quantities])
