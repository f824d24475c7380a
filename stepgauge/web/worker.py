"""The process that measures for the page: ``python -m stepgauge.web.worker``, told on stdin, telling on stdout.

The first line says what is measured, further ones are ``pause``, ``go`` and ``stop``. Where stdin ends, the page is
gone: nobody could stop the machine any more, so it stops as if it were told to, and the journal has every point.
"""

from __future__ import annotations

import json
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stepgauge.errors import InputError
from stepgauge.web.measuring import MeasurementRequest, parse_request, request_file

if TYPE_CHECKING:
    from stepgauge.evaluation.evaluate import Evaluation
    from stepgauge.live.measuring_job import Job
    from stepgauge.planning.planned import Plan
    from stepgauge.recording import Recording

MOST_POINTS = 400
"""Newest single points that are told."""
REST_S = 0.5
SHARE = 0.2
"""Of the time that goes into looking at what was measured."""


@dataclass
class Control:
    """What the page wants, and what it is told."""

    paused: bool = False
    stopped: bool = False
    began: tuple[float, float] | None = None
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def listen(self) -> None:
        """Lines of the page until there are no more."""
        for line in sys.stdin:
            word = line.strip()
            self.paused = word == "pause" or (self.paused and word != "go")
            self.stopped = self.stopped or word == "stop"
        self.stopped = True

    def say(self, kind: str, **content: Any) -> None:
        """One line to the page; one that is gone hears nothing."""
        with self._lock:
            try:
                print(json.dumps({"kind": kind, **content}, allow_nan=False), flush=True)
            except OSError:
                self.stopped = True

    def progress(self, done: int, total: int, left_s: float) -> None:
        """After every point; a pause is a rest here, with the session open and the machine clear of the gauge."""
        now = time.monotonic()
        self.began = self.began or (now, left_s)
        passed = self.began[1] - left_s
        pace = (now - self.began[0]) / passed if passed > 0.0 else 1.0
        self.say("status", state="running", done=done, total=total, left_s=round(left_s * pace, 1))
        if self.paused and not self.stopped:
            self.say("status", state="paused", done=done, total=total, left_s=round(left_s * pace, 1))
            while self.paused and not self.stopped:
                time.sleep(0.05)
            rested = time.monotonic() - now
            self.began = (self.began[0] + rested, self.began[1])

    def wants_stop(self) -> bool:
        """Whether ``stop`` was heard."""
        return self.stopped


def main() -> None:
    """Measure what the first line asks for."""
    control = Control()
    asked = parse_request(sys.stdin.readline())
    threading.Thread(target=control.listen, daemon=True).start()
    try:
        _measure(asked, control)
    except InputError as error:
        _forget_if_empty(asked)
        control.say("status", state="failed", error=error.cli_text())
    except KeyboardInterrupt:
        control.say("status", state="stopped")


def _forget_if_empty(asked: MeasurementRequest) -> None:
    """A start that failed before its first point leaves nothing that one could go on with."""
    from stepgauge.live.journal import journal_of, look

    journal = journal_of(asked.output)
    if not asked.resume and not (journal.exists() and look(journal).rows):
        journal.unlink(missing_ok=True)
        request_file(Path(asked.output)).unlink(missing_ok=True)


def _measure(asked: MeasurementRequest, control: Control) -> None:
    import stepgauge as sg
    from stepgauge.live.journal import journal_of
    from stepgauge.recording import write_recording

    control.say("status", state="starting")
    program = _program(asked)
    job = _job(asked, program)
    control.say("status", state="starting", done=0, total=len(job))
    journal = journal_of(asked.output)
    done = threading.Event()
    looking = threading.Thread(target=_look, args=(job, journal, control, done), daemon=True)
    looking.start()
    try:
        with _server(asked) as server:
            recording = sg.measure(
                program,
                asked.machine,
                asked.gauge,
                asked.placement,
                server=server,
                journal=journal,
                resume=asked.resume,
                homing=asked.homing,
                gauge_temperature_C=asked.gauge_temperature_C if asked.server else None,
                progress=control.progress,
                stop=control.wants_stop,
            )
    finally:
        done.set()
        looking.join()
    if not asked.server:  # by which two runs with the same scatter are known
        recording = recording.assign_comments(seed=str(asked.seed))
    write_recording(asked.output, recording)
    _tell(job, recording, control)
    request_file(Path(asked.output)).unlink(missing_ok=True)
    control.say("status", state="done", done=len(job), total=len(job), left_s=0.0)


def _program(asked: MeasurementRequest) -> str | Plan:
    import stepgauge as sg

    if asked.program:
        return asked.program
    return sg.plan(asked.placement, asked.gauge, asked.machine, cycles=asked.cycles, blocks=asked.blocks or None)


def _job(asked: MeasurementRequest, program: str | Plan) -> Job:
    """What the points of the journal mean."""
    import stepgauge as sg
    from stepgauge.live.measuring_job import make_job
    from stepgauge.machine.virtual import probing_settings
    from stepgauge.programs import read_program

    machine, gauge = sg.read_machine(asked.machine), sg.read_gauge(asked.gauge)
    moves = read_program(program, probing_settings(machine, 2.0)) if isinstance(program, str) else program.program
    return make_job(moves, machine, gauge, sg.read_placement(asked.placement, gauge))


@contextmanager
def _server(asked: MeasurementRequest) -> Iterator[str]:
    """The address of the machine; the virtual CMM listens for this process alone."""
    if asked.server:
        yield asked.server
        return
    import stepgauge as sg
    from stepgauge.live.clock import MachineClock
    from stepgauge.live.cmm import LiveCmm
    from stepgauge.live.faults import read_faults
    from stepgauge.live.machine_state import MachineState
    from stepgauge.live.server import Server, ServerAddress

    gauge = sg.read_gauge(asked.gauge)
    cmm = LiveCmm(
        sg.read_machine(asked.machine),
        gauge,
        sg.read_placement(asked.placement, gauge),
        MachineClock(asked.speed),
        read_faults(asked.faults) if asked.faults else None,
        asked.gauge_temperature_C,
        asked.seed,
    )
    with Server(MachineState(cmm), ServerAddress(port=0)).serving_in_thread() as port:
        yield f"127.0.0.1:{port}"


def _look(job: Job, path: Path, control: Control, done: threading.Event) -> None:
    """Tell the errors as they grow, for a share of the time: the machine must not wait for it."""
    from stepgauge.live.journal import look

    seen, rest_s = 0, REST_S
    while not done.wait(rest_s):
        began = time.monotonic()
        if not path.exists():
            continue
        try:
            journal = look(path)
            if len(journal.rows) != seen:
                seen = len(journal.rows)
                _tell(job, job.recording(journal, {}), control)
        except InputError:
            continue  # a line that is being written
        rest_s = max(REST_S, (time.monotonic() - began) / SHARE)


def _tell(job: Job, recording: Recording, control: Control) -> None:
    import stepgauge as sg
    from stepgauge.evaluation.probings import probing_errors

    try:
        evaluation = sg.evaluate(recording, job.gauge)
    except InputError:
        return  # no block is complete yet
    points = probing_errors(recording, evaluation)[0].tail(MOST_POINTS)
    columns = {name: points[name].tolist() for name in ("face", "cycle", "nominal_mm")}
    control.say("errors", faces=_faces(evaluation), points={**columns, "error_um": _plain(points["error_um"])})


def _faces(evaluation: Evaluation) -> dict[str, list[Any]]:
    found = evaluation.results[0]
    names = ("nominal_mm", "xf_um", "sf_um", "xb_um", "sb_um", "xm_um", "xr_um")
    return {"face": found.face.tolist(), **{name: _plain(getattr(found, name)) for name in names}}


def _plain(values: Any) -> list[float | None]:
    return [None if value != value else round(float(value), 4) for value in values]


if __name__ == "__main__":
    main()
