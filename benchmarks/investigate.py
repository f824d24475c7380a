"""Does the closed loop find concealed causes, and in how little machine time?

    python -m benchmarks.investigate [--draws N] [--kinds KIND ...] [--seed S] [-o results.jsonl]
    python -m benchmarks.investigate --pairs N [--seed S] [-o pairs.jsonl]

The machine with the fault is in another process, behind an I++ DME server; it draws the fault, gives a SHA-256 of it
before anything is measured, and tells it when the answer has been given. Its hands lay the gauge as a person would.
Beside the loop it measures two fixed plans: the full plan (five placements, three cycles each, two more speeds), and as
much of it, with two cycles, as the loop had machine time for.

An answer is right where the cause that is there is named first or in the set, and nothing else is named beside it; of
a pair, two causes of different kinds at once, where each is named so by a finding of its own.
"""

from __future__ import annotations

import asyncio
import hashlib
import json
import math
import multiprocessing
import os
import statistics
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations, permutations
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import click
import numpy as np
import pandas as pd

from benchmarks.blind.score import wilson_interval
from stepgauge.diagnosis.engine import diagnose
from stepgauge.diagnosis.further_runs import FurtherRun
from stepgauge.diagnosis.result import GaugeDiagnosis
from stepgauge.effects import make_effects
from stepgauge.errors import InputError
from stepgauge.executors.journal import open_steps
from stepgauge.gauge.certified import read_gauge
from stepgauge.gauge.placement import Placement, make_placement
from stepgauge.investigation.decision import Case
from stepgauge.investigation.feasible_runs import LOCATING_MINUTES, placement_json, placement_of_json, program_of
from stepgauge.investigation.loop import Investigation
from stepgauge.investigation.running import Runner
from stepgauge.investigation.stations import Served, Station, nearly
from stepgauge.live.clock import MachineClock
from stepgauge.live.cmm import LiveCmm
from stepgauge.live.controller import ControllerOptions
from stepgauge.live.faults import Faults
from stepgauge.live.machine_state import MachineState
from stepgauge.live.server import Server, ServerAddress
from stepgauge.machine.file import Machine, read_machine
from stepgauge.machine.virtual import RunConditions, run_program
from stepgauge.recording import Recording

GAUGE, MACHINE = "step-gauge-420", "bridge-cmm"
PROCESSES = multiprocessing.get_context("spawn")
HANDS_S = 300.0
Effect = dict[str, Any]


def _signed(random: np.random.Generator, usual: float) -> float:
    """A size that is clear beside the scatter: one to two and a half times the usual one, of either sign."""
    return float(random.choice([-1.0, 1.0]) * usual * random.uniform(1.0, 2.5))


def causes(random: np.random.Generator, kind: str) -> Effect:
    """A concealed cause of a kind."""
    axis = str(random.choice(["x", "y"]))
    own: dict[str, Effect] = {
        "angular_error": {"travel_axis": axis, "rotation_axis": "z", "urad_per_m": _signed(random, 20.0)},
        "block_defect": {"face": int(random.integers(3, 40)), "um": _signed(random, 1.5)},
        "effective_radius": {"um": _signed(random, 1.0)},
        "gauge_temperature": {"delta_K": _signed(random, 0.5)},
        "periodic_scale_error": {
            "axis": axis,
            "period_mm": float(random.uniform(30.0, 150.0)),
            "amplitude_um": abs(_signed(random, 0.8)),
            "phase_deg": float(random.uniform(0.0, 360.0)),
        },
        "probe_lobing": {"amplitude_um": abs(_signed(random, 1.0)), "phase_deg": float(random.uniform(0.0, 120.0))},
        "reversal_error": {"axis": axis, "um": _signed(random, 1.0)},
        "scale_curvature": {"axis": axis, "um_per_m2": _signed(random, 20.0)},
        "scale_error": {"axis": axis, "ppm": _signed(random, 4.0)},
        "squareness": {"plane": "xy", "urad": _signed(random, 6.0)},
        "step_change": {"direction": axis, "time_s": float(random.uniform(20.0, 150.0)), "um": _signed(random, 1.5)},
        "straightness": {"axis": "x", "direction": "y", "um": _signed(random, 4.0), "length_mm": 700.0},
        "thermal_drift": {"direction": axis, "rate_um_per_h": _signed(random, 15.0)},
        "trigger_delay": {"ms": abs(_signed(random, 0.3))},
        "nothing": {},
    }
    return {"kind": kind, **own[kind]}


KINDS = (
    *("angular_error", "block_defect", "effective_radius", "gauge_temperature", "nothing", "periodic_scale_error"),
    *("probe_lobing", "reversal_error", "scale_curvature", "scale_error", "squareness", "step_change", "straightness"),
    *("thermal_drift", "trigger_delay"),
)
AND = " and "


def drawn_pairs(seed: int, count: int) -> list[str]:
    """The names of so many different pairs of kinds, in the order in which the seed draws them."""
    every = [AND.join(two) for two in combinations([kind for kind in KINDS if kind != "nothing"], 2)]
    return [every[int(index)] for index in np.random.default_rng(seed).permutation(len(every))[:count]]


# -- the process that knows ------------------------------------------------------------


class Hall:
    """The machine with its fault, the server in front of it, and the hands that lay the gauge."""

    def __init__(self, kinds: Sequence[str], seed: int) -> None:
        self.random = np.random.default_rng(seed)
        self.truth = [causes(self.random, kind) for kind in kinds if kind != "nothing"]
        self.salt = os.urandom(16).hex()
        self.gauge, self.machine = read_gauge(GAUGE), read_machine(MACHINE)
        self.faulty = replace(self.machine, effects=(*self.machine.effects, *self.truth))
        self.faults = Faults(make_effects(self.truth, "faults"))
        self.clock = MachineClock(None)
        self.state: MachineState | None = None

    def lay(self, number: int, lies: dict[str, Any]) -> int:
        """The gauge is laid; the port of the server."""
        asked = placement_of_json(lies)
        true = asked if number == 1 else nearly(asked, self.random)
        self.clock.advance_to(self.clock.now_s + (HANDS_S if number > 1 else 0.0))
        seed = int(self.random.integers(2**32))
        cmm = LiveCmm(self.machine, self.gauge, true, self.clock, self.faults, None, seed)
        if self.state is None:
            self.state = MachineState(cmm)
            return self._serve(self.state)
        cmm.position_mm, cmm.homed = self.state.cmm.position_mm, True
        self.state.cmm = cmm
        return 0

    def _serve(self, state: MachineState) -> int:
        ports: list[int] = []
        ready = threading.Event()
        server = Server(state, ServerAddress(port=0, idle_s=1e5))

        async def run() -> None:
            await server.run(lambda _, port: (ports.append(port), ready.set()), signals=False)

        threading.Thread(target=asyncio.run, args=(run(),), daemon=True).start()
        ready.wait(20.0)
        return ports[0]

    def measured(self, runs: list[tuple[int, dict[str, Any], int, float | None]]) -> list[pd.DataFrame]:
        """Rows of runs of a fixed plan, each a placement with its number, cycles and speed; one clock for all."""
        frames, now_s = [], 0.0
        for number, lies, cycles, speed in runs:
            asked = placement_of_json(lies)
            run = FurtherRun("", asked, speed, cycles=cycles, stays=True)
            conditions = RunConditions(20.0, number, now_s)
            seed = int(self.random.integers(2**32))
            program = program_of(run, self.gauge, self.machine)
            done = run_program(program, self.faulty, self.gauge, asked, seed, conditions)
            frame = done.recording.frame
            before = max((int(f["cycle"].max()) for f in frames if f["placement"].iloc[0] == number), default=0)
            frames.append(frame.assign(cycle=frame["cycle"] + before))
            now_s = float(frame["time_s"].max()) + HANDS_S
        return frames


def hall(pipe: Connection, kinds: Sequence[str], seed: int) -> None:
    """The work of the process that knows: answers until it is told that the answer has been given."""
    place = Hall(kinds, seed)
    pipe.send(seal(place.salt, place.truth))
    while True:
        what, *arguments = pipe.recv()
        if what == "reveal":
            pipe.send((place.salt, place.truth))
            return
        pipe.send(place.lay(*arguments) if what == "lay" else place.measured(*arguments))


# -- the process that asks ------------------------------------------------------------


@dataclass
class Behind(Served):
    """The machine behind the server of the other process; whoever lays the gauge is there, too."""

    pipe: Any = None

    def stand(self, number: int, lies: Placement) -> None:
        """The hands lay the gauge."""
        self.pipe.send(("lay", number, placement_json(lies)))
        port = self.pipe.recv()
        if port:
            self.server = f"127.0.0.1:{port}"

    def wait(self, seconds: float) -> None:
        """An unscaled machine waits in no time, and its clock stands: a pause is none here."""


@dataclass
class Result:
    """One draw: whether loop, fixed plan and full plan named the cause, and the machine minutes of each."""

    kind: str
    right: dict[str, bool] = field(default_factory=dict)
    alone: dict[str, bool] = field(default_factory=dict)
    said: dict[str, str] = field(default_factory=dict)
    minutes: dict[str, float] = field(default_factory=dict)
    runs: int = 0
    end: str = ""


def first_placement() -> Placement:
    """How the gauge lies at first: along y, in the middle of x."""
    gauge = read_gauge(GAUGE)
    length = float(gauge.block_centre_mm[-1] - gauge.block_centre_mm[0])
    return make_placement([350.0, 400.0, 150.0], [350.0, 400.0 + length, 150.0], 1, gauge.n_blocks)


def fixed_plan() -> list[tuple[int, Placement, float | None]]:
    """The placements of the full plan in their order, and the speeds of the first one."""
    first = first_placement()
    middle, half = (first.c1_mm + first.c2_mm) / 2.0, np.linalg.norm(first.c2_mm - first.c1_mm) / 2.0
    steep = np.sqrt(0.5)
    axes = [(1.0, 0.0, 0.0), (steep, steep, 0.0), (steep, -steep, 0.0)]
    laid = [make_placement(middle - half * np.array(a), middle + half * np.array(a), 1, first.last_block) for a in axes]
    up = np.array([0.0, 0.0, 350.0])
    laid.append(make_placement(first.c1_mm + up, first.c2_mm + up, 1, first.last_block))
    own = read_machine(MACHINE).table.measuring_speed_mm_s
    plan: list[tuple[int, Placement, float | None]] = [(n, one, None) for n, one in enumerate([first, *laid], 1)]
    return [*plan, (5, laid[-1], own / 3.0), (5, laid[-1], own * 3.0)]


def plan_minutes(frames: list[pd.DataFrame], placements: int) -> float:
    """Machine minutes of the runs of a fixed plan, with the locating of all placements but the first."""
    return sum(float(np.ptp(f["time_s"])) / 60.0 for f in frames) + (placements - 1) * LOCATING_MINUTES


def judged(found: GaugeDiagnosis, truth: Sequence[Effect]) -> tuple[bool, bool, str]:
    """Whether the answer is right, whether it is right and alone, and what it says; ``truth``: none, one or a pair."""
    said = found.summary().split(" (rms")[0]
    if not truth:
        return found.verdict == "adequate", found.verdict == "adequate", said
    if found.verdict != "effects" or len(found.findings) != len(truth):
        return False, False, said
    named = [list(zip(truth, order, strict=True)) for order in permutations(found.findings)]
    right = any(all(cause["kind"] in (one.kind, *one.confounded_with) for cause, one in pairs) for pairs in named)
    alone = any(all({cause["kind"]} == {one.kind, *one.confounded_with} for cause, one in pairs) for pairs in named)
    return right, alone, said


def draw(kind: str, seed: int, folder: Path, minutes: float) -> Result:
    """One concealed cause, or a pair of them, investigated, and measured by both plans."""
    mine, theirs = PROCESSES.Pipe()
    process = PROCESSES.Process(target=hall, args=(theirs, kind.split(AND), seed), daemon=True)
    process.start()
    try:
        return _drawn(mine, kind, folder, minutes)
    finally:
        process.terminate()
        process.join(10.0)


def _drawn(pipe: Any, kind: str, folder: Path, minutes: float) -> Result:
    sealed = pipe.recv()
    gauge, machine = read_gauge(GAUGE), read_machine(MACHINE)
    case = Case(gauge, machine, minutes=minutes)
    station = Behind("", machine, ControllerOptions(home=True), None, pipe)
    found, answer = looped(case, station, first_placement(), folder, sealed)
    answers, end = {"loop": answer}, found.learnt[-1]["end"]
    result = Result(kind, runs=len(found.runs), end=f"{end['how']}: {end['why']}")
    result.minutes["loop"] = sum(made.machine_minutes for made in found.runs)
    full = _measured(pipe, 3)
    result.minutes["full"] = plan_minutes(full, 5)
    answers["full"] = _diagnosed(full, machine)
    same = _within(_measured(pipe, 2), result.minutes["loop"])
    result.minutes["same"] = plan_minutes(same, len({int(f["placement"].iloc[0]) for f in same}))
    answers["same"] = _diagnosed(same, machine)
    truth = revealed(pipe, sealed)
    for name, answer in answers.items():
        result.right[name], result.alone[name], result.said[name] = judged(answer, truth)
    return result


def looped(
    case: Case, station: Station, first: Placement, folder: Path, sealed: str, again: bool = False
) -> tuple[Investigation, GaugeDiagnosis]:
    """The loop to its end, and what it says; ``again``: it was broken off, and goes on."""
    steps = open_steps(folder, {"draw": sealed}, again)
    try:
        found = Investigation(case, Runner(case, station, steps, lambda _: True), first)
        found.go_through()
    finally:
        steps.close()
    return found, diagnose(found.recording, case.gauge, case.machine, priors=case.priors)


def revealed(pipe: Any, sealed: str) -> list[Effect]:
    """The truth, which must be what was sealed."""
    pipe.send(("reveal",))
    salt, truth = pipe.recv()
    if seal(salt, truth) != sealed:
        raise InputError("the truth", "is not what was sealed")
    told: list[Effect] = truth
    return told


def seal(salt: str, truth: Sequence[Effect]) -> str:
    """What is said of the truth before the answer: a SHA-256."""
    return hashlib.sha256(json.dumps([salt, truth]).encode()).hexdigest()


def stopped(kind: str, why: str) -> Result:
    """A draw that ended with an error: wrong, whatever the plans would have said."""
    plans = ("loop", "same", "full")
    wrong, minutes = dict.fromkeys(plans, False), dict.fromkeys(plans, math.nan)
    return Result(kind, wrong, dict(wrong), dict.fromkeys(plans, why), minutes, 0, f"error: {why}")


def _measured(pipe: Any, cycles: int) -> list[pd.DataFrame]:
    pipe.send(("measured", [(n, placement_json(one), cycles, speed) for n, one, speed in fixed_plan()]))
    frames: list[pd.DataFrame] = pipe.recv()
    return frames


def _within(frames: list[pd.DataFrame], minutes: float) -> list[pd.DataFrame]:
    """As much of a fixed plan as fits into the minutes, one run at least."""
    counts = range(len(frames), 0, -1)
    fits = (
        n for n in counts if plan_minutes(frames[:n], len({int(f["placement"].iloc[0]) for f in frames[:n]})) <= minutes
    )
    return frames[: next(fits, 1)]


def _diagnosed(frames: list[pd.DataFrame], machine: Machine) -> GaugeDiagnosis:
    return diagnose(Recording(pd.concat(frames, ignore_index=True), {}, "fixed plan"), read_gauge(GAUGE), machine)


def table(results: list[Result]) -> Iterator[str]:
    """The kinds with the most misses first."""
    yield "| cause | draws | loop: right (alone) | fixed plan, same minutes | full plan | minutes: loop, full |"
    yield "|---|---|---|---|---|---|"
    kinds = sorted({one.kind for one in results}, key=lambda k: (_share(results, k, "loop"), k))
    for kind in [*kinds, "all"]:
        own = [one for one in results if kind in (one.kind, "all")]
        cells = [f"{sum(o.right[n] for o in own)} ({sum(o.alone[n] for o in own)})" for n in ("loop", "same", "full")]
        median = [_median([o.minutes[n] for o in own]) for n in ("loop", "full")]
        yield f"| {kind.replace('_', ' ')} | {len(own)} | {' | '.join(cells)} | {median[0]:.1f}, {median[1]:.1f} |"


def _share(results: list[Result], kind: str, name: str) -> float:
    own = [one.right[name] for one in results if one.kind == kind]
    return sum(own) / len(own)


def _median(values: list[float]) -> float:
    """Of the draws that came to an end."""
    ended = [value for value in values if not math.isnan(value)]
    return statistics.median(ended) if ended else math.nan


def bars(results: list[Result]) -> Iterator[str]:
    """The bars of the loop: 95 % of the causes and 90 % of the pairs that the full plan solves, in half of its time."""
    pairs = [one for one in results if AND in one.kind]
    for words, own, bar in (("causes", [one for one in results if AND not in one.kind], 95), ("pairs", pairs, 90)):
        if own:
            solved = [one.right["loop"] for one in own if one.right["full"]]
            low, high = (100.0 * share for share in wilson_interval(sum(solved), len(solved)))
            yield f"of {len(solved)} {words} that the full plan solves the loop solves {sum(solved)} (bar {bar} %)"
            yield f"95 % interval of that share: {low:.0f} % to {high:.0f} %"
    ratio = _median([one.minutes["loop"] / one.minutes["full"] for one in results])
    yield f"machine time of the loop over that of the full plan: {ratio:.2f} (median; bar 0.5)"


@click.command()
@click.option("--draws", default=10, show_default=True, type=click.IntRange(0), help="Of each kind; 0: only the table.")
@click.option("--kinds", multiple=True, type=click.Choice(KINDS), help="Default: all.")
@click.option("--pairs", type=click.IntRange(0), help="Draw so many pairs of causes in place of single ones.")
@click.option("--seed", default=2026, show_default=True, type=click.IntRange(0))
@click.option("--minutes", default=90.0, show_default=True, help="Of machine and hands, that the loop may take.")
@click.option("--output", "-o", type=click.Path(path_type=Path), help="A line of JSON for every draw; goes on with it.")
def main(draws: int, kinds: tuple[str, ...], pairs: int | None, seed: int, minutes: float, output: Path | None) -> None:
    """Run the draws and print the table."""
    results = (
        [Result(**json.loads(line)) for line in output.read_text().splitlines()] if output and output.exists() else []
    )
    for kind, own_seed in _to_draw(results, draws, kinds, pairs, seed):
        began = time.monotonic()
        result = _ended(kind, own_seed, minutes)
        results.append(result)
        if output:
            with output.open("a") as file:
                file.write(json.dumps(vars(result)) + "\n")
        took = time.monotonic() - began
        click.echo(f"{kind}, seed {own_seed}: {result.right} {result.said['loop']} ({took:.0f} s)", err=True)
    for line in (*table(results), *bars(results)):
        click.echo(line)


def _to_draw(
    results: list[Result], draws: int, kinds: tuple[str, ...], pairs: int | None, seed: int
) -> list[tuple[str, int]]:
    """What is not there yet: kinds, or pairs of them, each with its seed, every kind once before the second time."""
    have = [one.kind for one in results]
    if pairs is not None:
        return [(kind, seed + number) for number, kind in enumerate(drawn_pairs(seed, pairs)) if kind not in have]
    return [
        (kind, seed + 1000 * index + number)
        for number in range(draws)
        for index, kind in enumerate(KINDS)
        if (not kinds or kind in kinds) and have.count(kind) <= number
    ]


def _ended(kind: str, seed: int, minutes: float) -> Result:
    """A draw, whatever its end."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            return draw(kind, seed, Path(folder), minutes)
        except InputError as error:
            return stopped(kind, str(error))


if __name__ == "__main__":
    sys.exit(main())
