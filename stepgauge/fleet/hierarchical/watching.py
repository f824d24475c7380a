"""What watching a fleet gives: what needs a look in lines, all of it as a table, the feed and its figure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field

from stepgauge import __version__
from stepgauge.conditions.decision import Outcome
from stepgauge.files.config import TomlTable
from stepgauge.files.display import figures, join_lines
from stepgauge.files.notation import rounded
from stepgauge.files.stored import WrittenResult
from stepgauge.files.tables import csv_text, result_cell
from stepgauge.files.text import write_files
from stepgauge.fleet.hierarchical.answer import FleetInference, date_text
from stepgauge.fleet.hierarchical.watch import Watched, watch
from stepgauge.history import QUANTITIES, HistoryEntry, make_series

if TYPE_CHECKING:
    import pandas as pd


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


LIMITS = ("scale", "squareness", "reversal", "certificate_scale", "wear")
"""What a limit can be stated for, in um/m, urad, um, um/m and um."""
DUE_SHOWN = 10


@dataclass(frozen=True, repr=False)
class FleetWatch(WrittenResult):
    """``watched``: every quantity of every machine and gauge; ``limits``: maximum permissible sizes by name; ``risk``:
    accepted probability of being out of them; ``left_out``: why some recordings are not in it, a line each."""

    watched: tuple[Watched, ...]
    limits: Mapping[str, float]
    risk: float
    left_out: tuple[str, ...] = ()
    histories: tuple[MachineDrift, ...] = ()
    simulated: bool = False
    """Whether any recording is of a virtual machine."""

    @classmethod
    def of(
        cls,
        found: FleetInference,
        limits: Mapping[str, float],
        risk: float,
        entries: Sequence[HistoryEntry] = (),
    ) -> FleetWatch:
        """What an inference leaves of every visit, watched over the years; ``entries``: evaluations of the store."""
        drifts = tuple(machine_drifts(entries))
        simulated = found.simulated or any(one.simulated for one in entries)
        return cls(tuple(watch(found, limits, risk)), dict(limits), risk, found.left_out, drifts, simulated)

    def summary(self) -> str:
        """What changed, drifts, is beside its peers or out of limits, and the next that are due."""
        said = [line for one in self.watched if (line := _line(one))]
        said += [_history_line(one) for one in self.histories] + list(self._due())
        owners = len({(one.owner_kind, one.owner) for one in self.watched})
        return join_lines(
            *(said or ["nothing changed, nothing due"]),
            f"{len(self.watched)} quantities of {owners} machines and gauges",
        )

    def to_frame(self) -> pd.DataFrame:
        """One row per quantity: level on the last day with its standard uncertainty in ``unit``, rate in a year."""
        import pandas as pd

        rows = [one.model_dump(exclude={"history", "changes"}) for one in self.feed().quantities]
        return pd.json_normalize(rows, sep="_").drop(columns=["peers", "limit"], errors="ignore")

    def write(self, folder: str | Path, figure: str = "png") -> list[Path]:
        """Write ``watch.json``, its schema, ``watch.csv`` and the figure (png, svg, pdf); returns the paths."""
        with self.keeping():
            path = Path(folder) / f"watch.{figure}"
            figures("fleet").draw_watch(path, self.watched, self.simulated)
            return [*write_feed(folder, self.feed()), path]

    def feed(self) -> Feed:
        """All of it for other programs."""
        return make_feed(self.watched, self.limits, self.risk, self.histories)

    def _due(self) -> Iterator[str]:
        due = [(one.due, one) for one in self.watched if one.due is not None]
        for day, one in sorted(due, key=lambda pair: pair[0])[:DUE_SHOWN]:
            yield f"due {date_text(day)}: {one.owner_kind} {one.owner} ({one.quantity})"


def machine_drifts(entries: Sequence[HistoryEntry]) -> Iterator[MachineDrift]:
    """The drifts that ``stepgauge history`` finds in these evaluations, each machine with each gauge by itself.

    Which of the two drifts it cannot say; what is watched says it, where several gauges and machines met.
    """
    pairs = sorted({(entry.machine, entry.gauge_serial) for entry in entries})
    for machine, gauge in pairs:
        own = [entry for entry in entries if (entry.machine, entry.gauge_serial) == (machine, gauge)]
        for one in make_series(own):
            if one.drift is not None and one.drift.significant:
                yield MachineDrift(
                    machine=machine,
                    gauge=gauge,
                    direction=one.direction,
                    quantity=one.quantity,
                    unit=QUANTITIES[one.quantity].unit,
                    per_year=one.drift.per_year,
                    u_per_year=one.drift.u_per_year,
                    by_chance=one.drift.by_chance,
                )


def _history_line(one: MachineDrift) -> str:
    rate, u = rounded(one.per_year, 3, plus=True), rounded(one.u_per_year, 2)
    found = f"{one.quantity} along {one.direction} drifts by {rate} +- {u} {one.unit} a year"
    return f"machine {one.machine} with gauge {one.gauge}: {found} (as 'stepgauge history' finds it)"


def _line(one: Watched) -> str:
    """What of a quantity needs a look, empty where nothing does."""
    said = [f"changed between {date_text(first)} and {date_text(last)}" for first, last in one.changes]
    if one.drifts:
        rate, expanded = rounded(one.rate, 3, plus=True), rounded(2.0 * one.u_rate, 2)
        said.append(f"drifts by {rate} {one.unit} a year (U = {expanded})")
    if one.leaves_peers and one.peers:
        said.append(f"beside its peers ({rounded(one.peers[0], 3, plus=True)} {one.unit})")
    said += [one.outcome] if one.outcome is not None and one.outcome != "conforms" else []
    size = f"{rounded(one.level[-1], 3, plus=True)} {one.unit} (U = {rounded(2.0 * one.u[-1], 2)})"
    return f"{one.owner_kind} {one.owner} {one.quantity} {size}: {', '.join(said)}" if said else ""
