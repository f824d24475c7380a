"""A program that measures the 16 points of a placement, from 16 positions to which the tip was only moved by hand.

The rough positions, some tenths of a millimetre to a millimetre off, give a rough placement; the program then touches
the 16 places as a machine touches them, at one speed and along the normals of the gauge. Its log holds the 16 points in
order, and ``stepgauge locate`` reads it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from stepgauge.alignment.blocks import fit_up, rough_axis, unit, usual_up
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement, possible_scale_error, scaled_tolerance_mm
from stepgauge.machine.file import Machine
from stepgauge.motion.collision import make_tool
from stepgauge.motion.moves import ProbingSettings, Program, ProgramBuilder
from stepgauge.planning.check import check_path, check_travel
from stepgauge.planning.plan import LIFT_MM
from stepgauge.probes.schema import ConstantTable

LYING_COS = 0.9
"""Machine +z is up for a gauge whose own up direction is within 25 deg of it; for another the points say it."""
RAIL_GAP_MM = 3.0
"""Between the ball at point 7 and the side of the block."""
_FRONT, _BACK, _TOP, _RIGHT, _LEFT = (-1, 0, 0), (1, 0, 0), (0, 0, 1), (0, 1, 0), (0, -1, 0)
PLACES = (
    (_FRONT, -0.6, -0.5),
    (_FRONT, 0.6, -0.5),
    (_FRONT, 0.0, 0.6),
    (_RIGHT, 0.0, 0.0),
    (_LEFT, 0.0, 0.0),
    (_TOP, 0.0, 0.0),
    (_TOP, 1.0, -1.0),
    (_BACK, 0.0, 0.0),
)
"""Points 1 to 8: outward normal in gauge coordinates, and the place across it, in units of half width and height."""
RAIL = 6


def rough_placement(
    points: Array, gauge: Gauge, blocks: tuple[int, int], tip_radius_mm: float, scale_error: float = 0.0
) -> Placement:
    """How the gauge lies, from rough positions ``(16, 3)``: the axis through the middles of the two blocks' points.

    :class:`InputError` where the blocks are not as far from each other as certified.
    """
    axis = rough_axis(points)
    fitted = fit_up(points, axis, gauge)[0]
    up = fitted if abs(fitted[2]) < LYING_COS else usual_up(points, axis, gauge)
    half = gauge.table.block_height_mm / 2.0
    eight = points.reshape(2, 8, 3)
    centre = eight.mean(axis=1)
    for _ in range(5):
        up = unit(up - axis * (axis @ up))
        side = np.cross(axis, up)
        along = (eight[:, :3] @ axis).mean(axis=1) / 2.0 + eight[:, 7] @ axis / 2.0
        across = eight[:, 3:5].mean(axis=1) @ side
        above = (eight[:, 5] @ up - half - tip_radius_mm + (eight[:, 6] @ up + half - tip_radius_mm)) / 2.0
        centre = along[:, None] * axis + across[:, None] * side + above[:, None] * up
        axis = unit(centre[1] - centre[0])
    middle = (gauge.position_mm[0::2] + gauge.position_mm[1::2]) / 2.0
    certified = float(middle[blocks[1] - 1] - middle[blocks[0] - 1])
    found = float(np.linalg.norm(centre[1] - centre[0]))
    if abs(found - certified) > scaled_tolerance_mm(gauge, blocks, scale_error) + 3.0:
        words = f"{certified:.1f} mm between blocks {blocks[0]} and {blocks[1]}"
        what = "the two blocks are not as far from each other as certified"
        raise InputError("the 16 positions", what, found=f"{found:.1f} mm", expected=words)
    inward = axis * (found - certified) / 2.0
    return Placement(centre[0] + inward, centre[1] - inward, axis, unit(up - axis * (axis @ up)), *blocks)


def teach_program(
    points: Array,
    gauge: Gauge,
    blocks: tuple[int, int],
    machine: Machine | None,
    settings: ProbingSettings,
    margin_mm: float,
) -> tuple[Program, Placement]:
    """The checked moves that touch the 16 points, and the rough placement that they are planned in.

    Parameters
    ----------
    points : rough positions of the tip centre, ``(16, 3)`` mm
    gauge, blocks : which blocks they are on
    machine : stylus and travel limits; without it the travel is not checked
    settings : stand-off, search, speeds, tip radius
    margin_mm : smallest gap on the way, for the gauge as the rough positions have it

    Raises
    ------
    InputError
        positions of other blocks, a way that comes too close to the gauge, a move outside the travel
    """
    placement = rough_placement(points, gauge, blocks, settings.tip_radius_mm, possible_scale_error(machine))
    program = _program(placement, gauge, blocks, settings)
    probe = machine.probe if machine else ConstantTable(tip_radius_mm=settings.tip_radius_mm)
    probe = probe.model_copy(update={"tip_radius_mm": settings.tip_radius_mm})
    rows = [gauge.n_blocks if place == RAIL else block - 1 for block in blocks for place in range(8)]
    check_path(program, rows, placement, gauge, make_tool(probe), margin_mm)
    if machine is not None:
        check_travel(program, machine)
    return replace(program, stylus=probe.stylus_direction), placement


def sixteen_points(placement: Placement, gauge: Gauge, blocks: tuple[int, int], tip_radius_mm: float) -> Array:
    """Tip centres at the 16 places of a gauge that lies so, ``(16, 3)`` mm in machine coordinates."""
    contacts = [_contact(gauge, block, place, tip_radius_mm)[0] for block in blocks for place in range(8)]
    return placement.to_machine(gauge, np.array(contacts))


def _program(placement: Placement, gauge: Gauge, blocks: tuple[int, int], settings: ProbingSettings) -> Program:
    """From above to each stand-off, along the normal to the place, back and up again."""
    builder = ProgramBuilder(f"{gauge.table.name} 16 points", settings)
    high = gauge.table.block_height_mm / 2.0 + settings.tip_radius_mm + settings.standoff_mm + LIFT_MM

    def go(place: Array, name: str) -> None:
        builder.goto(placement.to_machine(gauge, place), name=name)

    here: Array | None = None
    number = 0
    for block in blocks:
        for place in range(8):
            contact, normal = _contact(gauge, block, place, settings.tip_radius_mm)
            off = contact + settings.standoff_mm * normal
            if here is None:
                go(_at_height(off, high), "home")
            builder.open_point()
            if here is not None:
                go(here, "retract")
                go(_at_height(here, high), "lift")
                go(_at_height(off, high), "advance")
            go(off, "enter")
            number += 1
            into = placement.rotation.T @ -normal
            builder.measure(placement.to_machine(gauge, contact), into, name=f"T{number}")
            here = off
    builder.open_point()
    assert here is not None
    go(here, "retract")
    go(_at_height(here, high), "lift")
    return builder.build()


def _at_height(place: Array, high: float) -> Array:
    return np.array([place[0], place[1], high])


def _contact(gauge: Gauge, block: int, place: int, radius_mm: float) -> tuple[Array, Array]:
    """Tip centre at the contact and outward normal, in gauge coordinates (a, s, up)."""
    normal = np.array(PLACES[place][0], float)
    front, back = gauge.position_mm[2 * block - 2 : 2 * block]
    half = np.array([(back - front) / 2.0, gauge.table.block_width_mm / 2.0, gauge.table.block_height_mm / 2.0])
    centre = np.array([(front + back) / 2.0, 0.0, 0.0])
    if place == RAIL:
        return centre + np.array([0.0, half[1] + radius_mm + RAIL_GAP_MM, radius_mm - half[2]]), normal
    across = np.array([0.0, PLACES[place][1] * half[1], PLACES[place][2] * half[2]]) * (normal == 0.0)
    return centre + normal * (half + radius_mm) + across, normal
