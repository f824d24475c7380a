"""A small gauge on a small machine, behind a server in a thread or in memory; and clients that send what they like."""

from __future__ import annotations

import asyncio
import socket
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from stepgauge.effects import make_effects
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.live.clock import MachineClock
from stepgauge.live.cmm import LiveCmm
from stepgauge.live.faults import EventTable, Faults
from stepgauge.live.machine_state import MachineState
from stepgauge.live.methods import HANDLERS
from stepgauge.live.server import Server, ServerAddress
from stepgauge.live.session import Session
from stepgauge.machine.file import Machine, MachineTable
from stepgauge.motion.moves import Program
from stepgauge.planning.plan import PlanOptions
from stepgauge.planning.program import ProbingChoice, checked_program, make_settings
from stepgauge.probes.schema import ConstantTable
from tests.build import make_gauge, make_pose

IDLE_S = 60.0
"""Servers of the tests end by themselves."""


def small_machine(repeatability_um: float = 0.0, effects: tuple[dict[str, Any], ...] = ()) -> Machine:
    table = MachineTable(
        name="Small CMM",
        travel_mm={"x": [0, 400], "y": [0, 400], "z": [0, 300]},
        repeatability_um=repeatability_um,
        measuring_speed_mm_s=3.0,
        travel_speed_mm_s=50.0,
    )
    return Machine(table, ConstantTable(tip_radius_mm=2.0, pretravel_um=3.0, stylus_diameter_mm=2.0), effects)


def small_gauge() -> Gauge:
    return make_gauge(4, deviation_um=np.array([0.0, 1.0, -2.0, 0.5, 1.5, -1.0, 0.3, 2.0]))


def lying(gauge: Gauge, yaw: float = 0.5, pitch: float = 0.03) -> Placement:
    return make_pose(yaw, pitch, 0.01, (150.0, 150.0, 100.0)).placement(gauge)


def small_program(gauge: Gauge, machine: Machine, cycles: int = 1, placement: Placement | None = None) -> Program:
    """A planned program of all faces."""
    options = PlanOptions(1, gauge.n_blocks, cycles=cycles)
    settings = make_settings(gauge, machine, machine.probe.tip_radius_mm, ProbingChoice())
    return checked_program(placement or lying(gauge), gauge, machine, options, settings)


def events(*tables: dict[str, Any]) -> Faults:
    return Faults((), [EventTable(**table) for table in tables])


def make_state(
    speed: float | None = None,
    faults: Faults | None = None,
    machine: Machine | None = None,
    placement: Placement | None = None,
    **cmm: Any,
) -> MachineState:
    """The machine with its gauge; ``speed`` None: unscaled."""
    gauge = small_gauge()
    machine = machine or small_machine()
    lies = placement or lying(gauge)
    return MachineState(LiveCmm(machine, gauge, lies, MachineClock(speed), faults, **cmm))


def with_effects(*tables: dict[str, Any]) -> Faults:
    return Faults(make_effects(tables, "faults.toml"))


@contextmanager
def serving(state: MachineState | None = None, **listening: Any) -> Iterator[int]:
    """The port of a server in a thread."""
    server = Server(state or make_state(), ServerAddress(**{"port": 0, "idle_s": IDLE_S, **listening}))
    found: list[Any] = []
    ready = threading.Event()

    async def run() -> None:
        found.append(asyncio.get_running_loop())
        await server.run(lambda _, port: (found.append(port), ready.set()), signals=False)

    thread = threading.Thread(target=asyncio.run, args=(run(),), daemon=True)
    thread.start()
    assert ready.wait(10.0)
    try:
        yield found[1]
    finally:
        if thread.is_alive():
            found[0].call_soon_threadsafe(server.stop)
        thread.join(10.0)
        assert not thread.is_alive()


def tag_of(command: str, number: int) -> str:
    """Commands whose name ends in E have tags of events."""
    return f"E{number:04d}" if command.partition("(")[0].endswith("E") else f"{number:05d}"


class Raw:
    """A client of bytes."""

    def __init__(self, port: int, timeout_s: float = 10.0) -> None:
        self.socket = socket.create_connection(("127.0.0.1", port), timeout_s)
        self.file = self.socket.makefile("rb")
        self.tag = 0

    def send(self, text: str | bytes) -> None:
        self.socket.sendall(text.encode("latin-1") + b"\r\n" if isinstance(text, str) else text)

    def line(self) -> str:
        return self.file.readline().decode("ascii").removesuffix("\r\n")

    def until(self, end: str) -> list[str]:
        """Lines up to one that is this."""
        lines = [self.line()]
        while lines[-1] != end:
            assert lines[-1], f"the server hung up before {end!r}: {lines}"
            lines.append(self.line())
        return lines

    def ask(self, command: str) -> list[str]:
        """What a command answers, without tags and without & and %."""
        self.tag += 1
        tag = tag_of(command, self.tag)
        self.send(f"{tag} {command}")
        return [line[6:] for line in self.until(f"{tag} %")[1:-1]]

    def close(self) -> None:
        self.file.close()
        self.socket.close()


class Memory:
    """A session without sockets: lines in, lines out."""

    def __init__(self, state: MachineState | None = None) -> None:
        self.state = state or make_state()
        self.lines: list[str] = []
        self.session = Session(self.state, self.lines.append, HANDLERS)
        self.tag = 0

    def run(self, *lines: str | bytes, wait_s: float = 0.0) -> list[str]:
        """All lines at once; what is answered until nothing is left to do.

        In a thread: a test of the pages in the same process may have left a loop running in this one (Playwright's).
        """
        sent = [one.encode("latin-1") if isinstance(one, str) else one for one in lines]
        with ThreadPoolExecutor(1) as thread:
            return thread.submit(lambda: asyncio.run(self._run(sent, wait_s))).result()

    async def _run(self, lines: list[bytes], wait_s: float) -> list[str]:
        self.session._wake, self.session._stopped = asyncio.Event(), asyncio.Event()
        before = len(self.lines)
        for line in lines:
            self.session.receive(line)
        work = asyncio.create_task(self.session.work())
        while self.session._order:
            await asyncio.sleep(wait_s)
        work.cancel()
        return self.lines[before:]

    def ask(self, command: str) -> list[str]:
        """What a command answers, without tags and without & and %."""
        self.tag += 1
        return [line[6:] for line in self.run(f"{tag_of(command, self.tag)} {command}")[1:-1]]

    def start(self) -> Memory:
        """In a session, homed."""
        for command in ("StartSession()", "Home()"):
            assert self.ask(command) == []
        return self


def write_files(folder: Path, machine: Machine, gauge: Gauge, placement: Placement) -> dict[str, str]:
    """The files that the verbs read, by their option."""
    gauge_path, machine_path, placement_path = folder / "gauge.toml", folder / "machine.toml", folder / "placement.toml"
    rows = [
        f"{face},{nominal!r},{position!r},0.1"
        for face, (nominal, position) in enumerate(
            zip(gauge.nominal_mm.tolist(), gauge.position_mm.tolist(), strict=True), 1
        )
    ]
    (folder / "gauge.csv").write_text("\n".join(["face,nominal_mm,position_mm,uncertainty_um", *rows]) + "\n")
    table = {**gauge.table.model_dump(exclude_none=True), "faces": "gauge.csv"}
    certificate = gauge.certificate.model_dump(exclude_none=True)
    gauge_path.write_text(tomli_w.dumps({"gauge": table, "certificate": certificate}))
    stated = machine.table.model_dump(mode="json", exclude_none=True)
    probe = {**machine.probe.model_dump(mode="json", exclude_none=True), "model": "constant"}
    machine_path.write_text(tomli_w.dumps({"machine": stated, "probe": probe, "effect": list(machine.effects)}))
    replace(placement, gauge_serial=gauge.table.serial).write(placement_path)
    return {"--gauge": str(gauge_path), "--machine": str(machine_path), "--placement": str(placement_path)}
