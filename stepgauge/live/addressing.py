"""The machine that an address names, linked for as long as it is needed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from stepgauge.errors import InputError
from stepgauge.live.connection import Address, Connection, SessionLog
from stepgauge.live.controller import Controller, Link
from stepgauge.machine.file import Machine
from stepgauge.motion.moves import ProbingSettings

LINUXCNC = "linuxcnc"
"""Instead of an address: the controller that runs on this computer."""


@contextmanager
def linked(
    server: str,
    settings: ProbingSettings,
    machine: Machine,
    *,
    spy: str | Path | None = None,
    stop: Callable[[], bool] | None = None,
) -> Iterator[Link]:
    """A link to the machine that ``server`` names.

    Parameters
    ----------
    server : ``"HOST:PORT"`` of an I++ DME server, or ``"linuxcnc"``
    settings : what the controller is told of speeds and distances
    machine : its travel bounds how long a move may take
    spy : file that gets every line of both sides
    stop : asked ten times a second whether to stop
    """
    if server == LINUXCNC:
        from stepgauge.live.linuxcnc import LinuxCnc

        if spy is not None:
            raise InputError("spy", "LinuxCNC has no session to write down", found=spy, expected="an I++ DME server")
        yield LinuxCnc(settings, stop)
        return
    address = Address.parse(server)
    with ExitStack() as open_files:
        watching = None if spy is None else SessionLog(spy, {"server": str(address)})
        if watching is not None:
            open_files.callback(watching.close)
        connection = Connection(address, watching, stop)
        open_files.callback(connection.close)
        yield Controller(connection, settings, machine.longest_move_mm)
