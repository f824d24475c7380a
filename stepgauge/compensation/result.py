"""What a compensation gives: a table and its text for a controller, or the commands against a skew."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from stepgauge.compensation.formats import Format, render_table, write_table
from stepgauge.compensation.skew import Skew, find_skew, render_skew
from stepgauge.compensation.table import CompensationTable
from stepgauge.conditions import stored_conditions
from stepgauge.errors import InputError, naming
from stepgauge.files.display import Plotted, Summarized, figures, join_lines
from stepgauge.files.stored import WrittenResult
from stepgauge.files.text import write_text
from stepgauge.recording.simulated import is_simulated

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, repr=False)
class Compensation(WrittenResult, Plotted):
    """The table of an axis, and its ``text`` in the format of a controller."""

    drawn_by: ClassVar[str] = "compensation.draw_table"
    table: CompensationTable
    known: Format
    evaluation: Mapping[str, Any]
    template: str | Path | None = None
    file_type: int = 0
    joint: int | None = None
    unconfirmed_sense: str | None = None
    text: str = ""

    def rendered(self) -> Compensation:
        """The same with its text."""
        numbers = self.file_type, self.joint
        text = render_table(self.table, self.known, self.template, *numbers, self.unconfirmed_sense)
        return replace(self, text=text)

    def summary(self) -> str:
        """Notes of the table, rows, range, and the largest correction with the largest standard uncertainty.

        What the evaluation says of its readings stands there, and with all notes in the ``.json`` of the table.
        """
        table, x = self.table, self.table.position_mm
        largest = max(abs(table.positive_um).max(), abs(table.negative_um).max())
        u = max(table.u_positive_um.max(), table.u_negative_um.max())
        return join_lines(
            *(f"note: {note}" for note in table.notes if note not in stored_conditions(self.evaluation).notes),
            f"{table.axis}: {len(table)} rows from {x[0]:.3f} to {x[-1]:.3f} mm, zero at {table.zero_at_mm:.3f} mm;"
            f" largest correction {largest:.2f} um, largest standard uncertainty {u:.2f} um",
            f"note: {self.known.name} needs: {self.known.convention.needs}",
        )

    def to_frame(self) -> pd.DataFrame:
        """One row per place: coordinate in mm, error and standard uncertainty in um by direction of travel."""
        import pandas as pd

        names = ("position_mm", "positive_um", "u_positive_um", "negative_um", "u_negative_um")
        return pd.DataFrame({name: getattr(self.table, name) for name in names})

    def write(self, path: str | Path) -> list[Path]:
        """Write the controller's file and ``<name>.json``; returns their paths."""
        with self.keeping():
            return write_table(path, self.text, self.table, self.known)

    def draw(self, path: str | Path) -> list[Path]:
        """The table as a figure in a file."""
        figures("compensation").draw_compensation(path, self.table, is_simulated(self.evaluation["comments"]))
        return [Path(path)]

    def notes_on(self, path: str | Path) -> list[str]:
        """What LinuxCNC's configuration must say for the table to be in force."""
        if self.known.name != "linuxcnc":
            return []
        joint = "xyz".index(self.table.axis) if self.joint is None else self.joint
        file = f"COMP_FILE = {Path(path).name}, COMP_FILE_TYPE = {self.file_type}"
        return [f"for the INI file, [JOINT_{joint}]: {file}"]


@dataclass(frozen=True, repr=False)
class SkewCompensation(Summarized):
    """The skew of two axes, and the commands of a firmware that take it away."""

    skew: Skew
    notes: tuple[str, ...]
    text: str

    def summary(self) -> str:
        """Notes, and the skew."""
        skew, plane = self.skew, self.skew.plane
        u = "unknown: nothing was read twice" if math.isnan(skew.u_rad) else f"{skew.u_rad * 1e6:.1f} um per m"
        found = (
            f"{plane}: indicated {plane[0]} too large by {skew.alpha_rad * 1e6:+.1f} um per m of {plane[1]};"
            f" standard uncertainty from repeatability {u}"
        )
        return join_lines(*(f"note: {note}" for note in self.notes), found)

    def to_frame(self) -> pd.DataFrame:
        """One row: the plane, its squareness error and its standard uncertainty from repeatability in urad."""
        import pandas as pd

        found = {"squareness_urad": self.skew.alpha_rad * 1e6, "u_urad": self.skew.u_rad * 1e6}
        return pd.DataFrame([{"plane": self.skew.plane, **found}])

    def write(self, path: str | Path) -> list[Path]:
        """Write the commands; returns the path."""
        write_text(path, self.text)
        return [Path(path)]

    def draw(self, path: str | Path) -> list[Path]:
        """:class:`InputError`: a skew has no table."""
        raise InputError(naming("plot"), "a skew has no table to draw", expected=naming("axis"))

    def notes_on(self, path: str | Path) -> list[str]:
        """Nothing is to be configured."""
        return []


def skew_compensation(evaluation: Mapping[str, Any], path: str | Path, plane: str, firmware: str) -> SkewCompensation:
    """The commands of a firmware against the skew of a plane; errors as :func:`find_skew`."""
    skew = find_skew(evaluation, path, plane)
    notes = tuple(stored_conditions(evaluation).notes)
    return SkewCompensation(skew, notes, render_skew(skew, firmware, evaluation, path))
