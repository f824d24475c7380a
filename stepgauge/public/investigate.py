"""``investigate``: measure, diagnose, and measure what tells the rivals apart, until an answer stands."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stepgauge.errors import InputError, naming
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.machine.file import Machine
from stepgauge.programs import DIALECTS
from stepgauge.verbs.inputs import File, as_gauge, as_machine_with, as_placement, at_least, several

if TYPE_CHECKING:
    from stepgauge.diagnosis.result import Diagnosis
    from stepgauge.investigation.decision import Case
    from stepgauge.investigation.stations import Station

Box = tuple[tuple[float, float], tuple[float, float], tuple[float, float]]


def investigate(
    placement: File | Placement | None,
    gauge: File | Gauge,
    machine: File | Machine,
    folder: File,
    *,
    ask: Callable[[str], bool],
    server: str | None = None,
    faults: File | None = None,
    seed: int = 0,
    minutes: float = 60.0,
    odds: float = 20.0,
    within_mm: Box | None = None,
    level: bool = False,
    hands_minutes: float = 5.0,
    styli: File | Machine | Iterable[File | Machine] = (),
    cycles: int = 2,
    without: str | Iterable[str] = (),
    priors: File | None = None,
    resume: bool = False,
    homing: bool = False,
    tool: str = DIALECTS["ippdme"].tool,
    tell: Callable[[str], None] | None = None,
    progress: Callable[[int, int, float], None] | None = None,
    stop: Callable[[], bool] | None = None,
) -> Diagnosis:
    """Find out what is wrong with a machine while the gauge is on its table.

    A first run is measured and diagnosed. Of the further runs that are within reach the one is chosen that is expected
    to tell most per minute; a person is asked to lay the gauge, seven probings find it, it is measured, and all runs
    are diagnosed together, until one answer stands or no run within reach can tell.

    Parameters
    ----------
    placement : how the gauge lies now; None: the 16 points of ``locate`` are measured by hand and sent by the server
    gauge : the certified gauge, its file or shipped name
    machine : the machine that is to be judged, with travel, speeds and probe
    folder : gets the journal, the recordings, ``investigation.json``, ``investigation.md`` and the diagnosis
    ask : asks a person for something that hands have to do; returns False where it cannot be done
    server : ``"HOST:PORT"`` of the controller, or ``"linuxcnc"``; None: the virtual CMM
    faults : of the virtual CMM: effects and events that the machine file does not have
    seed : of the virtual CMM
    minutes : of machine and hands, in all
    odds : at which an answer stands
    within_mm : lowest and highest x, y and z at which the ends of the gauge may lie; default: the travel
    level : the gauge is neither lifted nor inclined
    hands_minutes : what it takes a person to lay the gauge elsewhere, or to change the stylus
    styli : further styli that are at hand: machine files that differ from ``machine`` in ``[probe]``, in ``stylus_mm``
        and ``head_mm`` of the chain, and in the travel of the tip only
    cycles : of a whole run
    without : kinds of effects that are known not to be there
    priors : file that replaces a part of the shipped priors
    resume : go on with the investigation in the folder
    homing : the machine may home itself
    tool : what the server calls the probe
    tell : called with a line for every step
    progress : called after every point, as of ``measure``
    stop : asked ten times a second whether to stop

    Returns
    -------
    The diagnosis of all runs together.

    Raises
    ------
    InputError
        what is refused before the machine moves; an error of the machine or the loss of the connection, after which it
        can be resumed
    """
    from stepgauge.investigation.decision import Case
    from stepgauge.investigation.feasible_runs import Reach
    from stepgauge.investigation.loop import check_first

    _check(minutes, odds, hands_minutes, cycles)
    steps, cmm = as_gauge(gauge), as_machine_with(machine, styli)
    lies = None if placement is None else as_placement(placement, steps)
    reach = Reach(within_mm, level, hands_minutes, cycles, _racked(cmm, server))
    table = {} if priors is None else {"priors": _priors(priors)}
    case = Case(steps, cmm, reach, odds, minutes, tuple(several(without)), **table)
    if lies is None and server is None:
        raise InputError(naming("placement"), "is needed without a server, which would send the points by hand")
    if lies is not None:
        check_first(case, lies)
    station = _station(case, server, faults, seed, homing, tool, stop)
    head = _head(case, lies, server, faults, seed)
    return _gone_through(case, station, lies, Path(folder), head, resume, ask, tell, progress)


def _check(minutes: float, odds: float, hands_minutes: float, cycles: int) -> None:
    at_least("minutes", minutes, 0.0, "min", beyond=True)
    at_least("odds", odds, 1.0, beyond=True)
    at_least("hands_minutes", hands_minutes, 0.0, "min")
    if not (isinstance(cycles, int) and 2 <= cycles <= 100):
        raise InputError(naming("cycles"), "out of range", found=cycles, expected="a whole number from 2 to 100")


def _racked(machine: Machine, server: str | None) -> frozenset[int]:
    """Numbers of the styli that a server may change to by itself: they have a name there, the first one always."""
    from stepgauge.live.addressing import LINUXCNC

    named = [number for number, one in enumerate(machine.styli, 2) if one.probe.tool]
    return frozenset([1, *named] if named and server not in (None, LINUXCNC) else [])


def _priors(path: File) -> Any:
    from stepgauge.diagnosis.priors import read_priors

    return read_priors(path)


def _station(
    case: Case,
    server: str | None,
    faults: File | None,
    seed: int,
    homing: bool,
    tool: str,
    stop: Callable[[], bool] | None,
) -> Station:
    from stepgauge.investigation.stations import Served, Simulated
    from stepgauge.live.controller import ControllerOptions
    from stepgauge.live.faults import read_faults

    if server is None:
        return Simulated(case.machine, case.gauge, read_faults(faults) if faults else None, seed, stop=stop)
    if faults is not None:
        raise InputError(naming("faults"), "are those of the virtual CMM", expected="no server, or no faults")
    return Served(server, case.machine, ControllerOptions(tool, homing), stop)


def _head(case: Case, lies: Placement | None, server: str | None, faults: File | None, seed: int) -> dict[str, Any]:
    """What a journal is known again by."""
    from stepgauge.investigation.feasible_runs import placement_json

    reach = case.reach
    return {
        "gauge": case.gauge.table.serial,
        "machine": case.machine.table.name,
        "machine_file": _known(case.machine.table, case.machine.probe, case.machine.effects),
        "styli": [_known(one.table, one.probe) for one in case.machine.styli] or None,
        "certificate": _known(case.gauge.table, case.gauge.certificate, case.gauge.position_mm.tolist()),
        "placement": "by hand" if lies is None else placement_json(lies),
        "server": server,
        "simulated": None if server else {"faults": None if faults is None else str(faults), "seed": seed},
        "odds": case.odds,
        "without": list(case.without),
        "region_mm": None if reach.region_mm is None else [list(one) for one in reach.region_mm],
        "level": reach.level,
        "hands_minutes": reach.hands_minutes,
        "cycles": reach.cycles,
    }


def _known(*parts: object) -> str:
    """By which the content of a file is known again."""
    return hashlib.sha256(repr(parts).encode()).hexdigest()


def _gone_through(
    case: Case,
    station: Station,
    lies: Placement | None,
    folder: Path,
    head: dict[str, Any],
    again: bool,
    ask: Callable[[str], bool],
    tell: Callable[[str], None] | None,
    progress: Callable[[int, int, float], None] | None,
) -> Diagnosis:
    from dataclasses import replace

    from stepgauge.executors.journal import open_steps
    from stepgauge.investigation.loop import Investigation, check_first, final_diagnosis
    from stepgauge.investigation.running import Runner
    from stepgauge.investigation.story import write_story

    steps = open_steps(folder, head, again)
    try:
        runner, told = Runner(case, station, steps, ask, progress), tell or (lambda _: None)
        if lies is None:
            lies = runner.placed_by_hand(told)
            check_first(case, lies)
        found = Investigation(case, runner, lies, told)
        found.go_through()
    finally:
        steps.close()
    recording = found.recording
    recording.write(folder / "recording.csv")
    write_story(folder, found)
    whole = replace(recording, path=str(folder / "recording.csv"))
    return replace(final_diagnosis(case, whole), recordings=(whole,))
