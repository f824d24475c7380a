"""``investigate``: measure, diagnose, and measure what tells the rivals apart, until an answer stands."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from stepgauge.verbs.define import verb
from stepgauge.verbs.kind import Kind
from stepgauge.verbs.kinds import Count, Flag, Number, Reads, Supplied, Text, Writes
from stepgauge.verbs.shared import Figure, File, FurtherStyli, GaugeLike, MachineLike, Priors, Tool, Without

if TYPE_CHECKING:
    from stepgauge.diagnosis.result import Diagnosis
    from stepgauge.gauge.placement import Placement
    from stepgauge.investigation.decision import Case
    from stepgauge.investigation.stations import Station
    from stepgauge.machine.file import Machine

Region = tuple[tuple[float, float], tuple[float, float], tuple[float, float]]


class Box(Kind):
    """Lowest and highest coordinates, ``X0:X1,Y0:Y1,Z0:Z1`` in mm."""

    def __init__(self) -> None:
        super().__init__(metavar="BOX", name="box", unit="mm")

    def parse(self, text: str) -> Any:
        try:
            return tuple(tuple(float(one) for one in pair.split(":")) for pair in text.split(","))
        except ValueError:
            raise ValueError(self.bounds()) from None

    def fault(self, value: Any) -> tuple[str, str] | None:
        good = len(value) == 3 and all(len(pair) == 2 and pair[0] < pair[1] for pair in value)
        return None if good else ("not a box", self.bounds())

    def bounds(self) -> str:
        return "X0:X1,Y0:Y1,Z0:Z1 in mm, each from low to high"


def said(diagnosis: "Diagnosis") -> str:
    """How it ended, and what would be needed and is not to be had."""
    from stepgauge.files.outputs import place_of
    from stepgauge.files.text import read_json
    from stepgauge.reports.investigation import sentence

    (recording,) = diagnosis.recordings  # type: ignore[attr-defined]
    folder = Path(recording.path).parent
    told = read_json(place_of(folder / "investigation.json"))
    return "\n".join([sentence(told), *(f"needed and not to be had: {one}" for one in told["needed"])])


@verb(says=said)
def investigate(
    placement: Annotated["File | Placement | None", Reads("P", short="p", optional=True)],
    gauge: GaugeLike,
    machine: MachineLike,
    output: Annotated[File, Writes(folder=True, short="o")],
    *,
    ask: Annotated[Callable[[str], bool], Supplied("ask")],
    server: Annotated[str | None, Text("HOST:PORT")] = None,
    simulate: Annotated[bool, Flag()] = False,
    faults: Annotated[File | None, Reads("FILE")] = None,
    seed: Annotated[int, Count(0)] = 0,
    minutes: Annotated[float, Number("min", above=0.0)] = 60.0,
    odds: Annotated[float, Number("", above=1.0)] = 20.0,
    within_mm: Annotated[Region | None, Box()] = None,
    level: Annotated[bool, Flag()] = False,
    hands_minutes: Annotated[float, Number("min", 0.0)] = 5.0,
    further_styli: FurtherStyli = (),
    cycles: Annotated[int, Count(2, 100)] = 2,
    without: Without = (),
    priors: Priors = None,
    resume: Annotated[bool, Flag()] = False,
    yes: Annotated[bool, Flag()] = False,
    homing: Annotated[bool, Flag()] = False,
    tool: Tool = "StepGaugeProbe",
    figure: Figure = "png",
    tell: Annotated[Callable[[str], None] | None, Supplied("tell")] = None,
    progress: Annotated[Callable[[int, int, float], None] | None, Supplied("live")] = None,
    stop: Annotated[Callable[[], bool] | None, Supplied("stop")] = None,
) -> "Diagnosis":
    """Find the cause of a machine's errors while the gauge is still on its table.

    A first run is measured and diagnosed. Of the possible further runs (another placement or direction, the gauge end
    for end; another speed or order, a pause, a few blocks often; a further stylus) the one with the most expected
    information per minute is chosen. You are asked to move the gauge or to change the stylus; if you answer no,
    another run is chosen. A gauge that you have moved is located by seven probings from outside, and refused where
    they do not fit it; with another stylus it is located again.

    It ends with one cause or a set at stated odds, with adequate, with unknown, or with a list of what would be needed
    but is not available. Every step is in a journal; after a kill or an error ``resume`` continues.

    Parameters
    ----------
    placement : placement file: how the gauge lies now; without it you measure the 16 points of 'locate' by hand, and
        the server sends them
    machine : machine file that is to be judged, with travel, speeds and probe
    output : folder for the journal, the recordings, investigation.json, investigation.md and the diagnosis (made if
        missing)
    ask : asks a person for something that hands have to do; returns False where it cannot be done
    server : the I++ DME server of the machine, or linuxcnc
    simulate : measure on the virtual CMM of this process instead
    faults : with ``simulate``: concealed faults, as of 'stepgauge serve'
    seed : with ``simulate``: seed of its scatter
    minutes : how long it may take, machine and hands
    odds : odds at which an answer is accepted
    within_mm : where the ends of the gauge may lie; default: the travel
    level : the gauge is neither lifted nor inclined: it stays at its height
    hands_minutes : time that a person needs to move the gauge, or to change the stylus
    cycles : repetitions of every face in a run
    resume : continue the investigation in the folder; nothing is asked twice
    yes : do not ask: answer every question with done
    homing : the machine may home itself if it is not
    tell : called with a line for every step
    progress : called after every point, as of ``measure``
    stop : asked ten times a second whether to stop

    Returns
    -------
    The diagnosis of all runs together; its files are in the folder ``diagnosis`` of the output.

    Raises
    ------
    InputError
        what is refused before the machine moves; an error of the machine or the loss of the connection, after which it
        can be resumed

    Examples
    --------
    stepgauge investigate -g step-gauge-420 -m bridge-cmm -p placement.toml \\
        --server 127.0.0.1:1294 --minutes 60 -o cause
    stepgauge investigate -g step-gauge-420 -m bridge-cmm -p placement.toml \\
        --simulate --faults faults.toml --yes -o cause
    stepgauge report cause -o cause.pdf
    """
    from stepgauge.errors import InputError, naming
    from stepgauge.investigation.decision import Case
    from stepgauge.investigation.feasible_runs import Reach
    from stepgauge.investigation.loop import check_first
    from stepgauge.verbs.inputs import resolve_gauge, resolve_machine_with_styli, resolve_placement, several

    if bool(server) == simulate:
        raise InputError(naming("server", "simulate", words="either {} or {}"), "on which machine?")
    if faults is not None and not simulate:
        raise InputError(naming("faults"), "are those of the virtual CMM", expected=naming("simulate"))
    if placement is None and simulate:
        raise InputError(
            naming("simulate"), naming("placement", words="needs {}: nobody measures points by hand there")
        )
    steps, cmm = resolve_gauge(gauge), resolve_machine_with_styli(machine, further_styli)
    lies = None if placement is None else resolve_placement(placement, steps)
    reach = Reach(within_mm, level, hands_minutes, cycles, _racked(cmm, server))
    table = {} if priors is None else {"priors": _priors(priors)}
    case = Case(steps, cmm, reach, odds, minutes, tuple(several(without)), **table)
    if lies is not None:
        check_first(case, lies)
    station = _station(case, server, faults, seed, homing, tool, stop)
    head = _head(case, lies, server, faults, seed)
    found = _gone_through(case, station, lies, Path(output), head, resume, ask, tell, progress)
    found.write(Path(output) / "diagnosis", figure)
    return found


def _racked(machine: "Machine", server: str | None) -> frozenset[int]:
    """Numbers of the styli that a server may change to by itself: they have a name there, the first one always."""
    from stepgauge.live.addressing import LINUXCNC

    named = [number for number, one in enumerate(machine.styli, 2) if one.probe.tool]
    return frozenset([1, *named] if named and server not in (None, LINUXCNC) else [])


def _priors(path: File) -> Any:
    from stepgauge.diagnosis.priors import read_priors

    return read_priors(path)


def _station(
    case: "Case",
    server: str | None,
    faults: File | None,
    seed: int,
    homing: bool,
    tool: str,
    stop: Callable[[], bool] | None,
) -> "Station":
    from stepgauge.investigation.stations import Served, Simulated
    from stepgauge.live.controller import ControllerOptions
    from stepgauge.live.faults import read_faults

    if server is None:
        return Simulated(case.machine, case.gauge, read_faults(faults) if faults else None, seed, stop=stop)
    return Served(server, case.machine, ControllerOptions(tool, homing), stop)


def _head(case: "Case", lies: "Placement | None", server: str | None, faults: File | None, seed: int) -> dict[str, Any]:
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
    import hashlib

    return hashlib.sha256(repr(parts).encode()).hexdigest()


def _gone_through(
    case: "Case",
    station: "Station",
    lies: "Placement | None",
    folder: Path,
    head: dict[str, Any],
    again: bool,
    ask: Callable[[str], bool],
    tell: Callable[[str], None] | None,
    progress: Callable[[int, int, float], None] | None,
) -> "Diagnosis":
    from dataclasses import replace

    from stepgauge.executors.journal import open_steps
    from stepgauge.investigation.loop import Investigation, check_first, final_diagnosis, write_story
    from stepgauge.investigation.running import Runner

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
