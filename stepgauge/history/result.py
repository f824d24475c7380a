"""A history as a result: its table, trends and warnings, its files."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, ClassVar

from stepgauge import __version__
from stepgauge.errors import InputError
from stepgauge.files.display import Plotted, figures
from stepgauge.files.json_types import json_types
from stepgauge.files.stored import WrittenResult
from stepgauge.files.tables import csv_text, result_cell
from stepgauge.files.text import write_files
from stepgauge.history.entries import QUANTITIES, DateFrom, HistoryEntry, select_machine
from stepgauge.history.series import FALSE_WARNINGS, Alert, Series, false_warning_words, judge, make_series
from stepgauge.history.store import refresh_store
from stepgauge.history.trend import Trend

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, repr=False)
class History(WrittenResult, Plotted):
    """Values of one machine by date (``entries``), ``series`` with trends, and ``warnings``."""

    drawn_by: ClassVar[str] = "history.draw_scale"
    entries: tuple[HistoryEntry, ...]
    series: tuple[Series, ...]
    warnings: tuple[Alert, ...]
    limits: Mapping[str, float]
    store: Path | None = None

    def summary(self) -> str:
        """The table by date, the trends by year, and the warnings."""
        return "\n".join([_table(self.entries), _trends(self.series), *(_warning(one) for one in self.warnings)])

    def to_frame(self) -> pd.DataFrame:
        """One row per evaluation and placement: date, direction, and the quantities in the units of their names."""
        import pandas as pd

        names = ("measured_at", "direction", "gauge_temperature_C", *NUMBERS, "date_source", "path", "placement")
        return pd.DataFrame([{name: getattr(one, name) for name in names} for one in self.entries])

    def write(self, folder: str | Path, figure: str = "png") -> list[Path]:
        """Write ``history.json``, ``history.csv`` and the figure into a folder; returns the paths, the store's too."""
        drawing = Path(folder) / f"history.{figure}"
        with self.keeping():
            written = write_history(folder, self.series, self.warnings, self.limits)
            figures("history").draw_history(drawing, self.series, self.limits, self.entries[0].machine)
        return [*written, drawing, *([self.store] if self.store else [])]


NUMBERS = ("scale_ppm", "reversal_um", "r_eff_mm", "band_um", "worst_two_sigma_um")


def history_of(
    found: Sequence[HistoryEntry],
    folder: str | Path,
    limits: Mapping[str, float],
    machine: str | None = None,
    gauge: str | None = None,
    store: Path | None = None,
) -> History:
    """The history of one machine; errors as :func:`select_machine`."""
    entries = select_machine(found, folder, machine, gauge)
    series = make_series(entries)
    return History(tuple(entries), tuple(series), tuple(judge(series, limits)), dict(limits), store)


def stored_entries(
    folder: str | Path, store: Path | None, date_from: DateFrom, rebuild: bool, tell: Callable[[str], None]
) -> Sequence[HistoryEntry]:
    """What the evaluations below a folder give, by way of the store; without one nothing is kept."""

    def progress(done: int, of: int) -> None:
        if of >= 200 and done % 100 == 0:
            tell(f"{done} of {of} files")

    with TemporaryDirectory(prefix="stepgauge-") as place:
        path = store or Path(place) / "history.sqlite"
        found = refresh_store(path, str(folder), date_from, rebuild, progress)
    if not found.entries and found.remarks:
        raise InputError(folder, "no evaluation that can be used", found=found.remarks[0])
    for remark in found.remarks:
        tell(remark)
    gone = f", {found.gone} gone" if found.gone else ""
    tell(f"{found.read} files read, {found.unchanged} unchanged{gone}")
    return found.entries


def _table(entries: Sequence[HistoryEntry]) -> str:
    lines = ["date        along  gauge C   scale um/m  reversal um   R_eff mm  band um  2 sigma um  date from   file"]
    for one in entries:
        numbers = (
            f"{_cell(one.gauge_temperature_C, 8, 2)}  {_cell(one.scale_ppm, 11, 2)}  {_cell(one.reversal_um, 11, 2)}"
            f"  {one.r_eff_mm:9.5f}  {_cell(one.band_um, 7, 2)}  {_cell(one.worst_two_sigma_um, 10, 2)}"
        )
        lines.append(f"{one.measured_at:%Y-%m-%d}  {one.direction:5s} {numbers}  {one.date_source:10s}  {one.path}")
    return "\n".join(lines)


def _cell(value: float, width: int, decimals: int) -> str:
    return "-".rjust(width) if math.isnan(value) else f"{value:{width}.{decimals}f}"


def _trends(series: Sequence[Series]) -> str:
    lines = ["", "trend by year (weighted by repeatability; u: standard uncertainty)", false_warning_words(series)]
    for one in series:
        unit, trend = QUANTITIES[one.quantity].unit, one.trend
        words = "too few dates" if trend is None else f"{trend.per_year:+8.3f}  u {trend.u_per_year:7.3f} {unit}"
        moves, drifts = (line is not None and line.significant for line in (one.trend, one.drift))
        mark = "  drift" if drifts else "  as the scale error does" if moves else ""
        lines.append(f"{QUANTITIES[one.quantity].title:26s} along {one.direction:5s} {words}{mark}")
    return "\n".join(lines)


def _warning(one: Alert) -> str:
    return f"warning: {one.measured_at:%Y-%m-%d}, along {one.direction}: {one.quantity} {one.text}"


def write_history(
    folder: str | Path, series: Sequence[Series], warnings: Sequence[Alert], limits: Mapping[str, float]
) -> list[Path]:
    """Write both files into a folder (made if missing); returns their paths."""
    entries = _entries(series)
    document = _document(series, entries, warnings, limits)
    return write_files(folder, {"history.json": document, "history.csv": _csv(entries)})


def _entries(series: Sequence[Series]) -> list[HistoryEntry]:
    found = {(entry.path, entry.placement): entry for one in series for entry in one.entries}
    return sorted(found.values(), key=lambda entry: (entry.measured_at, entry.path, entry.placement))


def _document(
    series: Sequence[Series], entries: list[HistoryEntry], warnings: Sequence[Alert], limits: Mapping[str, float]
) -> dict[str, Any]:
    return {
        "format": "stepgauge history 1",
        "stepgauge": __version__,
        "machine": entries[0].machine,
        "gauges": sorted({entry.gauge_serial for entry in entries}),
        "limits": dict(limits),
        "false_warnings": FALSE_WARNINGS,
        "trends_tested": sum(one.drift is not None for one in series),
        "values_tested": sum(one.charted for one in series),
        "simulated": any(entry.simulated for entry in entries),
        "entries": [json_types(dataclasses.asdict(entry)) for entry in entries],
        "series": [
            json_types(
                {
                    "quantity": one.quantity,
                    "unit": QUANTITIES[one.quantity].unit,
                    "direction": one.direction,
                    "values": one.value.tolist(),
                    "u": one.u.tolist(),
                    "trend": _trend(one.trend),
                    "of_scale": one.of_scale.tolist(),
                    "drift": _trend(one.drift),
                    "control_low": one.low.tolist(),
                    "control_high": one.high.tolist(),
                }
            )
            for one in series
        ],
        "warnings": [json_types(dataclasses.asdict(warning)) for warning in warnings],
    }


def _trend(trend: Trend | None) -> dict[str, Any] | None:
    return None if trend is None else dataclasses.asdict(trend)


def _csv(entries: list[HistoryEntry]) -> str:
    names = [field.name for field in dataclasses.fields(HistoryEntry)]
    rows = [json_types(dataclasses.asdict(entry)) for entry in entries]
    return csv_text(names, [[result_cell(row[name]) for name in names] for row in rows])
