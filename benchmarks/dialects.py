"""Every dialect, from the plan to the evaluation: random placements -> text -> virtual controller -> log -> import.

    python benchmarks/dialects.py [--cases 200] [--options] [DIALECT ...]

A gauge that lies anywhere (turned, tilted, rolled) is planned on a random route and measured by a machine whose three
scales and probe err. What the text is read as must be the plan; what is evaluated from the log must be what is
evaluated from the readings themselves, and the forward error must be that of the scales, sum of a_i^2 ppm_i times the
length. The log's own digits are allowed for: half a digit in three coordinates of two faces.

With ``--options`` the shipped templates are only rendered and read back, each time with other values of all options
within their types: none may be refused.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from stepgauge.errors import InputError
from stepgauge.evaluation.evaluate import evaluate
from stepgauge.gauge.certified import read_gauge
from stepgauge.gauge.placement import Placement
from stepgauge.importing.build import ImportOptions
from stepgauge.importing.logs import import_log, read_run_program, recognise_log
from stepgauge.machine.file import Machine, read_machine
from stepgauge.machine.virtual import probing_settings, run_program
from stepgauge.planning.plan import ORDERS, ROUTES, PlanOptions
from stepgauge.planning.program import ProbingChoice, checked_program, make_settings, program_text
from stepgauge.programs import DIALECTS, Dialect
from stepgauge.programs.compare import difference, read_again
from stepgauge.programs.controller import controller_log
from stepgauge.programs.options import ChoiceOption, Name, Option
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


NAMES = {
    "siemens.file": ("STEPGAUGE_LOG", "PROT", "GAUGE_17_MPF", "A_1"),
    "heidenhain.folder": ("TNC:\\STEPGAUGE\\", "TNC:\\", "TNC:\\nc_prog\\Cal-2026\\"),
    "heidenhain.mask": ("STEPGAUGE.A", "m.a"),
    "heidenhain.file": ("STEPGAUGE.TXT", "out-1.log"),
    "rrf.file": ("0:/sys/stepgauge-log.txt", "1:/gcodes/GAUGE_2.csv"),
    "dmis.device": ("RESULTS", "R2", "Out-1"),
    "dmis.file": ("STEPGAUGE.DMO", "", "results", "Gauge_1.txt"),
}
"""Values of the options that are names."""


def random_value(dialect: str, name: str, option: Option, random: np.random.Generator) -> str:
    """A value of an option within its type; a number with none to three decimals."""
    kind = option.kind
    if isinstance(kind, ChoiceOption):
        return str(random.choice(kind.values))
    if isinstance(kind, Name):
        return str(random.choice(NAMES[f"{dialect}.{name}"]))
    if kind.may_be_left_out and random.random() < 0.5:
        return ""
    return f"{random.uniform(kind.least, kind.most):.{0 if kind.whole else random.integers(4)}f}"


def refusal(dialect: Dialect, random: np.random.Generator) -> str | None:
    """Why a shipped template was refused at a random placement with random options; None where it was not."""
    gauge = read_gauge("step-gauge-420")
    placement = random_placement(random, gauge.n_blocks)
    machine, _ = random_machine(random, placement)
    around = int(random.choice([-1, 1]))
    route, order = str(random.choice(ROUTES)), str(random.choice(ORDERS))
    options = PlanOptions(1, int(random.integers(2, 6)), route=route, order=order, cycles=1, around=around)
    choice = ProbingChoice(search_mm=float(random.uniform(0.5, 3.0)))
    settings = make_settings(gauge, machine, machine.probe.tip_radius_mm, choice)
    planned = checked_program(placement, gauge, machine, options, settings)
    said = {name: random_value(dialect.name, name, one, random) for name, one in dialect.options.items()}
    try:
        program_text(planned, dialect.name, options=said)
    except InputError as error:
        return f"{said}: {error}"
    return None


def refuse_none(names: list[str], cases: int) -> int:
    """A line per dialect; exit code 1 where a shipped template is refused."""
    print("dialect      cases  refused  time, s")
    bad = 0
    for name in names:
        began, random = time.perf_counter(), np.random.default_rng(46)
        found = [one for one in (refusal(DIALECTS[name], random) for _ in range(cases)) if one is not None]
        bad += len(found)
        print(f"{name:12s} {cases:5d} {len(found):8d} {time.perf_counter() - began:8.1f}", *found[:1], flush=True)
    return 1 if bad else 0


def main() -> int:
    """A line per dialect; exit code 1 where one is beyond what its log allows, or refused."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dialects", nargs="*", metavar="DIALECT", help="default: all that write a log")
    parser.add_argument("--cases", type=int, default=200)
    parser.add_argument("--options", action="store_true", help="shipped templates with random options: none is refused")
    asked = parser.parse_args()
    if asked.options:
        return refuse_none(asked.dialects or list(DIALECTS), asked.cases)
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
