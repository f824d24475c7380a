"""``stepgauge probe bench``: the recording of a probe test bench -> pre-travel, hysteresis, repeatability."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from stepgauge.cli.options import POSITIVE, output, plot_option, say_written, show

if TYPE_CHECKING:
    from stepgauge.physics.bench import ContactFrom
    from stepgauge.probes.bench import BenchSession


@click.command("bench")
@click.argument("series", metavar="SERIES.csv")
@output("Table to write (CSV), one row per push; directions and budget go into a JSON file of the same name.")
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
    type=POSITIVE,
    default=2.0,
    show_default=True,
    metavar="K",
    help="Factor from standard to expanded uncertainty of a pre-travel.",
)
@plot_option("A push and the directions")
def command(series: str, contact_from: ContactFrom, coverage_factor: float, output: str, plot: str | None) -> None:
    """Evaluate a probe test bench: a push rod on a grating, a laser on the tip.

    SERIES.csv holds time series, one row per sample: time_s,rod_mm,tip_mm,contact,trigger, where the two signals are 1
    at rest and 0 while touching or triggered. direction_deg and push tell the pushes apart; their rows stand together.

    r0 is the rod where it meets the tip, r1 at the trigger, r2 where it stops, r3 where the tip stays behind on the way
    back. Pre-travel is r1 - r0, hysteresis r3 - r0, repeatability the range of r1 over the pushes of a direction.

    The uncertainty is that of Ren's device (0.10 um and 0.13 um/m), with the repeatabilities measured here.

    \b
    stepgauge probe bench pushes.csv -o bench.csv --plot bench.png
    """
    from stepgauge.probes.bench import check_bench_output, evaluate_bench, write_bench
    from stepgauge.probes.files import read_bench

    check_bench_output(output)
    session = evaluate_bench(read_bench(series), contact_from)
    written = write_bench(output, session, coverage_factor)
    if plot is not None:
        from stepgauge.figures.qualification import draw_bench

        draw_bench(session.pushes[0].channels, session.events[0], session.directions, plot, session.simulated)
    _print(session)
    say_written(*written, plot)


def _print(session: BenchSession) -> None:
    show("direction  pushes  pre-travel  hysteresis  repeatability (um)")
    for result in session.directions:
        show(
            f"{result.direction_deg:8.1f}  {result.count:6d}  {result.pretravel_um:10.3f}  "
            f"{result.hysteresis_um:10.3f}  {result.trigger_range_um:13.3f}"
        )
    spread = session.anisotropy
    show(f"mean pre-travel {spread.mean_pretravel_um:.3f} um, anisotropy {spread.pretravel_um:.3f} um")
