"""The seven planned positions of ISO 10360-2 as a result: what is said of them, their table, their files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from stepgauge.errors import InputError, naming
from stepgauge.files.display import join_lines
from stepgauge.files.notation import percent
from stepgauge.files.stored import WrittenResult
from stepgauge.machine.file import Machine
from stepgauge.planning.program import check_tool
from stepgauge.standards.iso10360_plan import PlannedPosition
from stepgauge.standards.iso10360_plan_files import write_plan
from stepgauge.standards.measuring_line import LONGEST_SHARE

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, repr=False)
class SevenPositions(WrittenResult):
    """Positions in the travel of a machine, each with what does not fit."""

    positions: tuple[PlannedPosition, ...]
    machine: Machine

    def check(self, allow_short: bool) -> None:
        """:class:`InputError` that names the positions along which the gauge is too short, or does not fit."""
        problems = [one for one in self.positions if one.problem]
        if not problems or allow_short:
            return
        numbers = ", ".join(str(one.orientation.number) for one in problems)
        words = f"ISO 10360-2 asks for longer lengths (positions {numbers}; {{}} writes the rest)"
        raise InputError(
            self.machine.path,
            naming("allow_short", words=words),
            found=f"position {problems[0].orientation.number}: {problems[0].problem}",
            expected=f"{percent(LONGEST_SHARE)} of the travel",
        )

    def summary(self) -> str:
        """Blocks and longest length of each position, and what is to be agreed on."""
        lines = [
            f"position {one.orientation.number}, {one.orientation.name}: {self._line(one)}" for one in self.positions
        ]
        turned = [one for one in self.positions if one.turned(self.machine)]
        if turned:
            off_mm = max(one.tip_off_ram_mm() for one in turned)
            lines.append(
                "ISO 10360-2 tests E0 with the stylus tip on the axis of the ram. Where the stylus is turned it lies"
                f" off it, here by up to {off_mm:.0f} mm with stylus and probe body:"
                " agree on it, or test with a stylus that is thin enough to stay upright (as in the machine file)"
            )
        programs = sum(one.program is not None for one in self.positions)
        lines.append(
            f"path of {programs} programs checked: gauge, rail, travel of the tip centre. Locate the gauge as it really"
            " lies, and plan it again with these blocks: a program moves to where its placement says"
        )
        return join_lines(*lines)

    def _line(self, one: PlannedPosition) -> str:
        if one.program is None or one.probe is None:
            return str(one.problem)
        blocks = ", ".join(map(str, one.blocks))
        line = f"blocks {blocks}; longest {one.longest_mm:.1f} mm, {percent(one.share)} of the travel"
        if one.turned(self.machine):
            line += "; stylus square to the gauge, (" + ", ".join(f"{v:.4f}" for v in one.probe.stylus_direction) + ")"
        return f"{line}; {one.problem}" if one.problem else line

    def to_frame(self) -> pd.DataFrame:
        """One row per position: number, name, length of the line and the longest measured one in mm, problem."""
        import pandas as pd

        rows = [
            (one.orientation.number, one.orientation.name, one.line_mm, one.longest_mm, one.problem)
            for one in self.positions
        ]
        return pd.DataFrame(rows, columns=["position", "orientation", "line_mm", "longest_mm", "problem"])

    def write(
        self,
        folder: str | Path,
        dialect: str,
        *,
        template: str | Path | None = None,
        tool: str = "",
        settings: Mapping[str, str] | None = None,
    ) -> list[str]:
        """Write placements, programs, machine files and ``plan.json``; returns notes on the programs."""
        check_tool(tool, dialect)
        named = [_named(one, tool) for one in self.positions]
        with self.keeping():
            return write_plan(folder, named, self.machine, dialect, template, settings)


def _named(one: PlannedPosition, tool: str) -> PlannedPosition:
    """The position with a program that says which tool it takes, and which way its stylus stands."""
    if one.program is None or one.probe is None:
        return one
    return replace(one, program=replace(one.program, tool=tool, stylus=one.probe.stylus_direction))
