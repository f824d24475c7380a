"""LinuxCNC as the concealer: something is hidden in its HAL or INI file, its log is diagnosed, then the truth is read.

Exit code 0: every case is diagnosed rightly; 1: not every one; 2: wrong input, or LinuxCNC is missing or stopped.
"""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import click
from cases import CASES, GAUGE, Case, read_cases
from score import Score, score, table

from stepgauge.cli import run_command
from stepgauge.errors import InputError

HERE = Path(__file__).resolve().parent
sys.path.append(str(HERE.parent / "linuxcnc"))
from controller import require_linuxcnc  # noqa: E402

MACHINE = str(HERE / "machine.toml")
SEALED = str(HERE / "sealed.py")
LOG = "stepgauge-probe-log.txt"


@dataclass(frozen=True)
class Run:
    """One program on the controller."""

    placement: str
    speed_mm_s: float
    folder: Path


@click.command(context_settings={"show_default": True})
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="Folder for all that comes out.")
@click.option("--case", "names", multiple=True, metavar="NAME", help="A case of cases.toml, repeatable; default: all.")
def main(output: Path, names: tuple[str, ...]) -> None:
    """Run every case on LinuxCNC, diagnose its recordings, and print what was found beside what was hidden."""
    require_linuxcnc()
    cases = read_cases()
    unknown = [name for name in names if name not in cases]
    if unknown:
        raise InputError(CASES, f"there is no case {unknown[0]!r}", expected=", ".join(cases))
    scores = [examine(name, cases[name], output / name) for name in names or cases]
    click.echo("\n".join(["", *table(scores)]))
    sys.exit(0 if all(one.right for one in scores) else 1)


def examine(name: str, case: Case, folder: Path) -> Score:
    """Plan, run, import and diagnose a case without its truth, then score it."""
    recordings = [_record(name, case, run) for run in _runs(case, folder)]
    diagnosis = folder / "diagnosis"
    verb = ["diagnose", *recordings, "--gauge", GAUGE, "--machine", MACHINE, "-o", str(diagnosis)]
    _process(SEALED, *_sealed(folder), *verb)
    return score(name, diagnosis / "diagnosis.json")


def _runs(case: Case, folder: Path) -> Iterator[Run]:
    for placement, speed in product(case.placements, case.speeds_mm_s):
        yield Run(str(HERE / f"{placement}.toml"), speed, folder / f"{placement}-{speed:g}-mm-s")


def _record(name: str, case: Case, run: Run) -> str:
    """One recording: the program planned, run on the controller, and its log imported."""
    program, recording = str(run.folder / "program.ngc"), str(run.folder / "recording.csv")
    controller = run.folder / "controller"
    plan = ["plan", run.placement, "--gauge", GAUGE, "--machine", MACHINE, "--dialect", "linuxcnc"]
    plan += ["--blocks", case.blocks, "--cycles", str(case.cycles), "--measuring-speed", f"{run.speed_mm_s:g}"]
    plan += ["--standoff", "0.4", "--margin", "0.3", "--clearance", "2"]
    plan += ["--template", str(HERE / "clocked.ngc.j2")]
    _process("-m", "stepgauge", *plan, "-o", program)
    _process(str(HERE / "conceal.py"), name, program, run.placement, str(controller))
    origin = ["--program", program, "--gauge", GAUGE, "--placement", run.placement]
    verb = ["import", str(controller / LOG), "--format", "linuxcnc", *origin, "-o", recording]
    _process(SEALED, *_sealed(run.folder.parent), *verb)
    return recording


def _sealed(folder: Path) -> list[str]:
    """What no process but the concealer and the scorer may open: the truth, and what the controller was set up with."""
    return [str(HERE / "truth.toml"), *map(str, folder.glob("*/controller/simulation.*")), "--"]


def _process(*arguments: str) -> None:
    """A Python process of its own; what it complains about ends this one. Interrupted, it is let tidy up."""
    with subprocess.Popen(
        [sys.executable, *arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as process:
        try:
            said, _ = process.communicate()
        except KeyboardInterrupt:
            process.send_signal(signal.SIGINT)
            process.communicate()
            raise
    click.echo(said, nl=False)
    if process.returncode:
        sys.exit(2)


if __name__ == "__main__":
    run_command(main, "run.py")
