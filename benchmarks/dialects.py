"""Every dialect, from the plan to the evaluation: random placements -> text -> virtual controller -> log -> import.

    python benchmarks/dialects.py [--cases 200] [DIALECT ...]

A gauge that lies anywhere (turned, tilted, rolled) is planned on a random route and measured by a machine whose three
scales and probe err. What the text is read as must be the plan; what is evaluated from the log must be what is
evaluated from the readings themselves, and the forward error must be that of the scales, sum of a_i^2 ppm_i times the
length. The log's own digits are allowed for: half a digit in three coordinates of two faces.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from stepgauge.evaluation.evaluate import evaluate
from stepgauge.gauge.certified import read_gauge
from stepgauge.gauge.placement import Placement
from stepgauge.importing import ImportOptions, import_log, read_run_program, recognise_log
from stepgauge.machine.file import Machine, read_machine
from stepgauge.machine.virtual import probing_settings, run_program
from stepgauge.planning.plan import ORDERS, ROUTES, PlanOptions
from stepgauge.planning.program import ProbingChoice, checked_program, make_settings
from stepgauge.programs import DIALECTS, Dialect
from stepgauge.programs.compare import difference, read_again
from stepgauge.programs.controller import controller_log
from stepgauge.programs.render import render

BLOCKS, CYCLES = 5, 2
EXACT_UM = 0.01
ROOM_MM = 5000.0


@dataclass(frozen=True)
class Outcome:
    """One placement: the difference between plan and text (None: none), and the largest differences of errors, um."""

    difference: str | None
    from_readings_um: float
    from_injected_um: float
    lines: int


def allowed_um(dialect: Dialect) -> float:
    """0.01 um, and what the digits of the log do to the difference of two faces at worst."""
    assert dialect.log_decimals is not None
    return EXACT_UM + 3**0.5 * 1e3 * 10.0**-dialect.log_decimals


def random_placement(random: np.random.Generator, blocks: int) -> Placement:
    """Any direction of the axis, any roll about it."""
    axis, other = random.normal(size=(2, 3))
    axis /= np.linalg.norm(axis)
    up = other - axis * (other @ axis)
    start = random.uniform(-200.0, 200.0, 3)
    return Placement(start, start + 20.0 * (blocks - 1) * axis, axis, up / np.linalg.norm(up), 1, blocks)


def random_machine(random: np.random.Generator, placement: Placement) -> tuple[Machine, np.ndarray]:
    """A machine with scale errors in the three axes, um/m, whose head holds the stylus square to the gauge."""
    plain = read_machine("bridge-cmm")
    ppm = random.uniform(-40.0, 40.0, 3)
    effects = tuple({"kind": "scale_error", "axis": axis, "ppm": float(p)} for axis, p in zip("xyz", ppm, strict=True))
    room = plain.table.travel_mm.model_copy(update=dict.fromkeys("xyz", (-ROOM_MM, ROOM_MM)))
    table = plain.table.model_copy(update={"repeatability_um": 0.0, "travel_mm": room})
    probe = plain.probe.model_copy(update={"stylus_direction": tuple(float(-value) for value in placement.up)})
    return replace(plain, table=table, probe=probe, effects=effects), ppm


def outcome(dialect: Dialect, random: np.random.Generator, folder: Path) -> Outcome:
    """One placement, all the way; :class:`stepgauge.errors.InputError` where something is refused."""
    gauge = read_gauge("step-gauge-420")
    placement = random_placement(random, gauge.n_blocks)
    machine, ppm = random_machine(random, placement)
    route, order = random.choice(ROUTES), random.choice(ORDERS)
    around = int(random.choice([-1, 1]))
    options = PlanOptions(1, BLOCKS, route=str(route), order=str(order), cycles=CYCLES, around=around)
    settings = make_settings(gauge, machine, machine.probe.tip_radius_mm, ProbingChoice())
    planned = dialect.slowed(checked_program(placement, gauge, machine, options, settings))
    text = render(planned, dialect)
    found = difference(planned, read_again(text, dialect, settings), dialect)
    own = probing_settings(machine, settings.search_mm)
    run = run_program(dialect.read(text, "program", own), machine, gauge, placement, 1)
    log = controller_log(text, "program", dialect, own, run)
    assert log.alarm is None, log.alarm
    (folder / "program").write_text(text)
    (folder / "log").write_text(log.text)
    program, _ = read_run_program(folder / "program", machine.probe.tip_radius_mm)
    choice = ImportOptions(gauge_temperature_C=20.0)
    source = recognise_log(folder / "log")
    imported = import_log(folder / "log", source, gauge, placement, program, choice).recording
    blocks = (1, BLOCKS)
    back, direct = (evaluate(one, gauge, blocks).results[0].xf_um for one in (imported, run.recording))
    length_mm = gauge.position_mm[: 2 * BLOCKS] - gauge.position_mm[0]
    injected = (placement.axis**2 @ ppm) * length_mm * 1e-3
    return Outcome(
        found,
        float(np.nanmax(np.abs(back - direct))),
        float(np.nanmax(np.abs(back - injected)[::2])),
        len(text.splitlines()),
    )


def main() -> int:
    """A line per dialect; exit code 1 where one is beyond what its log allows."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dialects", nargs="*", metavar="DIALECT", help="default: all that write a log")
    parser.add_argument("--cases", type=int, default=200)
    asked = parser.parse_args()
    known = asked.dialects or [one.name for one in DIALECTS.values() if one.log_decimals is not None]
    print("dialect      cases  differences  worst from readings, um  worst from injected, um  allowed, um  time, s")
    bad = 0
    with tempfile.TemporaryDirectory() as folder:
        for name in known:
            began, dialect = time.perf_counter(), DIALECTS[name]
            random = np.random.default_rng(21)
            outcomes = [outcome(dialect, random, Path(folder)) for _ in range(asked.cases)]
            differing = [one.difference for one in outcomes if one.difference is not None]
            worst = [max(getattr(one, key) for one in outcomes) for key in ("from_readings_um", "from_injected_um")]
            bad += bool(differing) or max(worst) > allowed_um(dialect)
            print(
                f"{name:12s} {len(outcomes):5d} {len(differing):12d} {worst[0]:24.4f} {worst[1]:24.4f}"
                f" {allowed_um(dialect):12.4f} {time.perf_counter() - began:8.1f}",
                flush=True,
            )
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
