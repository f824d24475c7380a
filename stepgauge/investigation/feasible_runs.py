"""Which further runs are within reach, and what each costs in minutes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from stepgauge.diagnosis.further_runs import SPEED_FACTOR, FurtherRun, laid_elsewhere, program_of
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement, make_placement
from stepgauge.machine.file import Machine
from stepgauge.machine.styli import stylus_words
from stepgauge.planning.program import duration_s, fastest_mm_s

LOCATING_MINUTES = 3.0
"""Seven probings from outside, with the long ways between them."""
WAIT_S = 1200.0
FEW_BLOCKS_CYCLES = 5
LEVEL_SIN = 0.01
ELSEWHERE_MM, TURNED_COS = 50.0, 0.97
"""Placements nearer than this, in directions nearer than this, are one."""


@dataclass(frozen=True)
class Reach:
    """Where the gauge may be laid and what that costs.

    ``region_mm (3, 2)``: lowest and highest coordinates that the ends of the gauge may have, None for the travel;
    ``level``: the gauge lies on the table, at the height at which it is, and is neither lifted nor inclined;
    ``hands_minutes``: to lay it elsewhere, or to change the stylus; ``cycles``: of a whole run; ``racked``: numbers of
    the styli that the machine changes to by itself.
    """

    region_mm: tuple[tuple[float, float], ...] | None = None
    level: bool = False
    hands_minutes: float = 5.0
    cycles: int = 2
    racked: frozenset[int] = frozenset()

    def rest_minutes(self, run: FurtherRun) -> float:
        """What a run takes besides the machine: a pause, or hands."""
        if run.stays:
            return run.wait_s / 60.0
        by_hand = run.changed and run.stylus not in self.racked
        return self.hands_minutes * (run.is_laid + by_hand)

    def allows(self, run: FurtherRun, first: Placement) -> bool:
        """Whether the gauge may lie so."""
        ends = np.array([run.placement.c1_mm, run.placement.c2_mm])
        if self.level and not (
            abs(run.placement.axis[2] - first.axis[2]) < LEVEL_SIN
            and abs(float(ends[:, 2].mean() - (first.c1_mm + first.c2_mm)[2] / 2.0)) < 1.0
        ):
            return False
        if self.region_mm is None:
            return True
        low, high = np.array(self.region_mm).T
        return bool((ends >= low).all() and (ends <= high).all())


def possible_runs(data: Residuals, placements: Sequence[Placement], machine: Machine, reach: Reach) -> list[FurtherRun]:
    """Runs that have not been made yet: with the gauge as it lies now, laid elsewhere, and with another stylus.

    ``placements``: how the gauge was laid, the last one being how it lies.
    """
    here, cycles = placements[-1], reach.cycles
    stylus = [int(data.stylus[data.placement == place][0]) for place in range(len(placements))]
    mounted = stylus[-1]
    runs = list(_runs_in_place(data, here, machine, cycles))
    taken = [one for one, own in zip(placements, stylus, strict=True) if own == mounted]
    for run in (one for base in (placements[0], here) for one in laid_elsewhere(data, base)):
        if not any(_same(run.placement, one) for one in taken) and reach.allows(run, placements[0]):
            runs.append(replace(run, cycles=cycles))
            taken.append(run.placement)
    with_others = _stylus_runs(machine, cycles, list(zip(placements, stylus, strict=True)))
    return [*(_mount_stylus(run, mounted) for run in runs), *with_others]


def _mount_stylus(run: FurtherRun, mounted: int) -> FurtherRun:
    """A run with the stylus that is in the machine, which is told where it is not that of the machine file."""
    return run if mounted == 1 else replace(run, words=f"{run.words}, with stylus {mounted}", stylus=mounted)


def _stylus_runs(machine: Machine, cycles: int, made: Sequence[tuple[Placement, int]]) -> Iterator[FurtherRun]:
    """The gauge as it lies, or laid again as it lay, with every other stylus with which it was not measured so."""
    others = [number for number in range(1, len(machine.styli) + 2) if number != made[-1][1]]
    for number in others:
        taken = [lies for lies, stylus in made if stylus == number]
        for place in range(len(made), 0, -1):
            lies, kept = made[place - 1][0], place == len(made)
            if not any(_same(lies, one) for one in taken):
                where = f"{'as it lies' if kept else 'again as'} in placement {place}"  # nothing is proposed twice
                words = f"the gauge {where}, with {stylus_words(machine, number)}"
                yield FurtherRun(words, lies, cycles=cycles, stylus=number, changed=True, kept=kept)
                taken.append(lies)


def _runs_in_place(data: Residuals, here: Placement, machine: Machine, cycles: int) -> Iterator[FurtherRun]:
    """Other speeds, another order, a pause, and a few blocks often, with the gauge where it is."""
    own = machine.table.measuring_speed_mm_s
    done = set(np.round(data.frame["speed_mm_s"], 6)) if "speed_mm_s" in data.frame else set()
    for speed in (max(own / SPEED_FACTOR, 0.1), min(own * SPEED_FACTOR, fastest_mm_s(machine)[0])):
        if round(speed, 6) not in done:
            words = f"the gauge as it lies, at {speed:.3g} mm/s instead of {own:.3g} mm/s"
            yield FurtherRun(words, here, speed, cycles=cycles, wait_s=0.0, stays=True)
    yield FurtherRun("the gauge as it lies, there and back", here, cycles=2, order="up-down", wait_s=0.0, stays=True)
    pause = f"the gauge as it lies, after a pause of {WAIT_S / 60.0:g} min"
    yield FurtherRun(pause, here, cycles=cycles, wait_s=WAIT_S, stays=True)
    count = data.gauge.n_blocks
    some = tuple(sorted({1, (count + 1) // 2, count}))
    words = f"the gauge as it lies, blocks {', '.join(map(str, some))} {FEW_BLOCKS_CYCLES} times"
    yield FurtherRun(words, here, cycles=FEW_BLOCKS_CYCLES, blocks=some, wait_s=0.0, stays=True)


def _same(one: Placement, other: Placement) -> bool:
    apart = np.linalg.norm((one.c1_mm + one.c2_mm - other.c1_mm - other.c2_mm) / 2.0)
    return bool(one.axis @ other.axis > TURNED_COS and apart < ELSEWHERE_MM)


def directions(placements: Sequence[Placement]) -> int:
    """How many directions the gauge was laid in; end for end is the same."""
    kept: list[Array] = []
    for one in placements:
        if all(abs(float(one.axis @ other)) < TURNED_COS for other in kept):
            kept.append(one.axis)
    return len(kept)


class Costed(NamedTuple):
    """A run with the minutes that it takes of the machine, locating included, and in all with hands and pauses."""

    run: FurtherRun
    machine_minutes: float
    minutes: float


def cost_runs(runs: Sequence[FurtherRun], gauge: Gauge, machine: Machine, reach: Reach) -> Iterator[Costed]:
    """Runs whose path is free, with what they cost."""
    for run in runs:
        try:
            machine_s = duration_s(program_of(run, gauge, machine))
        except InputError:
            continue
        own = machine_s / 60.0 + (0.0 if run.stays else LOCATING_MINUTES)
        yield Costed(run, own, own + reach.rest_minutes(run))


def run_json(run: FurtherRun) -> dict[str, Any]:
    """A run as JSON types, to be read by :func:`run_of`."""
    names = ("words", "speed_mm_s", "cycles", "order", "wait_s", "stays", "stylus", "changed", "kept")
    said = {name: getattr(run, name) for name in names}
    return {
        **said,
        "blocks": None if run.blocks is None else list(run.blocks),
        "placement": placement_json(run.placement),
    }


def run_of(said: dict[str, Any]) -> FurtherRun:
    """The run that :func:`run_json` wrote."""
    blocks = None if said["blocks"] is None else tuple(said["blocks"])
    return FurtherRun(**{**said, "blocks": blocks, "placement": placement_of_json(said["placement"])})


def placement_json(placement: Placement) -> dict[str, Any]:
    """A placement as JSON types."""
    vectors = {name: [float(v) for v in getattr(placement, name)] for name in ("c1_mm", "c2_mm", "up")}
    return {**vectors, "first_block": placement.first_block, "last_block": placement.last_block}


def placement_of_json(said: dict[str, Any]) -> Placement:
    """The placement that :func:`placement_json` wrote."""
    return make_placement(said["c1_mm"], said["c2_mm"], said["first_block"], said["last_block"], said["up"])
