"""What a compensation gives: a table and its text for a controller, or the commands against a skew.

Squareness of two axes from a gauge that lay along both diagonals of their plane, as firmwares for skew want it.

Skew alpha: the indicated first coordinate is too large by alpha times the second, rad. Along a direction (c, s) of the
plane a length is then indicated too long by alpha c s, beside sx c^2 + sy s^2 of the two scales; the difference of two
directions with the same c^2 has alpha alone.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from stepgauge import __version__
from stepgauge.compensation.conventions import SKEW_CONVENTIONS
from stepgauge.compensation.formats import Format, render_table, write_table
from stepgauge.compensation.table import CompensationTable
from stepgauge.conditions import require_statement, stored_conditions
from stepgauge.errors import InputError, naming
from stepgauge.files.arrays import Array
from stepgauge.files.display import Plotted, Summarized, figures, join_lines
from stepgauge.files.json_types import defined
from stepgauge.files.resources import folder
from stepgauge.files.stored import WrittenResult
from stepgauge.files.templating import check_printable, fill_template
from stepgauge.files.text import write_text
from stepgauge.recording.simulated import SIMULATED_WARNING

if TYPE_CHECKING:
    import pandas as pd


OUT_OF_PLANE_DEG, UNLIKE_DEG = 2.0, 2.0
SIDE_MM = 100.0
"""Side of the square that lengths are stated for."""


@dataclass(frozen=True)
class Skew:
    """Squareness error of a plane: ``alpha_rad`` as above with its standard uncertainty ``u_rad`` from repeatability
    (NaN where nothing was read twice), from two placements by number.
    """

    plane: str
    alpha_rad: float
    u_rad: float
    placements: tuple[int, int]


def find_skew(evaluation: Mapping[str, Any], path: str | Path, plane: str) -> Skew:
    """The skew of a plane from an ``evaluation.json``.

    :class:`InputError` where no two placements lie in the plane, mirrored at one of its axes, and where a condition of
    the readings prevents a statement.
    """
    require_statement(stored_conditions(evaluation), path)
    i, j = ("xyz".index(axis) for axis in plane)
    lying = [one for one in evaluation["placements"] if _out_of_plane_deg(one["axis"], i, j) <= OUT_OF_PLANE_DEG]
    for one in lying:
        for other in lying:
            if one["axis"][i] * one["axis"][j] > 0.0 > other["axis"][i] * other["axis"][j]:
                turned = abs(_angle_from_axis_deg(one["axis"], i, j) - _angle_from_axis_deg(other["axis"], i, j))
                if turned <= UNLIKE_DEG:
                    return Skew(plane, *_alpha(one, other, i, j), (one["placement"], other["placement"]))
    raise InputError(
        path,
        f"no two placements along the diagonals of {plane}",
        found=f"{len(lying)} placements in the plane",
        expected=f"two, mirrored at an axis to {UNLIKE_DEG:g} deg, best at 45 deg",
    )


def _out_of_plane_deg(axis: list[float], i: int, j: int) -> float:
    return math.degrees(math.asin(min(1.0, abs(axis[3 - i - j]))))


def _angle_from_axis_deg(axis: list[float], i: int, j: int) -> float:
    return math.degrees(math.atan2(abs(axis[j]), abs(axis[i])))


def _alpha(one: Mapping[str, Any], other: Mapping[str, Any], i: int, j: int) -> tuple[float, float]:
    """Skew and its standard uncertainty from repeatability (NaN where nothing was read twice), rad."""
    product = [placement["axis"][i] * placement["axis"][j] for placement in (one, other)]
    (first, u_first), (second, u_second) = _slope(one), _slope(other)
    per_um = 1e-3 / (product[0] - product[1])
    return (first - second) * per_um, math.hypot(u_first, u_second) * abs(per_um)


def _slope(placement: Mapping[str, Any]) -> tuple[float, float]:
    """Scale error along the gauge and its standard uncertainty, um per mm: fronts and backs on parallel lines.

    Not the slope of XM: the tip diameter holds the scale error of a block (Eq 1) and half of each XM is interpolated
    from the neighbours (Eqs 8 to 11), which together take from the slope what gaps are wider than blocks. Between the
    two lines lies whatever tip and reversal are.
    """
    sides = [_read_faces(placement, side) for side in ("f", "b")]
    centred = [position - position.mean() for position, _, _ in sides]
    total = sum(float(x @ x) for x in centred)
    slope = sum(float(x @ error) for x, (_, error, _) in zip(centred, sides, strict=True)) / total
    variance = sum(float(x**2 @ u**2) for x, (_, _, u) in zip(centred, sides, strict=True))
    return slope, math.sqrt(variance) / total


def _read_faces(placement: Mapping[str, Any], side: str) -> tuple[Array, Array, Array]:
    """Position in mm, error and standard uncertainty of its mean in um of the faces that were read from one side."""
    rows = [
        (one["position_mm"], one[f"x{side}_um"], one[f"s{side}_um"], one["count"])
        for one in placement["faces"]
        if one["count"] and (one["face"] % 2 == 1) == (side == "f")
    ]
    position, error, deviation, count = np.array(rows, float).reshape(-1, 4).T
    return position, error, deviation / np.sqrt(count)


def render_skew(skew: Skew, firmware: str, evaluation: Mapping[str, Any], path: str | Path) -> str:
    """The commands of a firmware that take a skew away (``SKEW_CONVENTIONS``)."""
    if firmware not in SKEW_CONVENTIONS:
        raise InputError(
            naming("to"), "no firmware that corrects a skew", found=firmware, expected=", ".join(SKEW_CONVENTIONS)
        )
    factor = -skew.alpha_rad
    sine = math.sin(math.atan(factor))
    diagonals = [SIDE_MM * math.sqrt(2.0 + 2.0 * sign * sine) for sign in (1, -1)]
    source = folder("templates") / "compensation" / "skew.j2"
    context = {
        "firmware": firmware,
        "convention": SKEW_CONVENTIONS[firmware],
        "plane": skew.plane,
        "factor": factor,
        "ppm": skew.alpha_rad * 1e6,
        "u_ppm": defined(skew.u_rad * 1e6),
        "ac_mm": diagonals[0],
        "bd_mm": diagonals[1],
        "side_mm": SIDE_MM,
        "placements": list(skew.placements),
        "evaluation": Path(path).name,
        "gauge": evaluation["gauge"]["serial"],
        "version": __version__,
    }
    text = fill_template(source, "compensation", context)
    check_printable(text, source)
    return text


@dataclass(frozen=True, repr=False)
class Compensation(WrittenResult, Plotted):
    """The table of an axis, and its ``text`` in the format of a controller."""

    drawn_by: ClassVar[str] = "compensation.draw_table"
    table: CompensationTable
    known: Format
    told: tuple[str, ...] = ()
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

        What an evaluation says of its readings (``told``) stands there, and with all notes in the ``.json`` of the
        table.
        """
        table, x = self.table, self.table.position_mm
        largest = max(abs(table.positive_um).max(), abs(table.negative_um).max())
        u = max(table.u_positive_um.max(), table.u_negative_um.max())
        return join_lines(
            *(f"note: {note}" for note in table.notes if note not in self.told),
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
        figures("compensation").draw_compensation(path, self.table, SIMULATED_WARNING in self.table.notes)
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
