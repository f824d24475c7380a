"""``demo``: the whole loop on a shipped example, then a concealed fault that the diagnosis has to find."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from stepgauge.demonstration.faults import NAMES
from stepgauge.verbs.define import verb
from stepgauge.verbs.kinds import Count, OneOf, Supplied
from stepgauge.verbs.shared import OutputFolder

if TYPE_CHECKING:
    from stepgauge.demonstration.conceal import Concealed

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
    ("evaluate the recording against the certificate", "evaluate {d}/recording.csv -g {g} --draw error -o {d}/result"),
    (
        "write the report to print and sign",
        "report {d}/result -g {g} -p {d}/placement.toml -m {d}/machine.toml -o {d}/report.pdf",
    ),
    (
        "write the report for the screen",
        "report {d}/result -g {g} -p {d}/placement.toml -m {d}/machine.toml -o {d}/report.html",
    ),
)


SECOND = (
    "plan the same measurement with the gauge along x",
    "plan {d}/along-x.toml -g {g} -m {d}/machine.toml -d dmis --cycles 3 -o {d}/program-x.dmi",
)
DIAGNOSE = (
    "diagnose: what do the recordings show that the machine file does not know?",
    "diagnose {d}/faulty-1.csv {d}/faulty-2.csv -g {g} -m {d}/machine.toml -o {d}/diagnosis",
)
COUNT = len(STEPS) + 4


@verb(in_project=False)
def demo(
    output: OutputFolder = "stepgauge-demo",
    *,
    conceal: Annotated[str | None, OneOf(*NAMES)] = None,
    seed: Annotated[int | None, Count(0)] = None,
    run: Annotated[Callable[..., object], Supplied("run")],
    tell: Annotated[Callable[[str], None], Supplied("tell")] = print,
) -> None:
    """The whole loop on a shipped example, then a fault that is concealed in the machine.

    From 16 probed points to a report to sign: every step is a command of its own that is shown as it runs, so that it
    can be repeated and changed. The y scale of the example's machine is 14 ppm too long and has a wave of 0.8 um every
    160 mm; its machine file states both.

    Then a fault that the machine file does not state is concealed in the virtual machine: what it is stands in a sealed
    file. The gauge is measured again, the diagnosis names what it finds, and the seal is opened. OUTPUT/story.html and
    OUTPUT/story.png show truth and answer side by side.

    Parameters
    ----------
    output : folder for the results (made if missing)
    conceal : fault to conceal in the virtual machine; default: one at random
    seed : of the fault, its size and the scatter; default: new each time
    run : runs a verb by its words
    tell : called with a line for every step

    Examples
    --------
    stepgauge demo
    stepgauge demo --conceal backlash
    """
    from stepgauge.demonstration.reveal import reveal
    from stepgauge.files.outputs import one_set

    folder = Path(output)
    _copy_inputs(folder)
    numbers = count(1)
    for purpose, line in (*STEPS, SECOND):
        with _step(tell, next(numbers), purpose):
            _run(run, line, folder)
    with _step(tell, next(numbers), "conceal a fault in the machine, and measure the gauge twice, along y and along x"):
        with one_set():
            concealed = _conceal(folder, conceal, seed)
        tell(f"{folder}/sealed.txt says what it is (SHA-256 {concealed.checksum[:16]}..); nothing else knows it")
    with _step(tell, next(numbers), DIAGNOSE[0]):
        _run(run, DIAGNOSE[1], folder)
        tell(f"{folder}/diagnosis/machine.diagnosed.toml is the machine file with what was found")
    with _step(tell, next(numbers), "open the seal"):
        with one_set():
            revealed = reveal(folder, concealed, folder / "diagnosis")
        for line in revealed.lines():
            tell(line)
    tell(f"look at {output}/report.pdf, {output}/result/error.png and, in a browser, {output}/story.html")


@contextmanager
def _step(tell: Callable[[str], None], number: int, purpose: str) -> Iterator[None]:
    tell(f"[{number}/{COUNT}] {purpose}")
    began = time.perf_counter()
    yield
    tell(f"  done in {time.perf_counter() - began:.1f} s")


def _run(run: Callable[..., object], line: str, folder: Path) -> None:
    run(*(part.format(d=folder, g=GAUGE) for part in line.split()))


def _conceal(folder: Path, name: str | None, seed: int | None) -> "Concealed":
    from stepgauge.demonstration.conceal import conceal_fault
    from stepgauge.gauge.certified import read_gauge
    from stepgauge.gauge.placement import read_placement
    from stepgauge.machine.file import read_machine

    gauge = read_gauge(GAUGE)
    programs = [
        (folder / program, read_placement(folder / placement, gauge))
        for program, placement in (("program.dmi", "placement.toml"), ("program-x.dmi", "along-x.toml"))
    ]
    return conceal_fault(folder, read_machine(folder / "machine.toml"), gauge, programs, name, seed)


def _copy_inputs(target: Path) -> None:
    from stepgauge.files.resources import folder
    from stepgauge.files.text import read_text, write_text

    for name in ("points.csv", "machine.toml", "along-x.toml"):
        write_text(target / name, read_text(folder("examples/demo") / name))
