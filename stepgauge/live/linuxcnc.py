"""LinuxCNC as a machine to measure on: single blocks through its Python interface, on the computer that it runs on.

Searches are G38.2; the latched position is that of the controller's status, in machine coordinates. Its messages become
the errors of I++ DME, which say the same (docs/live.md).
"""

from __future__ import annotations

import importlib
import sys
import time
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np

from stepgauge.errors import InputError, naming
from stepgauge.files.arrays import Array
from stepgauge.ippdme.codes import DmeError
from stepgauge.live.connection import ConnectionLostError, StopAskedError
from stepgauge.live.controller import SLOWER, ControllerOptions, MeasuredPoint, refused
from stepgauge.motion.moves import ProbingSettings

PLACES = ("/usr/lib/python3/dist-packages",)
"""Where distributions keep LinuxCNC's module, which is none of the Python that stepgauge was installed in."""
STATES = "G21 G90 G94 G17 G40 G49 G54 G61 G80"
"""Millimetres, absolute, feed per minute, no compensation, no tool length, first work offset, exact path."""
SETTLED_POLLS = 5
POLL_S = 0.005
PATIENCE_S = 10.0
MESSAGES = (
    ("without making contact", 1006),
    ("Probe tripped during", 1001),
    ("Probe is already tripped", 1501),
    ("already tripped", 1501),
    ("exceed", 1008),
    ("limit", 2500),
    ("estop", 500),
)
"""Parts of LinuxCNC's messages, and the errors that mean the same."""


def _module() -> ModuleType:
    """The module ``linuxcnc`` (:class:`InputError` where there is none for this Python)."""
    before = list(sys.path)
    try:
        sys.path += PLACES
        return importlib.import_module("linuxcnc")
    except ImportError as error:
        expected = "LinuxCNC on this computer, and stepgauge in a Python of the same version"
        raise InputError("linuxcnc", "its Python module is not here", found=str(error), expected=expected) from None
    finally:
        sys.path[:] = before


class LinuxCnc:
    """The LinuxCNC that runs here.

    ``stop``: asked at every poll whether to stop. :class:`InputError` where none runs.
    """

    name = "linuxcnc"
    simulated = False

    def __init__(self, settings: ProbingSettings, stop: Callable[[], bool] | None = None) -> None:
        self.settings, self._stop, self._heeds_stop = settings, stop or (lambda: False), True
        self._stopped_mm = np.full(3, np.nan)
        self._cnc: Any = _module()
        try:
            self._status, self._command = self._cnc.stat(), self._cnc.command()
            self._errors = self._cnc.error_channel()
            self._status.poll()
        except self._cnc.error as error:
            raise InputError(self.name, "no LinuxCNC runs on this computer", found=str(error)) from None

    def prepare(self, wishes: ControllerOptions) -> None:
        """Check that the machine is on, homed and idle, in millimetres and without offsets; then single blocks."""
        self._poll()
        now, cnc = self._status, self._cnc
        if now.task_state != cnc.STATE_ON:
            raise refused(self, "the machine is not switched on", "an emergency stop or power off", "power on")
        if now.interp_state != cnc.INTERP_IDLE:
            raise refused(self, "a program is running", "a program", "an idle machine")
        if not np.isclose(now.linear_units, 1.0):
            raise refused(self, "the machine does not count in millimetres", f"{now.linear_units:g}", "1 per mm")
        if not all(now.homed[:3]):
            self._home(wishes)
        self._command.mode(cnc.MODE_MDI)
        self._command.wait_complete(PATIENCE_S)
        self._messages()
        self._block(STATES, PATIENCE_S)
        offset = np.abs([now.g5x_offset[:3], now.g92_offset[:3], now.tool_offset[:3]]).max()
        if offset > 1e-6:
            raise refused(self, "there is a work offset or a tool length", f"{offset:g} mm", "machine coordinates")

    def _home(self, wishes: ControllerOptions) -> None:
        if not wishes.home:
            expected = naming("homing", words="a machine that is homed, or {}")
            raise refused(self, "the machine is not homed", "not homed", expected)
        self._command.mode(self._cnc.MODE_MANUAL)
        self._command.wait_complete(PATIENCE_S)
        self._command.home(-1)
        self._wait(lambda now: all(now.homed[:3]), 300.0)

    def position_mm(self) -> Array:
        """Where the machine stands, shape ``(3,)``."""
        self._poll()
        return np.array(self._status.actual_position[:3], float)

    def temperatures_C(self) -> dict[str, float]:
        """LinuxCNC knows no temperatures."""
        return {}

    def time_s(self) -> float | None:
        """Times are those of this computer, on which it runs."""
        return None

    def go(self, place_mm: Array) -> None:
        """Move to a place, shape ``(3,)``, at the travel speed."""
        speed = self.settings.travel_speed_mm_s
        way_s = float(np.linalg.norm(place_mm - self.position_mm())) / speed
        self._block(f"G1 {_words(place_mm)} F{speed * 60.0:.4f}", SLOWER * way_s + PATIENCE_S)

    def probe(self, surface_mm: Array, approach: Array, takes_s: float) -> MeasuredPoint:
        """To the stand-off, search, and back by the retract distance; errors 1006 (no contact) and 1501 (deflected)."""
        contact = surface_mm - self.settings.tip_radius_mm * approach
        self.go(contact - self.settings.standoff_mm * approach)
        end = contact + self.settings.search_mm * approach
        feed = self.settings.measuring_speed_mm_s * 60.0
        self._block(f"G38.2 {_words(end)} F{feed:.4f}", SLOWER * (takes_s + 1.0) + PATIENCE_S)
        if not self._status.probe_tripped:
            raise DmeError(1006, "G38.2")
        found = [float(value) for value in self._status.probed_position[:3]]
        self._stopped_mm = self.position_mm()
        self.go(self._stopped_mm - self.settings.retract_mm * approach)
        return MeasuredPoint(found)

    def touched_mm(self, approach: Array) -> Array:
        """Where the search stopped, which is told apart from the latched position, shape ``(3,)``."""
        return self._stopped_mm

    def abort(self) -> None:
        """Motion stops at once."""
        self._heeds_stop = False
        self._command.abort()
        self._command.wait_complete(PATIENCE_S)

    def clear(self) -> None:
        """Errors are cleared; the wish to stop, which led here, is heeded no more."""
        self._heeds_stop = False
        self._command.abort()
        self._command.wait_complete(PATIENCE_S)
        time.sleep(10 * POLL_S)
        while self._errors.poll():
            continue
        self._command.mode(self._cnc.MODE_MDI)
        self._command.wait_complete(PATIENCE_S)

    def end(self) -> None:
        """Nothing: the machine stays on."""

    def _block(self, block: str, limit_s: float) -> None:
        """One block, until it is done."""
        if self._heeds_stop and self._stop():
            raise StopAskedError
        self._command.mdi(block)
        self._command.wait_complete(PATIENCE_S)
        cnc = self._cnc
        self._wait(
            lambda now: now.interp_state == cnc.INTERP_IDLE and now.inpos and now.exec_state == cnc.EXEC_DONE, limit_s
        )

    def _wait(self, condition: Callable[[Any], Any], limit_s: float) -> None:
        """Until a condition holds several times in a row; a single one may be from before the command."""
        until, held = time.monotonic() + limit_s, 0
        while held < SETTLED_POLLS:
            self._poll()
            self._messages()
            if self._heeds_stop and self._stop():
                self.abort()
                raise StopAskedError
            if time.monotonic() > until:
                raise ConnectionLostError(f"LinuxCNC did not come to an end within {limit_s:.0f} s")
            held = held + 1 if condition(self._status) else 0
            time.sleep(POLL_S)

    def _poll(self) -> None:
        try:
            self._status.poll()
        except self._cnc.error as error:
            raise ConnectionLostError(f"LinuxCNC is gone: {error}") from None
        if self._status.task_state == self._cnc.STATE_ESTOP:
            raise DmeError(500)

    def _messages(self) -> None:
        """What LinuxCNC complains about, as an error."""
        message = self._errors.poll()
        while message:
            if message[0] in (self._cnc.OPERATOR_ERROR, self._cnc.NML_ERROR):
                text = " ".join(str(message[1]).split())
                raise DmeError(next((number for part, number in MESSAGES if part in text), 1000), "", None, text)
            message = self._errors.poll()


def _words(place_mm: Array) -> str:
    return " ".join(f"{axis}{value:.6f}" for axis, value in zip("XYZ", place_mm, strict=True))
