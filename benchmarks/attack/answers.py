"""False answers of a server: the measurement stops at that point, nothing is lost, and it is resumed to its end.

    python -m benchmarks.attack.answers --rounds 20

Between client and server stands a liar that changes one answer to one ``PtMeas`` (or to the ``Get`` after it). What is
false is refused by name; the points before it are in the journal and no others; the machine is drawn back out of the
gauge; ``--resume`` against the server itself ends with the recording that an undisturbed machine gives.
"""

from __future__ import annotations

import argparse
import random
import re
import socket
import sys
import tempfile
import threading
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import stepgauge as sg
from stepgauge.errors import InputError
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement, make_placement
from stepgauge.live.clock import MachineClock
from stepgauge.live.cmm import LiveCmm
from stepgauge.live.journal import look
from stepgauge.live.machine_state import MachineState
from stepgauge.live.server import Server, ServerAddress
from stepgauge.machine.file import Machine, read_machine
from stepgauge.planning.planned import Plan
from stepgauge.recording import POSITION, Recording

SAME_MM = 3e-3
"""Ten times the repeatability of the machine: two readings of one face agree within it."""
NO_NUMBERS = ("nan", "inf", "1.2.3", "1e", "", "1e9999", "0x10", "1,5", "12mm")
_FIELD = re.compile(r"([A-Za-z.]+)\(([^()]*)\)")
PART = "Part.Temperature"
Words = dict[str, str]
Lie = Callable[[str, str, Words, Words, random.Random], list[str]]
"""Tag, kind and words of an answer, the words of the answer before, and chance: the lines that are sent instead."""


def _written(tag: str, words: Words) -> str:
    return f"{tag} # {', '.join(f'{name}({value})' for name, value in words.items())}"


def _of_data(change: Callable[[Words, Words, random.Random], Words]) -> Lie:
    """A lie that changes the words of the data."""

    def lie(tag: str, kind: str, words: Words, before: Words, pick: random.Random) -> list[str]:
        return [_written(tag, change(words, before, pick))] if kind == "#" else [f"{tag} {kind}"]

    return lie


def _of_line(change: Callable[[str, str], list[str]]) -> Lie:
    """A lie that changes the line of the data as it is written."""

    def lie(tag: str, kind: str, words: Words, before: Words, pick: random.Random) -> list[str]:
        return change(tag, _written(tag, words)) if kind == "#" else [f"{tag} {kind}"]

    return lie


def _moved(words: Words, size_mm: float, pick: random.Random) -> Words:
    """All three coordinates moved together by a random direction of this length."""
    way = np.array([pick.gauss(0.0, 1.0) for _ in "XYZ"])
    way *= size_mm / np.linalg.norm(way)
    return words | {axis: f"{float(words[axis]) + by:.7f}" for axis, by in zip("XYZ", way, strict=True)}


def _scaled(words: Words, factor: float) -> Words:
    return words | {axis: f"{float(words[axis]) * factor:.7f}" for axis in "XYZ"}


def _flipped(words: Words, axis: str) -> Words:
    return words | {axis: f"-{words[axis]}"}


def _without(words: Words, axis: str) -> Words:
    return {name: value for name, value in words.items() if name != axis}


def _second_line(tag: str, line: str, by_mm: float) -> list[str]:
    words = dict(_FIELD.findall(line))
    return [line, _written(tag, words | {"Y": f"{float(words['Y']) + by_mm:.7f}"})]


def _early(tag: str, kind: str, words: Words, before: Words, pick: random.Random) -> list[str]:
    """The answer to the next command comes before the command."""
    after = f"{int(tag) % 99999 + 1:05d}"
    return [f"{tag} %", f"{after} &", f"{after} # X(1), Y(2), Z(3)", f"{after} %"] if kind == "%" else [f"{tag} {kind}"]


def _unaccepted(tag: str, kind: str, words: Words, before: Words, pick: random.Random) -> list[str]:
    return [_written(tag, words), f"{tag} &"] if kind == "&" else [f"{tag} {kind}"]


LIES: dict[str, Lie] = {
    "moved by 0.6 mm": _of_data(lambda words, _, pick: _moved(words, 0.6, pick)),
    "moved by 5 mm": _of_data(lambda words, _, pick: _moved(words, 5.0, pick)),
    "Z + 50 mm": _of_data(lambda words, *_: words | {"Z": f"{float(words['Z']) + 50.0:.7f}"}),
    "a sign flipped": _of_data(lambda words, _, pick: _flipped(words, pick.choice("XYZ"))),
    "X and Y exchanged": _of_data(lambda words, *_: words | {"X": words["Y"], "Y": words["X"]}),
    "inches": _of_data(lambda words, *_: _scaled(words, 1.0 / 25.4)),
    "metres": _of_data(lambda words, *_: _scaled(words, 1e-3)),
    "micrometres": _of_data(lambda words, *_: _scaled(words, 1e3)),
    "the point before again": _of_data(lambda words, before, _: before or _scaled(words, 0.9)),
    "a coordinate is missing": _of_data(lambda words, _, pick: _without(words, pick.choice("XYZ"))),
    "not a number": _of_data(lambda words, _, pick: words | {"X": pick.choice(NO_NUMBERS)}),
    "17 digits": _of_data(lambda words, *_: words | {"X": f"{float(words['X']):.3f}".ljust(18, "1")}),
    "another tip": _of_data(lambda words, *_: words | {"ER": "1.5"}),
    "the clock of before": _of_data(lambda words, before, _: words | {"Server.Time": before.get("Server.Time", "0")}),
    "X twice": _of_line(lambda _, line: [re.sub(r"X\(([^)]*)\)", r"X(\1), X(0.5)", line)]),
    "X twice, the same": _of_line(lambda _, line: [re.sub(r"(X\([^)]*\))", r"\1, \1", line)]),
    "a second line that contradicts": _of_line(lambda tag, line: _second_line(tag, line, 0.4)),
    "the same line twice": _of_line(lambda tag, line: _second_line(tag, line, 0.0)),
    "a name that was not asked for": _of_line(lambda _, line: [f"{line}, Colour(3)"]),
    "no parentheses": _of_line(lambda _, line: [line.replace("(", " ").replace(")", "")]),
    "a line that is cut": _of_line(lambda _, line: [line[: len(line) // 2]]),
    "another tag": _of_line(lambda tag, line: [line.replace(tag, f"{int(tag) - 1:05d}", 1)]),
    "no tag": _of_line(lambda _, line: [line[6:]]),
    "no data": _of_line(lambda *_: []),
    "data before it is accepted": _unaccepted,
    "the next answer before its command": _early,
}  # fmt: skip
OTHERS: dict[str, tuple[str, int, Lie]] = {
    "the machine stands elsewhere": ("Get(", 0, _of_data(lambda words, _, pick: _moved(words, 8.0, pick))),
    "a temperature in kelvin": (
        "GetProp(Part.Temperature(), ",
        -1,
        _of_data(lambda words, *_: words | {PART: "293.15"}),
    ),
    "a thermometer that is not connected": (
        "GetProp(Part.Temperature(), ",
        -1,
        _of_data(lambda words, *_: words | {PART: "0"}),
    ),
    "a temperature that is no number": (
        "GetProp(Part.Temperature(), ",
        -1,
        _of_data(lambda words, *_: words | {PART: "nan"}),
    ),
    "a temperature twice": ("GetProp(Part.Temperature(), ", -1, _of_line(lambda _, line: [f"{line}, {PART}(21)"])),
    "a move with data": ("GoTo(", -1, lambda tag, kind, *_: [f"{tag} # X(1)"] * (kind == "%") + [f"{tag} {kind}"]),
}
"""Not the measurement is answered falsely, but the first command of this name after so many measurements more."""


@dataclass
class Liar:
    """Stands between a client and the server at ``port``, and tells a lie at the n-th measurement of the session."""

    port: int
    name: str
    point: int
    pick: random.Random
    tag: str = ""
    told: bool = False
    _measured: int = 0
    _before: Words = field(default_factory=dict)
    _data: Words = field(default_factory=dict)

    @contextmanager
    def listening(self) -> Iterator[int]:
        """The port to connect to."""
        with socket.create_server(("127.0.0.1", 0)) as listener:
            thread = threading.Thread(target=self._serve, args=(listener,), daemon=True)
            thread.start()
            yield int(listener.getsockname()[1])
            thread.join(10.0)

    def _serve(self, listener: socket.socket) -> None:
        client, _ = listener.accept()
        server = socket.create_connection(("127.0.0.1", self.port), 10.0)
        for one in (client, server):
            one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        back = threading.Thread(target=self._pump, args=(server, client, self._answer), daemon=True)
        back.start()
        self._pump(client, server, self._command)
        back.join(10.0)
        client.close()
        server.close()

    def _pump(self, source: socket.socket, sink: socket.socket, change: Callable[[str], list[str]]) -> None:
        with suppress(OSError), source.makefile("rb") as lines:
            for line in lines:
                for one in change(line.decode("latin-1").removesuffix("\r\n")):
                    sink.sendall(one.encode("latin-1") + b"\r\n")
        with suppress(OSError):
            sink.shutdown(socket.SHUT_WR)

    def _command(self, line: str) -> list[str]:
        """Commands pass; the one that gets the false answer is noted."""
        self._measured += "PtMeas(" in line
        wanted, after, _ = OTHERS.get(self.name, ("PtMeas(", 0, None))
        if not self.tag and self._measured == self.point + after and wanted in line:
            self.tag = line[:5]
        return [line]

    def _answer(self, line: str) -> list[str]:
        tag, kind, text = line[:5], line[6:7], line[8:]
        words = dict(_FIELD.findall(text))
        if tag != self.tag:
            self._before = words if "ER" in words else self._before
            return [line]
        self.told = True
        if self.name in OTHERS:
            return OTHERS[self.name][2](tag, kind, words, self._before, self.pick)
        self._data = words or self._data
        if kind == "&" and self.name == "data before it is accepted":
            words = {"X": "1", "Y": "2", "Z": "3"}
        return LIES[self.name](tag, kind, words, self._before, self.pick)


@dataclass
class Bench:
    """A small measurement on the virtual CMM, its plan, and what it reads when nobody lies."""

    gauge: Gauge
    machine: Machine
    placement: Placement
    plan: Plan
    state: MachineState
    port: int
    truth: Recording

    def measure(self, journal: Path, port: int, resume: bool = False) -> Recording:
        """All points of the plan."""
        where = f"127.0.0.1:{port}"
        return sg.measure(
            self.plan,
            self.machine,
            self.gauge,
            self.placement,
            server=where,
            journal=journal,
            homing=True,
            resume=resume,
        )


@contextmanager
def bench(folder: Path) -> Iterator[Bench]:
    """The first three blocks of the shipped gauge, up and down and up again, on the shipped bridge machine."""
    gauge, machine = sg.read_gauge("step-gauge-420"), read_machine("bridge-cmm")
    axis = np.array([0.5, 0.8, 0.05]) / np.linalg.norm([0.5, 0.8, 0.05])
    centre, length = np.array([200.0, 300.0, 150.0]), gauge.block_centre_mm[-1] - gauge.block_centre_mm[0]
    lies = make_placement(centre, centre + length * axis, 1, gauge.n_blocks)
    planned = sg.plan(lies, gauge, machine, blocks=(1, 3), order="up-down", cycles=2)
    state = MachineState(LiveCmm(machine, gauge, lies, MachineClock(None), seed=1))
    with Server(state, ServerAddress(port=0)).serving_in_thread() as port:
        found = Bench(gauge, machine, lies, planned, state, port, Recording.__new__(Recording))
        found.truth = found.measure(folder / "truth.journal", port)
        yield found


def attack(place: Bench, folder: Path, name: str, point: int, pick: random.Random) -> str:
    """One lie at one point (from 1); what was found that must not be, or nothing."""
    journal = folder / f"{name}-{point}.journal".replace(" ", "_")
    liar = Liar(place.port, name, point, pick)
    with liar.listening() as port:
        try:
            place.measure(journal, port)
            return "recorded, as if nothing were wrong"
        except InputError as error:
            message = str(error)
    wrong = _wrong(place, journal, point, message, liar)
    again = place.measure(journal, place.port, resume=True)
    off_mm = float(np.abs(again.position_mm - place.truth.position_mm).max())
    return wrong or ("" if off_mm <= SAME_MM else f"resumed to a recording that is {off_mm:.4f} mm off")


def _wrong(place: Bench, journal: Path, point: int, message: str, liar: Liar) -> str:
    rows = look(journal).rows
    frame = place.truth.frame
    named = f"cycle {frame['cycle'][point - 1]}, face {frame['face'][point - 1]}"
    read = np.array([[row[axis] for axis in POSITION] for row in rows.values()]).reshape(-1, 3)
    if not liar.told:
        return "no lie was told"
    if sorted(rows) != list(range(1, point)):
        return f"points {sorted(rows)} are in the journal, not those before {point}"
    if rows and np.abs(read - place.truth.position_mm[: len(read)]).max() > SAME_MM:
        return "a false reading is in the journal"
    so_far = f"{point - 1} of {len(place.truth)} points measured"
    if not all(words in message for words in (f"{named}: ", so_far, "resume goes on")):
        return f"the message does not name the point: {message}"
    top = float(place.machine.travel_mm[2, 1])
    if "; drawn back" not in message or place.state.cmm.position_mm[2] < top - 2.0:
        return f"the machine was not drawn back: {message}"
    return ""


def main() -> int:
    """The command; the exit code is 1 where anything was found."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5, help="lies of each kind")
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    pick, outcomes = random.Random(asked.seed), Counter[str]()
    with tempfile.TemporaryDirectory() as name, bench(Path(name)) as place:
        for number in range(asked.rounds):
            folder = Path(name) / str(number)
            folder.mkdir()
            for kind in (*LIES, *OTHERS):
                wrong = attack(place, folder, kind, pick.randrange(1, len(place.truth) + 1), pick)
                outcomes["missed" if wrong else "stopped and resumed"] += 1
                if wrong:
                    print(f"{kind}: {wrong}")
    print(f"{len(LIES) + len(OTHERS)} kinds of false answers, {asked.rounds} of each: {dict(outcomes)}")
    return int(bool(outcomes["missed"]))


if __name__ == "__main__":
    sys.exit(main())
