"""Time of the machine: real time, so many times as fast, or only as long as the motions take."""

from __future__ import annotations

import time
from collections.abc import Callable


class MachineClock:
    """Seconds since the first session.

    ``speed``: how many seconds of the machine pass in one of real time; None: time passes in motions alone, and these
    take no real time. ``start_s``: what the clock shows at first. ``real``: the clock of real time, s.
    """

    def __init__(
        self, speed: float | None = 1.0, start_s: float = 0.0, real: Callable[[], float] = time.monotonic
    ) -> None:
        self.speed, self._real = speed, real
        self._passed_s = self._offset_s = start_s
        self._zero: float | None = None

    def start(self) -> None:
        """The clock runs from now on; nothing if it does already."""
        if self._zero is None:
            self._zero = self._real()

    @property
    def now_s(self) -> float:
        """The time of the machine."""
        if self.speed is None or self._zero is None:
            return self._passed_s
        return max(self._passed_s, self._offset_s + (self._real() - self._zero) * self.speed)

    def advance_to(self, time_s: float) -> None:
        """It is at least this time: what took so long is done."""
        self._passed_s = max(self._passed_s, time_s)

    def real_s_until(self, time_s: float) -> float:
        """Real time to wait until then, s."""
        if self.speed is None or self._zero is None:
            return 0.0
        return max(0.0, (time_s - self._offset_s) / self.speed - (self._real() - self._zero))
