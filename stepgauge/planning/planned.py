"""A plan: the checked moves of a measurement, and their text for any controller."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from stepgauge.errors import InputError
from stepgauge.files.display import Plotted, join_lines
from stepgauge.motion.moves import Program
from stepgauge.planning.program import ProgramText, check_tool, duration_s, duration_words, program_text
from stepgauge.programs import DIALECTS, find_dialect

if TYPE_CHECKING:
    import pandas as pd

APPROACH = ("approach_i", "approach_j", "approach_k")


@dataclass(frozen=True, repr=False)
class Plan(Plotted):
    """Moves that were checked against gauge and rail, and against the machine's travel where ``travel_checked``.

    ``notes``: of the placement.
    """

    drawn_by: ClassVar[str] = "run.draw_plan"
    program: Program
    travel_checked: bool
    notes: tuple[str, ...] = ()

    def summary(self) -> str:
        """Points, moves, time at full speed, and what the path was checked against."""
        travel = ", travel" if self.travel_checked else "; travel limits NOT checked (no machine)"
        size = f"{self.program.n_points} points, {len(self.program)} moves"
        return join_lines(
            f"{size}; about {duration_words(duration_s(self.program))} at full speed",
            f"path checked: gauge, rail{travel}",
            *(f"note: {note}" for note in self.notes),
        )

    def to_frame(self) -> pd.DataFrame:
        """One row per move: measuring point, name, target in mm, whether it measures, unit direction of the search."""
        import pandas as pd

        moves = self.program
        columns = {"point": moves.point, "name": list(moves.names), "measures": moves.is_measure}
        position = dict(zip(("x_mm", "y_mm", "z_mm"), moves.position_mm.T, strict=True))
        return pd.DataFrame({**columns, **position, **dict(zip(APPROACH, moves.approach.T, strict=True))})

    def text(
        self,
        dialect: str,
        *,
        template: str | Path | None = None,
        tool: str = "",
        unchecked: bool = False,
        settings: Mapping[str, str] | None = None,
    ) -> ProgramText:
        """The program for a controller, read back as the controller would and compared with the plan.

        Parameters
        ----------
        dialect : language of the controller: jinyoung, dmis, linuxcnc, ippdme, fanuc, haas, mazak, mitsubishi,
            siemens, heidenhain, grbl or rrf
        template : a Jinja template instead of the shipped one
        tool : what the controller calls the probe (dmis, ippdme)
        unchecked : with a template: a text that cannot be read back is made all the same, and says so itself
        settings : how the control is set up, where it differs from the usual

        Returns
        -------
        The text, with a note of what was compared; ``str`` of it is the program.
        """
        dialect = find_dialect(dialect).name
        check_tool(tool, dialect)
        return program_text(replace(self.program, tool=tool), dialect, template, unchecked, settings or {})

    def write(
        self,
        path: str | Path,
        dialect: str | None = None,
        *,
        template: str | Path | None = None,
        tool: str = "",
        unchecked: bool = False,
        settings: Mapping[str, str] | None = None,
    ) -> ProgramText:
        """Write the program of :meth:`text`; the dialect is that of the suffix (.dmi, .ngc, .nc, ..) by default.

        Beside it go the files that the control needs besides (the mask of HEIDENHAIN).
        """
        name = dialect or dialect_of(path)
        rendered = self.text(name, template=template, tool=tool, unchecked=unchecked, settings=settings)
        rendered.write(path)
        return rendered


def dialect_of(path: str | Path) -> str:
    """The dialect whose files have the suffix of ``path``."""
    suffix = Path(path).suffix.lower()
    for one in DIALECTS.values():
        if one.suffix == suffix:
            return one.name
    raise InputError(path, "the suffix does not say the dialect", found=repr(suffix), expected=", ".join(DIALECTS))
