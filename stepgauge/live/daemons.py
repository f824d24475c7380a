"""Daemons: what a client asked to be told while the machine moves."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import numpy as np

from stepgauge.files.arrays import Array
from stepgauge.live.machine_state import MachineState

SHORTEST_S = 0.1
"""At most ten reports a second."""


@dataclass
class Daemon:
    """Reports of the position, of the quantities ``names``; not before ``every_s`` (real time) and ``every_mm``."""

    names: tuple[str, ...]
    every_s: float = SHORTEST_S
    every_mm: float = 0.0
    _last_s: float = field(default=-1e9)
    _last_mm: Array | None = None

    def report(self, state: MachineState, position_mm: Array) -> str | None:
        """The data of a report; None where none is due."""
        now_s = time.monotonic()
        moved = np.inf if self._last_mm is None else float(np.linalg.norm(position_mm - self._last_mm))
        if now_s - self._last_s < max(self.every_s, SHORTEST_S) or moved <= self.every_mm:
            return None
        self._last_s, self._last_mm = now_s, position_mm
        return ", ".join(state.quantity(name, position_mm) for name in self.names)
