"""Parameters of a tool as I++ DME has them: speeds and distances with their limits, by path and by name."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from stepgauge.ippdme.codes import DmeError
from stepgauge.machine.file import Machine
from stepgauge.motion.moves import ProbingSettings
from stepgauge.planning.program import SLOWEST_MM_S, fastest_mm_s

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
