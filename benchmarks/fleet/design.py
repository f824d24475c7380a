"""Who measured what and when: visits of a gauge and a probe to a machine, each a few recordings on one day.

The design is crossed: every gauge goes to many machines and every machine sees several gauges. It has the gaps of a
real one: machines that are visited once, gauges that stay in a hall for a month, gauges that never leave one machine.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date, datetime, time, timedelta
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.fleet.parts import HALLS, Gauge, Machine, Random, make_gauge, make_machine

FIRST_DAY, DAYS = date(2024, 10, 1), 730
DIRECTIONS = {"x": (1.0, 0.0), "x_shifted": (1.0, 0.0), "y": (0.0, 1.0), "diagonal": (1.0, 1.0), "cross": (-1.0, 1.0)}
"""Placements of a gauge in the table's plane; ``x_shifted`` lies beside the fixture."""
SETS = (("x", "y"), ("x", "y", "diagonal"), ("x", "y", "diagonal", "cross"), ("x", "x_shifted", "y"), ("x", "cross"))
AT_ONE_MACHINE = 3
"""Gauges that never leave their machine, which sees no other; always along x in the same fixture."""
BAD_GAUGE_MACHINES = 12
ROWS = 400
MACHINES_OF_A_DAY = 4
"""Machines that are visited in one hall on one day, on average."""


@dataclass(frozen=True)
class Recording:
    """One placement of a gauge; indices into the fleet's machines and gauges. ``day`` counts from the first."""

    name: str
    day: int
    visit: int
    machine: int
    gauge: int
    probe: str
    placement: str
    axis: tuple[float, float, float]
    middle_mm: tuple[float, float, float]
    cycles: int
    temperature_C: float
    clock_s: float

    @property
    def measured_at(self) -> datetime:
        """Local time at which it began."""
        return datetime.combine(FIRST_DAY, time()) + timedelta(days=self.day, seconds=round(self.clock_s))


@dataclass(frozen=True)
class Fleet:
    """Machines, gauges, and all recordings in the order of their dates. ``shared`` is used on twelve machines only."""

    machines: list[Machine]
    gauges: list[Gauge]
    recordings: list[Recording]
    shared: int
    captive: dict[int, int]

    @cached_property
    def machine_of(self) -> NDArray[np.int64]:
        return np.array([recording.machine for recording in self.recordings])

    @cached_property
    def gauge_of(self) -> NDArray[np.int64]:
        return np.array([recording.gauge for recording in self.recordings])

    @cached_property
    def day_of(self) -> NDArray[np.int64]:
        return np.array([recording.day for recording in self.recordings])

    @cached_property
    def probe_of(self) -> NDArray[np.str_]:
        return np.array([recording.probe for recording in self.recordings])

    @cached_property
    def hall_of(self) -> NDArray[np.str_]:
        return np.array([self.machines[recording.machine].hall for recording in self.recordings])

    @cached_property
    def line_of(self) -> NDArray[np.str_]:
        return np.array([self.machines[recording.machine].line for recording in self.recordings])

    @cached_property
    def names_of(self) -> dict[str, NDArray[np.str_]]:
        """Of every recording the name of its owner, by kind of owner."""
        return {
            "machine": np.array([machine.name for machine in self.machines])[self.machine_of],
            "gauge": np.array([gauge.name for gauge in self.gauges])[self.gauge_of],
            "hall": self.hall_of,
            "type": self.line_of,
            "probe": self.probe_of,
        }

    def owned(self, owner_kind: str, owner: str) -> NDArray[np.bool_]:
        """Which recordings an owner takes part in."""
        return np.asarray(self.names_of[owner_kind] == owner)


@dataclass
class _Visit:
    day: int
    machine: int
    gauge: int
    probe: str
    placements: tuple[str, ...]


def make_fleet(seed: int, recordings: int, machines: int = 200, gauges: int = 20) -> Fleet:
    """A fleet of so many recordings; small numbers of recordings have fewer machines and gauges (5 and 50 of each)."""
    random = np.random.default_rng([seed, 1])
    machines = min(machines, max(12, recordings // 5))
    gauges = min(gauges, max(6, recordings // 50))
    shop = [make_machine(number, random) for number in range(1, machines + 1)]
    captive = _captives(machines, gauges, random)
    bars = [make_gauge(k + 1, random, _longest_mm(k, captive), k in captive) for k in range(gauges)]
    shared = int(random.choice([k for k in range(gauges) if k not in captive and bars[k].length_mm < 640.0]))
    visits = _visits(shop, bars, captive, shared, recordings, random)
    return Fleet(shop, bars, _recordings(visits, shop, bars, captive, recordings, random), shared, captive)


def _captives(machines: int, gauges: int, random: Random) -> dict[int, int]:
    """Gauges that stay at one machine, by their index, and that machine."""
    count = min(AT_ONE_MACHINE, gauges // 5)
    chosen = random.choice(gauges, count, replace=False)
    hosts = random.choice(machines, count, replace=False)
    return {int(gauge): int(host) for gauge, host in zip(chosen, hosts, strict=True)}


def _longest_mm(number: int, captive: dict[int, int]) -> float:
    """A third of the gauges may be long; those do not fit along x on the small machines."""
    return 1000.0 if number % 3 == 0 and number not in captive else 640.0


def _visits(
    shop: list[Machine], bars: list[Gauge], captive: dict[int, int], shared: int, recordings: int, random: Random
) -> list[_Visit]:
    """Days in a hall on which some machines are visited, until there are enough recordings."""
    weight = random.gamma(1.0, 1.0, len(shop)) + 0.15
    weight[list(captive.values())] += 2.0
    free = [k for k in range(len(shop)) if k not in captive.values()]
    customers = _customers(shop, bars[shared], free, weight, random)
    away = [k for k in range(len(bars)) if k not in captive and k != shared]
    probes = {hall: [f"P{10 * k + j + 1:02d}" for j in range(10)] for k, hall in enumerate(HALLS)}
    host_of = {host: gauge for gauge, host in captive.items()}
    season = int(random.integers(1 << 30))
    seen: set[int] = set()
    visits: list[_Visit] = []
    while sum(len(visit.placements) for visit in visits) < recordings:
        day, hall = _workday(random), str(random.choice(HALLS))
        here = [k for k, machine in enumerate(shop) if machine.hall == hall]
        if not here:
            continue
        share = weight[here] / weight[here].sum()
        count = min(len(here), 1 + int(random.poisson(MACHINES_OF_A_DAY - 1)))
        at_hand = _at_hand(away, hall, [season, day // 30], random)
        for machine in random.choice(here, count, replace=False, p=share):
            takes_shared = machine in customers and (machine not in seen or random.random() < 0.5)
            gauge = host_of.get(int(machine), shared if takes_shared else at_hand[0])
            seen.add(int(machine))
            at_hand = at_hand[1:] + at_hand[:1]
            placements = ("x",) if gauge in captive else SETS[random.integers(len(SETS))]
            fitting = tuple(name for name in placements if _fits(bars[gauge], shop[machine], name))
            if fitting:
                visits.append(_Visit(day, int(machine), gauge, str(random.choice(probes[hall])), fitting))
    return sorted(visits, key=lambda visit: visit.day)


def _customers(shop: list[Machine], gauge: Gauge, free: list[int], weight: np.ndarray, random: Random) -> set[int]:
    """The machines that use the shared gauge: those often visited among the ones it fits."""
    fitting = [k for k in free if _fits(gauge, shop[k], "x")]
    count = min(BAD_GAUGE_MACHINES, len(fitting) // 2)
    often = sorted(fitting, key=lambda k: -weight[k])[: 3 * count]
    return {int(k) for k in random.choice(often, count, replace=False)}


def _workday(random: Random) -> int:
    while True:
        day = int(random.integers(DAYS))
        if (FIRST_DAY + timedelta(days=day)).weekday() < 5:
            return day


def _at_hand(away: list[int], hall: str, month: list[int], random: Random) -> list[int]:
    """The gauges in a hall that month, in the order in which they are taken today: they travel once a month."""
    spread = np.random.default_rng(month).permutation(away)
    here = [int(gauge) for gauge in spread[HALLS.index(hall) :: len(HALLS)]]
    return [here[k] for k in random.permutation(len(here))]


def _fits(gauge: Gauge, machine: Machine, placement: str) -> bool:
    dx, dy = np.abs(DIRECTIONS[placement]) / np.hypot(*DIRECTIONS[placement])
    spare = 160.0 if placement == "x_shifted" else 40.0
    return bool(
        gauge.length_mm * dx <= machine.travel_mm[0] - spare and gauge.length_mm * dy <= machine.travel_mm[1] - 40
    )


def _recordings(
    visits: list[_Visit],
    shop: list[Machine],
    bars: list[Gauge],
    captive: dict[int, int],
    count: int,
    random: Random,
) -> list[Recording]:
    table: list[Recording] = []
    for number, visit in enumerate(visits):
        warm_C = stated_temperature_C(shop[visit.machine], visit.day) + float(random.normal(0.0, 0.1))
        hour = float(random.choice([8.0, 10.5, 13.0, 15.5]))
        for turn, placement in enumerate(visit.placements):
            loose = 0.0 if visit.gauge in captive else 1.0
            recording = _lay(visit, placement, shop[visit.machine], bars[visit.gauge], loose, random)
            table.append(
                Recording(
                    **recording,
                    name=f"R{len(table) + 1:05d}",
                    visit=number,
                    temperature_C=round(warm_C + float(random.normal(0.0, 0.03)), 2),
                    clock_s=3600.0 * (hour + 0.6 * turn),
                )
            )
    return table[:count]


def _lay(visit: _Visit, placement: str, machine: Machine, gauge: Gauge, loose: float, random: Random) -> dict[str, Any]:
    """Where one gauge lies: within 3 mm of its place in the fixture, within some mrad of its direction.

    ``loose`` is 1 where it is laid by hand, 0 where it is bolted down.
    """
    dx, dy = np.array(DIRECTIONS[placement]) / np.hypot(*DIRECTIONS[placement])
    axis = np.array([dx, dy, 0.0]) + loose * random.normal(0.0, 2e-3, 3)
    axis /= np.linalg.norm(axis)
    middle = np.array(machine.fixture_mm) + loose * random.uniform(-3.0, 3.0, 3)
    if placement == "x_shifted":
        spare = (machine.travel_mm[0] - gauge.length_mm) / 2.0 - 20.0
        middle[0] += random.choice([-1.0, 1.0]) * random.uniform(50.0, spare)
    room = np.array(machine.travel_mm) - np.abs(axis) * (gauge.length_mm + 8.0)
    middle = np.clip(
        middle, np.array(machine.travel_mm) / 2.0 - room / 2.0, np.array(machine.travel_mm) / 2.0 + room / 2.0
    )
    return {
        "day": visit.day,
        "machine": visit.machine,
        "gauge": visit.gauge,
        "probe": visit.probe,
        "placement": placement,
        "axis": tuple(float(value) for value in axis),
        "middle_mm": tuple(float(value) for value in middle),
        "cycles": max(2, round(ROWS / (2 * gauge.blocks))),
    }


def stated_temperature_C(machine: Machine, day: int) -> float:
    """What the thermometers of a hall show: H1 is held at 20, H2 and H3 follow the season about something warmer."""
    middle_C, swing_K = {"H1": (20.0, 0.2), "H2": (20.7, 0.8), "H3": (20.9, 0.6)}[machine.hall]
    summer = np.sin(2.0 * np.pi * (day + 60.0) / 365.25 + np.pi)
    return float(middle_C + swing_K * summer + machine.warmth_K)
