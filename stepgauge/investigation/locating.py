"""A gauge that was laid by hand, located from seven probings at its outside.

Two tops, the front of the first block, the back of the last one, two points on one side and one on the other: five
numbers say how it lies (the blocks stand up), so that two are left over: its length and its width must be right.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement, make_placement
from stepgauge.ippdme.codes import DmeError
from stepgauge.live.controller import Link
from stepgauge.live.judging import check_on_line, check_touched
from stepgauge.live.measuring import MEANING, RETREATS
from stepgauge.live.safe_path import SafePaths
from stepgauge.machine.file import Machine
from stepgauge.motion.moves import ProbingSettings
from stepgauge.recording.identity import TURNED

LAID_MM = 3.0
"""How near to the asked place the person has to lay each end of the gauge, mm."""
AGREE_MM = 0.1
"""Probings that disagree by more than this did not touch what they were meant to."""
UP = 2


class NotAsAskedError(InputError):
    """The gauge does not lie as it was asked to: it has to be laid again."""


@dataclass(frozen=True)
class Target:
    """A probing: the surface point in gauge coordinates (along, across, up; mm); approach by axis and sign."""

    name: str
    surface_mm: tuple[float, float, float]
    along: int
    sign: float

    @property
    def approach(self) -> Array:
        """Unit approach in gauge coordinates, shape ``(3,)``."""
        return self.sign * np.eye(3)[self.along]


def targets(gauge: Gauge) -> list[Target]:
    """The seven probings, in an order in which each is made safe by those before it."""
    centre, width, height = gauge.block_centre_mm, gauge.table.block_width_mm / 2.0, gauge.table.block_height_mm / 2.0
    first, last, count = float(centre[0]), float(centre[-1]), gauge.n_blocks
    ends = (float(gauge.position_mm[0]), float(gauge.position_mm[-1]))
    return [
        Target("the top of block 1", (first, 0.0, height), UP, -1.0),
        Target(f"the top of block {count}", (last, 0.0, height), UP, -1.0),
        Target("the front of block 1", (ends[0], 0.0, 0.0), 0, 1.0),
        Target(f"the back of block {count}", (ends[1], 0.0, 0.0), 0, -1.0),
        Target("the right side of block 1", (first, width, 0.0), 1, -1.0),
        Target(f"the right side of block {count}", (last, width, 0.0), 1, -1.0),
        Target("the left side of block 1", (first, -width, 0.0), 1, 1.0),
    ]


def locating_settings(machine: Machine) -> ProbingSettings:
    """Searches that begin and end so far from the surface that a gauge laid by hand is met."""
    table, radius = machine.table, machine.probe.tip_radius_mm
    return ProbingSettings(
        standoff_mm=2.0 * LAID_MM,
        search_mm=2.0 * LAID_MM,
        retract_mm=2.0 * LAID_MM,
        measuring_speed_mm_s=table.measuring_speed_mm_s,
        travel_speed_mm_s=table.travel_speed_mm_s,
        tip_radius_mm=radius,
    )


def locate(link: Link, asked: Placement, gauge: Gauge, machine: Machine) -> tuple[Placement, float]:
    """Probe a gauge that lies nearly as asked, and find how it lies, and the minutes that this took.

    The session that was prepared is ended, the machine out of the way.

    :class:`NotAsAskedError` where it does not lie there, or where the probings contradict its length or its width.
    """
    began_s = clock_s(link)
    believed, points, every = asked, list[list[float]](), targets(gauge)
    try:
        for target in every:
            points.append(_probe(link, target, believed, gauge, machine))
            believed = fitted(asked, gauge, machine, every[: len(points)], points)[0]
        _leave(link, believed, gauge, machine)
    except DmeError as error:
        if error.number not in RETREATS:
            raise
        link.clear()
        _leave(link, believed, gauge, machine)
        link.end()
        what = f"the gauge was not found: {every[len(points)].name} is not there"
        expected = f"the gauge within {LAID_MM:g} mm"
        raise NotAsAskedError(link.name, what, found=MEANING[error.number], expected=expected) from None
    minutes = (clock_s(link) - began_s) / 60.0
    link.end()
    found, off_mm = fitted(asked, gauge, machine, every, points)
    check_agreement(every, off_mm, link.name)
    return found, minutes


def clock_s(link: Link) -> float:
    """The machine's clock in an open session, that of this computer where it has none."""
    now_s = link.time_s()
    return time.monotonic() if now_s is None else now_s


def _probe(link: Link, target: Target, believed: Placement, gauge: Gauge, machine: Machine) -> list[float]:
    """One probing: over the gauge to its start, and the search."""
    settings = locating_settings(machine)
    surface = believed.to_machine(gauge, target.surface_mm)
    approach = target.approach @ believed.rotation
    start = surface - (settings.tip_radius_mm + settings.standoff_mm) * approach
    here = link.position_mm()
    way, _ = SafePaths(machine, gauge, believed, LAID_MM).to_path(here, [here], [start])
    for place in way:
        link.go(place)
    takes_s = (settings.standoff_mm + settings.search_mm) / settings.measuring_speed_mm_s
    found = list(link.probe(surface, approach, takes_s).position_mm)
    check_on_line(np.array(found), surface - settings.tip_radius_mm * approach, approach, settings.search_mm)
    check_touched(np.array(found), link.touched_mm(approach))
    return found


def _leave(link: Link, believed: Placement, gauge: Gauge, machine: Machine) -> None:
    here = link.position_mm()
    for place in SafePaths(machine, gauge, believed).out(here, [here]):
        link.go(place)


def fitted(
    asked: Placement, gauge: Gauge, machine: Machine, probed: Sequence[Target], points: Sequence[Sequence[float]]
) -> tuple[Placement, Array]:
    """The placement that fits indicated tip centres best, and how far each is off it, mm.

    A shift on three axes, and the turns about the up and the side direction that are told by two points each.
    """
    centres = np.array(points, float)
    pretravel_mm = machine.sensor.pretravel_um(np.array([one.approach @ asked.rotation for one in probed])) * 1e-3
    reach = machine.probe.tip_radius_mm - pretravel_mm
    free = _free(probed)

    def off(values: Array) -> Array:
        lies = _moved(asked, gauge, values, free)
        in_gauge = lies.to_gauge(gauge, centres)
        meant = np.array([one.surface_mm[one.along] - one.sign * r for one, r in zip(probed, reach, strict=True)])
        return np.array([in_gauge[i, one.along] for i, one in enumerate(probed)]) - meant

    found = least_squares(off, np.zeros(len(free)), x_scale=[1.0 if one < 3 else 1e-2 for one in free], xtol=1e-14)
    return _moved(asked, gauge, found.x, free), off(found.x)


def _free(probed: Sequence[Target]) -> list[int]:
    """What the probings tell: shifts 0 to 2 (along, across, up), 3: the turn about up, 4: the rise."""
    seen = {one.along for one in probed}
    sides = {one.surface_mm[0] for one in probed if one.along == 1}
    tops = {one.surface_mm[0] for one in probed if one.along == UP}
    return [*sorted(seen), *([3] if len(sides) > 1 else []), *([4] if len(tops) > 1 else [])]


def _moved(asked: Placement, gauge: Gauge, values: Array, free: Sequence[int]) -> Placement:
    """The asked placement, shifted and turned by so much."""
    every = np.zeros(5)
    every[list(free)] = values
    axis = asked.axis + every[3] * asked.side + every[4] * asked.up
    axis = axis / np.linalg.norm(axis)
    c1 = asked.c1_mm + every[:3] @ asked.rotation
    length = float(gauge.block_centre_mm[asked.last_block - 1] - gauge.block_centre_mm[asked.first_block - 1])
    return make_placement(c1, c1 + length * axis, asked.first_block, asked.last_block, asked.up)


def check_agreement(probed: Sequence[Target], off_mm: Array, where: str) -> None:
    """:class:`InputError` where the probings do not fit one gauge: something else was touched, or it moved."""
    worst = int(np.abs(off_mm).argmax())
    if abs(off_mm[worst]) > AGREE_MM:
        found = f"{probed[worst].name} is {off_mm[worst]:+.3f} mm off the others"
        raise NotAsAskedError(
            where, "the probings do not fit this gauge", found=found, expected=f"within {AGREE_MM:g} mm"
        )


def check_end_for_end(recording: Any, gauge: Gauge, sigma_um: float) -> None:
    """:class:`InputError` where the readings of a run fit the certificate far better from the other end.

    Blocks look alike: seven probings cannot tell. Deviations of the faces from even spacing can, as soon as they stand
    out of the scatter. A straight line is taken out of both comparisons: scale and temperature are no evidence.
    """
    face, along = recording.frame["face"].to_numpy(), _along_mm(recording)
    told = np.unique(face)
    mean = np.array([along[face == one].mean() for one in told])
    own, turned = gauge.position_mm, gauge.position_mm[-1] - gauge.position_mm[::-1]
    chi2 = [_line_chi2(mean - certified[told - 1], told, gauge, sigma_um) for certified in (own, turned)]
    if chi2[1] < len(told) and chi2[0] > chi2[1] + CLEARLY:
        found, expected = f"chi-square {chi2[0]:.0f}", f"{chi2[1]:.0f} if turned"
        raise NotAsAskedError(recording.path, TURNED, found=found, expected=expected)


CLEARLY = 100.0
"""Difference of chi-square that no scatter makes: odds of 10^21."""


def _along_mm(recording: Any) -> Array:
    """Positions along the gauge's axis, mm."""
    approach, face = recording.approach, recording.frame["face"].to_numpy()
    axis = (approach * np.where(face % 2, 1.0, -1.0)[:, None]).mean(axis=0)
    return np.asarray(recording.position_mm @ (axis / np.linalg.norm(axis)))


def _line_chi2(off_mm: Array, face: NDArray[np.int64], gauge: Gauge, sigma_um: float) -> float:
    """Chi-square of errors of the faces after a line along the gauge and a tip radius, by certificate and scatter."""
    u_um = np.sqrt(np.asarray(gauge.u_um)[face - 1] ** 2 + sigma_um**2)
    design = np.column_stack([np.ones(len(face)), gauge.position_mm[face - 1], np.where(face % 2, 1.0, -1.0)])
    weighted = design / u_um[:, None]
    um = off_mm * 1e3 / u_um
    left = um - weighted @ np.linalg.lstsq(weighted, um, rcond=None)[0]
    return float(left @ left)
