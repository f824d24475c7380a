"""One run of an investigation: the gauge is laid where hands are needed, located, and measured; every step once."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from stepgauge.alignment import locate as located_by_points
from stepgauge.diagnosis.further_runs import FurtherRun, program_of
from stepgauge.errors import InputError, naming
from stepgauge.executors.journal import Steps
from stepgauge.gauge.placement import Placement
from stepgauge.investigation.decision import Case
from stepgauge.investigation.feasible_runs import placement_json, placement_of_json
from stepgauge.investigation.locating import LAID_MM, NotAsAskedError, check_end_for_end, locate, locating_settings
from stepgauge.investigation.stations import Station
from stepgauge.ippdme.codes import DmeError
from stepgauge.live.connection import ConnectionLostError, FalseAnswerError, StopAskedError
from stepgauge.live.controller import Controller, ControllerOptions, Link
from stepgauge.live.journal import Journal, resume, start
from stepgauge.live.measuring import MEANING, Progress, StoppedByPersonError, measure
from stepgauge.live.measuring_job import Job, make_job
from stepgauge.live.safe_path import SafePaths
from stepgauge.machine.file import Machine
from stepgauge.machine.styli import assign_stylus, stylus_words
from stepgauge.recording import Recording, read_recording, write_recording

Ask = Callable[[str], bool]
"""Asks a person to do something; False: it cannot be done. Whoever wants to stop raises an interrupt."""
ATTEMPTS = 5
POINTS = 16
LIFTED = -1
"""In place of the number of a placement: the gauge is being laid again."""


@dataclass(frozen=True)
class CompletedRun:
    """A run that was made: where its recording is, how the gauge lay, what it took."""

    run: FurtherRun
    path: Path
    lies: Placement
    placement_number: int
    machine_minutes: float
    minutes: float
    own_clock: bool
    began_s: float


@dataclass
class Runner:
    """Makes runs on a station.

    ``last``: the run before; ``laid``: number and place of the last laying; ``standing``: that of the station in this
    process; ``mounted``: the number of the stylus; ``fitted``: that of the station in this process.
    """

    case: Case
    station: Station
    steps: Steps
    ask: Ask
    progress: Progress | None = None
    last: CompletedRun | None = field(default=None, init=False)
    laid: tuple[int, Placement] | None = field(default=None, init=False)
    standing: int = field(default=0, init=False)
    mounted: int = field(default=1, init=False)
    fitted: int = field(default=1, init=False)

    @property
    def folder(self) -> Path:
        """Folder of the investigation."""
        return self.steps.path.parent

    @property
    def machine(self) -> Machine:
        """The machine with the stylus that it has now."""
        return self.case.machine.select_stylus(self.mounted)

    @property
    def wishes(self) -> ControllerOptions:
        """What is asked of the server, with its name of the stylus where that has one."""
        own = self.station.wishes
        return own if self.mounted == 1 else replace(own, tool=self.machine.probe.tool or own.tool)

    def _once(self, name: str, make: Callable[[], Any]) -> Any:
        """What a step gave: from the journal where it is done. A station that repeats does it again all the same."""
        if self.station.repeats and name in self.steps.done:
            asked, self.ask = self.ask, lambda _: bool(self.steps.done[name])
            try:
                make()
            finally:
                self.ask = asked
        return self.steps.once(name, make)

    def placed_by_hand(self, tell: Callable[[str], None]) -> Placement:
        """How the gauge lies, from 16 points that a person measures by hand and the server sends; asked for once."""
        return placement_of_json(self._once("placed by hand", lambda: placement_json(self._probe_by_hand(tell))))

    def _probe_by_hand(self, tell: Callable[[str], None]) -> Placement:
        """:class:`InputError` where the points contradict each other, and on LinuxCNC, which sends none."""
        tell("measure the 16 points of 'stepgauge locate' by hand, in their order, 1 to 8 and 9 to 16")
        with self._session("waiting for points by hand") as link:
            if not isinstance(link, Controller):
                raise InputError(link.name, "sends no points by hand", expected="a placement file")
            points = link.points_by_hand(POINTS, tell)
            link.end()
        gauge, machine = self.case.gauge, self.case.machine
        sigma_um, radius_mm = machine.table.virtual_repeatability_um, machine.probe.tip_radius_mm
        return located_by_points(points, gauge, (1, gauge.n_blocks), sigma_um, radius_mm, link.name)

    def make(self, number: int, run: FurtherRun, lies: Placement, placement_number: int) -> CompletedRun | None:
        """Make a run; None where the person cannot lay the gauge so.

        Parameters
        ----------
        number : of the run, from 1
        run : what is to be measured
        lies : how the gauge lies, where it stays
        placement_number : of the placement that the gauge has in this run
        """
        if not run.stays:
            self._once(f"parked {number}", self._park)
        said = ""
        for attempt in range(1, ATTEMPTS + 1):
            name = f"{number}" if attempt == 1 else f"{number}-{attempt}"
            told = self._attempted(name, said, run, lies, placement_number)
            if told is None or isinstance(told, CompletedRun):
                self.last = told or self.last
                return told
            said, self.standing = f"{told}. ", LIFTED
        raise InputError("the gauge", "could not be laid as asked", found=said.rstrip(". "), expected="it as asked")

    def _attempted(
        self, name: str, said: str, run: FurtherRun, lies: Placement, placement_number: int
    ) -> CompletedRun | str | None:
        """The run; why it has to be laid again, where it does not lie as asked; None where it cannot be laid so."""
        located: dict[str, Any] = {"lies": placement_json(lies), "minutes": 0.0}
        if not run.stays and not self._once(f"laid {name}, {run.words}", lambda: self._prepared(run, said)):
            return None
        self.mounted = run.stylus
        if self.laid is None or run.is_laid:
            self.laid = (placement_number, run.placement)
        self._stand()
        if not run.stays:
            located = self._once(f"located {name}", lambda: self._located(run.placement))
        elif run.wait_s > 0.0:
            self._once(f"waited {name}", lambda: self.station.wait(run.wait_s))
        if "refused" in located:
            return str(located["refused"])
        found = placement_of_json(located["lies"])
        measured = self._once(f"measured {name}", lambda: self._measured(name, run, found, placement_number))
        if "refused" in measured:
            return str(measured["refused"])
        return self._made(run, found, placement_number, located, measured)

    def _prepared(self, run: FurtherRun, said: str) -> bool:
        """Whether the gauge was laid or the stylus changed, by the machine where it can, else by the person."""
        by_hand = run.changed
        if by_hand and not said and run.stylus in self.case.reach.racked:
            by_hand = not self._changed(run.stylus)
        return not (by_hand or run.is_laid) or self.ask(f"{said}{question(run, self.case.machine, by_hand)}")

    def _changed(self, stylus: int) -> bool:
        """Whether the server knows the stylus and has changed to it."""
        tool = self.case.machine.select_stylus(stylus).probe.tool if stylus > 1 else self.station.wishes.tool
        with self._session("changing the stylus") as link:
            done = isinstance(link, Controller) and link.change_tool(tool)
            link.end()
        return done

    def _park(self) -> None:
        """The machine out of the way before the gauge is laid elsewhere."""
        assert self.last is not None
        self._stand()
        ways = SafePaths(self.machine, self.case.gauge, self.last.lies)
        with self._session("going out of the way") as link:
            here = link.position_mm()
            for place in ways.out(here, [here]):
                link.go(place)
            link.end()

    def _stand(self) -> None:
        """The station has the gauge and the stylus as they are now."""
        assert self.laid is not None
        if self.standing != self.laid[0]:
            self.station.stand(*self.laid)
            self.standing = self.laid[0]
        if self.fitted != self.mounted:
            self.station.mount(self.mounted)
            self.fitted = self.mounted

    def _located(self, asked: Placement) -> dict[str, Any]:
        case = self.case
        with self._session("locating the gauge") as link:
            try:
                found, minutes = locate(link, asked, case.gauge, self.machine)
            except NotAsAskedError as error:
                return {"refused": str(error)}
            return {"lies": placement_json(found), "minutes": minutes}

    def _measured(self, name: str, run: FurtherRun, lies: Placement, placement_number: int) -> dict[str, Any]:
        case = self.case
        program = program_of(run, case.gauge, case.machine, lies)
        job = make_job(program, self.machine, case.gauge, lies, placement_number=placement_number)
        own_clock = self._once("clock", self._has_clock)
        recording, began_s = self._points(job, self.folder / f"run-{name}.journal")
        if not run.stays:
            try:
                check_end_for_end(recording, case.gauge, case.machine.table.virtual_repeatability_um)
            except NotAsAskedError as error:
                return {"refused": str(error)}
        path = self.folder / f"run-{name}.csv"
        write_recording(path, assign_stylus(recording, run.stylus, case.machine), at_once=True)
        minutes = float(np.ptp(recording.frame["time_s"])) / 60.0
        return {"path": path.name, "minutes": minutes, "own_clock": own_clock, "began_s": began_s}

    @contextmanager
    def _session(self, what: str) -> Iterator[Link]:
        """A session in which no program is measured; what stops it is told as :func:`measure` tells it."""
        with self.station.linked(locating_settings(self.machine)) as link:
            try:
                link.prepare(self.wishes)
                yield link
            except (StopAskedError, KeyboardInterrupt):
                link.clear()
                link.end()
                raise StoppedByPersonError(f"the machine was {what}, and stands where it was") from None
            except DmeError as error:
                found = MEANING.get(error.number, str(error))
                expected = naming("resume", words="the cause removed, then {}")
                raise InputError(
                    link.name, f"the machine stopped while {what}", found=found, expected=expected
                ) from None
            except FalseAnswerError as error:
                found = f"{error.what}; {error.found}"
                raise InputError(
                    link.name, f"a false answer while {what}", found=found, expected=error.expected
                ) from None
            except ConnectionLostError as error:
                what, expected = "the connection was lost", naming("resume")
                raise InputError(link.name, what, found=str(error), expected=expected) from None

    def _has_clock(self) -> bool:
        """Whether the machine tells its own time, which goes on from run to run."""
        with self._session("reading its clock") as link:
            told = link.time_s() is not None
            link.end()
        return told

    def _points(self, job: Job, path: Path) -> tuple[Recording, float]:
        """All points of a run, those that its journal has not yet measured now."""
        book = self._journal(path, job)
        try:
            if len(book.rows) == len(job):
                return job.recording(book, {}), book.began_s
            with self.station.linked(job.program.settings) as link:
                return measure(job, link, book, wishes=self.wishes, progress=self.progress), book.began_s
        finally:
            book.close()

    def _journal(self, path: Path, job: Job) -> Journal:
        begun = path.is_file() and path.stat().st_size > 0
        if begun and self.station.repeats:
            path.unlink()
            begun = False
        return (resume if begun else start)(path, job.head())

    def _made(
        self, run: FurtherRun, lies: Placement, number: int, located: dict[str, Any], measured: dict[str, Any]
    ) -> CompletedRun:
        machine = located["minutes"] + measured["minutes"]
        rest = self.case.reach.rest_minutes(run)
        path = self.folder / measured["path"]
        own, began_s = measured["own_clock"], measured["began_s"]
        return CompletedRun(run, path, lies, number, machine, machine + rest, own, began_s)


MOVES = "The machine then moves by itself to find it: keep the table clear"


def question(run: FurtherRun, machine: Machine, change: bool = False) -> str:
    """What the person is asked to do; ``change``: the stylus, too."""
    first = f"Change to {stylus_words(machine, run.stylus)} and qualify it. " if change else ""
    return f"{first}{_laying(run) if run.is_laid else 'Leave the gauge as it lies.'} {MOVES}"


def _laying(run: FurtherRun) -> str:
    ends = [", ".join(f"{value:.0f}" for value in end) for end in (run.placement.c1_mm, run.placement.c2_mm)]
    return (
        f"Lay {run.words}: the middle of block {run.placement.first_block} at ({ends[0]}) mm, that of block"
        f" {run.placement.last_block} at ({ends[1]}) mm, each to {LAID_MM:g} mm."
    )


def joined(runs: list[CompletedRun]) -> Recording:
    """All runs as one recording.

    A gauge that was left in place keeps its placement number, its cycles are counted on; times go on from run to run.
    """
    import pandas as pd

    frames, comments, end_s = [], dict[str, str](), -np.inf
    cycles: dict[int, int] = {}
    for made in runs:
        recording = read_recording(made.path)
        frame, before = recording.frame.copy(), cycles.get(made.placement_number, 0)
        frame["placement"], frame["cycle"] = made.placement_number, frame["cycle"] + before
        cycles[made.placement_number] = int(frame["cycle"].max())
        if "time_s" in frame:
            frame["time_s"] += _shift_s(made, runs[0], float(frame["time_s"].min()), end_s)
            end_s = float(frame["time_s"].max())
        frames.append(frame)
        comments = {**recording.comments, **comments}
    shared = [name for name in frames[0].columns if all(name in frame for frame in frames)]
    whole = pd.concat([frame[shared] for frame in frames], ignore_index=True)
    return Recording(whole, comments, ", ".join(str(made.path) for made in runs))


def _shift_s(made: CompletedRun, first: CompletedRun, begin_s: float, end_s: float) -> float:
    """What brings the times of a run to the clock of the first one.

    A machine without a clock counts from when each run was begun; one that was started anew begins again.
    """
    shift_s = 0.0 if made.own_clock else made.began_s - first.began_s
    return shift_s if begin_s + shift_s > end_s else end_s - begin_s + max(made.run.wait_s, 1.0)
