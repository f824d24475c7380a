"""Whether an answer of a machine is a reading, as it comes: the rules by which ``import`` judges a finished log.

An answer on the line of its search (:mod:`stepgauge.correspondence.search_line`), where the machine stands, on a face
of this gauge (:mod:`stepgauge.recording.identity`), with temperatures that a thermometer shows
(:mod:`stepgauge.recording.temperatures`), with the tip of the machine file, after the time that a search takes, and not
the one before once more. Whatever it came from: I++ DME, LinuxCNC, the virtual CMM of this process.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from stepgauge.correspondence.expected_points import LATERAL_MM, coordinates
from stepgauge.correspondence.search_line import line_distances, off_search_line
from stepgauge.files.arrays import Array
from stepgauge.files.units import likely_unit
from stepgauge.live.connection import FalseAnswerError
from stepgauge.live.controller import MeasuredPoint
from stepgauge.live.journal import Row
from stepgauge.live.measuring_job import Job
from stepgauge.machine.file import TIP_TOLERANCE_MM
from stepgauge.recording import POSITION
from stepgauge.recording.identity import RADIUS_MM, RADIUS_SHARE, WRONG_GAUGE_MM
from stepgauge.recording.temperatures import no_temperature

SOONEST = 0.5
"""Share of the time of a search at the commanded speed, which was read back, that it takes at least."""
STOPS_MM = 0.5
"""A machine comes to rest this near to where it touched, or to the retract distance from there."""
REMEMBERED = 20
"""Points that a new one is held against."""


def check_on_line(position_mm: Array, target_mm: Array, approach: Array, search_mm: float) -> None:
    """:class:`FalseAnswerError` for a reading that no search for this target can have made; all ``(3,)``."""
    off = off_search_line(position_mm[None], target_mm[None], approach[None], search_mm, LATERAL_MM)
    if off is None:
        return
    unit = likely_unit(float(np.linalg.norm(position_mm)), float(np.linalg.norm(target_mm)))
    what = "the search went to its end" if off.missed else "the answer is not on the line of its search"
    what = what if unit is None else f"the answer looks like {unit}"
    raise FalseAnswerError(what, off.found, f"{coordinates(target_mm)}, {off.expected}")


def check_touched(position_mm: Array, touched_mm: Array) -> None:
    """:class:`FalseAnswerError` where an answer and where the machine stands are not of one touch, both ``(3,)``."""
    if not np.linalg.norm(position_mm - touched_mm) <= STOPS_MM:
        found = f"{coordinates(position_mm)}, and a touch at {coordinates(touched_mm)} by where it stands"
        raise FalseAnswerError("the machine does not stand where its answer says", found, f"within {STOPS_MM:g} mm")


@dataclass
class Judge:
    """Of the answers of a session. ``rows``: the journal's; ``clock_s``: the machine's at the last one, where told."""

    job: Job
    rows: Mapping[int, Row]
    clock_s: float | None = None

    def check_temperatures(self, point: int, row: Row) -> None:
        """:class:`FalseAnswerError` for what no thermometer shows beside the temperatures of the points before."""
        for name in (name for name in row if name.endswith("_C")):
            rows = (self.rows.get(n, {}) for n in range(max(1, point - REMEMBERED), point))
            before = [one[name] for one in rows if name in one]
            value = np.array([*before, row[name]], float)
            wrong = no_temperature(value, np.full(len(value), self.job.placement_number))
            if wrong is not None and wrong.row == len(before):
                raise FalseAnswerError(f"{name} {wrong.why}", wrong.found, wrong.expected)

    def check(self, point: int, found: MeasuredPoint, took_s: float) -> None:
        """:class:`FalseAnswerError` for an answer that is no reading of this point.

        Parameters
        ----------
        point : from 1
        found : the answer
        took_s : from the command to its completion, by the clock of this computer
        """
        settings, expected = self.job.program.settings, self.job.expected
        position = np.array(found.position_mm, float)
        target, approach = expected.target_mm[point - 1], expected.approach[point - 1]
        self._check_repeated(point, found, took_s)
        check_on_line(position, target, approach, settings.search_mm)
        self._check_face(point, position)
        self._check_tip(found)
        along, _ = line_distances(position[None], target[None], approach[None])
        self._check_clock(found, (settings.standoff_mm + float(along[0])) / settings.measuring_speed_mm_s)

    def _check_repeated(self, point: int, found: MeasuredPoint, took_s: float) -> None:
        """The answer before again: of another face at once; of the same face sooner than a search takes.

        A machine without scatter reads a face again to the last digit; what it tells by its own clock is asked next.
        """
        before, expected = self.rows.get(point - 1), self.job.expected
        if before is None or [before[axis] for axis in POSITION] != list(found.position_mm):
            return
        settings = self.job.program.settings
        least_s = SOONEST * settings.standoff_mm / settings.measuring_speed_mm_s
        same = bool((expected.target_mm[point - 1] == expected.target_mm[point - 2]).all())
        if same and (found.time_s is not None or took_s >= least_s):
            return
        place = coordinates(np.array(found.position_mm))
        wanted = f"a reading near {coordinates(expected.target_mm[point - 1])}"
        raise FalseAnswerError(f"this is the answer of {self.job.name(point - 1)} again", place, wanted)

    def _check_face(self, point: int, position: Array) -> None:
        """A face as far from the others as the certificate says, by the limits of :mod:`stepgauge.recording.identity`.

        Fronts are held against fronts and backs against backs; the one against the other tells the tip.
        """
        radius_mm = self.job.machine.probe.tip_radius_mm
        face = self.job.expected.face
        before = [n for n in range(max(1, point - REMEMBERED), point) if n in self.rows]
        alike = [n for n in before if (face[n - 1] - face[point - 1]) % 2 == 0]
        others = [n for n in before if n not in alike]
        self._check_distance(point, position, alike, WRONG_GAUGE_MM, "the certificate and the points before have it")
        width_mm = 2.0 * max(RADIUS_MM, RADIUS_SHARE * radius_mm)
        self._check_distance(point, position, others, width_mm, f"a tip of {radius_mm:g} mm has it")

    def _check_distance(self, point: int, position: Array, others: list[int], limit_mm: float, where: str) -> None:
        """Along the gauge from other points, as far as their targets are, within a limit and 0.1 %."""
        if not others:
            return
        axis, targets = self.job.placement.axis, self.job.expected.target_mm
        theirs = targets[np.array(others) - 1]
        read = np.array([[self.rows[n][name] for name in POSITION] for n in others])
        off_mm = (position - targets[point - 1]) @ axis - float(np.median((read - theirs) @ axis))
        limit_mm += 1e-3 * np.abs((theirs - targets[point - 1]) @ axis).max()
        if not abs(off_mm) <= limit_mm:
            found = f"{coordinates(position)}, {off_mm:+.3f} mm off along the gauge"
            raise FalseAnswerError(f"the face is not where {where}", found, f"within {limit_mm:.2f} mm")

    def _check_tip(self, found: MeasuredPoint) -> None:
        radius, machine = self.job.machine.probe.tip_radius_mm, self.job.machine
        if found.radius_mm is not None and not abs(found.radius_mm - radius) <= TIP_TOLERANCE_MM:
            expected = f"{radius:g} mm, as in {machine.path or 'the machine file'}"
            raise FalseAnswerError("the server's tool has another tip", f"ER {found.radius_mm:g} mm", expected)

    def _check_clock(self, found: MeasuredPoint, search_s: float) -> None:
        """A machine that tells its clock cannot touch before it has searched."""
        if found.time_s is None:
            return
        last_s, self.clock_s = self.clock_s, found.time_s
        if last_s is not None and not found.time_s - last_s >= SOONEST * search_s:
            what = "the answer was made before the search could have been"
            told = f"{found.time_s - last_s:.3f} s after the one before, by the machine's clock"
            raise FalseAnswerError(what, told, f"at least {SOONEST * search_s:.2f} s")
