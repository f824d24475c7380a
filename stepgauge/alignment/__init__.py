"""16 hand-probed points to the placement of the gauge (Pahk & Kim, section 3, Fig 2).

Points 1-8 lie on the beginning block, 9-16 on the end block: three on the front face, one on either side, one on top,
one on the rail beside the block, one on the back face. All are tip centres. The normal N of the front plane and the
five other points give the centre of the block; the axis is the line through the two centres, never N. The points are
redundant: the redundancy is used to test them (:mod:`stepgauge.alignment.adjustment`,
:mod:`stepgauge.alignment.slips`) and, where the scatter is larger than stated, to increase the uncertainties
(:mod:`stepgauge.alignment.scatter`).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from stepgauge.alignment.blocks import Blocks, fit_up, solve_blocks
from stepgauge.alignment.checks import undo_scale
from stepgauge.alignment.scatter import find_scatter
from stepgauge.alignment.slips import check_points
from stepgauge.errors import InputError, naming
from stepgauge.files.arrays import Array
from stepgauge.files.tables import read_numbers
from stepgauge.files.text import read_text
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import (
    STANDING_COS,
    Placement,
    block_distance_mm,
    has_yaw,
    make_placement,
    scale_note,
)
from stepgauge.recording.lines import is_beside

POINT_COLUMNS = ("point", "x_mm", "y_mm", "z_mm")
FARTHEST_MM = 1e5
"""No coordinate of a machine is farther from 0 than this."""
ROLLED_DEG = 2.0
"""A gauge rotated about its axis by less than this is assumed to lie with its blocks up."""
TURNED_DEG, STEEP_DEG = 30.0, 50.0
"""A rotation about the axis, or a pitch, of more than this must be stated: a cyclic exchange of the three columns gives
such angles for every lying gauge, up to 0.6 rad of pitch."""
ROLL_RESIDUAL_MM = 0.2
"""Misfit of width and height above which a rotation about the axis is considered."""


def is_point_table(path: str | Path) -> bool:
    """Whether :func:`read_points` reads a file, or says what is wrong with it: there is none, or its header has one of
    our columns; what others write has other names."""
    if not Path(path).is_file():
        return True
    try:
        lines = [line for line in read_text(path).splitlines() if line.strip() and not is_beside(line)]
    except InputError:
        return False
    return not lines or bool({*POINT_COLUMNS} & {*lines[0].replace(" ", "").split(",")})


def read_points(path: str | Path) -> Array:
    """Read the 16 points, shape ``(16, 3)`` in mm; :class:`InputError` for missing, repeated or unknown points."""
    if not Path(path).exists():
        expected = f"{','.join(POINT_COLUMNS)} with points 1 to 16; 'stepgauge demo' writes an example"
        raise InputError(path, "no such file", expected=expected)
    table = read_numbers(path, POINT_COLUMNS)
    numbers = table["point"]
    for row, number in enumerate(numbers):
        if number not in range(1, 17):
            raise InputError(table.at(row), "unknown point", found=f"{number:g}", expected="1 to 16")
        if number in numbers[:row]:
            raise InputError(table.at(row), "point appears twice", found=f"{number:g}", expected="each of 1 to 16 once")
    missing = sorted(set(range(1, 17)) - {int(n) for n in numbers})
    if missing:
        raise InputError(
            table.path, f"{len(missing)} of the 16 points missing", found=f"not there: {', '.join(map(str, missing))}"
        )
    for name in POINT_COLUMNS[1:]:
        far = np.abs(table[name]) > FARTHEST_MM
        if far.any():
            row = int(far.argmax())
            raise InputError(
                table.at(row),
                f"point {numbers[row]:g} is in no machine",
                found=f"{name} {table[name][row]:g}",
                expected=f"at most {FARTHEST_MM:g} mm from 0",
            )
    order = np.argsort(numbers)
    return np.column_stack([table[name][order] for name in POINT_COLUMNS[1:]])


def locate(
    points: Array,
    gauge: Gauge,
    blocks: tuple[int, int],
    repeatability_um: float,
    tip_radius_mm: float | None = None,
    where: str | Path = "points",
    turned: bool = False,
    scale_error: float = 0.0,
) -> Placement:
    """Find how the gauge lies.

    Parameters
    ----------
    points : tip centres in mm, shape ``(16, 3)``
    gauge : the certified gauge
    blocks : numbers of the beginning and the end block
    repeatability_um : standard deviation of a probed coordinate
    tip_radius_mm : nominal tip radius, checked against the one that the points give
    where : file name for messages
    turned : the gauge is known to be steeper than :data:`STEEP_DEG`, or rotated by more than :data:`TURNED_DEG`
    scale_error : largest relative scale error that the machine may have; the blocks are placed about their middle

    Returns
    -------
    The placement, with orientation and standard uncertainties in ``details``.

    Raises
    ------
    InputError
        points that contradict the certificate or each other, with the slip that explains them (see ``locate.checks``);
        a gauge that is rotated or steep without being stated so
    """
    up, notes = _choose_up(points, gauge, blocks)
    points, off_mm = undo_scale(points, gauge, blocks, up, scale_error)
    if off_mm:
        notes = [*notes, scale_note(off_mm, block_distance_mm(gauge, *blocks))]
    check_points(points, gauge, blocks, up, tip_radius_mm, where)
    if not turned:
        _check_lies(points, gauge, blocks, up, where)
    found = solve_blocks(points, gauge, blocks, up)
    scatter = find_scatter(points, gauge, blocks, up, repeatability_um)
    details: dict[str, Any] = {
        "notes": [*notes, *scatter.notes],
        "angles": _angles(found),
        "uncertainty": {
            "repeatability_um": repeatability_um,
            **_uncertainty(points, gauge, blocks, up, scatter.sigma_um),
            **scatter.to_table(),
        },
        **({"too_long_mm": round(off_mm, 4)} if off_mm else {}),
    }
    centre = found.centre_mm
    return make_placement(
        centre[0], centre[1], *blocks, found.up, float(found.tip_radius_mm), gauge.table.serial, details
    )


def _choose_up(points: Array, gauge: Gauge, blocks: tuple[int, int]) -> tuple[Array | None, list[str]]:
    """None where machine +z is right; else the direction from the points, and a note."""
    try:
        level = solve_blocks(points, gauge, blocks)
    except np.linalg.LinAlgError:
        return None, []  # the checks will say what is wrong
    fitted, misfit = fit_up(points, level.axis, gauge)
    if abs(level.axis[2]) > STANDING_COS:
        return fitted, ["the gauge stands on end: its up direction is from points 4 to 7"]
    turn_deg = _turn_deg(level, fitted)
    if abs(turn_deg) < ROLLED_DEG or 2.0 * misfit > _level_misfit(level, gauge):
        return None, []
    return fitted, [f"the gauge is turned about its axis by {turn_deg:.1f} deg: its up direction is from points 4 to 7"]


def _turn_deg(level: Blocks, up: Array) -> float:
    return float(np.degrees(np.arctan2(up @ level.side, up @ level.up)))


def _check_lies(points: Array, gauge: Gauge, blocks: tuple[int, int], up: Array | None, where: str | Path) -> None:
    """:class:`InputError` for a gauge on end, steep or rotated: the points cannot exclude exchanged columns.

    The program of a placement that is wrong in this way would cause a collision.
    """
    level = solve_blocks(points, gauge, blocks)
    rise_deg = float(np.degrees(np.arcsin(np.clip(abs(level.axis[2]), 0.0, 1.0))))
    turn_deg = 0.0 if up is None or rise_deg > STEEP_DEG else _turn_deg(level, up)
    found = f"a gauge that rises by {rise_deg:.1f} deg" if rise_deg > STEEP_DEG else ""
    if abs(turn_deg) > TURNED_DEG:
        found = f"a gauge turned about its axis by {turn_deg:.1f} deg"
    if found:
        expected = naming("turned", words="a gauge that lies; where this one does not, state {}")
        raise InputError(
            where, "the columns look exchanged in turn (x, y, z for y, z, x)", found=found, expected=expected
        )


def _level_misfit(level: Blocks, gauge: Gauge) -> float:
    p = level.points
    width = gauge.table.block_width_mm + 2.0 * level.tip_radius_mm
    off = [(p[:, 3] - p[:, 4]) @ level.side - width, (p[:, 5] - p[:, 6]) @ level.up - gauge.table.block_height_mm]
    misfit = float(np.sqrt(np.mean(np.square(off))))
    return misfit if misfit > ROLL_RESIDUAL_MM else 0.0


def orientation(axis: Array) -> tuple[float, float]:
    """Yaw (about +z from +x) and pitch (rise towards +z) of an axis, rad."""
    return float(np.arctan2(axis[1], axis[0])), float(np.arcsin(np.clip(axis[2], -1.0, 1.0)))


def _angles(found: Blocks) -> dict[str, Any]:
    yaw, pitch = orientation(found.axis)
    nearest = int(np.abs(found.axis).argmax())
    off = np.arctan2(np.linalg.norm(np.delete(found.axis, nearest)), abs(found.axis[nearest]))
    tilt = _tilt(found)
    return {
        "yaw_deg": round(float(np.degrees(yaw)), 7) if has_yaw(found.axis) else "undefined",
        "pitch_deg": round(float(np.degrees(pitch)), 7),
        "nearest_machine_axis": ("-" if found.axis[nearest] < 0 else "+") + "xyz"[nearest],
        "from_nearest_axis_deg": round(float(np.degrees(off)), 7),
        "n1": [round(float(v), 9) for v in found.normal[0]],
        "n2": [round(float(v), 9) for v in found.normal[1]],
        "n1_to_axis_mrad": round(float(np.linalg.norm(tilt[0])) * 1e3, 4),
        "n2_to_axis_mrad": round(float(np.linalg.norm(tilt[1])) * 1e3, 4),
    }


def _tilt(found: Blocks) -> Array:
    """Components along s and up of the inward face normals of both blocks, rad, shape ``(..., 2, 2)``."""
    across = np.stack([found.side, found.up], axis=-2)
    return -found.normal @ np.swapaxes(across, -1, -2)


def _uncertainty(
    points: Array, gauge: Gauge, blocks: tuple[int, int], up: Array | None, sigma_um: Array
) -> dict[str, Any]:
    """Standard uncertainties by linear propagation of independent coordinate errors (GUM 5.1.2), ``(16,)`` in um."""
    step = 1e-3
    steps = step * np.eye(48).reshape(48, 16, 3)
    plus, minus = (_quantities(solve_blocks(at, gauge, blocks, up)) for at in (points + steps, points - steps))
    change = plus - minus
    change[:, 10] = np.angle(np.exp(1j * change[:, 10]))  # yaw jumps by a turn at 180 deg
    each = np.repeat(sigma_um, 3)[:, None]
    u = np.sqrt(((change / (2.0 * step) * each) ** 2).sum(axis=0))
    n1, n2 = np.hypot(u[6], u[7]) * 1e3, np.hypot(u[8], u[9]) * 1e3
    scalars = (u[10] * 1e3, u[11] * 1e3, n1, n2, u[12], u[13])
    names = ("yaw_urad", "pitch_urad", "n1_urad", "n2_urad", "length_um", "tip_radius_um")
    return {
        "c1_um": [round(float(v), 4) for v in u[0:3]],
        "c2_um": [round(float(v), 4) for v in u[3:6]],
        **{name: round(float(value), 4) for name, value in zip(names, scalars, strict=True)},
    }


def _quantities(found: Blocks) -> Array:
    """Centres (6), tilts (4), yaw, pitch, length and tip radius of many locations, ``(n, 14)`` in mm and rad."""
    axis, centre = found.axis, found.centre_mm
    length = np.linalg.norm(centre[:, 1] - centre[:, 0], axis=-1)
    scalars = [np.arctan2(axis[:, 1], axis[:, 0]), np.arcsin(axis[:, 2]), length, found.tip_radius_mm]
    return np.column_stack([centre.reshape(-1, 6), _tilt(found).reshape(-1, 4), *scalars])
