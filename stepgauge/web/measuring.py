"""The measurements that this server has started: processes steered by lines; only their newest words are kept."""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
import threading
import time
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from stepgauge.errors import InputError
from stepgauge.files.children import python_environment, python_line
from stepgauge.files.text import read_result, write_json

SUFFIX = ".request.json"
KIND = "measurement as asked"
WRONG = "this is not what a measurement was asked for"


@dataclass(frozen=True)
class MeasurementRequest:
    """A measurement; all paths as from the folder of the project.

    ``program``: empty where the path is planned now, with ``cycles`` and ``blocks``; ``server``: empty for the virtual
    CMM, which runs ``speed`` times as fast as a real one (None: its time passes in motions alone), reads as ``faults``
    say, and scatters by ``seed``.
    """

    output: str
    gauge: str
    machine: str
    placement: str
    program: str = ""
    cycles: int = 5
    blocks: str = ""
    server: str = ""
    homing: bool = True
    gauge_temperature_C: float | None = None
    speed: float | None = 10.0
    faults: str = ""
    seed: int = 0
    resume: bool = False

    def to_json(self) -> str:
        """One line for the process that measures."""
        return json.dumps(asdict(self))

    def write(self, path: Path) -> None:
        """Beside the recording, for whoever goes on with it."""
        write_json(path, {"format": f"stepgauge {KIND} 1", **asdict(self)}, at_once=True)


def request_file(output: Path) -> Path:
    """Beside an unfinished recording: what it was asked for, so that it can go on."""
    return Path(f"{output}{SUFFIX}")


def parse_request(text: str) -> MeasurementRequest:
    """As :meth:`MeasurementRequest.to_json` wrote it."""
    try:
        return MeasurementRequest(**json.loads(text))
    except (ValueError, TypeError):
        raise InputError("asked", WRONG) from None


def read_request(path: Path) -> MeasurementRequest:
    """As :meth:`MeasurementRequest.write` wrote it (:class:`InputError` where it is not as it was written)."""
    said = read_result(path, KIND, with_inputs=False)
    try:
        return MeasurementRequest(**{key: value for key, value in said.items() if key not in ("format", "checksum")})
    except TypeError:
        raise InputError(path, WRONG) from None


RUNNING = ("starting", "running", "paused", "stopping")
WAIT_S = 10.0
"""For a machine to stop and draw back, when the server ends."""


@dataclass
class MeasuringRun:
    """A measurement. ``told``: by kind, the number of the newest message and its text; nothing older is kept."""

    asked: MeasurementRequest
    process: subprocess.Popen[bytes]
    said: Any
    told: dict[str, tuple[int, str]] = field(default_factory=dict)
    status: dict[str, Any] = field(default_factory=lambda: {"state": "starting"})
    _count: int = 0

    def listen(self) -> None:
        """Take what the process tells until it ends."""
        assert self.process.stdout is not None
        for line in self.process.stdout:
            message = json.loads(line)
            kind = message.pop("kind")
            if kind == "status":
                if self.status["state"] == "stopping" and message["state"] in ("running", "paused"):
                    message["state"] = "stopping"
                self._tell_status({**self.status, **message})
            else:
                self._tell(kind, message)
        self.process.wait()
        if self.is_running:
            self.said.seek(0)
            last = self.said.read().decode("utf-8", "replace").strip().splitlines()
            self._tell_status({**self.status, "state": "failed", "error": last[-1] if last else "it ended"})

    def _tell_status(self, status: dict[str, Any]) -> None:
        self._tell("status", status)  # first: who sees the end must find it told
        self.status = status

    def _tell(self, kind: str, message: dict[str, Any]) -> None:
        self._count += 1
        self.told[kind] = (self._count, json.dumps(message))

    def newest(self) -> list[tuple[str, tuple[int, str]]]:
        """Kinds with number and text of their newest message, the status last: after the end nobody listens on."""
        return sorted(self.told.items(), key=lambda one: one[0] == "status")

    @property
    def is_running(self) -> bool:
        """Whether it measures or may go on."""
        return self.status["state"] in RUNNING

    def say(self, word: str) -> None:
        """``pause``, ``go`` or ``stop``; a process that has ended hears nothing."""
        assert self.process.stdin is not None
        if not self.is_running:
            return
        if word == "stop":
            self._tell_status({**self.status, "state": "stopping"})
        try:
            self.process.stdin.write(word.encode() + b"\n")
            self.process.stdin.flush()
        except OSError:
            return


class Runs:
    """The measurements by their recordings."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._lock, self._all = folder, threading.Lock(), dict[str, MeasuringRun]()

    def get(self, output: str) -> MeasuringRun | None:
        """The run that writes to a folder, if there is one."""
        return self._all.get(output)

    def running(self) -> list[MeasuringRun]:
        """Those that have not ended."""
        return [one for one in self._all.values() if one.is_running]

    def start(self, asked: MeasurementRequest) -> MeasuringRun:
        """Begin or go on; :class:`InputError` where the recording is there or being measured."""
        output = self._folder / asked.output
        with self._lock:
            known = self._all.get(asked.output)
            if known is not None and known.is_running:
                raise InputError(asked.output, "is being measured", expected="another name, or its end")
            if output.exists():
                raise InputError(asked.output, "exists already", expected="another name; nothing is overwritten")
            if not asked.resume and _is_begun(output):
                raise InputError(
                    asked.output, "is begun and not finished", expected="another name, or to go on with it"
                )
            output.parent.mkdir(parents=True, exist_ok=True)
            replace(asked, resume=True).write(request_file(output))
            self._all[asked.output] = self._begin(asked)
            return self._all[asked.output]

    def go_on(self, output: str, server: str = "") -> MeasuringRun:
        """Go on with a measurement that was stopped, whoever began it; ``server``: where the machine is now."""
        asked = self.asked(output)
        if asked is None:
            expected = "'stepgauge measure --resume' with the options that it was begun with"
            raise InputError(output, "it is not known what was asked for", expected=expected)
        return self.start(replace(asked, server=server or asked.server) if asked.server else asked)

    def discard(self, output: str) -> None:
        """Put away what was broken off: its journal stays beside, under a name that no measurement has."""
        from stepgauge.live.journal import SUFFIX

        run = self._all.get(output)
        if run is not None and run.is_running:
            raise InputError(output, "is being measured", expected="its end")
        journal = self._folder / f"{output}{SUFFIX}"
        if journal.is_file():
            journal.replace(journal.with_name(f"{journal.name}-{time.strftime('%Y%m%d-%H%M%S')}"))
        request_file(self._folder / output).unlink(missing_ok=True)
        self._all.pop(output, None)

    def asked(self, output: str) -> MeasurementRequest | None:
        """What an unfinished measurement was asked for, None where the page did not begin it."""
        path = request_file(self._folder / output)
        return read_request(path) if path.is_file() else None

    def _begin(self, asked: MeasurementRequest) -> MeasuringRun:
        said = tempfile.TemporaryFile()  # noqa: SIM115  for as long as the process lives
        pipe = subprocess.PIPE
        process = subprocess.Popen(
            python_line("stepgauge.web.worker"),
            cwd=self._folder,
            env=python_environment(),
            stdin=pipe,
            stdout=pipe,
            stderr=said,
            start_new_session=os.name == "posix",
        )
        assert process.stdin is not None
        process.stdin.write(asked.to_json().encode() + b"\n")
        process.stdin.flush()
        run = MeasuringRun(asked, process, said)
        threading.Thread(target=run.listen, daemon=True).start()
        return run

    def unfinished(self) -> list[tuple[str, int, int]]:
        """Recordings that were broken off and are not measured now, with points done and points of the program."""
        from stepgauge.live.journal import SUFFIX

        found = []
        for path in sorted(self._folder.glob(f"*/*{SUFFIX}")):
            output = path.relative_to(self._folder).as_posix().removesuffix(SUFFIX)
            run = self._all.get(output)
            if not (self._folder / output).exists() and not (run and run.is_running):
                done, total = _counted(path)
                found += [(output, done, total)] if done or not total else []
        return found

    def close(self) -> None:
        """Every machine is told to stop, and given time to draw back."""
        running = self.running()
        for one in running:
            one.say("stop")
        until = time.monotonic() + WAIT_S
        for one in running:
            try:
                one.process.wait(max(0.1, until - time.monotonic()))
            except subprocess.TimeoutExpired:
                continue  # its stdin ends with this process


def _is_begun(output: Path) -> bool:
    """Whether points of it are in a journal."""
    from stepgauge.live.journal import journal_of

    path = journal_of(output)
    return path.is_file() and _counted(path)[0] > 0


def _counted(path: Path) -> tuple[int, int]:
    """Points done and points of the program, by a journal; none of one that is damaged: to go on with it says why."""
    from stepgauge.live.journal import look

    try:
        journal = look(path)
    except InputError:
        return 0, 0
    return len(journal.rows), int(journal.head.get("points", 0))
