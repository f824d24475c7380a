"""Does another stylus at hand tell the loop what one stylus cannot?

    python -m benchmarks.investigate_stylus [--draws N] [--seed S] [-o results.jsonl]

The x carriage of a bridge yaws as it travels, or its scale is too long. The tip of the one stylus is always equally far
beside the guide, so that readings along x, at any place and speed, are the same; that of a cranked one is on its other
side. Half of the draws are the one, half the other, of sizes that displace the readings of the first stylus alike. Each
is investigated with the first stylus alone and with both at hand, on the virtual CMM of this process, unsealed.
"""

from __future__ import annotations

import json
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import numpy as np

from benchmarks.investigate import GAUGE, MACHINE, judged
from stepgauge.diagnosis.engine import diagnose
from stepgauge.effects import make_effects
from stepgauge.executors.journal import open_steps
from stepgauge.gauge.certified import read_gauge
from stepgauge.gauge.placement import Placement, make_placement
from stepgauge.investigation.decision import Case
from stepgauge.investigation.feasible_runs import Reach
from stepgauge.investigation.loop import Investigation
from stepgauge.investigation.running import Runner
from stepgauge.investigation.stations import Simulated
from stepgauge.live.faults import Faults
from stepgauge.machine.file import ChainTable, Machine, read_machine
from stepgauge.machine.styli import add_styli

ARM_MM = 100.0
"""From the guide of x to the tip of the first stylus, along y."""
BESIDE_MM = 150.0
"""How far beside it the cranked one has its tip."""
MINUTES = 90.0


def with_tip(stylus_mm: tuple[float, float, float], **probe: Any) -> Machine:
    """The machine with its chain and a stylus."""
    machine = read_machine(MACHINE)
    reference = {"x": (0.0, -ARM_MM, 300.0), "y": (-300.0, 0.0, 0.0)}
    chain = ChainTable(probe=["y", "x", "z"], reference_mm=reference, stylus_mm=stylus_mm)
    table = machine.table.model_copy(update={"chain": chain})
    return replace(machine, table=table, probe=machine.probe.model_copy(update=probe), path=probe.get("name", ""))


def first_placement() -> Placement:
    """Along x."""
    gauge = read_gauge(GAUGE)
    end = 130.0 + float(gauge.block_centre_mm[-1] - gauge.block_centre_mm[0])
    return make_placement([130.0, 600.0, 150.0], [end, 600.0, 150.0], 1, gauge.n_blocks)


def cause(number: int, random: np.random.Generator) -> dict[str, Any]:
    """A yaw or a scale error, one after the other, of 4 um/m to 10 um/m along x with the first stylus."""
    size = float(random.choice([-1.0, 1.0]) * random.uniform(4.0, 10.0))
    if number % 2:
        return {"kind": "scale_error", "axis": "x", "ppm": size}
    return {"kind": "angular_error", "travel_axis": "x", "rotation_axis": "z", "urad_per_m": size * 1e3 / ARM_MM}


def draw(hidden: dict[str, Any], seed: int, machine: Machine, folder: Path) -> dict[str, Any]:
    """One investigation: whether its answer is right, whether alone, and what it took."""
    case = Case(read_gauge(GAUGE), machine, Reach(level=True), minutes=MINUTES)
    station = Simulated(machine, case.gauge, Faults(make_effects([hidden], "faults")), seed)
    steps = open_steps(folder, {"seed": seed}, False)
    try:
        found = Investigation(case, Runner(case, station, steps, lambda _: True), first_placement())
        found.go_through()
    finally:
        steps.close()
    right, alone, said = judged(diagnose(found.recording, case.gauge, machine), [hidden])
    spent = {"machine_minutes": sum(made.machine_minutes for made in found.runs), "minutes": found.spent_minutes}
    end = found.learnt[-1]["end"]
    return {
        "right": right,
        "alone": alone,
        "said": said,
        "end": end,
        "styli": [m.run.stylus for m in found.runs],
        **spent,
    }


@click.command()
@click.option("--draws", default=10, show_default=True, type=click.IntRange(1))
@click.option("--seed", default=2026, show_default=True, type=click.IntRange(0))
@click.option("--output", "-o", type=click.Path(path_type=Path), help="A line of JSON for every draw.")
def main(draws: int, seed: int, output: Path | None) -> None:
    """Run the draws and print what was hidden and what was said, with one stylus and with both."""
    one = with_tip((0.0, 0.0, -50.0))
    cranked = with_tip((0.0, -BESIDE_MM, -80.0), name="cranked", stylus_length_mm=80.0, tip_radius_mm=1.5)
    for number in range(draws):
        hidden = cause(number, np.random.default_rng([seed, number]))
        told: dict[str, Any] = {"hidden": hidden}
        for name, machine in (("one stylus", one), ("both", add_styli(one, [cranked]))):
            with tempfile.TemporaryDirectory() as folder:
                told[name] = draw(hidden, seed + number, machine, Path(folder))
        click.echo(json.dumps(told))
        if output:
            with output.open("a") as file:
                file.write(json.dumps(told) + "\n")


if __name__ == "__main__":
    sys.exit(main())
