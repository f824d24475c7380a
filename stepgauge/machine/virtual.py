"""The virtual CMM: executes the moves of a program text on the gauge in its true placement.

A search ends where the tip ball touches a face, plus the pre-travel of the probe; repeatability and the effects of the
machine are added to the indication. All moves are computed at once; the run ends at the first event that would stop a
real machine.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from stepgauge.effects import Probings, Setting
from stepgauge.errors import ProgramStoppedError
from stepgauge.files.arrays import Array
from stepgauge.files.display import Plotted, join_lines
from stepgauge.files.text import write_text
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.machine.file import Machine
from stepgauge.machine.readout import correct_temperature, read_out, rows_beyond
from stepgauge.machine.stops import NO_TRIGGER, Stop, first_stop
from stepgauge.machine.styli import stylus_comment
from stepgauge.motion.collision import Obstacles, ball_contacts, make_obstacles, make_tool
from stepgauge.motion.moves import Path, ProbingSettings, Program, trace
from stepgauge.recording import APPROACH, POSITION, Recording, write_recording
from stepgauge.recording.columns import SCALE_TEMPERATURES
from stepgauge.recording.simulated import SIMULATED_COMMENT

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class RunConditions:
    """Conditions of one run.

    ``gauge_temperature_C``: of the gauge, true and recorded; ``placement``: its number in the recording; ``start_s``:
    time at the first position; ``any_surface``: searches may end at sides, tops and the rail (the 16 points).
    """

    gauge_temperature_C: float = 20.0
    placement: int = 1
    start_s: float = 0.0
    any_surface: bool = False


@dataclass(frozen=True, repr=False)
class Run(Plotted):
    """Result of a program: the recording, the path, its duration, and the stop (None if it ran through).

    ``stop_piece`` is the index of the piece of the path on which it stopped. ``shares``, on request: one column per
    effect, its share along the approach in um, with the rows of the recording. ``notes``: parts of the machine file
    that had no influence. ``setup``: machine, gauge, and how it lay; ``log``: what the controller wrote; ``teach``: the
    16 points were touched.
    """

    drawn_by: ClassVar[str] = "run.draw_plan_view"
    recording: Recording
    path: Path
    duration_s: float
    stop: ProgramStoppedError | None = None
    stop_piece: int | None = None
    shares: pd.DataFrame | None = None
    notes: tuple[str, ...] = ()
    setup: tuple[Machine, Gauge, Placement] | None = None
    log: FilePath | None = None
    teach: bool = False

    def summary(self) -> str:
        """How many points were recorded, the machine time, notes, and what stopped the program."""
        searches = int(self.path.measuring.sum())
        first = f"{len(self.recording)} of {searches} points recorded, {self.duration_s:.0f} s of machine time"
        stopped = [] if self.stop is None else [f"stopped: {self.stop}"]
        return join_lines(first, *(f"note: {note}" for note in self.notes), *stopped)

    def to_frame(self) -> pd.DataFrame:
        """One row per probing as in a recording (mm, s, deg C), with the shares of the effects in um if asked for."""
        return self.explained().to_frame()

    def write(self, path: str | FilePath) -> None:
        """Write the recording, CSV or (by the extension) Parquet, with the shares where they were asked for.

        Of points that were taught it is the table that ``locate`` reads.
        """
        if self.teach:
            rows = [f"{n},{x:.6f},{y:.6f},{z:.6f}" for n, (x, y, z) in enumerate(self.recording.position_mm, 1)]
            write_text(path, "\n".join(["point,x_mm,y_mm,z_mm", *rows]) + "\n")
        else:
            write_recording(path, self.explained())

    def _stated(self) -> Any:
        return self.explained()._stated()

    def explained(self) -> Recording:
        """The recording with the shares as further columns."""
        if self.shares is None:
            return self.recording
        return self.recording.assign_columns(**{str(name): um.to_numpy() for name, um in self.shares.items()})


@dataclass(frozen=True)
class Execution:
    """An executed program, before the effects of the machine.

    ``columns``: those of a recording, ``(n,)``, with the true tip centres at the trigger; ``setting``: further data for
    effects; the rest as in :class:`Run`.
    """

    columns: dict[str, NDArray[Any]]
    setting: Setting
    path: Path
    duration_s: float
    stop: ProgramStoppedError | None
    stop_piece: int | None

    @property
    def probings(self) -> Probings:
        """The rows as input of effects."""
        return Probings(self.columns, self.setting)


def run_program(
    program: Program,
    machine: Machine,
    gauge: Gauge,
    placement: Placement,
    seed: int,
    conditions: RunConditions | None = None,
    explain: bool = False,
) -> Run:
    """Execute a program and return the indications of the machine.

    Parameters
    ----------
    program : moves read from program text
    machine : travel, speeds, probe, repeatability and effects
    gauge, placement : the gauge in its true placement (the program may assume another)
    seed : of the repeatability; the same seed gives the same recording
    conditions : temperature and labels of the run
    explain : also return the share of every effect

    Returns
    -------
    The recording of all probings up to the first stop, the path, and the stop as an error with the program's line.
    """
    executed = execute(program, machine, gauge, placement, conditions)
    reading = read_out(executed.probings, machine, np.random.default_rng(seed))
    moved_mm = reading.displacement_um.T * 1e-3
    indicated = {name: executed.columns[name] + moved for name, moved in zip(POSITION, moved_mm, strict=True)}
    comments = {
        "program": program.name,
        "machine": machine.table.name,
        "gauge": gauge.table.name,
        "gauge_serial": gauge.table.serial,
        "tip_radius_mm": f"{machine.probe.tip_radius_mm:g}",
        "seed": str(seed),
        **SIMULATED_COMMENT,
        **stylus_comment(machine),
    }
    if executed.stop is not None:
        comments["stopped"] = str(executed.stop)
    read = Recording({**executed.columns, **indicated}, comments)
    recording = correct_temperature(read, machine, gauge, placement.origin_mm(gauge))
    shares = reading.shares_um() if explain else None
    notes = rows_beyond(reading.effects, len(recording), machine.path)
    return Run(recording, executed.path, executed.duration_s, executed.stop, executed.stop_piece, shares, notes)


def probing_settings(machine: Machine, search_mm: float) -> ProbingSettings:
    """Settings for a program whose text does not state them."""
    return ProbingSettings(
        search_mm=search_mm,
        measuring_speed_mm_s=machine.table.measuring_speed_mm_s,
        travel_speed_mm_s=machine.table.travel_speed_mm_s,
        tip_radius_mm=machine.probe.tip_radius_mm,
    )


def execute(
    program: Program, machine: Machine, gauge: Gauge, placement: Placement, conditions: RunConditions | None = None
) -> Execution:
    """Trigger positions of a machine without errors: parameters as :func:`run_program`."""
    conditions = conditions or RunConditions()
    obstacles = make_obstacles(gauge, placement, conditions.gauge_temperature_C)
    tool = make_tool(machine.probe)
    approach = program.approach[program.is_measure]
    contact, row = _search(program, obstacles, tool.tip_radius_mm)
    face = _faces(contact, row, approach, obstacles)
    touch = np.where(row[:, None] >= 0, contact, program.position_mm[program.is_measure])
    pretravel_um = machine.sensor.pretravel_um(approach)
    triggers = np.isfinite(pretravel_um)
    met = np.where(row >= 0, 1, face) if conditions.any_surface else face
    stop = first_stop(
        program, trace(program, touch), machine, obstacles, tool, row, np.where(triggers, met, NO_TRIGGER)
    )

    trigger = touch + np.where(triggers, pretravel_um, 0.0)[:, None] * 1e-3 * approach
    path = trace(program, trigger)
    searching = np.flatnonzero(path.measuring)
    kept = searching < (len(path.measuring) if stop is None else stop.piece)
    time_s = _times(path, program)
    columns = _columns(program, conditions, trigger, approach, face, time_s[searching], machine.table.temperature_C)
    return Execution(
        {name: values[kept] for name, values in columns.items()},
        Setting.of(machine, gauge, {conditions.placement: placement.axis}),
        path,
        float(time_s[-1] if stop is None else time_s[stop.piece]),
        None if stop is None else _stopped_error(stop, program, path),
        None if stop is None else stop.piece,
    )


def _search(program: Program, obstacles: Obstacles, radius_mm: float) -> tuple[Array, NDArray[np.intp]]:
    """Tip centre at first contact of every search (NaN without), and the row of what was touched (-1 without)."""
    path = trace(program)
    start, target = path.start_mm[path.measuring], path.end_mm[path.measuring]
    end = target + program.settings.search_mm * program.approach[program.is_measure]
    search = Path(start, end, np.ones(len(start), bool), path.move[path.measuring])
    t, row = ball_contacts(search, obstacles, radius_mm)
    return start + t[:, None] * (end - start), row


def _faces(contact: Array, row: NDArray[np.intp], approach: Array, obstacles: Obstacles) -> NDArray[np.int64]:
    """Number of the face that was touched; 0 for an edge, a side, a top or the rail, or no contact."""
    tip = obstacles.placement.to_gauge(obstacles.gauge, contact)
    low, high = obstacles.low_mm[row], obstacles.high_mm[row]
    on_face = (row >= 0) & (row < obstacles.rail_row)
    on_face &= ((tip[:, 1:] >= low[:, 1:]) & (tip[:, 1:] <= high[:, 1:])).all(axis=1)
    along = approach @ obstacles.placement.axis
    front, back = (tip[:, 0] < low[:, 0]) & (along > 0), (tip[:, 0] > high[:, 0]) & (along < 0)
    return np.where(on_face & front, 2 * row + 1, np.where(on_face & back, 2 * row + 2, 0))


def _stopped_error(stop: Stop, program: Program, path: Path) -> ProgramStoppedError:
    line = program.line[path.move[stop.piece]]
    return ProgramStoppedError(f"{program.name}:{line}", stop.what, found=stop.found, expected=stop.expected)


def _times(path: Path, program: Program) -> Array:
    """Time from the first position to the end of every piece, s."""
    speed = np.where(path.measuring, program.settings.measuring_speed_mm_s, program.settings.travel_speed_mm_s)
    return np.cumsum(path.length_mm / speed)


def _columns(
    program: Program,
    conditions: RunConditions,
    trigger: Array,
    approach: Array,
    face: NDArray[np.int64],
    time_s: Array,
    scales_C: float,
) -> dict[str, NDArray[Any]]:
    """The true probings, before the errors of the machine."""
    same = {"speed_mm_s": program.settings.measuring_speed_mm_s, "gauge_temperature_C": conditions.gauge_temperature_C}
    same |= dict.fromkeys(SCALE_TEMPERATURES, scales_C)
    return {
        "placement": np.full(len(face), conditions.placement),
        "cycle": _visits(face),
        "face": face,
        **dict(zip(POSITION, trigger.T, strict=True)),
        **dict(zip(APPROACH, approach.T, strict=True)),
        "time_s": time_s + conditions.start_s,
        **{name: np.full(len(face), value) for name, value in same.items()},
    }


def _visits(face: NDArray[np.int64]) -> NDArray[np.int64]:
    """The how many-th visit to its face every probing is, from 1, ``(n,)``: visit n to a face is cycle n."""
    order = np.argsort(face, kind="stable")
    first = np.searchsorted(face[order], face[order])  # where the visits to this face begin
    visit = np.empty(len(face), np.int64)
    visit[order] = np.arange(1, len(face) + 1) - first
    return visit
