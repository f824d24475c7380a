"""The I++ DME server and client: points per second, memory, random bytes, and what survives being killed.

    python benchmarks/live.py [--commands N] [--lines N] [--kills N]

The server runs unscaled in a process of its own; its rate is that of the processor time which it takes, so that other
work on the machine does not count. Client and server are killed in turn (SIGKILL) at random moments of a measurement of
48 points, until that has happened so many times; every measurement is resumed to its end.
"""

from __future__ import annotations

import contextlib
import json
import multiprocessing
import os
import random
import re
import socket
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import click
import numpy as np
from table import Table

from stepgauge.cli import main as stepgauge
from stepgauge.gauge.certified import read_gauge
from stepgauge.gauge.placement import make_placement, write_placement
from stepgauge.ippdme.codes import CODES
from stepgauge.live.journal import journal_of
from stepgauge.recording import read_recording

BAR_POINTS_PER_S, BAR_GROWTH_MB = 1000.0, 2.0
WAIT_S = 30.0
PROCESSES = multiprocessing.get_context("fork")
STANDARD = re.compile(r'(?:[0-9]{5}|E[0-9]{4}) (?:&|%|# .*|! Error\([0-9], ([0-9]{4}), "[^"]*", "([^"]*)"\))')
COMMANDS = (
    *(b"StartSession()", b"EndSession()", b"Home()", b"ClearAllErrors()", b"AbortE()", b"StopAllDaemons()"),
    *(b"GoTo(X(1), Y(2), Z(550))", b"PtMeas(X(650), Y(50), Z(50), IJK(0, 0, 1))", b"Get(X(), Y())"),
    *(b"SetProp(Tool.PtMeasPar.Speed(2))", b"EnumAllProp(Tool())", b"OnMoveReportE(Time(1), X())"),
    *(b'SetTool("RefTool")', b"AlignTool(0, 0, 1, 5)", b"SetCsyTransformation(PartCsy, 1, 2, 3, 4, 5, 6)"),
)


class Files:
    """Placement, program and machine of a measurement, in a folder of its own."""

    def __init__(self, folder: Path) -> None:
        gauge = read_gauge("step-gauge-420")
        axis = np.array([0.5, 0.8, 0.05]) / np.linalg.norm([0.5, 0.8, 0.05])
        length = gauge.block_centre_mm[-1] - gauge.block_centre_mm[0]
        self.placement, self.program = folder / "placement.toml", folder / "gauge.ipp"
        centre = np.array([200.0, 300.0, 150.0])
        write_placement(self.placement, make_placement(centre, centre + length * axis, 1, gauge.n_blocks))
        self.common = ["-m", "bridge-cmm", "-g", "step-gauge-420", "-p", str(self.placement)]
        plan = ["plan", str(self.placement), *self.common[:4], "-d", "ippdme", "--blocks", "1:8", "--cycles", "3"]
        _wait(start([*plan, "-o", str(self.program)]))

    def serve(self, port: int, speed: str) -> multiprocessing.Process:
        """A server that is ready."""
        words = ["serve", *self.common, "--port", str(port), "--speed", speed, "--idle", "120"]
        process = start(words)
        until = time.monotonic() + WAIT_S
        while True:
            with contextlib.suppress(OSError):
                socket.create_connection(("127.0.0.1", port), 1.0).close()
                return process
            if time.monotonic() > until:
                raise TimeoutError("the server does not listen")
            time.sleep(0.01)

    def measure(self, port: int, output: Path, again: bool) -> multiprocessing.Process:
        """A client, at work."""
        words = ["measure", str(self.program), *self.common, "--server", f"127.0.0.1:{port}", "--homing"]
        return start([*words, "-o", str(output), *["--resume"] * again])


def _verb(words: list[str]) -> None:
    with open(os.devnull, "w") as nothing, contextlib.redirect_stderr(nothing):
        stepgauge(words)


def start(words: list[str]) -> multiprocessing.Process:
    """A verb in a process that is forked off, without the time of imports."""
    process = PROCESSES.Process(target=_verb, args=(words,), daemon=True)
    process.start()
    return process


def _wait(process: multiprocessing.Process) -> int:
    process.join(10.0 * WAIT_S)
    assert process.exitcode is not None, "a process did not end"
    return process.exitcode


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return int(listener.getsockname()[1])


class Client:
    """Sends commands one after the other."""

    def __init__(self, port: int) -> None:
        self.socket = socket.create_connection(("127.0.0.1", port), WAIT_S)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.file, self.tag = self.socket.makefile("rb"), 0

    def ask(self, command: bytes) -> bytes:
        """The last line before the command was complete."""
        self.tag = self.tag % 99999 + 1
        self.socket.sendall(b"%05d %b\r\n" % (self.tag, command))
        line = b""
        while (now := self.file.readline())[6:7] != b"%":
            line = now
        return line

    def close(self) -> None:
        self.file.close()
        self.socket.close()


@contextmanager
def served(files: Files, speed: str = "max") -> Iterator[tuple[Client, int]]:
    """A client in a session with a homed machine, and the number of the server's process."""
    port = free_port()
    process = files.serve(port, speed)
    time.sleep(0.1)
    client = Client(port)
    for command in (b"StartSession()", b"Home()"):
        client.ask(command)
    yield client, process.pid or 0
    client.close()
    process.terminate()
    _wait(process)


def processor_s(pid: int) -> float:
    """Processor time of a process, s."""
    words = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")


def memory_mb(pid: int) -> float:
    """Resident memory of a process, MB."""
    text = Path(f"/proc/{pid}/status").read_text()
    return int(text.split("VmRSS:")[1].split()[0]) / 1024.0


def probings(files: Files) -> list[bytes]:
    """PtMeas commands of the program."""
    lines = files.program.read_bytes().split(b"\r\n")
    return [line[6:] for line in lines if line[6:].startswith((b"PtMeas", b"GoTo", b"SetProp"))]


def rate(files: Files, table: Table, rounds: int = 30) -> None:
    """Points, with the moves between them."""
    commands = probings(files)
    points = sum(one.startswith(b"PtMeas") for one in commands)
    with served(files) as (client, pid):
        for command in commands:
            client.ask(command)
        before, began = processor_s(pid), time.perf_counter()
        for _ in range(rounds):
            for command in commands:
                assert b"!" not in client.ask(command)
        used, took = processor_s(pid) - before, time.perf_counter() - began
        table.add("points with 4 moves between them, of processor time", rounds * points / used, "1/s")
        first = next(n for n, one in enumerate(commands) if one.startswith(b"PtMeas"))
        for command in commands[: first + 1]:
            client.ask(command)
        before, began = processor_s(pid), time.perf_counter()
        for _ in range(rounds * points):
            client.ask(commands[first])
        used, alone = processor_s(pid) - before, time.perf_counter() - began
    table.add("PtMeas, of processor time", rounds * points / used, "1/s", low=BAR_POINTS_PER_S)
    table.add("PtMeas, of real time with this client", rounds * points / alone, "1/s")
    table.add("points with moves, of real time with this client", rounds * points / took, "1/s")


def growth(files: Files, table: Table, commands: int) -> None:
    """Memory over many commands, of which one in ten measures."""
    cycle = [*[b"GetProp(Tool.PtMeasPar.Speed())"] * 4, b"GetXtdErrStatus()", *[b"Get(X(), Y(), Z())"] * 2]
    cycle += [b"Nonsense()", b"ClearAllErrors()"]
    every = probings(files)
    first = next(n for n, one in enumerate(every) if one.startswith(b"PtMeas"))
    with served(files) as (client, pid):
        for command in every[: first + 1]:
            client.ask(command)
        cycle.append(every[first])
        for n in range(10_000):
            client.ask(cycle[n % len(cycle)])
        before = memory_mb(pid)
        for n in range(commands):
            client.ask(cycle[n % len(cycle)])
        table.add(f"memory, growth over {commands} commands", memory_mb(pid) - before, "MB", high=BAR_GROWTH_MB)


def mad(rng: random.Random, number: int) -> bytes:
    """Random bytes, or a command with characters put in, taken out or exchanged."""
    if rng.random() < 0.3:
        return rng.randbytes(rng.randrange(80)).replace(b"\n", b"?")
    command = rng.choice(COMMANDS)
    tag = (
        b"E%04d " % (number % 9998 + 1)
        if command.partition(b"(")[0].endswith(b"E")
        else b"%05d " % (number % 99999 + 1)
    )
    line = bytearray(tag + command)
    for _ in range(rng.choice([0, 0, 1, 3])):
        at = rng.randrange(len(line))
        line[at : at + rng.randrange(2)] = bytes([rng.randrange(32, 127)]) * rng.randrange(3)
    return bytes(line)


def random_bytes(files: Files, table: Table, count: int) -> None:
    """Every answer is one of the standard, and the server lives."""
    rng, foreign, errors = random.Random(1), 0, 0
    with served(files) as (client, _):
        for number in range(count):
            client.socket.sendall(mad(rng, number) + b"\r\n")
            if number % 50 == 49 or number == count - 1:
                client.socket.sendall(b"E9999 GetErrStatusE()\r\n")
                answer = ""
                while not answer.endswith("E9999 %"):
                    answer = client.file.readline().decode("latin-1").removesuffix("\r\n")
                    match = STANDARD.fullmatch(answer)
                    good = match is not None and (not match[1] or CODES[int(match[1])].text == match[2])
                    foreign += not good
                    errors += bool(match and match[1])
    table.add(f"{count} random lines: answers outside the standard", foreign, high=0.0)
    table.add("of these, answered with an error", errors)


def kills(files: Files, table: Table, count: int) -> None:
    """Kill client and server in turn, resume, and look at what was recorded."""
    rng, killed, lost, twice, off_um, runs = random.Random(2), 0, 0, 0, 0.0, 0
    truth = _truth(files)
    while killed < count:
        runs += 1
        output = files.program.parent / f"recording-{runs}.csv"
        port, acknowledged, finished = free_port(), set[int](), False
        server = files.serve(port, "60")
        while not finished:
            began = journal_of(output).exists()
            client = files.measure(port, output, again=began)
            if killed < count and rng.random() < 0.85:
                time.sleep(rng.random() * 1.2)
                victim = (client, server)[killed % 2]
                killed += victim.is_alive()
                victim.kill()
                _wait(victim)
            code = _wait(client)
            points = _points(output)
            lost += len(acknowledged - set(points))
            twice += len(points) - len(set(points))
            acknowledged = set(points)
            finished = code == 0 and output.exists()
            if not server.is_alive():
                port = free_port()
                server = files.serve(port, "60")
        found = read_recording(output)
        lost += len(truth) - len(found)
        twice += int(found.frame.duplicated(["cycle", "face"]).sum())
        off_um = max(off_um, float(np.abs(found.position_mm - truth).max()) * 1e3)
        server.terminate()
        _wait(server)
    table.add(f"{killed} kills in {runs} measurements: points lost", lost, high=0.0)
    table.add("points measured twice", twice, high=0.0)
    table.add("largest difference from an undisturbed run (1 sigma 0.3 um each)", off_um, "um", high=3.0)


def _points(output: Path) -> list[int]:
    """Numbers of the points in a journal; a line that is not whole is no point."""
    path = journal_of(output)
    lines = path.read_bytes().split(b"\n")[:-1] if path.exists() else []
    return [point for line in lines if (point := json.loads(line).get("point"))]


def _truth(files: Files) -> np.ndarray:
    output = files.program.parent / "undisturbed.csv"
    _wait(start(["simulate", str(files.program), *files.common, "-o", str(output), "--seed", "1"]))
    return read_recording(output).position_mm


@click.command(context_settings={"show_default": True})
@click.option("--commands", default=1_000_000, help="Commands over which the memory is watched.")
@click.option("--lines", default=100_000, help="Random lines.")
@click.option("--kills", "count", default=100, help="How many times client or server is killed.")
def main(commands: int, lines: int, count: int) -> None:
    """Print the table; the exit code is the number of bars that were missed."""
    table = Table()
    with tempfile.TemporaryDirectory() as name:
        files = Files(Path(name))
        rate(files, table)
        growth(files, table, commands)
        random_bytes(files, table, lines)
        kills(files, table, count)
    sys.exit(table.print())


if __name__ == "__main__":
    main()
