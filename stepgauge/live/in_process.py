"""The virtual CMM of this process as a machine to measure on: the same physics as behind the server, without lines."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from stepgauge.files.arrays import Array
from stepgauge.ippdme.codes import DmeError
from stepgauge.live.cmm import LiveCmm, TimedMove
from stepgauge.live.connection import ConnectionLostError, StopAskedError
from stepgauge.live.controller import ControllerOptions, MeasuredPoint
from stepgauge.motion.moves import ProbingSettings
from stepgauge.recording.columns import SCALE_TEMPERATURES


class VirtualLink:
    """A link to a virtual CMM; ``stop``: asked before every move whether to stop."""

    name = "the virtual CMM"
    simulated = True

    def __init__(self, cmm: LiveCmm, settings: ProbingSettings, stop: Callable[[], bool] | None = None) -> None:
        self.cmm, self.settings, self._stop, self._heeds_stop = cmm, settings, stop or (lambda: False), True

    def prepare(self, wishes: ControllerOptions) -> None:
        """The clock runs; a virtual machine is homed."""
        self.cmm.homed = True
        self.cmm.clock.start()

    def position_mm(self) -> Array:
        """Where the machine stands, shape ``(3,)``."""
        return self.cmm.position_mm

    def temperatures_C(self) -> dict[str, float]:
        """Of the gauge and of the scales, deg C."""
        scales = dict.fromkeys(SCALE_TEMPERATURES, self.cmm.scale_temperature_C())
        return {"gauge_temperature_C": self.cmm.gauge_temperature_C, **scales}

    def time_s(self) -> float | None:
        """The machine's clock."""
        return self.cmm.clock.now_s

    def go(self, place_mm: Array) -> None:
        """Move to a place, shape ``(3,)``."""
        if not self.cmm.inside(place_mm):
            raise DmeError(1008, "GoTo")
        self._travel(self.cmm.leg(place_mm, self.settings.travel_speed_mm_s))

    def probe(self, surface_mm: Array, approach: Array, takes_s: float) -> MeasuredPoint:
        """To the stand-off, search, and back by the retract distance."""
        contact = surface_mm - self.settings.tip_radius_mm * approach
        start = contact - self.settings.standoff_mm * approach
        self.go(start)
        end = contact + self.settings.search_mm * approach
        leg, touch = self.cmm.search(start, end, self.settings.measuring_speed_mm_s)
        try:
            self._travel(leg)
        except DmeError as error:
            if error.number == 1006:  # nothing was met: it goes back to where the search began
                self.go(start)
            raise
        assert touch is not None
        indicated = self.cmm.indicate(touch)
        back = touch.trigger_mm - self.settings.retract_mm * approach
        self.go(np.clip(back, self.cmm.limits_mm[:, 0], self.cmm.limits_mm[:, 1]))
        self.cmm.completed += 1
        return MeasuredPoint(indicated.tolist(), self.cmm.tip_radius_mm, touch.time_s)

    def touched_mm(self, approach: Array) -> Array:
        """Where the tip touched last, by where the machine stands, shape ``(3,)``."""
        return self.cmm.position_mm + self.settings.retract_mm * approach

    def _travel(self, leg: TimedMove) -> None:
        if self._heeds_stop and self._stop():
            raise StopAskedError
        self.cmm.arrive(leg)
        if leg.lost:
            raise ConnectionLostError("the virtual CMM is gone")
        if leg.error is not None:
            raise leg.error

    def abort(self) -> None:
        """Nothing moves between two commands."""

    def clear(self) -> None:
        """The wish to stop, which led here, is heeded no more."""
        self._heeds_stop = False

    def end(self) -> None:
        """Nothing: the machine stays as it is."""
