"""The closed loop on LinuxCNC in real time: three causes, hidden in the HAL file of a headless controller.

    python -m benchmarks.investigate_linuxcnc [--kinds KIND ...] [--seed S] [-o cases.jsonl]

As in :mod:`benchmarks.investigate` a process that knows draws and seals the cause, and lays the gauge nearly as asked,
by new constants in HAL while the controller stays up. The other one has the controller's Python interface alone, as
``stepgauge investigate --server linuxcnc``. The faces in HAL are off their certificate as far as it allows. That the
scatter grows with the speed, as that of every contact that is latched, is stated in the machine file.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import click
import numpy as np

from benchmarks.investigate import GAUGE, PROCESSES, Effect, causes, judged, looped, revealed, seal
from stepgauge.diagnosis.further_runs import FurtherRun
from stepgauge.diagnosis.result import GaugeDiagnosis
from stepgauge.errors import InputError
from stepgauge.gauge.certified import Gauge, read_gauge
from stepgauge.gauge.placement import Placement, make_placement
from stepgauge.investigation.decision import Case
from stepgauge.investigation.feasible_runs import Reach, placement_json, placement_of_json, program_of
from stepgauge.investigation.loop import Investigation
from stepgauge.investigation.stations import Served, Station, nearly
from stepgauge.live.controller import ControllerOptions
from stepgauge.machine.file import Machine, read_machine

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
sys.path += [str(EXAMPLES / "linuxcnc"), str(EXAMPLES / "linuxcnc-concealed")]
from conceal import ACCELERATION_MM_S2, LAG_MM  # noqa: E402
from controller import SERVO_PERIOD_NS, STARVED, Drives, running  # noqa: E402
from hal_gauge import laid_anew, render_hal  # noqa: E402
from truth import Hidden  # noqa: E402

KINDS = ("scale_error", "reversal_error", "squareness")
SPEED_MM_S = 8.0
"""Faster than the example measures: a case is over in some minutes."""
HANDS_MINUTES = 1.0
UP_S = 7200.0
ATTEMPTS = 5


def machine_file() -> Machine:
    """The machine as its user knows it: a contact is read 0 to v T late, v being the speed and T the servo period."""
    machine = read_machine(EXAMPLES / "linuxcnc-concealed" / "machine.toml")
    table = machine.table.model_copy(update={"measuring_speed_mm_s": SPEED_MM_S, "repeatability_um": 0.02})
    latch = {"kind": "interpolation_step", "cycle_ms": SERVO_PERIOD_NS * 1e-6}
    return replace(machine, table=table, effects=(latch,))


def first_placement(gauge: Gauge) -> Placement:
    """Along y, in the middle of the table."""
    length = float(gauge.block_centre_mm[-1] - gauge.block_centre_mm[0])
    c1 = np.array([325.0, 275.0 - length / 2.0, 150.0])
    return make_placement(c1, c1 + np.array([0.0, length, 0.0]), 1, gauge.n_blocks)


def hidden(cause: Effect) -> Hidden:
    """What makes an effect in HAL."""
    if cause["kind"] == "scale_error":
        return Hidden(scale_ppm={cause["axis"]: cause["ppm"]})
    if cause["kind"] == "reversal_error":
        return Hidden(play_um={cause["axis"]: cause["um"]})
    return Hidden(squareness_urad=cause["urad"])


# -- the process that knows ------------------------------------------------------------


class Hall:
    """LinuxCNC with the cause in its HAL file, and the hands that lay the gauge there."""

    def __init__(self, kind: str, seed: int, keep: Path) -> None:
        self.random, self.keep = np.random.default_rng(seed), keep
        cause = causes(self.random, kind)
        if kind == "reversal_error":
            cause["um"] = abs(cause["um"])  # play is never negative
        self.truth, self.salt = [cause], os.urandom(16).hex()
        self.gauge, self.machine = read_gauge(GAUGE), machine_file()
        self.deviation_um = self.random.normal(0.0, self.gauge.u_um)
        self.number = 0
        self.set_hal: Callable[[Iterable[str]], None] | None = None

    def lay(self, up: ExitStack, number: int, lies: dict[str, Any]) -> None:
        """The gauge is laid; the controller is started with the first one."""
        if number == self.number:  # the one who asks goes on with what was broken off
            return
        self.number, asked = number, placement_of_json(lies)
        hal = self.hal(asked if number == 1 else nearly(asked, self.random))
        if self.set_hal is not None:
            self.set_hal(laid_anew(hal))
            return
        program = program_of(FurtherRun("", asked, stays=True), self.gauge, self.machine)
        drives = Drives(acceleration_mm_s2=ACCELERATION_MM_S2)
        self.set_hal = up.enter_context(running(program, self.machine, hal, self.keep, drives, UP_S))

    def hal(self, lies: Placement) -> str:
        """The HAL file of the machine with its cause, and of the gauge where it lies."""
        template = EXAMPLES / "linuxcnc-concealed" / "concealed.hal.j2"
        tip_mm, chaos = self.machine.probe.tip_radius_mm, 2.0 - 0.1 * self.random.random()
        more = {"hidden": hidden(self.truth[0]), "lag_mm": LAG_MM, "chaos": chaos}
        return str(render_hal(self.gauge, lies, self.deviation_um, tip_mm, template, **more))


def hall(pipe: Connection, kind: str, seed: int, keep: Path) -> None:
    """The work of the process that knows; it ends when the answer was given, or when the other one is gone."""
    place = Hall(kind, seed, keep)
    pipe.send(seal(place.salt, place.truth))
    with ExitStack() as up:
        while True:
            try:
                what, *arguments = pipe.recv()
            except EOFError:
                return
            if what == "reveal":
                pipe.send((place.salt, place.truth))
                return
            try:
                pipe.send(place.lay(up, *arguments))
            except InputError as error:
                pipe.send(str(error))


# -- the process that asks ------------------------------------------------------------


@dataclass
class OnController(Served):
    """LinuxCNC by its Python interface; whoever lays the gauge is in the other process."""

    pipe: Any = None

    def stand(self, number: int, lies: Placement) -> None:
        """The hands lay the gauge; what they complain about ends the case."""
        self.pipe.send(("lay", number, placement_json(lies)))
        if refused := self.pipe.recv():
            raise InputError("linuxcnc", refused)


@contextmanager
def knowing(kind: str, seed: int, keep: Path) -> Iterator[Any]:
    """The process that knows, by its end of a pipe; ``keep``: folder that takes the controller's files."""
    mine, theirs = PROCESSES.Pipe()
    process = PROCESSES.Process(target=hall, args=(theirs, kind, seed, keep))
    process.start()
    theirs.close()
    try:
        yield mine
    finally:
        mine.close()
        process.join()


def draw(kind: str, seed: int, folder: Path, minutes: float) -> dict[str, Any]:
    """One cause in the controller, investigated."""
    with knowing(kind, seed, folder / "controller") as pipe:
        return _drawn(pipe, kind, folder / "cause", minutes)


def _drawn(pipe: Any, kind: str, folder: Path, minutes: float) -> dict[str, Any]:
    sealed, began_s = pipe.recv(), time.monotonic()
    case = Case(read_gauge(GAUGE), machine_file(), Reach(hands_minutes=HANDS_MINUTES), minutes=minutes)
    station = OnController("linuxcnc", case.machine, ControllerOptions(), None, pipe)
    found, answer, resumed = _resumed(case, station, folder, sealed)
    truth = revealed(pipe, sealed)
    right, alone, said = judged(answer, truth)
    end = found.learnt[-1]["end"]
    return {
        "kind": kind,
        "right": right,
        "alone": alone,
        "hidden": truth[0],
        "said": said,
        "runs": [made.run.words for made in found.runs],
        "placements": len(found.placements),
        "end": f"{end['how']}: {end['why']}",
        "machine_minutes": sum(made.machine_minutes for made in found.runs),
        "real_minutes": (time.monotonic() - began_s) / 60.0,
        "resumed": resumed,
    }


def _resumed(case: Case, station: Station, folder: Path, sealed: str) -> tuple[Investigation, GaugeDiagnosis, int]:
    """The loop, gone on with where the controller read a touch too early, as it does on a busy computer."""
    for attempt in range(ATTEMPTS):
        try:
            return *looped(case, station, first_placement(case.gauge), folder, sealed, attempt > 0), attempt
        except InputError as error:
            if STARVED not in str(error) or attempt == ATTEMPTS - 1:
                raise
    raise AssertionError


@click.command()
@click.option("--kinds", multiple=True, type=click.Choice(KINDS), default=KINDS, help="Default: all.")
@click.option("--seed", default=2026, show_default=True, type=click.IntRange(0))
@click.option("--minutes", default=40.0, show_default=True, help="Of machine and hands, that the loop may take.")
@click.option("--output", "-o", type=click.Path(path_type=Path), help="A line of JSON for every case.")
def main(kinds: tuple[str, ...], seed: int, minutes: float, output: Path | None) -> None:
    """Run the cases and print what was hidden and what was said."""
    for kind in kinds:
        with tempfile.TemporaryDirectory() as folder:
            line = json.dumps(draw(kind, seed + KINDS.index(kind), Path(folder), minutes))
        click.echo(line)
        if output:
            with output.open("a") as file:
                file.write(line + "\n")


if __name__ == "__main__":
    sys.exit(main())
