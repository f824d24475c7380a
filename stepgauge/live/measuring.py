"""A program, measured point by point on a machine; what was measured survives whatever happens.

A point counts once the server has completed it and the journal has it on the disk. After a stop of any kind the next
run goes on with the first point that the journal has not.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from stepgauge.correspondence.expected_points import LATERAL_MM
from stepgauge.errors import InputError, PartlyDoneError, naming
from stepgauge.files.arrays import Array
from stepgauge.ippdme.codes import DmeError
from stepgauge.live.connection import (
    BY_HAND_NUMBER,
    ConnectionLostError,
    FalseAnswerError,
    StopAskedError,
    UnaskedError,
)
from stepgauge.live.controller import ControllerOptions, Link, MeasuredPoint
from stepgauge.live.journal import Journal, Row
from stepgauge.live.judging import Judge, check_touched
from stepgauge.live.measuring_job import Job
from stepgauge.live.safe_path import HAND_MM, SafePaths
from stepgauge.recording import POSITION, Recording
from stepgauge.recording.simulated import SIMULATED

Progress = Callable[[int, int, float], None]
"""Called with points done, points of the program, and the time left at full speed, s."""
MEANING = {
    500: "emergency stop: the machine stands where it was",
    503: "the controller has lost its machine",
    1000: "the machine is in an error state",
    1001: "the probe touched something on its way",
    1003: "the probe did not trigger",
    1005: "the machine could not home",
    1006: "no face where the program expects it",
    1008: "a position is outside the machine's volume",
    1009: "air pressure out of range",
    1011: "the machine cannot move",
    1501: "the probe is not free: it is deflected or not armed",
    1502: "the server does not know the tool",
    2500: "a limit switch or the end of the travel",
    2504: "collision",
    BY_HAND_NUMBER: "somebody moved the machine by hand",
}
RETREATS = (1003, 1006)
"""Errors after which the machine may move: it searched in vain, and nothing is wrong with it."""


class MeasurementStoppedError(PartlyDoneError):
    """The measurement stopped; what was measured is in the journal."""


class StoppedByPersonError(KeyboardInterrupt):
    """The person stopped the measurement; the message says how far it came."""


@dataclass
class _MeasuringSession:
    """One session of a measurement. ``touched``: points of this session, after which the machine stands at a face.

    ``entry``: the way from where it stood to the path.
    """

    job: Job
    link: Link
    journal: Journal
    ways: SafePaths
    progress: Progress
    offset_s: float = 0.0
    moved: bool = False
    drawn_back: bool = False
    entry: list[Array] = field(default_factory=list)
    touched: set[int] = field(default_factory=set)

    def __post_init__(self) -> None:
        self.durations_s = self.job.durations_s()
        self.judge = Judge(self.job, self.journal.rows)

    @property
    def next_point(self) -> int:
        """The first point that the journal has not, from 1; one more than there are where all are done."""
        return next((n for n in range(1, len(self.job) + 1) if n not in self.journal.rows), len(self.job) + 1)

    def measure_all(self, wishes: ControllerOptions) -> None:
        """From the beginning of the session to its end."""
        self.link.prepare(wishes)
        self._set_clock()
        if self.next_point <= len(self.job):
            self._enter(self.next_point)
        while (point := self.next_point) <= len(self.job):
            self._measure(point)
        self._leave()

    def _set_clock(self) -> None:
        """The clock of a server that was started anew counts on from the last point."""
        self.judge.clock_s = now_s = self.link.time_s()
        last_s = max((row.get("time_s", 0.0) for row in self.journal.rows.values()), default=0.0)
        self.offset_s = max(0.0, last_s - now_s) if now_s is not None else 0.0

    def _enter(self, point: int) -> None:
        """A safe way from wherever the machine stands to the path, at the first point that is missing."""
        before = [move.position for move in self.job.program.moves(0)] if point == 1 else []
        stops = [*before, *(move.position for move in self.job.moves(point)[0]), self._start_of(point)]
        here = self.link.position_mm()
        way, first = self.ways.to_path(here, self._near(point, here), stops)
        self.moved, self.entry = True, [here, *way]
        for place in [*way, *stops[first + 1 : -1]]:
            self.link.go(place)

    def _start_of(self, point: int) -> Array:
        """Where the search of a point starts."""
        measure = self.job.moves(point)[1]
        assert measure.approach is not None
        return measure.position - self.job.program.settings.standoff_mm * measure.approach

    def _near(self, point: int, here: Array) -> list[Array]:
        """Where to back off to from a face: the starts of the searches of this point and of the one before.

        Of a measurement that was begun anew, somewhere else along the gauge: a stand-off from there.
        """
        step = self.job.program.settings.standoff_mm * self.job.placement.axis
        return [*(self._start_of(n) for n in (point, point - 1) if 1 <= n <= len(self.job)), here - step, here + step]

    def _measure(self, point: int) -> None:
        way, measure = self.job.moves(point)
        assert measure.approach is not None
        if point - 1 in self.touched:
            for move in way:
                self.link.go(move.position)
        row = self._temperatures(point)
        surface = measure.position + self.job.machine.probe.tip_radius_mm * measure.approach
        begin_s = time.monotonic()
        found = self.link.probe(surface, measure.approach, float(self.durations_s[point - 1]))
        self.judge.check(point, found, time.monotonic() - begin_s)
        self._accept(point, self._row(row, found), measure.approach)
        self.touched.add(point)
        self.progress(len(self.journal.rows), len(self.job), float(self.durations_s[point:].sum()))

    def _temperatures(self, point: int) -> Row:
        """Temperatures of a point as the journal keeps them; that of the gauge that the person states wins."""
        row: Row = dict(self.link.temperatures_C())
        if self.job.gauge_temperature_C is not None:
            row["gauge_temperature_C"] = self.job.gauge_temperature_C
        self.judge.check_temperatures(point, row)
        return row

    def _accept(self, point: int, row: Row, approach: Array) -> None:
        """A point into the journal, once the machine stands where its answer says.

        What stops the machine meanwhile undoes no point that was complete.
        """
        try:
            check_touched(np.array([row[axis] for axis in POSITION]), self.link.touched_mm(approach))
        except FalseAnswerError:
            raise
        except BaseException:
            self.journal.add(point, row)
            raise
        self.journal.add(point, row)

    def _row(self, row: Row, found: MeasuredPoint) -> Row:
        """A point as the journal keeps it."""
        own = time.time() - self.journal.began_s if found.time_s is None else found.time_s + self.offset_s
        row |= dict(zip(POSITION, found.position_mm, strict=True))
        row |= {SIMULATED: 1} if self.link.simulated else {}
        return row | {"time_s": round(own, 6), "speed_mm_s": self.job.program.settings.measuring_speed_mm_s}

    def _leave(self) -> None:
        for move in self.job.program.moves(len(self.job) + 1):
            self.link.go(move.position)
        self.link.end()

    def retreat(self) -> None:
        """After a stop: errors cleared, back from the face, out along the stylus, end of the session.

        A machine that was not moved stays where it is.
        """
        self.link.clear()
        if not self.moved:
            self.link.end()
            return
        here = self.link.position_mm()
        for place in self.ways.out(here, self._near(self.next_point, here)):
            if np.linalg.norm(place - here) > HAND_MM:
                self.link.go(place)
        self.link.end()

    def abort_and_retreat(self) -> None:
        """After an interrupt: no way back where the machine says meanwhile that it may not move."""
        self.link.abort()
        self.retreat()

    def draw_back(self) -> None:
        """After a false answer: the machine stops, and is brought out where it says that it stands on its path.

        A machine that tells something else may not be moved by what it tells.
        """
        self.link.abort()
        self.link.clear()
        if self.moved and self._on_path(self.link.position_mm()):
            self.retreat()
            self.drawn_back = True
        else:
            self.link.end()

    def _on_path(self, here: Array) -> bool:
        """Whether a place is on the search of this point, on the way to it, or where that began."""
        point = self.next_point
        stops = self._search_of(point - 1) if point - 1 in self.touched else [*self.entry]
        if point <= len(self.job):
            stops += [*(move.position for move in self.job.moves(point)[0]), *reversed(self._search_of(point))]
        return any(_distance_from_move_mm(here, a, b) <= LATERAL_MM for a, b in pairwise(stops))

    def _search_of(self, point: int) -> list[Array]:
        """The line on which the tip is in a measurement, from the end of the search to where it is drawn back to."""
        move, settings = self.job.moves(point)[1], self.job.program.settings
        assert move.approach is not None
        back = max(settings.standoff_mm, settings.retract_mm)
        return [move.position + settings.search_mm * move.approach, move.position - back * move.approach]

    def end(self) -> None:
        """End of the session without a move."""
        self.link.clear()
        self.link.end()


def _distance_from_move_mm(place: Array, start: Array, end: Array) -> float:
    """How far a place is from a straight move, mm."""
    way = end - start
    share = np.clip((place - start) @ way / max(float(way @ way), 1e-12), 0.0, 1.0)
    return float(np.linalg.norm(place - start - share * way))


def measure(
    job: Job,
    link: Link,
    journal: Journal,
    *,
    wishes: ControllerOptions | None = None,
    progress: Progress | None = None,
) -> Recording:
    """Measure a program through a link to a machine.

    Parameters
    ----------
    job : the checked program, see :func:`stepgauge.live.measuring_job.make_job`
    link : to the machine, used by nobody else: :class:`stepgauge.live.controller.Controller` over I++ DME, or LinuxCNC
    journal : new, or of the same measurement broken off before; gets every point
    wishes : tool and homing
    progress : called after every point

    Returns
    -------
    The recording of all points, those of earlier sessions too, with times (s) and temperatures (deg C).

    Raises
    ------
    MeasurementStoppedError
        an error of the server, an answer that cannot be (:mod:`stepgauge.live.judging`), or the loss of the connection;
        the machine stands or has drawn back, as documented
    StoppedByPersonError
        the person asked to stop; the machine has drawn back, the session is ended
    InputError
        a server that is refused before it moves
    """
    ways = SafePaths(job.machine, job.gauge, job.placement)
    run = _MeasuringSession(job, link, journal, ways, progress or (lambda *_: None))
    try:
        run.measure_all(wishes or ControllerOptions())
    except (StopAskedError, KeyboardInterrupt) as asked:
        _after(run.abort_and_retreat if isinstance(asked, KeyboardInterrupt) else run.retreat)
        raise StoppedByPersonError(_so_far(run)) from None
    except DmeError as error:
        may_move = error.number in RETREATS and not isinstance(error, UnaskedError)
        _after(run.retreat if may_move else run.end)
        raise _stopped(run, MEANING.get(error.number, "the server reports an error"), f"error {error} ") from None
    except FalseAnswerError as error:
        _after(run.draw_back)
        raise _refused(run, error) from None
    except ConnectionLostError as error:
        raise _stopped(run, "the connection was lost", f"{error} ") from None
    except InputError:
        _after(run.end)
        raise
    journal.finish()
    return job.recording(journal, {"server": link.name})


def _after(what: Callable[[], None]) -> None:
    """Come to an end as far as the server lets; what stopped the measurement is what is told."""
    try:
        what()
    except (DmeError, ConnectionLostError, FalseAnswerError, InputError):
        return


def _so_far(run: _MeasuringSession) -> str:
    return f"{len(run.journal.rows)} of {len(run.job)} points measured"


def _stopped(run: _MeasuringSession, what: str, found: str) -> MeasurementStoppedError:
    expected = naming("resume", words="the cause removed, then the same command with {}")
    return MeasurementStoppedError(
        run.link.name, what, found=f"{found}at {_place(run)}, {_so_far(run)}", expected=expected
    )


def _refused(run: _MeasuringSession, error: FalseAnswerError) -> MeasurementStoppedError:
    """Of an answer that is no reading: its point is measured again."""
    stands = "drawn back" if run.drawn_back else "not drawn back"
    expected = naming("resume", words=f"{error.expected}; {stands}, {{}} goes on")
    what, found = f"{_place(run)}: {error.what}", f"{error.found}; {_so_far(run)}"
    return MeasurementStoppedError(run.link.name, what, found=found, expected=expected)


def _place(run: _MeasuringSession) -> str:
    point = run.next_point
    return run.job.name(point) if point <= len(run.job) else "the end"
