"""Where an investigation measures: on a machine behind a server, or on the virtual CMM of this process.

The gauge is laid by a person in the one case; in the other it is laid nearly as asked, as a person would lay it.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field, replace
from typing import ClassVar, Protocol

import numpy as np

from stepgauge.errors import InputError
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement, make_placement
from stepgauge.investigation.locating import LAID_MM
from stepgauge.live.addressing import linked
from stepgauge.live.clock import MachineClock
from stepgauge.live.cmm import LiveCmm
from stepgauge.live.controller import ControllerOptions, Link
from stepgauge.live.faults import Faults
from stepgauge.live.in_process import VirtualLink
from stepgauge.machine.file import Machine
from stepgauge.motion.moves import ProbingSettings

Stop = Callable[[], bool]


class Station(Protocol):
    """A machine to measure on, and whoever lays the gauge."""

    wishes: ControllerOptions
    repeats: ClassVar[bool]
    """Whether it does the same again, by its seed: so an investigation that goes on brings it to where it was."""

    def stand(self, number: int, lies: Placement) -> None:
        """From now on the gauge lies nearly so; ``number``: of the placement, from 1."""

    def mount(self, stylus: int) -> None:
        """From now on the machine has the stylus of this number; the gauge lies as it did."""

    def wait(self, seconds: float) -> None:
        """Nothing for so long."""

    def linked(self, settings: ProbingSettings) -> AbstractContextManager[Link]:
        """A link for as long as it is needed."""


@dataclass
class Served:
    """A machine behind an I++ DME server, or LinuxCNC; a person lays the gauge."""

    server: str
    machine: Machine
    wishes: ControllerOptions = field(default_factory=ControllerOptions)
    stop: Stop | None = None
    repeats: ClassVar[bool] = False

    def stand(self, number: int, lies: Placement) -> None:
        """The person has laid it."""

    def mount(self, stylus: int) -> None:
        """The person or the machine has changed it."""

    def wait(self, seconds: float) -> None:
        """Real time passes; a wish to stop ends it."""
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            if self.stop is not None and self.stop():
                raise KeyboardInterrupt
            time.sleep(0.1)

    @contextmanager
    def linked(self, settings: ProbingSettings) -> Iterator[Link]:
        """A session of its own, for as long as it is needed."""
        with linked(self.server, settings, self.machine, stop=self.stop) as link:
            yield link


class Simulated:
    """The virtual CMM of this process, with faults that the machine file does not have.

    Parameters
    ----------
    machine, gauge : what the investigation believes
    faults : effects and events that are concealed from it
    seed : of the repeatability and of how exactly the gauge is laid
    gauge_temperature_C : true and indicated
    """

    repeats: ClassVar[bool] = True

    def __init__(
        self,
        machine: Machine,
        gauge: Gauge,
        faults: Faults | None = None,
        seed: int = 0,
        gauge_temperature_C: float | None = None,
        stop: Stop | None = None,
    ) -> None:
        self.machine, self.gauge, self.faults, self.seed, self.stop = machine, gauge, faults or Faults(), seed, stop
        self.gauge_temperature_C, self.wishes = gauge_temperature_C, ControllerOptions(home=True)
        self.clock, self.stylus = MachineClock(None), 1
        self._cmm: LiveCmm | None = None

    def stand(self, number: int, lies: Placement) -> None:
        """The gauge is laid; the first placement is that of its file, the others are met as well as a person can."""
        random = np.random.default_rng([self.seed, number, round(self.clock.now_s * 1e3)])
        true = lies if number == 1 else nearly(lies, np.random.default_rng([self.seed, number]))
        seed, heat_C = int(random.integers(2**32)), self.gauge_temperature_C
        before = self._cmm
        self._cmm = LiveCmm(self.machine, self.gauge, true, self.clock, self.faults, heat_C, seed, self.stylus)
        if before is not None:
            self._cmm.position_mm = before.position_mm

    def mount(self, stylus: int) -> None:
        """Another tip at the machine, where it stands."""
        self.stylus = stylus
        if self._cmm is not None:
            self._cmm.mount(stylus)

    def wait(self, seconds: float) -> None:
        """The clock goes on."""
        self.clock.advance_to(self.clock.now_s + seconds)

    @contextmanager
    def linked(self, settings: ProbingSettings) -> Iterator[Link]:
        """The machine itself."""
        if self._cmm is None:
            raise InputError("the virtual CMM", "no gauge lies on it")
        yield VirtualLink(self._cmm, settings, self.stop)


def nearly(asked: Placement, random: np.random.Generator) -> Placement:
    """A placement whose ends are off the asked ones by up to half of what is allowed, in the plane of the table."""
    along = np.linalg.norm(asked.c2_mm - asked.c1_mm) * asked.axis
    off = random.uniform(-1.0, 1.0, (2, 3)) * LAID_MM / 2.0 * np.array([1.0, 1.0, 0.1])
    axis = along + off[1] - off[0]
    axis *= np.linalg.norm(along) / np.linalg.norm(axis)
    c1 = asked.c1_mm + off[0]
    moved = make_placement(c1, c1 + axis, asked.first_block, asked.last_block, asked.up)
    return replace(moved, gauge_serial=asked.gauge_serial)
