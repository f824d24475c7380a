"""What of the virtual CMM outlives its clients: tool, parameters, coordinate systems; and what it can tell."""

from __future__ import annotations

from dataclasses import dataclass, field

from stepgauge.files.arrays import Array
from stepgauge.ippdme.codes import DmeError
from stepgauge.ippdme.commands import OWN_TIME, TEMPERATURES
from stepgauge.ippdme.values import fixed
from stepgauge.live.cmm import LiveCmm
from stepgauge.live.coordinates import Coordinates
from stepgauge.live.parameters import ToolParameters, tool_parameters
from stepgauge.programs import DIALECTS

NO_TOOL, UNDEFINED = "NoTool", "UnDefTool"
REPORTED = ("X", "Y", "Z")
POSITIONS = {"X": 0, "Y": 1, "Z": 2}


@dataclass
class MachineState:
    """The machine with its tools."""

    cmm: LiveCmm
    probe_name: str = DIALECTS["ippdme"].tool
    user_enabled: bool = False
    found_tool: str = UNDEFINED
    coordinates: Coordinates = field(default_factory=Coordinates)
    report: tuple[str, ...] = REPORTED
    parameters: dict[str, ToolParameters] = field(default_factory=dict)
    tool: str = ""

    def __post_init__(self) -> None:
        self.tool = self.tool or self.probe_name
        self.parameters = {name: tool_parameters(self.cmm.machine) for name in (*self.tools, "BaseTool")}

    @property
    def tools(self) -> tuple[str, ...]:
        """Names of the tools that can be listed."""
        return ("RefTool", NO_TOOL, *self.styli)

    @property
    def styli(self) -> dict[str, int]:
        """The styli of the machine by their names, the first one by that of the probe."""
        further = {one.probe.tool: number for number, one in enumerate(self.cmm.styli, 2) if one.probe.tool}
        return {**further, self.probe_name: 1}

    def change_to(self, name: str) -> None:
        """A tool becomes the one in use; a stylus is put in."""
        self.tool = name
        if self.styli.get(name, self.cmm.stylus) != self.cmm.stylus:
            self.cmm.mount(self.styli[name])

    @property
    def active(self) -> ToolParameters:
        """Parameters of the tool in use."""
        return self.parameters[self.tool]

    def tool_of(self, path: str) -> tuple[str, str]:
        """The tool that ``Tool``, ``FoundTool`` or ``BaseTool`` means, and the rest of the path.

        :class:`DmeError` 0510 for another beginning, 1503 where no tool was found yet.
        """
        first, _, rest = path.partition(".")
        names = {"Tool": self.tool, "FoundTool": self.found_tool, "BaseTool": "BaseTool"}
        if first not in names:
            raise DmeError(510)
        if names[first] == UNDEFINED:
            raise DmeError(1503)
        return names[first], rest

    def temperature_C(self, name: str) -> float | None:
        """A temperature by its name, deg C; None for another name."""
        if name == "Part.Temperature":
            return self.cmm.gauge_temperature_C
        return self.cmm.scale_temperature_C() if name in TEMPERATURES else None

    def quantity(self, name: str, machine_mm: Array) -> str:
        """``X(1.5)`` and the like, of :data:`stepgauge.ippdme.commands.QUANTITIES`, in the coordinates selected."""
        if name in POSITIONS:
            return f"{name}({fixed(self.coordinates.to_part(machine_mm)[POSITIONS[name]])})"
        if name == OWN_TIME:
            return f"{name}({fixed(self.cmm.clock.now_s, 6)})"
        temperature_C = self.temperature_C(name)
        assert temperature_C is not None, name
        return f"{name}({fixed(temperature_C, 4)})"
