"""The virtual controller after a run of the virtual CMM: the text writes the log, with the readings of that run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stepgauge.errors import InputError
from stepgauge.motion.moves import ProbingSettings
from stepgauge.programs.reading import Contact, ControllerAlarmError, ReadingProbe

if TYPE_CHECKING:
    from stepgauge.machine.virtual import Run
    from stepgauge.programs import Dialect


class Played(ReadingProbe):
    """Answers with the indications of a run, one after the other; where the run was stopped, with what stopped it."""

    def __init__(self, run: Run) -> None:
        recorded = run.recording
        self.readings = recorded.position_mm.tolist()
        times = recorded.frame["time_s"] if "time_s" in recorded.frame else np.zeros(len(recorded))
        self.time_s = [float(seconds) for seconds in times]
        self.stop = None if run.stop_piece is None else int(run.path.move[run.stop_piece])
        self.why = str(run.stop)
        self.next = 0

    def answer(self, move: int, measuring: bool, end: Sequence[float], target: Sequence[float]) -> Contact:
        """The next reading; at the stop a search without a contact, or a contact on the way."""
        if self.stop is not None and move > self.stop:
            raise ControllerAlarmError(self.why)
        if move == self.stop:
            return Contact(end, False) if measuring else Contact([value - 1.0 for value in end], True)
        if not measuring:
            return Contact(end, False)
        self.next += 1
        read = self.readings[self.next - 1]
        return Contact(_on_line(read, target, end), True, self.time_s[self.next - 1])


def _on_line(read: Sequence[float], target: Sequence[float], end: Sequence[float]) -> list[float]:
    """A reading as a control has it that keeps its own coordinates on the line of the search, ``(3,)``, mm.

    Its axes follow the command, so that errors of the machine across the search move the tip and no indication.
    """
    way = np.subtract(end, target)
    share = np.subtract(read, target) @ way / (way @ way)
    return [float(value) for value in target + share * way]


@dataclass(frozen=True)
class ControllerLog:
    """What the controller wrote down: the text of its log, and the alarm that stopped it (None if it ran through)."""

    text: str
    alarm: str | None


def controller_log(text: str, path: str, dialect: Dialect, settings: ProbingSettings, run: Run) -> ControllerLog:
    """Execute a program text with the readings of a run of the virtual CMM.

    ``settings``: of the controller, where the text does not say. :class:`InputError` for a dialect whose controller
    writes no log.
    """
    log, alarm = dialect.log_of(text, path, settings, Played(run))
    if not log:
        raise InputError(path, f"{dialect.title}: its log is not known", expected="the recording instead")
    return ControllerLog(log, alarm or (None if run.stop is None else str(run.stop)))
