"""A program, measured point by point on an I++ DME server; what was measured survives whatever happens.

A point counts once the server has completed it and the journal has it on the disk. After a stop of any kind the next
run goes on with the first point that the journal has not.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError, PartlyDoneError
from stepgauge.importing.ippdme import OWN_TIME
from stepgauge.live.codes import DmeError
from stepgauge.live.connection import Connection, ConnectionLostError, StopAskedError
from stepgauge.live.job import Job
from stepgauge.live.journal import Journal, Row
from stepgauge.live.protocol import Call, fields, fixed
from stepgauge.live.ways import HAND_MM, Ways
from stepgauge.machine.file import TIP_TOLERANCE_MM
from stepgauge.programs import DIALECTS
from stepgauge.recording import POSITION, Recording

Array = NDArray[np.float64]
Progress = Callable[[int, int, float], None]
"""Called with points done, points of the program, and the time left at full speed, s."""
REPORTS = (f"X(), Y(), Z(), ER(), {OWN_TIME}()", "X(), Y(), Z(), ER()", "X(), Y(), Z()")
"""What is asked of a measurement: with the server's own time, which only stepgauge's has; without; the least."""
TEMPERATURES = {
    "Part.Temperature": "gauge_temperature_C",
    **{f"Scale{axis}.Temperature": f"scale_temperature_{axis.lower()}_C" for axis in "XYZ"},
}
SPEED_TOLERANCE = 1e-3
"""Relative; a server that keeps another speed measures something else."""
SLOWER = 5.0
"""A real machine accelerates, and may take so many times as long as a move at full speed."""
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
}
RETREATS = (1003, 1006)
"""Errors after which the machine may move: it searched in vain, and nothing is wrong with it."""


class MeasurementStoppedError(PartlyDoneError):
    """The measurement stopped; what was measured is in the journal."""


class StoppedByPersonError(Exception):
    """The person stopped the measurement; the message says how far it came."""


@dataclass(frozen=True)
class Wishes:
    """How to measure: ``tool``: what the server calls the probe; ``home``: the machine may home itself."""

    tool: str = DIALECTS["ippdme"].tool
    home: bool = False


@dataclass
class _Server:
    """What the server can tell, found at the beginning."""

    report: str = REPORTS[-1]
    temperatures: tuple[str, ...] = ()
    own_time: bool = False
    offset_s: float = 0.0


@dataclass
class _Run:
    """One session of a measurement."""

    job: Job
    connection: Connection
    journal: Journal
    wishes: Wishes
    progress: Progress
    began_s: float
    server: _Server = field(default_factory=_Server)

    def __post_init__(self) -> None:
        self.ways = Ways(self.job.machine, self.job.gauge, self.job.placement)
        self.durations_s = self.job.durations_s()

    @property
    def next_point(self) -> int:
        """The first point that the journal has not, from 1; one more than there are where all are done."""
        return next((n for n in range(1, len(self.job) + 1) if n not in self.journal.rows), len(self.job) + 1)

    def measure_all(self) -> None:
        """From the beginning of the session to its end."""
        self._prepare()
        self._enter()
        while (point := self.next_point) <= len(self.job):
            self._measure(point)
        self._leave()

    def _prepare(self) -> None:
        ask, settings = self.connection.ask, self.job.program.settings
        ask("EndSession()")
        ask("StartSession()")
        self.connection.forget_errors()
        self._check_class()
        self._check_home()
        ask("SetCoordSystem(MachineCsy)")
        ask(f'SetTool("{self.wishes.tool}")')
        self._set("PtMeasPar.Speed", settings.measuring_speed_mm_s)
        self._set("PtMeasPar.Approach", settings.standoff_mm)
        self._set("PtMeasPar.Search", settings.search_mm)
        self._set("PtMeasPar.Retract", settings.standoff_mm)
        self._set("GoToPar.Speed", settings.travel_speed_mm_s)
        number, _ = self.connection.ask_first_of([f"OnPtMeasReport({report})" for report in REPORTS])
        self.server.report = REPORTS[number]
        self.server.own_time = OWN_TIME in self.server.report
        self._find_temperatures()
        self._set_clock()

    def _check_class(self) -> None:
        said = ", ".join(self.connection.ask("GetMachineClass()"))
        if "CartCMM" not in said:
            raise self._refused("the server is no Cartesian CMM", said or "nothing", "GetMachineClass(CartCMM)")

    def _check_home(self) -> None:
        if any("IsHomed(1)" in line for line in self.connection.ask("IsHomed()")):
            return
        if not self.wishes.home:
            raise self._refused("the machine is not homed", "IsHomed(0)", "a machine that is homed, or --homing")
        self.connection.ask("Home()", takes_s=SLOWER * 60.0)

    def _set(self, name: str, value: float) -> None:
        """Set a parameter of the tool and read it back: a server may limit it."""
        path = f"Tool.{name}"
        self.connection.ask(f"SetProp({path}({fixed(value, 6)}))")
        found = _number(self.connection.ask(f"GetProp({path}())"), path)
        if not abs(found - value) <= SPEED_TOLERANCE * value:
            raise self._refused(f"the server does not take {path} of the program", f"{found:g}", f"{value:g}")

    def _refused(self, what: str, found: str, expected: str) -> InputError:
        return InputError(str(self.connection.address), what, found=found, expected=expected)

    def _find_temperatures(self) -> None:
        """Which temperatures the server tells; real servers have few of them."""
        for name in TEMPERATURES:
            try:
                self.connection.ask(f"GetProp({name}())")
                self.server.temperatures += (name,)
            except DmeError:
                self.connection.forget_errors()

    def _set_clock(self) -> None:
        """The clock of a server that was started anew counts on from the last point."""
        last_s = max((row.get("time_s", 0.0) for row in self.journal.rows.values()), default=0.0)
        if self.server.own_time:
            now_s = _number(self.connection.ask(f"GetProp({OWN_TIME}())"), OWN_TIME)
            self.server.offset_s = max(0.0, last_s - now_s) if self.journal.rows else 0.0

    def _position(self) -> Array:
        found = _data(self.connection.ask("Get(X(), Y(), Z())"))
        return np.array([_only_number(found, axis) for axis in "XYZ"])

    def _enter(self) -> None:
        """A safe way from wherever the machine stands to the path, at the first point that is missing."""
        point = self.next_point
        if point > len(self.job):
            return
        way = [*self.job.program.moves(0)] if point == 1 else []
        stops = [move.position for move in [*way, *self.job.moves(point)[0]]]
        stops.append(self._start_of(point))
        here = self._position()
        moves, first = self.ways.to_path(here, self._near(point, here), stops)
        for place in [*moves, *stops[first + 1 : -1]]:
            self._go(place)

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

    def _go(self, place: Array) -> None:
        settings = self.job.program.settings
        travel_mm = float(np.linalg.norm(np.ptp(self.ways.limits_mm, axis=1)))
        self.connection.ask(f"GoTo({_xyz(place)})", takes_s=SLOWER * travel_mm / settings.travel_speed_mm_s)

    def _measure(self, point: int) -> None:
        way, measure = self.job.moves(point)
        if point - 1 in self.journal.rows and point - 1 in self._measured:
            for move in way:
                self._go(move.position)
        row = self._temperatures()
        assert measure.approach is not None
        surface = measure.position + self.job.machine.probe.tip_radius_mm * measure.approach
        ijk = ", ".join(fixed(-value, 9) for value in measure.approach)
        takes_s = SLOWER * (self.durations_s[point - 1] + 1.0)
        found = _data(self.connection.ask(f"PtMeas({_xyz(surface)}, IJK({ijk}))", takes_s))
        self._check_tip(found)
        row |= dict(zip(POSITION, (_only_number(found, axis) for axis in "XYZ"), strict=True))
        row["time_s"] = self._time_s(found)
        row["speed_mm_s"] = self.job.program.settings.measuring_speed_mm_s
        self.journal.add(point, row)
        self._measured.add(point)
        self.progress(len(self.journal.rows), len(self.job), float(self.durations_s[point:].sum()))

    _measured: set[int] = field(default_factory=set)
    """Points of this session: after them the machine stands at their faces."""

    def _check_tip(self, found: dict[str, Call]) -> None:
        radius = self.job.machine.probe.tip_radius_mm
        if "ER" in found and abs(_only_number(found, "ER") - radius) > TIP_TOLERANCE_MM:
            expected = f"{radius:g} mm, as in {self.job.machine.path or 'the machine file'}"
            raise self._refused("the server's tool has another tip", f"ER {_only_number(found, 'ER'):g} mm", expected)

    def _time_s(self, found: dict[str, Call]) -> float:
        """Time of a point since the beginning of the measurement, s: the server's where it tells it."""
        if OWN_TIME in found:
            return round(_only_number(found, OWN_TIME) + self.server.offset_s, 6)
        return round(time.time() - self.began_s, 6)

    def _temperatures(self) -> Row:
        """Temperatures as they are before a point; that of the gauge as the person states it, where they do."""
        names, row = self.server.temperatures, Row()
        if names:
            found = _data(self.connection.ask(f"GetProp({', '.join(f'{name}()' for name in names)})"))
            row = {TEMPERATURES[name]: _only_number(found, name) for name in names}
        if self.job.gauge_temperature_C is not None:
            row["gauge_temperature_C"] = self.job.gauge_temperature_C
        return row

    def _leave(self) -> None:
        for move in self.job.program.moves(len(self.job) + 1):
            self._go(move.position)
        self.connection.ask("EndSession()")

    def retreat(self) -> None:
        """After a stop: errors cleared, back from the face, out along the stylus, end of the session."""
        self.connection.heeds_stop = False
        self.connection.forget_errors()
        here = self._position()
        for place in self.ways.out(here, self._near(self.next_point, here)):
            if np.linalg.norm(place - here) > HAND_MM:
                self._go(place)
        self.connection.ask("EndSession()")

    def end(self) -> None:
        """End of the session without a move."""
        self.connection.heeds_stop = False
        self.connection.forget_errors()
        self.connection.ask("EndSession()")


def measure(
    job: Job,
    connection: Connection,
    journal: Journal,
    *,
    wishes: Wishes | None = None,
    progress: Progress | None = None,
) -> Recording:
    """Measure a program through a connection.

    Parameters
    ----------
    job : the checked program, see :func:`stepgauge.live.job.make_job`
    connection : open, and used by nobody else
    journal : new, or of the same measurement broken off before; gets every point
    wishes : tool and homing
    progress : called after every point

    Returns
    -------
    The recording of all points, those of earlier sessions too, with times (s) and temperatures (deg C).

    Raises
    ------
    MeasurementStoppedError
        an error of the server, or the loss of the connection; the machine stands or has drawn back, as documented
    StoppedByPersonError
        the person asked to stop; the machine has drawn back, the session is ended
    InputError
        a server that is refused before it moves
    """
    run = _Run(job, connection, journal, wishes or Wishes(), progress or (lambda *_: None), journal.began_s)
    try:
        run.measure_all()
    except StopAskedError:
        _after(run, run.retreat)
        raise StoppedByPersonError(_so_far(run)) from None
    except DmeError as error:
        _after(run, run.retreat if error.number in RETREATS else run.end)
        raise _stopped(run, MEANING.get(error.number, "the server reports an error"), f"error {error} ") from None
    except ConnectionLostError as error:
        raise _stopped(run, "the connection was lost", f"{error} ") from None
    except InputError:
        _after(run, run.end)
        raise
    journal.finish()
    return job.recording(journal, {"server": str(connection.address)})


def _after(run: _Run, what: Callable[[], None]) -> None:
    """Come to an end as far as the server lets; what stopped the measurement is what is told."""
    try:
        what()
    except (DmeError, ConnectionLostError, InputError):
        return


def _so_far(run: _Run) -> str:
    return f"{len(run.journal.rows)} of {len(run.job)} points measured"


def _stopped(run: _Run, what: str, found: str) -> MeasurementStoppedError:
    point = run.next_point
    place = f"at {run.job.name(point)}, " if point <= len(run.job) else ""
    return MeasurementStoppedError(
        str(run.connection.address),
        what,
        found=f"{found}{place}{_so_far(run)}",
        expected="the cause removed, then the same command with --resume",
    )


def _xyz(place: Array) -> str:
    return ", ".join(f"{axis}({fixed(value, 6)})" for axis, value in zip("XYZ", place, strict=True))


def _data(lines: list[str]) -> dict[str, Call]:
    """Named values of all lines of data (:class:`ConnectionLostError` where they are none)."""
    try:
        return {name: Call(name, values) for line in lines for name, values in fields(line).items()}
    except DmeError:
        raise ConnectionLostError(f"these are no data of I++ DME: {'; '.join(lines)[:60]!r}") from None


def _only_number(found: dict[str, Call], name: str) -> float:
    try:
        return found[name].number()
    except (KeyError, DmeError):
        raise ConnectionLostError(f"the server did not answer {name}(..) with a number") from None


def _number(lines: list[str], name: str) -> float:
    return _only_number(_data(lines), name)
