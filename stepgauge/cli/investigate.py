"""``stepgauge investigate``: measure, diagnose, and measure what tells the rivals apart."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

from stepgauge.cli.interrupt import at_once, interruptible, progress_bar, stoppable
from stepgauge.cli.options import (
    FURTHER_STYLUS,
    GAUGE,
    NOT_NEGATIVE,
    POSITIVE,
    SUFFIX,
    FiniteRange,
    machine_option,
    output,
    say,
)


class _Box(click.ParamType):
    """Lowest and highest coordinates, ``X0:X1,Y0:Y1,Z0:Z1`` in mm."""

    name = "box"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Three pairs from low to high, mm, from the text."""
        try:
            pairs = [tuple(float(one) for one in pair.split(":")) for pair in str(value).split(",")]
        except ValueError:
            pairs = []
        if len(pairs) != 3 or not all(len(pair) == 2 and pair[0] < pair[1] for pair in pairs):
            self.fail(f"{value!r} is no box in mm (X0:X1,Y0:Y1,Z0:Z1, each from low to high)", param, ctx)
        return tuple(pairs)


@click.command("investigate")
@GAUGE
@machine_option(True, "Machine file (TOML) that is to be judged, or the name of a shipped one.")
@click.option(
    "--placement",
    "-p",
    metavar="P",
    help="Placement file: how the gauge lies now. Without it you measure the 16 points of 'locate' by hand.",
)
@click.option("--server", metavar="HOST:PORT", help="The I++ DME server of the machine, or linuxcnc.")
@click.option("--simulate", is_flag=True, help="Measure on the virtual CMM of this process instead.")
@click.option("--faults", metavar="FILE", help="With --simulate: concealed faults, as of 'stepgauge serve'.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="With --simulate: of its scatter.")
@output("Folder for the journal, the recordings, the report and the diagnosis.")
@click.option(
    "--minutes", type=POSITIVE, default=60.0, show_default=True, help="How long it may take, machine and hands."
)
@click.option(
    "--odds",
    type=FiniteRange(1.0, min_open=True),
    default=20.0,
    show_default=True,
    help="Odds at which an answer is accepted.",
)
@click.option("--within", type=_Box(), metavar="BOX", help="Where the gauge may lie: X0:X1,Y0:Y1,Z0:Z1, mm.")
@click.option("--level", is_flag=True, help="The gauge is neither lifted nor inclined: it stays at its height.")
@click.option(
    "--hands-minutes",
    type=NOT_NEGATIVE,
    default=5.0,
    show_default=True,
    metavar="MIN",
    help="Time that you need to move the gauge, or to change the stylus.",
)
@FURTHER_STYLUS
@click.option(
    "--cycles", type=click.IntRange(2, 100), default=2, show_default=True, help="Repetitions of every face in a run."
)
@click.option("--without", multiple=True, metavar="KIND", help="Kind of effect that is known not to be there.")
@click.option("--priors", metavar="FILE", help="Priors in place of the shipped ones (TOML), as of 'diagnose'.")
@click.option("--resume", is_flag=True, help="Continue the investigation in the folder; nothing is asked twice.")
@click.option("--yes", is_flag=True, help="Do not ask: answer every question with done.")
@click.option("--homing", is_flag=True, help="The machine may home itself if it is not.")
@click.option(
    "--tool", default="StepGaugeProbe", show_default=True, metavar="NAME", help="The server's name of the probe."
)
@SUFFIX
def command(gauge: str, machine: str, placement: str | None, output: str, suffix: str, **options: Any) -> None:
    """Find the cause of a machine's errors while the gauge is still on its table.

    A first run is measured and diagnosed. Of the possible further runs (another placement or direction, the gauge end
    for end; another speed or order, a pause, a few blocks often; a --further-stylus) the one with the most expected
    information per minute is chosen. You are asked to move the gauge or to change the stylus; if you answer no,
    another run is chosen. A gauge that you have moved is located by seven probings from outside, and refused where
    they do not fit it; with another stylus it is located again.

    It ends with one cause or a set at stated odds, with adequate, with unknown, or with a list of what would be needed
    but is not available. Every step is in a journal; after a kill or an error --resume continues.

    \b
    stepgauge investigate -g step-gauge-420 -m bridge-cmm -p placement.toml \\
        --server 127.0.0.1:1294 --minutes 60 -o cause
    stepgauge investigate -g step-gauge-420 -m bridge-cmm -p placement.toml \\
        --simulate --faults faults.toml --yes -o cause
    stepgauge report cause -o cause.pdf
    """
    from stepgauge.public.investigate import investigate

    _check(options, placement)
    with interruptible() as stop, progress_bar() as progress, stoppable():
        diagnosis = investigate(
            placement,
            gauge,
            machine,
            output,
            ask=_done if options["yes"] else _asking(stop),
            server=options["server"],
            faults=options["faults"],
            seed=options["seed"],
            minutes=options["minutes"],
            odds=options["odds"],
            within_mm=options["within"],
            level=options["level"],
            hands_minutes=options["hands_minutes"],
            styli=options["styli"],
            cycles=options["cycles"],
            without=options["without"],
            priors=options["priors"],
            resume=options["resume"],
            homing=options["homing"],
            tool=options["tool"],
            tell=say,
            progress=progress,
            stop=stop,
        )
    files = diagnosis.write(f"{output}/diagnosis", suffix)
    _say_end(output)
    say(f"wrote {output}: investigation.json, investigation.md, recording.csv, diagnosis ({len(files)} files)")


def _check(options: dict[str, Any], placement: str | None) -> None:
    if bool(options["server"]) == options["simulate"]:
        raise click.UsageError("either --server or --simulate: on which machine?")
    if placement is None and options["simulate"]:
        raise click.UsageError("--simulate needs --placement: nobody measures points by hand there.")
    if options["faults"] and not options["simulate"]:
        raise click.UsageError("--faults are those of the virtual CMM: they need --simulate.")


def _asking(stop: Callable[[], bool]) -> Callable[[str], bool]:
    """Asks a person; here Ctrl-C ends at once, for nothing moves."""

    def ask(question: str) -> bool:
        if stop():
            raise click.Abort
        with at_once():
            return click.confirm(f"{question}. Done?", err=True)

    return ask


def _done(question: str) -> bool:
    say(f"{question}.")
    return True


def _say_end(folder: str) -> None:
    from stepgauge.files.outputs import place_of
    from stepgauge.files.text import read_json
    from stepgauge.reports.investigation import sentence

    said = read_json(place_of(f"{folder}/investigation.json"))
    say(sentence(said))
    for one in said["needed"]:
        say(f"needed and not to be had: {one}")
