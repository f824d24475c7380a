"""What watching a fleet gives: what needs a look in lines, all of it as a table, the feed and its figure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from stepgauge.files.display import figures, join_lines
from stepgauge.files.notation import rounded
from stepgauge.files.stored import WrittenResult
from stepgauge.fleet.hierarchical.answer import FleetInference, date_text
from stepgauge.fleet.hierarchical.feed import Feed, MachineDrift, make_feed, write_feed
from stepgauge.fleet.hierarchical.watch import Watched, watch
from stepgauge.history import QUANTITIES, HistoryEntry, make_series

if TYPE_CHECKING:
    import pandas as pd

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
