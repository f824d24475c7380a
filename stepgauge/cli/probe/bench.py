"""``stepgauge probe bench``: the recording of a probe test bench -> pre-travel, hysteresis, repeatability."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from stepgauge.cli.options import FiniteRange, check_figure

if TYPE_CHECKING:
    from stepgauge.physics.bench import Anisotropy, ContactFrom, DirectionResult, Events
    from stepgauge.probe_files import BenchSeries

PUSH_COLUMNS = (
    *("direction_deg", "push", "r0_mm", "r1_mm", "r2_mm", "r3_mm"),
    *("pretravel_um", "hysteresis_um", "overtravel_um", "resolution_um"),
)


@click.command()
@click.argument("series", type=click.Path(path_type=Path), metavar="SERIES.csv")
@click.option(
    "--contact-from",
    type=click.Choice(["signal", "tip"]),
    default="signal",
    show_default=True,
    help="Find the touch from the contact signal, or from where the line of the tip leaves rest (ruby conducts none).",
)
@click.option(
    "--coverage-factor",
    "-k",
    type=FiniteRange(),
    default=2.0,
    show_default=True,
    help="Of the expanded uncertainty of a pre-travel.",
)
@click.option(
    "--output",
    "-o",
    type=click.Path(path_type=Path),
    default="bench.csv",
    show_default=True,
    help="One row per push; the directions and the budget go into a JSON file of the same name.",
)
@click.option(
    "--figure",
    callback=check_figure,
    type=click.Path(path_type=Path),
    help="A push and the directions, PNG, SVG or PDF.",
)
def command(series: Path, contact_from: ContactFrom, coverage_factor: float, output: Path, figure: Path | None) -> None:
    """Evaluate a probe test bench: a push rod on a grating, a laser on the tip.

    SERIES.csv holds time series, one row per sample: time_s,rod_mm,tip_mm,contact,trigger, where the two signals are 1
    at rest and 0 while touching or triggered. direction_deg and push tell the pushes apart; their rows stand together.

    r0 is the rod where it meets the tip, r1 at the trigger, r2 where it stops, r3 where the tip stays behind on the way
    back. Pre-travel is r1 - r0, hysteresis r3 - r0, repeatability the range of r1 over the pushes of a direction.

    The uncertainty is that of Ren's device (0.10 um and 0.13 um/m), with the repeatabilities measured here.

    \b
    stepgauge probe bench pushes.csv -o bench.csv --figure bench.png
    """
    _check(coverage_factor, output)
    from stepgauge.physics.bench import anisotropy
    from stepgauge.probe_files import read_bench
    from stepgauge.tables import write_table

    pushes = read_bench(series)
    found = [_events(push, contact_from) for push in pushes]
    results = _by_direction(pushes, found)
    spread = anisotropy(results)
    write_table(output, PUSH_COLUMNS, [_row(push, events) for push, events in zip(pushes, found, strict=True)])
    summary = output.with_suffix(".json")
    _write_summary(summary, results, spread, found, coverage_factor)
    if figure is not None:
        from stepgauge.figures.qualification import draw_bench

        draw_bench(pushes[0].channels, found[0], results, figure)
    _print(results, spread)
    click.echo(f"written: {output}, {summary}" + (f", {figure}" if figure else ""))


def _check(coverage_factor: float, output: Path) -> None:
    from stepgauge.errors import InputError

    if not 0.0 < coverage_factor < float("inf"):
        raise InputError(
            "--coverage-factor", "impossible value", found=coverage_factor, expected="above zero, mostly 2"
        )
    if output.suffix.lower() == ".json":
        raise InputError("--output", "this name is that of the summary", found=output, expected="a name ending in .csv")


def _events(series: BenchSeries, contact_from: ContactFrom) -> Events:
    from stepgauge.errors import InputError
    from stepgauge.physics.bench import Push, find_events

    channels = series.channels
    push = Push(
        channels["time_s"], channels["rod_mm"], channels["tip_mm"], channels["contact"] > 0.5, channels["trigger"] > 0.5
    )
    try:
        return find_events(push, contact_from)
    except ValueError as error:
        name = f"push {series.push} in direction {series.direction_deg:g} deg"
        raise InputError(series.where, f"{name}: {error}") from None


def _by_direction(pushes: list[BenchSeries], found: list[Events]) -> list[DirectionResult]:
    from stepgauge.physics.bench import summarise

    groups: dict[float, list[Events]] = {}
    for push, events in zip(pushes, found, strict=True):
        groups.setdefault(push.direction_deg, []).append(events)
    return [summarise(direction, group) for direction, group in sorted(groups.items())]


def _row(push: BenchSeries, events: Events) -> list[object]:
    readings = [events.r0_mm, events.r1_mm, events.r2_mm, events.r3_mm]
    lengths = [events.pretravel_um, events.hysteresis_um, events.overtravel_um, events.resolution_um]
    return [push.direction_deg, push.push, *(round(r, 7) for r in readings), *(round(w, 4) for w in lengths)]


def _write_summary(
    path: Path, results: list[DirectionResult], spread: Anisotropy, found: list[Events], coverage_factor: float
) -> None:
    import dataclasses
    import json

    from stepgauge.files import write_text

    data = {
        "directions": [dataclasses.asdict(result) for result in results],
        "anisotropy": dataclasses.asdict(spread),
        "uncertainty": _uncertainty(results, found, coverage_factor),
    }
    write_text(path, json.dumps(data, indent=2) + "\n")


def _uncertainty(results: list[DirectionResult], found: list[Events], coverage_factor: float) -> dict[str, Any]:
    """Ren's budget with the repeatabilities of this recording, for its mean pre-travel."""
    import dataclasses
    import statistics

    from stepgauge.physics.probe_budget import with_repeatability

    pooled = [result.pretravel_std_um for result in results if result.pretravel_std_um is not None]
    std_um = statistics.fmean(std**2 for std in pooled) ** 0.5 if pooled else None
    budget = with_repeatability(std_um)
    length_m = 1e-3 * max(events.r2_mm for events in found)
    return {
        "coverage_factor": coverage_factor,
        "expanded_um": float(budget.expanded_um(length_m, coverage_factor)),
        "fixed_um": budget.fixed_um,
        "per_m_um": budget.per_m_um,
        "repeatability": "measured" if pooled else "Ren Table 2: a single push tells none",
        "components": [dataclasses.asdict(part) for part in budget.components],
    }


def _print(results: list[DirectionResult], spread: Anisotropy) -> None:
    click.echo("direction  pushes  pre-travel  hysteresis  repeatability (um)")
    for result in results:
        click.echo(
            f"{result.direction_deg:8.1f}  {result.count:6d}  {result.pretravel_um:10.3f}  "
            f"{result.hysteresis_um:10.3f}  {result.trigger_range_um:13.3f}"
        )
    click.echo(f"mean pre-travel {spread.mean_pretravel_um:.3f} um, anisotropy {spread.pretravel_um:.3f} um")
