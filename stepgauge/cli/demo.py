"""``stepgauge demo``: the whole loop on a shipped example."""

from __future__ import annotations

import time
from pathlib import Path

import click

from stepgauge.cli.options import say

GAUGE = "step-gauge-420"
STEPS = (
    (
        "find how the gauge lies from 16 probed points",
        "locate {d}/points.csv -g {g} -m {d}/machine.toml -o {d}/placement.toml",
    ),
    (
        "plan the measurement and write the program",
        "plan {d}/placement.toml -g {g} -m {d}/machine.toml -d dmis -o {d}/program.dmi",
    ),
    (
        "run the program's text on the virtual CMM",
        "simulate {d}/program.dmi -m {d}/machine.toml -g {g} -p {d}/placement.toml --seed 420 --gauge-temperature 20.4"
        " -o {d}/recording.csv --plot {d}/path.png --plot-html {d}/path.html",
    ),
    ("evaluate the recording against the certificate", "evaluate {d}/recording.csv -g {g} -o {d}/result"),
    (
        "write the report to print and sign",
        "report {d}/result -g {g} -p {d}/placement.toml -m {d}/machine.toml -o {d}/report.pdf",
    ),
    (
        "write the report for the screen",
        "report {d}/result -g {g} -p {d}/placement.toml -m {d}/machine.toml -o {d}/report.html",
    ),
)


@click.command("demo")
@click.option(
    "-o", "--output", default="stepgauge-demo", show_default=True, metavar="FOLDER", help="Folder for the results."
)
def command(output: str) -> None:
    """Run the whole loop on a shipped example, from 16 probed points to a report to sign.

    Every step is a command of its own that is shown as it runs, so that it can be repeated and changed. The y scale of
    the example's machine is 14 ppm too long and has a wave of 0.8 um every 160 mm: FOLDER/result/evaluation.png shows
    both.
    """
    from stepgauge.cli import show_and_run

    _copy_inputs(Path(output))
    for number, (purpose, line) in enumerate(STEPS, 1):
        arguments = [part.format(d=output, g=GAUGE) for part in line.split()]
        say(f"[{number}/{len(STEPS)}] {purpose}")
        began = time.perf_counter()
        show_and_run(*arguments)
        say(f"  done in {time.perf_counter() - began:.1f} s")
    say(f"look at {output}/report.pdf, {output}/result/evaluation.png and, in a browser, {output}/path.html")


def _copy_inputs(target: Path) -> None:
    from stepgauge.files.resources import folder
    from stepgauge.files.text import read_text, write_text

    for name in ("points.csv", "machine.toml"):
        write_text(target / name, read_text(folder("examples/demo") / name))
