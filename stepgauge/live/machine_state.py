"""What of the virtual CMM outlives its clients: tool, parameters, coordinate systems; and what it can tell."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from stepgauge.files.arrays import Array
from stepgauge.ippdme.codes import DmeError
from stepgauge.ippdme.commands import OWN_TIME, TEMPERATURES
from stepgauge.ippdme.values import fixed
from stepgauge.live.cmm import LiveCmm
from stepgauge.machine.file import Machine
from stepgauge.motion.moves import ProbingSettings
from stepgauge.planning.program import SLOWEST_MM_S, fastest_mm_s
from stepgauge.programs import DIALECTS

LARGEST_MM = 1e6


@dataclass(frozen=True)
class Transformation:
    """``part = rotation @ machine + origin_mm``; ``numbers`` are X0, Y0, Z0, Theta, Psi, Phi (mm, deg) as given."""

    numbers: tuple[float, ...] = (0.0,) * 6
    rotation: Array = field(default_factory=lambda: np.eye(3))

    @classmethod
    def of(cls, numbers: list[float]) -> Transformation:
        """From the six numbers of the standard: the machine's origin in part coordinates, and three Euler angles.

        The specification leaves open how the angles are used; here they are z-x-z, R = Rz(phi) Rx(theta) Rz(psi), as
        its range for theta alone (0 to 180 deg, else error 1007) suggests.
        """
        if max(map(abs, numbers)) > LARGEST_MM:
            raise DmeError(509)
        theta, psi, phi = np.radians(numbers[3:])
        if not 0.0 <= theta <= np.pi:
            raise DmeError(1007)
        return cls(tuple(numbers), _about_z(phi) @ _about_x(theta) @ _about_z(psi))

    @property
    def origin_mm(self) -> Array:
        """Where the machine's origin lies in the part's coordinates, (3,) in mm."""
        return np.array(self.numbers[:3])

    def to_part(self, machine_mm: Array) -> Array:
        """A position in the part's coordinates, mm."""
        return self.rotation @ machine_mm + self.origin_mm

    def to_machine(self, part_mm: Array) -> Array:
        """A position in machine coordinates, mm."""
        return self.rotation.T @ (part_mm - self.origin_mm)


def _about_z(angle: float) -> Array:
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])


def _about_x(angle: float) -> Array:
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, cos, sin], [0.0, -sin, cos]])


@dataclass
class Coordinates:
    """The selected coordinate system and all that were defined; a system that was not is that of the machine."""

    selected: str = "MachineCsy"
    defined: dict[str, Transformation] = field(default_factory=dict)

    @property
    def current(self) -> Transformation | None:
        """The transformation that holds; None in machine coordinates."""
        return self.defined.get(self.selected)

    def to_machine(self, position_mm: Array) -> Array:
        """A position of a command in machine coordinates, mm."""
        return position_mm if self.current is None else self.current.to_machine(position_mm)

    def to_part(self, machine_mm: Array) -> Array:
        """A position of the machine as it is answered, mm."""
        return machine_mm if self.current is None else self.current.to_part(machine_mm)

    def direction_to_machine(self, vector: Array) -> Array:
        """A direction of a command in machine axes."""
        return vector if self.current is None else self.current.rotation.T @ vector

    def direction_to_part(self, vector: Array) -> Array:
        """A direction of the machine as it is answered."""
        return vector if self.current is None else self.current.rotation @ vector


FACETS = ("Min", "Max", "Act", "Def")
LONGEST_MM = 100.0
"""Largest approach, search and retract distance of the virtual CMM."""
FASTEST_MM_S2 = 2000.0
ACCELERATION_MM_S2 = 500.0
"""The virtual CMM keeps an acceleration, which has no influence: its moves are at full speed from the start."""


@dataclass
class MachineParameter:
    """A number with its limits; ``value`` is the actual one."""

    low: float
    high: float
    default: float
    value: float

    @classmethod
    def of(cls, low: float, high: float, default: float) -> MachineParameter:
        """A parameter at its default."""
        return cls(low, high, default, default)

    def facet(self, name: str) -> float:
        """``Min``, ``Max``, ``Act`` or ``Def``."""
        return {"Min": self.low, "Max": self.high, "Act": self.value, "Def": self.default}[name]

    def set(self, value: float) -> bool:
        """Take a value, or the limit that it is beyond; False where it was limited."""
        self.value = min(max(value, self.low), self.high)
        return self.value == value


Block = dict[str, MachineParameter]


@dataclass
class ToolParameters:
    """Parameter blocks of one tool."""

    blocks: dict[str, Block]

    def number(self, block: str, name: str) -> float:
        """An actual value."""
        return self.blocks[block][name].value

    def find(self, path: str) -> tuple[MachineParameter, str]:
        """Parameter and facet of a path such as ``PtMeasPar.Speed.Max`` (error 0510 if there is none)."""
        parts = path.split(".")
        block = self.blocks.get(parts[0], {})
        facet = parts[2] if len(parts) == 3 else "Act"
        if not 2 <= len(parts) <= 3 or parts[1] not in block or facet not in FACETS:
            raise DmeError(510)
        return block[parts[1]], facet

    def children(self, path: str) -> Iterator[tuple[str, str]]:
        """Name and kind of what is below a path (error 0510 if there is no such path)."""
        parts = [part for part in path.split(".") if part]
        if not parts:
            yield from ((name, "Property") for name in self.blocks)
        elif len(parts) == 1 and parts[0] in self.blocks:
            yield from ((name, "Number") for name in self.blocks[parts[0]])
        else:
            self.find(path)
            yield from ((facet, "Number") for facet in FACETS if len(parts) == 2)


def tool_parameters(machine: Machine) -> ToolParameters:
    """The blocks of the machine's probe: speeds within the limits of the machine file, mm/s; distances in mm."""
    measuring, travel = fastest_mm_s(machine)
    usual = ProbingSettings()
    acceleration = MachineParameter.of(1.0, FASTEST_MM_S2, ACCELERATION_MM_S2)
    probing = {
        "Speed": MachineParameter.of(SLOWEST_MM_S, measuring, machine.table.measuring_speed_mm_s),
        "Accel": acceleration,
        "Approach": MachineParameter.of(0.0, LONGEST_MM, usual.standoff_mm),
        "Search": MachineParameter.of(0.0, LONGEST_MM, usual.search_mm),
        "Retract": MachineParameter.of(-1.0, LONGEST_MM, usual.retract_mm),
    }
    going = {
        "Speed": MachineParameter.of(SLOWEST_MM_S, travel, machine.table.travel_speed_mm_s),
        "Accel": MachineParameter.of(1.0, FASTEST_MM_S2, ACCELERATION_MM_S2),
    }
    return ToolParameters({"PtMeasPar": probing, "GoToPar": going})


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
