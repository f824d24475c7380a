"""``stepgauge history``: many evaluations of one machine -> trends and warnings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from stepgauge.cli.options import SUFFIX, limits_option, output, say, say_written, show
from stepgauge.errors import InputError

if TYPE_CHECKING:
    from stepgauge.history import HistoryEntry, Series
    from stepgauge.history.entries import DateFrom

# Written out so that --help needs no numpy; the test compares it with the quantities of the history.
LIMITS = ("scale_ppm", "reversal_um", "r_eff_change_um", "band_um", "worst_two_sigma_um")


@click.command("history")
@click.argument("folder", metavar="DIR")
@output("Folder for history.json, history.csv, the figure and the store (made if missing).")
@limits_option(LIMITS, f"Warn beyond this; repeatable. Names: {', '.join(LIMITS)} (sizes; um, or um/m for ppm).")
@click.option("--machine-name", metavar="NAME", help="Only evaluations of this machine.")
@click.option("--gauge-serial", metavar="SERIAL", help="Only evaluations with this gauge.")
@click.option(
    "--date-from",
    type=click.Choice(["record", "file"]),
    default="record",
    show_default=True,
    help="Where an evaluation has no measured_at and its path no date: leave it out, or take the file's own date.",
)
@click.option("--store", metavar="FILE", help="SQLite store to keep. Default: history.sqlite in the output folder.")
@click.option("--rebuild", is_flag=True, help="Delete the store and make it again from the JSON files.")
@SUFFIX
def command(folder: str, output: str, limits: dict[str, float], **options: Any) -> None:
    """What the evaluations below a folder say of one machine by date: trends, limits, a control chart.

    Every evaluation.json below DIR counts, each placement by the direction of the gauge. The date is measured_at of the
    evaluation ('evaluate --measured-at', or '# measured_at:' in the recording), else a date such as 2026-03-02 in the
    names of its folders. Trend lines are weighted by repeatability; a control chart needs five dates. All trends and
    values are tested together: a report of nothing but noise has any warning in at most one of twenty cases.

    A constant reversal of an axis shows in R_eff, minus half of it: a step gauge sees it as a smaller tip. R_eff is
    compared with the first one of the same tip (within 50 um). Evaluations that name no machine are '(unnamed)':
    'evaluate --machine-name'.

    The store is an SQLite file for other programs; it is brought up to date at every call and can always be rebuilt.

    DIR may be the store of a fleet ('stepgauge fleet') whose recordings were evaluated: then nothing is kept in SQLite.

    \b
    stepgauge history archive -o history
    stepgauge history archive --machine-name "Bridge CMM" --limit reversal_um=2 --limit scale_ppm=5 -o history
    """
    from stepgauge.figures.history import draw_history
    from stepgauge.history import judge, make_series, of_one_machine, write_history

    store = options["store"] or Path(output) / "history.sqlite"
    found, kept = _entries(folder, store, options["date_from"], options["rebuild"])
    entries = of_one_machine(found, folder, options["machine_name"], options["gauge_serial"])
    series = make_series(entries)
    warnings = judge(series, limits)
    written = write_history(output, series, warnings, limits)
    figure = Path(output) / f"history.{options['suffix']}"
    draw_history(figure, series, limits, entries[0].machine)
    show(_table(entries))
    show(_trends(series))
    for warning in warnings:
        say(f"warning: {warning.measured_at:%Y-%m-%d}, along {warning.direction}: {warning.quantity} {warning.text}")
    say_written(*written, figure, kept)


def _entries(
    folder: str, store: str | Path, date_from: DateFrom, rebuild: bool
) -> tuple[Sequence[HistoryEntry], str | Path | None]:
    """The entries of a folder of results, with the store that has them now, or those of a fleet."""
    if (Path(folder) / "fleet.json").is_file():
        from stepgauge.fleet.past import history_entries
        from stepgauge.fleet.store import Fleet

        return history_entries(Fleet(folder)), None
    from stepgauge.history import refresh_store

    found = refresh_store(store, folder, date_from, rebuild, _progress)
    if not found.entries and found.remarks:
        raise InputError(folder, "no evaluation that can be used", found=found.remarks[0])
    for remark in found.remarks:
        say(remark)
    gone = f", {found.gone} gone" if found.gone else ""
    say(f"{found.read} files read, {found.unchanged} unchanged{gone}")
    return found.entries, store


def _progress(done: int, of: int) -> None:
    if of >= 200 and done % 100 == 0:
        say(f"{done} of {of} files")


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
    from stepgauge.history import QUANTITIES, false_warning_words

    lines = ["", "trend by year (weighted by repeatability; u: standard uncertainty)", false_warning_words(series)]
    for one in series:
        unit = QUANTITIES[one.quantity].unit
        said = (
            "too few dates"
            if one.trend is None
            else f"{one.trend.per_year:+8.3f}  u {one.trend.u_per_year:7.3f} {unit}"
        )
        moves, drifts = (line is not None and line.significant for line in (one.trend, one.drift))
        mark = "  drift" if drifts else "  as the scale error does" if moves else ""
        lines.append(f"{QUANTITIES[one.quantity].title:26s} along {one.direction:5s} {said}{mark}")
    return "\n".join(lines)
