"""The placement of the gauge in the machine: the axis C1-C2, the directions across it, and its file."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.files.config import TomlTable, Vector3, check_table, parse_toml
from stepgauge.files.display import Plotted, join_lines
from stepgauge.files.text import read_text, write_sealed
from stepgauge.files.units import likely_unit
from stepgauge.gauge.certified import Gauge

if TYPE_CHECKING:
    import pandas as pd

    from stepgauge.machine.file import Machine

STANDING_COS = 0.999
"""|a.z| above which machine +z gives no usable up direction (within 2.6 deg of vertical)."""
SCALE_ERRORS = {"machine tool": 0.01, "printer": 0.01}
"""Largest scale error of the kinds of machine whose steps per mm someone types in; other kinds: as probed by hand."""
POSSIBLE_SCALE_ERROR = max(SCALE_ERRORS.values())
"""What is allowed where the machine is not asked for; the path of a machine is planned by its own kind."""
FAR_OFF = 0.05
"""Share of a distance by which a scale may be off that nobody has set; beyond it, it is another pair of blocks."""
STATE_KIND = (
    "of a machine tool or printer, whose scale may be off by 1 %, give the machine file"
    ' with kind = "machine tool" or "printer" in [machine]'
)
STATED_TO_MM = (1.0, 0.1, 0.01)
"""Digits to which a person states coordinates; finer ones are within any tolerance."""
UPRIGHT_SIN = 1e-3
"""An axis within this angle of the vertical has no yaw."""


class PlacementTable(TomlTable):
    """The keys of a placement file."""

    c1_mm: Vector3 = Field(description="centre of the first block in machine coordinates, mm")
    c2_mm: Vector3 = Field(description="centre of the last block in machine coordinates, mm")
    axis: Vector3 | None = Field(None, description="unit vector from the first to the last block; C2 - C1")
    up: Vector3 | None = Field(None, description="unit vector from the rail to the blocks; machine z across the axis")
    first_block: int = Field(ge=1, description="number of the block that has its centre at c1_mm")
    last_block: int = Field(ge=2, description="number of the block that has its centre at c2_mm")
    gauge_serial: str | None = Field(None, description="serial number of the gauge that was located")
    tip_radius_mm: float | None = Field(None, gt=0, le=20, description="effective tip radius found at locating, mm")
    too_long_mm: float | None = Field(None, description="distance found between the two blocks minus certified, mm")
    uncertainty: dict[str, Any] = Field(default_factory=dict, description="standard uncertainties")
    angles: dict[str, Any] = Field(default_factory=dict, description="orientation of the axis and the block normals")
    notes: list[str] = Field(default_factory=list, description="what locate remarked")


@dataclass(frozen=True, repr=False)
class Placement(Plotted):
    """A placement of the gauge.

    ``axis`` (a), ``up`` and ``side`` (s = a x up) are unit vectors, ``c1_mm`` the centre of block ``first_block``.
    Gauge coordinates are (along a from face 1, along s from the blocks' middle, along up from their middle height).
    """

    drawn_by: ClassVar[str] = "placement.draw_axis"
    c1_mm: Array
    c2_mm: Array
    axis: Array
    up: Array
    first_block: int
    last_block: int
    tip_radius_mm: float | None = None
    gauge_serial: str | None = None
    details: dict[str, Any] = field(default_factory=dict)

    @cached_property
    def side(self) -> Array:
        """Unit vector across the axis and ``up``, to the right of a right-handed system."""
        return np.cross(self.axis, self.up)

    @cached_property
    def rotation(self) -> Array:
        """Rows a, s, up: machine directions into gauge directions, shape ``(3, 3)``."""
        return np.array([self.axis, self.side, self.up])

    def origin_mm(self, gauge: Gauge) -> Array:
        """Machine coordinates of the middle of face 1, shape ``(3,)``."""
        return self.c1_mm - self.axis * gauge.block_centre_mm[self.first_block - 1]

    def to_machine(self, gauge: Gauge, points_mm: ArrayLike) -> Array:
        """Gauge coordinates ``(..., 3)`` as machine coordinates, mm."""
        return self.origin_mm(gauge) + np.asarray(points_mm, float) @ self.rotation

    def to_gauge(self, gauge: Gauge, points_mm: ArrayLike) -> Array:
        """Machine coordinates ``(..., 3)`` as gauge coordinates, mm."""
        return (np.asarray(points_mm, float) - self.origin_mm(gauge)) @ self.rotation.T

    def summary(self) -> str:
        """Notes of locate, direction of the axis, squareness, smallest error that would be seen, and tip radius."""
        from stepgauge.gauge.placed import placement_lines

        return join_lines(*placement_lines(self))

    def to_frame(self) -> pd.DataFrame:
        """One row: block centres and tip radius in mm, unit vectors, angles and uncertainties in the units named."""
        from stepgauge.gauge.placed import placement_frame

        return placement_frame(self)

    def write(self, path: str | Path) -> None:
        """Write the placement file (TOML), which :func:`read_placement` reads back."""
        write_placement(path, self)

    def _stated(self) -> str:
        return format_placement(self)


def make_placement(
    c1_mm: ArrayLike,
    c2_mm: ArrayLike,
    first_block: int,
    last_block: int,
    up: ArrayLike | None = None,
    tip_radius_mm: float | None = None,
    gauge_serial: str | None = None,
    details: dict[str, Any] | None = None,
) -> Placement:
    """A placement from the two block centres; ``up`` is made perpendicular to the axis (default machine +z).

    ``ValueError`` where the axis has no length, or stands on end and ``up`` is not given.
    """
    c1, c2 = np.asarray(c1_mm, float), np.asarray(c2_mm, float)
    length = np.linalg.norm(c2 - c1)
    if length == 0.0:
        raise ValueError("c1_mm and c2_mm are the same point")
    axis = (c2 - c1) / length
    if up is None and abs(axis[2]) > STANDING_COS:
        raise ValueError("the gauge stands on end: its up direction must be stated")
    across = perpendicular(np.array([0.0, 0.0, 1.0]) if up is None else np.asarray(up, float), axis)
    return Placement(c1, c2, axis, across, first_block, last_block, tip_radius_mm, gauge_serial, details or {})


def perpendicular(vector: Array, axis: Array) -> Array:
    """The unit vector along ``vector`` made perpendicular to the unit vector ``axis``."""
    across = vector - axis * (vector @ axis)
    size = np.linalg.norm(across)
    if size < 1e-9:
        raise ValueError("up is parallel to the axis")
    return across / size


def has_yaw(axis: ArrayLike) -> bool:
    """Whether an axis has a direction in the xy plane; one within 1 mrad of the vertical has none."""
    return float(np.hypot(*np.asarray(axis, float)[:2])) > UPRIGHT_SIN


def read_placement(path: str | Path, gauge: Gauge | None, scale_error: float = POSSIBLE_SCALE_ERROR) -> Placement:
    """Read a placement file and check it, also against its gauge if given (:class:`InputError` names the key)."""
    return parse_placement(read_text(path), path, gauge, scale_error)


def is_placement_file(path: str | Path) -> bool:
    """Whether a file is a placement (TOML) rather than a table of points (CSV)."""
    return Path(path).suffix.lower() == ".toml"


def parse_placement(
    text: str, path: str | Path, gauge: Gauge | None, scale_error: float = POSSIBLE_SCALE_ERROR
) -> Placement:
    """A placement from the text of its file; ``path`` is for messages.

    Centres whose distance is off by no more than a possible ``scale_error`` (relative) are moved to the certified
    distance: middle and direction stay, a note says how far it was off.
    """
    data = parse_toml(text, path)
    table = check_table(PlacementTable, data.get("placement", data), path)
    if gauge is not None:
        _check_blocks(table, path, gauge)
    try:
        placement = make_placement(
            table.c1_mm,
            table.c2_mm,
            table.first_block,
            table.last_block,
            table.up,
            table.tip_radius_mm,
            table.gauge_serial,
        )
    except ValueError as error:
        raise InputError(path, str(error), expected="two block centres and, for a standing gauge, key up") from None
    _check_directions(table, placement, path)
    details = {"uncertainty": table.uncertainty, "angles": table.angles, "notes": table.notes}
    stated = replace(placement, details={k: v for k, v in details.items() if v})
    if table.too_long_mm is not None:
        stated.details["too_long_mm"] = table.too_long_mm
    return stated if gauge is None else _certified_distance(stated, path, gauge, scale_error)


def _check_blocks(table: PlacementTable, path: str | Path, gauge: Gauge) -> None:
    if table.gauge_serial not in (None, gauge.table.serial):
        raise InputError(
            path,
            "this is the placement of another gauge",
            found=f"gauge_serial {table.gauge_serial}",
            expected=f"{gauge.table.serial} ({gauge.table.name})",
        )
    if table.last_block > gauge.n_blocks:
        raise InputError(
            path, "key last_block is not on this gauge", found=table.last_block, expected=f"2 to {gauge.n_blocks}"
        )
    if table.first_block >= table.last_block:
        raise InputError(
            path,
            "key first_block must come before last_block",
            found=f"first_block {table.first_block}, last_block {table.last_block}",
            expected="both exchanged, and c1_mm and c2_mm with them",
        )


def _check_directions(table: PlacementTable, placement: Placement, path: str | Path) -> None:
    for name, given, meant in (("axis", table.axis, placement.axis), ("up", table.up, placement.up)):
        if given is None:
            continue
        vector = np.asarray(given)
        if abs(np.linalg.norm(vector) - 1.0) > 1e-4:
            raise InputError(path, f"key {name} is not a unit vector", found=f"length {np.linalg.norm(vector):.6f}")
        if np.linalg.norm(vector - meant) > 1e-3:
            other = "c2_mm - c1_mm" if name == "axis" else "a direction perpendicular to the axis"
            raise InputError(path, f"key {name} is not {other}", found=list(given), expected=meant.round(6).tolist())


def _certified_distance(placement: Placement, path: str | Path, gauge: Gauge, scale_error: float) -> Placement:
    """The placement about its middle with the distance as certified, where a scale can be off that far."""
    found = float(np.linalg.norm(placement.c2_mm - placement.c1_mm))
    blocks = placement.first_block, placement.last_block
    certified = block_distance_mm(gauge, *blocks)
    off_mm = found - certified
    if abs(off_mm) <= distance_tolerance_mm(certified):
        return placement
    half = placement.axis * off_mm / 2.0
    details = {**placement.details, "too_long_mm": round(off_mm, 4)}
    moved = replace(placement, c1_mm=placement.c1_mm + half, c2_mm=placement.c2_mm - half, details=details)
    if abs(off_mm) <= rounding_mm(placement):
        return moved
    if abs(off_mm) > scaled_tolerance_mm(gauge, blocks, scale_error):
        expected = f"{certified:.3f} mm"
        if abs(off_mm) <= scaled_tolerance_mm(gauge, blocks, POSSIBLE_SCALE_ERROR):
            expected = f"{certified:.3f} mm; {STATE_KIND}"
        elif scale_error >= POSSIBLE_SCALE_ERROR and abs(off_mm) < FAR_OFF * certified:
            expected = f"{certified:.3f} mm; where the scale is so far off, correct it roughly first (steps per mm)"
        raise InputError(
            path,
            f"c1_mm and c2_mm are not blocks {placement.first_block} and {placement.last_block} of {gauge.table.name}"
            + _inch_hint(found, certified),
            found=f"{found:.3f} mm apart",
            expected=expected,
        )
    notes = [*placement.details.get("notes", ()), scale_note(off_mm, certified)]
    return replace(moved, details={**details, "notes": notes})


def rounding_mm(placement: Placement) -> float:
    """By how much the distance of the centres may be off since their coordinates are stated to so many digits, mm."""
    every = np.concatenate([placement.c1_mm, placement.c2_mm])
    step_mm = next((one for one in STATED_TO_MM if np.allclose(every / one, np.round(every / one), 0.0, 1e-6)), 0.0)
    return step_mm * float(np.abs(placement.axis).sum())  # half a step at either end


def scale_note(off_mm: float, certified_mm: float) -> str:
    """Remark on two blocks whose distance is too long by ``off_mm``."""
    percent, far = 100.0 * abs(off_mm) / certified_mm, abs(off_mm)
    if off_mm > 0.0:
        return (
            f"the distance C1-C2 is {percent:.2f} % ({far:.3f} mm) too long: the scale along the gauge,"
            " or another pair of blocks"
        )
    return (
        f"the distance C1-C2 is {percent:.2f} % ({far:.3f} mm) too short: the scale along the gauge,"
        " or another pair of blocks"
    )


def _inch_hint(found_mm: float, certified_mm: float) -> str:
    """Words where one of the two is the other in inches; else empty."""
    which = ("placement", found_mm, certified_mm), ("certificate", certified_mm, found_mm)
    inches = [name for name, one, other in which if likely_unit(one, other) == "inches"]
    return f" (the {inches[0]} looks like inches, not mm)" if inches else ""


def block_distance_mm(gauge: Gauge, first: int, last: int) -> float:
    """Certified distance between the centres of two blocks, mm."""
    return float(gauge.block_centre_mm[last - 1] - gauge.block_centre_mm[first - 1])


def distance_tolerance_mm(certified_mm: float) -> float:
    """Largest error of a located block distance: probing by hand, 10 K of steel and a poor machine, mm."""
    return 0.1 + 3e-4 * certified_mm


def possible_scale_error(machine: Machine | None) -> float:
    """The largest relative scale error that is possible on the stated kind of machine; 0 where none is stated."""
    return SCALE_ERRORS.get(machine.table.kind or "", 0.0) if machine else 0.0


def scaled_tolerance_mm(gauge: Gauge, blocks: tuple[int, int], scale_error: float) -> float:
    """The same of a machine with a possible relative ``scale_error``, mm; nearer to these blocks than to the next."""
    certified = block_distance_mm(gauge, *blocks)
    by_scale = min(0.1 + scale_error * certified, 0.5 * float(np.diff(gauge.block_centre_mm).min()))
    return max(distance_tolerance_mm(certified), by_scale)


def write_placement(path: str | Path, placement: Placement) -> None:
    """Write the placement file."""
    write_sealed(path, format_placement(placement))


def format_placement(placement: Placement) -> str:
    """The text of a placement file, its numbers to 1e-7 mm and 1e-12 of direction."""
    import tomli_w

    head: dict[str, Any] = {
        "c1_mm": [round(float(v), 7) for v in placement.c1_mm],
        "c2_mm": [round(float(v), 7) for v in placement.c2_mm],
        "axis": [round(float(v), 12) for v in placement.axis],
        "up": [round(float(v), 12) for v in placement.up],
        "first_block": placement.first_block,
        "last_block": placement.last_block,
    }
    if placement.gauge_serial is not None:
        head["gauge_serial"] = placement.gauge_serial
    if placement.tip_radius_mm is not None:
        head["tip_radius_mm"] = round(placement.tip_radius_mm, 7)
    text = tomli_w.dumps({**head, **placement.details})
    compact = re.sub(r"\[\s+([^\[\]\"]*?),?\s+\]", lambda m: "[" + re.sub(r"\s+", " ", m[1]) + "]", text)
    return "# Placement of a step gauge, written by stepgauge locate. Lengths mm.\n" + compact
