"""``stepgauge serve``: the virtual CMM as an I++ DME server."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from stepgauge.cli.options import (
    FURTHER_STYLUS,
    GAUGE,
    GAUGE_TEMPERATURE,
    NOT_NEGATIVE,
    POSITIVE,
    FiniteRange,
    machine_option,
    say,
)

if TYPE_CHECKING:
    from stepgauge.live.machine_state import MachineState

PORT = 1294
FASTEST = 1000.0


class _Speed(click.ParamType):
    """How many times as fast as real time, or ``max``."""

    name = "speed"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if value is None or value == "max":
            return None
        return FiniteRange(0.01, FASTEST).convert(value, param, ctx)


@click.command("serve")
@machine_option(True, "Machine file (TOML), or the name of a shipped one.")
@GAUGE
@click.option("--placement", "-p", required=True, metavar="P", help="Placement file: how the gauge truly lies.")
@click.option(
    "--faults",
    metavar="FILE",
    help="Concealed faults: [[effect]] tables as in a machine file, and [[event]] tables, which stop the machine.",
)
@click.option(
    "--speed",
    type=_Speed(),
    default="1",
    show_default=True,
    metavar="N|max",
    help="Seconds of the machine in one of real time; max: moves take no time, and the clock runs in moves only.",
)
@click.option("--port", type=click.IntRange(0, 65535), default=PORT, show_default=True, help="TCP port; 0: a free one.")
@click.option("--host", default="127.0.0.1", show_default=True, metavar="ADDRESS", help="Address to listen at.")
@FURTHER_STYLUS
@GAUGE_TEMPERATURE
@click.option("--seed", type=click.IntRange(0), help="Seed of the repeatability. Default: another one each time.")
@click.option(
    "--start-time",
    type=NOT_NEGATIVE,
    default=0.0,
    show_default=True,
    metavar="S",
    help="Time of the clock at first, s.",
)
@click.option("--tool", default="StepGaugeProbe", show_default=True, metavar="NAME", help="What the probe is called.")
@click.option("--idle", type=POSITIVE, metavar="S", help="End after so many seconds without a client. Default: never.")
@click.option(
    "--client-idle",
    type=POSITIVE,
    default=1800.0,
    show_default=True,
    metavar="S",
    help="Let a client go that sends nothing for so many seconds while the machine stands; it is told error 8001.",
)
@click.option("--log", metavar="FILE", help="Write down every line of both sides.")
def command(machine: str, gauge: str, placement: str, port: int, host: str, **options: Any) -> None:
    """Serve the virtual CMM over I++ DME, the standard interface of CMM controllers.

    Any I++ DME client can drive it, 'stepgauge measure' or a metrology software: sessions, tools, properties, moves and
    touches, in real time or faster. It moves within the travel of the machine file, hits the gauge if it is sent there,
    and reads as the machine file and the faults say; the effects act by its clock, which starts with the first session.
    With a --further-stylus whose file has a tool in [probe], clients change to it by that name (ChangeTool, SetTool).
    It serves one client at a time: another one is told who is there (error 8000), and an idle one is let go after
    --client-idle. It ends cleanly on Ctrl-C.

    \b
    stepgauge serve -m bridge-cmm -g step-gauge-420 -p placement.toml --speed 10
    stepgauge measure gauge.ipp -m bridge-cmm -g step-gauge-420 -p placement.toml \\
        --server 127.0.0.1:1294 --homing -o recording.csv

    A file of faults, to try what a client or a diagnosis makes of it:

    \b
    [[effect]]
    kind = "scale_error"
    axis = "x"
    ppm = 8.0
    [[event]]
    kind = "emergency_stop"
    after_points = 20
    """
    from stepgauge.live.server import Listening

    state = _state(machine, gauge, placement, options)
    if options["log"]:
        _log_to(options["log"])
    _serve(state, Listening(host, port, options["idle"], options["client_idle"]))


def _state(machine: str, gauge: str, placement: str, options: dict[str, Any]) -> MachineState:
    from stepgauge.gauge.certified import read_gauge
    from stepgauge.gauge.placement import read_placement
    from stepgauge.live.clock import MachineClock
    from stepgauge.live.cmm import LiveCmm
    from stepgauge.live.faults import read_faults
    from stepgauge.live.machine_state import MachineState
    from stepgauge.machine.file import read_machine
    from stepgauge.machine.styli import with_styli
    from stepgauge.planning.program import check_tool

    check_tool(options["tool"], "ippdme")
    steps = read_gauge(gauge)
    cmm = LiveCmm(
        with_styli(read_machine(machine), map(read_machine, options["styli"])),
        steps,
        read_placement(placement, steps),
        MachineClock(options["speed"], options["start_time"]),
        read_faults(options["faults"]) if options["faults"] else None,
        options["gauge_temperature"],
        options["seed"],
    )
    return MachineState(cmm, options["tool"])


def _log_to(path: str) -> None:
    import logging

    from stepgauge.errors import InputError
    from stepgauge.files.outputs import refuse_input

    refuse_input(path)
    try:
        handler = logging.FileHandler(path, encoding="ascii", errors="backslashreplace")
    except OSError as error:
        raise InputError(path, f"cannot write here: {error.strerror or error}") from None
    handler.setFormatter(logging.Formatter("%(asctime)s %(message)s"))
    logger = logging.getLogger("stepgauge.live")
    logger.addHandler(handler)
    logger.setLevel(logging.DEBUG)


def _serve(state: MachineState, listening: Any) -> None:
    """Serve until told to end; what went wrong at the beginning is told with the address."""
    import asyncio
    import ipaddress

    from stepgauge.errors import InputError
    from stepgauge.live.connection import Address
    from stepgauge.live.server import Server

    def ready(host: str, port: int) -> None:
        if not ipaddress.ip_address(host.partition("%")[0]).is_loopback:
            say(f"warning: whoever can reach {host} can drive this machine; I++ DME knows no passwords")
        say(f"{state.cmm.machine.table.name} listens at {Address(host, port)}")

    try:
        asyncio.run(Server(state, listening).run(ready))
    except OSError as error:
        where = f"{listening.host}:{listening.port}"
        raise InputError(
            where, "cannot listen here", found=error.strerror or error, expected="another --port"
        ) from None
    say("ended")
