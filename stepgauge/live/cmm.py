"""The virtual CMM, one move at a time: where it is, what stops it, what it indicates at a touch.

The physics are those of :mod:`stepgauge.machine.virtual`: contact of the ball, pre-travel of the probe, effects and
repeatability of the machine. Here they act at the time of the machine's clock.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from stepgauge.effects import Effect, Probings, Setting, total_displacement_um
from stepgauge.effects.totals import scatter_um
from stepgauge.files.arrays import Array
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.ippdme.codes import DmeError
from stepgauge.live.clock import MachineClock
from stepgauge.live.faults import NUMBERS, Faults
from stepgauge.live.obstacles import Surroundings
from stepgauge.machine.file import Machine
from stepgauge.machine.readout import machine_effects
from stepgauge.motion.collision import make_obstacles, make_tool
from stepgauge.recording import APPROACH, POSITION
from stepgauge.recording.columns import SCALE_TEMPERATURES

MEMORY = 4096
"""Probings that effects with a memory look back on."""
LEAST_MM = 1e-12
BY_HAND_MM = 10.0
"""How far a person moves the machine out along the stylus."""


@dataclass(frozen=True)
class TimedMove:
    """A straight move: from where to where (mm), from when to when (s), and the error that ends it, if one does."""

    start_mm: Array
    end_mm: Array
    begin_s: float
    end_s: float
    error: DmeError | None = None
    lost: bool = False

    def at(self, time_s: float) -> Array:
        """Position at a time, mm."""
        if self.end_s <= self.begin_s:
            return self.end_mm
        share = min(max((time_s - self.begin_s) / (self.end_s - self.begin_s), 0.0), 1.0)
        return self.start_mm + share * (self.end_mm - self.start_mm)

    def cut(self, share: float, error: DmeError, lost: bool = False) -> TimedMove:
        """The leg that ends early with an error."""
        end_s = self.begin_s + share * (self.end_s - self.begin_s)
        return TimedMove(
            self.start_mm, self.start_mm + share * (self.end_mm - self.start_mm), self.begin_s, end_s, error, lost
        )


@dataclass(frozen=True)
class Touch:
    """The end of a search: true tip centre at the contact and at the trigger, and the number of the (nearest) face."""

    contact_mm: Array
    trigger_mm: Array
    approach: Array
    face: int
    speed_mm_s: float
    time_s: float


class _Row(dict[str, Any]):
    """The columns of one probing; made arrays when they are asked for, for most effects ask for few."""

    def __getitem__(self, name: str) -> Any:
        return np.array([super().__getitem__(name)])


class _Remembering(Probings):
    """The last probing alone; tells whether an effect asked for those before it."""

    def __init__(self, row: dict[str, float], setting: Setting, first_row: int) -> None:
        super().__init__(_Row(row), setting)
        self._first_row, self.asked = first_row, False

    @property
    def first_row(self) -> int:
        return self._first_row

    def touches_since_pause(self, pause_s: float) -> Array:
        self.asked = True
        return super().touches_since_pause(pause_s)

    def rest_s(self) -> Array:
        self.asked = True
        return super().rest_s()

    def since_placed_s(self) -> Array:
        self.asked = True
        return super().since_placed_s()

    def rested(self, touches: float) -> Array:
        self.asked = True
        return super().rested(touches)

    def lagged(self, name: str, lag_s: float | Array) -> Array:
        self.asked = True
        return super().lagged(name, lag_s)

    def way(self) -> Array:
        self.asked = True
        return super().way()

    def since_turning_mm(self) -> Array:
        self.asked = True
        return super().since_turning_mm()

    def held_mm(self, column: str, way_mm: float) -> Array:
        self.asked = True
        return super().held_mm(column, way_mm)

    def run_mm(self, axis: str) -> Array:
        self.asked = True
        return super().run_mm(axis)


class LiveCmm:
    """A machine with the gauge on its table.

    Parameters
    ----------
    machine, gauge, placement : the machine file with its styli, the certified gauge, and how it truly lies
    clock : time of the machine
    faults : what the machine file does not say
    gauge_temperature_C : of the gauge, true and indicated
    seed : of the repeatability; None: another one each time
    stylus : the number of the one that is in, which faults may ask for
    """

    def __init__(
        self,
        machine: Machine,
        gauge: Gauge,
        placement: Placement,
        clock: MachineClock,
        faults: Faults | None = None,
        gauge_temperature_C: float | None = None,
        seed: int | None = None,
        stylus: int = 1,
    ) -> None:
        self._with_first, self.machine, self.clock = machine, machine, clock
        self.faults = faults or Faults()
        self.gauge_temperature_C = gauge.temperature_C(gauge_temperature_C)
        self.effects: list[Effect] = [*machine_effects(machine), *self.faults.effects]
        self.homed = False
        self.points = self.completed = 0
        self._obstacles = make_obstacles(gauge, placement, self.gauge_temperature_C)
        self._put_in(stylus)
        self.position_mm = self.home_mm
        self._setting = Setting.of(machine, gauge, {1: placement.axis})
        self._random = np.random.default_rng(seed)
        self._rows: deque[dict[str, float]] = deque(maxlen=MEMORY)
        self._remembers = False
        self._contact_mm: Array | None = None

    def mount(self, stylus: int) -> None:
        """A stylus is put in by its number, where the machine stands: its tip is where the chain has it."""
        own = self.machine.chain
        self._put_in(stylus)
        its = self.machine.chain
        shift_mm = np.zeros(3) if own is None or its is None else np.subtract(its.tip_mm, own.tip_mm)
        low_mm, high_mm = self.limits_mm.T
        self.position_mm, self._contact_mm = np.clip(self.position_mm + shift_mm, low_mm, high_mm), None

    def _put_in(self, stylus: int) -> None:
        """The probe of its file, and the travel of its tip."""
        self.stylus, self.machine = stylus, self._with_first.select_stylus(stylus)
        self.limits_mm = self.machine.travel_mm
        self._limits = self.limits_mm.tolist()
        self._around = Surroundings(self._obstacles, make_tool(self.machine.probe))
        self._pretravel_um: dict[bytes, float] = {}

    @property
    def styli(self) -> tuple[Machine, ...]:
        """The machine with each further stylus."""
        return self._with_first.styli

    @property
    def home_mm(self) -> Array:
        """Where the machine homes: at the low ends of x and y, and up."""
        return np.array([self.limits_mm[0, 0], self.limits_mm[1, 0], self.limits_mm[2, 1]])

    @property
    def tip_radius_mm(self) -> float:
        """True radius of the tip ball, mm."""
        return self.machine.probe.tip_radius_mm

    @property
    def upward(self) -> Array:
        """Unit vector from the tip to the probe's body."""
        return self._around.tool.upward

    def scale_temperature_C(self) -> float:
        """What the machine says of its scales, deg C."""
        return self.machine.table.temperature_C

    def inside(self, position_mm: Array) -> bool:
        """Whether a position is within the travel."""
        pairs = zip(position_mm.tolist(), self._limits, strict=True)
        return all(low <= value <= high for value, (low, high) in pairs)

    def leg(self, target_mm: Array, speed_mm_s: float, searching: bool = False) -> TimedMove:
        """The move from here to a target; it ends where something stops it, with the error.

        ``searching``: the ball may touch what it meets at the end.
        """
        begin_s, start = self.clock.now_s, self.position_mm
        length = math.dist(target_mm, start)
        whole = TimedMove(start, target_mm, begin_s, begin_s + length / speed_mm_s)
        clear = start if self._contact_mm is None else self._contact_mm
        hit = self._around.hit(clear, target_mm, with_tip=not searching) if length > LEAST_MM else None
        if hit is not None:
            is_tip = hit.part is self._around.tool.parts[0]
            whole = whole.cut(hit.share, DmeError(1001 if is_tip else 2504))
        event = self.faults.take(self.completed, begin_s, whole.end_s, searching)
        if event is None or event[0].kind == "missed_face":
            return whole if event is None else replace(whole, error=DmeError(1006))
        return whole.cut(event[1], DmeError(NUMBERS[event[0].kind]), lost=event[0].kind == "connection_lost")

    def arrive(self, leg: TimedMove) -> None:
        """The leg is done."""
        self.position_mm, self._contact_mm = leg.end_mm, None
        self.clock.advance_to(leg.end_s)

    def halt(self, leg: TimedMove) -> None:
        """The leg is broken off now; a probe that is still deflected springs back to the contact."""
        here, contact = leg.at(self.clock.now_s), self._contact_mm
        if contact is not None and float((here - contact) @ (leg.start_mm - contact)) > 0.0:
            here = contact
        self.position_mm, self._contact_mm = here, None

    def move_by_hand(self) -> None:
        """A person moves the standing machine out along the stylus, as far as the travel lets."""
        away = self.position_mm + BY_HAND_MM * self.upward
        self.position_mm, self._contact_mm = np.clip(away, self.limits_mm[:, 0], self.limits_mm[:, 1]), None

    def measure_by_hand(self, from_mm: Array, to_mm: Array) -> Array | None:
        """A person brings the tip to a place and on until it triggers, and back; the indicated tip centre, mm.

        None where nothing is met.
        """
        self.position_mm, self._contact_mm = from_mm, None
        _, touch = self.search(from_mm, to_mm, self.machine.table.measuring_speed_mm_s)
        found = None if touch is None else self.indicate(touch)
        self.position_mm, self._contact_mm = from_mm, None
        return found

    def search(self, start_mm: Array, end_mm: Array, speed_mm_s: float) -> tuple[TimedMove, Touch | None]:
        """The search from here: its leg, and the touch that ends it. Without one the leg has the error.

        Beyond the travel there is no search: it ends at the limit, with error 2500 where nothing was met before.
        """
        approach = (end_mm - start_mm) / math.dist(end_mm, start_mm)
        share = self._share_inside(start_mm, end_mm)
        end = start_mm + share * (end_mm - start_mm)
        found = self._around.contact(start_mm, end)
        if found is None:
            leg = self.leg(end, speed_mm_s, searching=True)
            return (leg if leg.error else replace(leg, error=DmeError(1006 if share == 1.0 else 2500))), None
        contact = start_mm + found[0] * (end - start_mm)
        pretravel_um = self._pretravel(approach)
        leg = self.leg(contact, speed_mm_s, searching=True)
        if leg.error is not None or not np.isfinite(pretravel_um):
            return (leg if leg.error else replace(leg, error=DmeError(2504))), None
        trigger = contact + pretravel_um * 1e-3 * approach
        time_s = leg.end_s + pretravel_um * 1e-3 / speed_mm_s
        return leg, Touch(contact, trigger, approach, self._face(contact, approach, found[1]), speed_mm_s, time_s)

    def indicate(self, touch: Touch) -> Array:
        """The indicated tip centre of a touch, mm: effects and repeatability added to where it truly was."""
        self.clock.advance_to(touch.time_s)
        self.position_mm, self._contact_mm = touch.trigger_mm, touch.contact_mm
        row = self._row(touch)
        displacement_um = self._displacement_um(row, touch.approach)
        self.points += 1
        return touch.trigger_mm + displacement_um * 1e-3

    def _displacement_um(self, row: dict[str, float], approach: Array) -> Array:
        if not self._remembers:
            alone = _Remembering(row, self._setting, self.points)
            um, sigma = self._sums(alone)
            if not alone.asked:
                return um + sigma * self._random.standard_normal() * approach
            self._remembers = True  # effects ask at every probing or at none: no earlier one is missed
        self._rows.append(row)
        columns = {name: np.array([one[name] for one in self._rows]) for name in row}
        um, sigma = self._sums(Probings(columns, self._setting))
        return um + sigma * self._random.standard_normal() * approach

    def _sums(self, probings: Probings) -> tuple[Array, float]:
        """Displacement of the last row and its standard deviation along the approach, um."""
        sigma = scatter_um(self.effects, probings, self.machine.table.virtual_repeatability_um)[-1]
        return total_displacement_um(self.effects, probings)[-1], float(np.ravel(sigma)[-1])

    def _row(self, touch: Touch) -> dict[str, float]:
        row: dict[str, float] = {"placement": 1, "cycle": 1, "face": touch.face, "stylus": self.stylus}
        row |= dict(zip(POSITION, touch.trigger_mm.tolist(), strict=True))
        row |= dict(zip(APPROACH, touch.approach.tolist(), strict=True))
        row |= {"time_s": touch.time_s, "speed_mm_s": touch.speed_mm_s, "gauge_temperature_C": self.gauge_temperature_C}
        return row | dict.fromkeys(SCALE_TEMPERATURES, self.scale_temperature_C())

    def _pretravel(self, approach: Array) -> float:
        key = approach.round(9).tobytes()
        if key not in self._pretravel_um:
            if len(self._pretravel_um) > MEMORY:
                self._pretravel_um.clear()
            self._pretravel_um[key] = float(self.machine.sensor.pretravel_um(approach[None])[0])
        return self._pretravel_um[key]

    def _face(self, contact_mm: Array, approach: Array, row: int) -> int:
        """The face that is touched; at the side, the top or the rail, the face nearest to it."""
        along = float(approach @ self._obstacles.placement.axis)
        if row == self._obstacles.rail_row:
            place = self._obstacles.placement.to_gauge(self._obstacles.gauge, contact_mm)[0]
            row = int(np.abs(self._obstacles.low_mm[:-1, 0] - place).argmin())
        return 2 * row + (1 if along > 0.0 else 2)

    def _share_inside(self, start_mm: Array, end_mm: Array) -> float:
        """How much of a way is within the travel, from its beginning."""
        if self.inside(end_mm):
            return 1.0
        step = end_mm - start_mm
        with np.errstate(divide="ignore", invalid="ignore"):
            to_limit = np.where(step > 0.0, self.limits_mm[:, 1] - start_mm, self.limits_mm[:, 0] - start_mm) / step
        return float(min(1.0, np.nanmin(np.where(step == 0.0, np.inf, to_limit))))
