"""``serve``: the virtual CMM as an I++ DME server."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any

from stepgauge.verbs.define import verb
from stepgauge.verbs.kinds import Count, Number, Reads, Supplied, Text, Writes
from stepgauge.verbs.shared import (
    File,
    FurtherStyli,
    GaugeLike,
    GaugeTemperature,
    MachineLike,
    PlacementLike,
    Tool,
)

if TYPE_CHECKING:
    from stepgauge.live.machine_state import MachineState

PORT = 1294


class Speed(Number):
    """How many times as fast as real time, or ``max``."""

    def __init__(self) -> None:
        super().__init__("", 0.01, 1000.0, name="speed")
        self.metavar = "N|max"

    def parse(self, text: str) -> Any:
        return text if text == "max" else super().parse(text)

    def fault(self, value: Any) -> tuple[str, str] | None:
        return None if value == "max" else super().fault(value)


@verb()
def serve(
    machine: MachineLike,
    gauge: GaugeLike,
    placement: PlacementLike,
    *,
    faults: Annotated[File | None, Reads("FILE")] = None,
    speed: Annotated[float | str, Speed()] = 1.0,
    port: Annotated[int, Count(0, 65535)] = PORT,
    host: Annotated[str, Text("ADDRESS")] = "127.0.0.1",
    further_styli: FurtherStyli = (),
    gauge_temperature_C: GaugeTemperature = None,
    seed: Annotated[int | None, Count(0)] = None,
    start_time_s: Annotated[float, Number("s", 0.0)] = 0.0,
    tool: Tool = "StepGaugeProbe",
    idle_s: Annotated[float | None, Number("s", above=0.0)] = None,
    client_idle_s: Annotated[float, Number("s", above=0.0)] = 1800.0,
    log: Annotated[File | None, Writes("FILE")] = None,
    tell: Annotated["Callable[[str], None]", Supplied("tell")] = print,
) -> None:
    """Serve the virtual CMM over I++ DME, the standard interface of CMM controllers.

    Any I++ DME client can drive it, 'stepgauge measure' or a metrology software: sessions, tools, properties, moves and
    touches, in real time or faster. It moves within the travel of the machine file, hits the gauge if it is sent there,
    and reads as the machine file and the faults say; the effects act by its clock, which starts with the first session.
    With a further stylus whose file has a tool in [probe], clients change to it by that name (ChangeTool, SetTool). It
    serves one client at a time: another one is told who is there (error 8000), and an idle one is let go after
    ``client_idle_s``. It ends cleanly on Ctrl-C.

    Parameters
    ----------
    placement : placement file: how the gauge truly lies
    faults : concealed faults: [[effect]] tables as in a machine file, and [[event]] tables, which stop the machine
    speed : seconds of the machine in one of real time; max: moves take no time, and the clock runs in moves only
    port : TCP port; 0: a free one
    host : address to listen at
    seed : seed of the repeatability; default: another one each time
    start_time_s : time of the clock at first
    tool : what the probe is called
    idle_s : end after so long without a client; default: never
    client_idle_s : let a client go that sends nothing for so long while the machine stands; it is told error 8001
    log : write down every line of both sides
    tell : called with a line where it listens, and when it ends

    Examples
    --------
    stepgauge serve -m bridge-cmm -g step-gauge-420 -p placement.toml --speed 10
    stepgauge measure gauge.ipp -m bridge-cmm -g step-gauge-420 -p placement.toml \\
        --server 127.0.0.1:1294 --homing -o recording.csv

    A file of faults, to try what a client or a diagnosis makes of it:

        [[effect]]
        kind = "scale_error"
        axis = "x"
        ppm = 8.0
        [[event]]
        kind = "emergency_stop"
        after_points = 20
    """
    from stepgauge.live.server import ServerAddress, log_to, run_server

    clock = None if speed == "max" else float(speed), start_time_s
    state = machine_state(machine, gauge, placement, further_styli, faults, clock, gauge_temperature_C, seed, tool)
    if log is not None:
        log_to(log)
    run_server(state, ServerAddress(host, port, idle_s, client_idle_s), tell)


def machine_state(
    machine: Any,
    gauge: Any,
    placement: Any,
    styli: Any,
    faults: File | None,
    clock: tuple[float | None, float],
    gauge_temperature_C: float | None,
    seed: int | None,
    tool: str,
) -> "MachineState":
    """The machine as a client meets it at first."""
    from stepgauge.live.clock import MachineClock
    from stepgauge.live.cmm import LiveCmm
    from stepgauge.live.faults import read_faults
    from stepgauge.live.machine_state import MachineState
    from stepgauge.planning.program import check_tool
    from stepgauge.verbs.inputs import resolve_gauge, resolve_machine_with_styli, resolve_placement

    check_tool(tool, "ippdme")
    steps = resolve_gauge(gauge)
    cmm = LiveCmm(
        resolve_machine_with_styli(machine, styli),
        steps,
        resolve_placement(placement, steps),
        MachineClock(*clock),
        read_faults(faults) if faults else None,
        gauge_temperature_C,
        seed,
    )
    return MachineState(cmm, tool)
