"""Causes in the probe: a tripod on six contacts, one of them worn, another tip, a servo behind its set point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.blind.cause import Cause, along
from benchmarks.blind.scene import Scene, contact_mm

Array = NDArray[np.float64]
Random = np.random.Generator
SEATS_DEG = (0.0, 120.0, 240.0)
SAME = 0.99
"""Cosine of the angle up to which two placings have one direction."""
CARRIER_MM = 15.0
"""From the plane of the arms to where the stylus is screwed in, roughly."""


@dataclass(frozen=True)
class Tripod:
    """Three arms, each on two balls, pressed down by a spring of unit force.

    ``lever`` is from the plane of the arms to the tip, in radii of the contacts; ``along`` the compliance along the
    stylus over that across it.
    """

    arm_deg: float = 0.0
    lever: float = 4.0
    contact_deg: float = 30.0
    along: float = 0.1

    def reactions(self, load: Array) -> Array:
        """What six contacts bear of a load at the tip, forces and balances of moments solved; ``(n, 3)`` to ``(n, 6)``.

        A ball presses along the line through the arm's axis: aside by the cosine, up by the sine of its angle.
        """
        wrench, tip = np.empty((6, 6)), np.array([0.0, 0.0, -self.lever])
        slope = np.radians(self.contact_deg)
        for number in range(6):
            azimuth = np.radians(self.arm_deg + SEATS_DEG[number // 2])
            arm = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
            aside = np.cross([0.0, 0.0, 1.0], arm) * (1.0 if number % 2 else -1.0)
            push = np.cos(slope) * aside + np.sin(slope) * np.array([0.0, 0.0, 1.0])
            wrench[:, number] = np.r_[push, np.cross(arm, push)]
        return np.asarray(np.linalg.solve(wrench, -np.hstack([load, np.cross(tip, load)]).T).T)

    def force(self, normal: Array, open_at: Array | float = 0.0) -> Array:
        """Force at the tip, over the spring's, at which some contact bears only ``open_at`` of that at rest."""
        rest = self.reactions(np.array([[0.0, 0.0, -1.0]]))
        relief = np.maximum(-self.reactions(normal), 1e-12)
        return np.asarray((rest * (1.0 - np.asarray(open_at)) / relief).min(axis=1))

    def travel(self, normal: Array, open_at: Array | float = 0.0) -> Array:
        """Force times compliance along the normal: how far the tip is pressed before the contact opens."""
        soft = normal[:, 0] ** 2 + normal[:, 1] ** 2 + self.along * normal[:, 2] ** 2
        return self.force(normal, open_at) * soft


def stylus_frame(direction: tuple[float, float, float]) -> Array:
    """Axes of the probe as rows: x near machine x (machine y for a stylus along x), z from the tip to the probe."""
    up = -np.asarray(direction, float)
    x = np.eye(3)[1 if abs(up[0]) > 0.999 else 0]
    x = x - up * (x @ up)
    x /= np.linalg.norm(x)
    return np.array([x, np.cross(up, x), up])


def normals(scene: Scene) -> Array:
    """Normals of the faces in the frame of the probe: against the approaches."""
    return np.asarray(-scene.approach @ stylus_frame(scene.stylus_direction).T)


def qualifying_normals() -> Array:
    """Twenty-five points on half a sphere: the pole, and rings of four, eight, four and eight down to the equator."""
    rows = [np.array([0.0, 0.0, 1.0])]
    for down_deg, count, first_deg in ((22.5, 4, 0.0), (45.0, 8, 22.5), (67.5, 4, 0.0), (90.0, 8, 22.5)):
        for azimuth in np.radians(first_deg + 360.0 / count * np.arange(count)):
            flat = np.sin(np.radians(down_deg))
            rows.append(np.array([flat * np.cos(azimuth), flat * np.sin(azimuth), np.cos(np.radians(down_deg))]))
    return np.array(rows)


def _tripod(scene: Scene, random: Random) -> Tripod:
    radius_mm, angle_deg = random.uniform(9.0, 16.0), random.uniform(25.0, 35.0)
    carrier_mm = CARRIER_MM + random.uniform(-3.0, 3.0)
    lever = ((50.0 if scene.stylus_mm is None else scene.stylus_mm) + carrier_mm) / radius_mm
    return Tripod(float(random.uniform(0.0, 120.0)), float(lever), float(angle_deg), float(random.uniform(0.05, 0.15)))


def kinematic_pretravel(scene: Scene, random: Random) -> Cause:
    """A tripod that was qualified on a sphere: what is left of its pre-travel in every direction of approach.

    Between an arm and the gap opposite to it only odd orders decide; level gauges show none of them, tilted ones few.
    """
    tripod = _tripod(scene, random)
    left = tripod.travel(normals(scene)) - tripod.travel(qualifying_normals()).mean()
    return Cause(
        "kinematic_pretravel",
        lambda um: (um * left)[:, None] * scene.approach,
        "",
        lambda um: {"arm_azimuth_deg": tripod.arm_deg},
        turns={"arm_azimuth_deg": 120.0},
    )


def tripod_as_radius(scene: Scene, random: Random) -> Cause:
    """The same before faces of one direction: nobody can see more of it than a radius that is off."""
    tripod = kinematic_pretravel(scene, random)
    mean = along(scene, tripod.displace(1.0)).mean()
    return Cause("effective_radius", tripod.displace, "", lambda um: {"um": float(um * mean)}, radius_is_effect=True)


def seat_defect(scene: Scene, random: Random) -> Cause:
    """An oxidised seat: its contact resistance (Holm: as one over the root of the load) reaches the limit too early.

    A sound contact opens at 1 % of its load at rest, the films on the worn one make that many times more.
    """
    tripod, films = _tripod(scene, random), np.ones(6)
    sound, arm = 0.01, int(random.integers(3))
    films[2 * arm : 2 * arm + 2] = np.sqrt(random.uniform(12.0, 30.0))
    early = tripod.travel(normals(scene), sound * films**2) - tripod.travel(normals(scene), sound)
    return Cause("seat_defect", lambda um: (um * early)[:, None] * scene.approach)


def _with_company(scene: Scene) -> list[int]:
    """Placings that share their direction with another one: what is off in a direction is not off there alone."""
    axes = {int(place): scene.axis[scene.placement == place][0] for place in np.unique(scene.placement)}
    return [place for place in axes if any(other != place and abs(axes[other] @ axes[place]) > SAME for other in axes)]


def tip_change(scene: Scene, random: Random) -> Cause:
    """Between two placings the tip is exchanged and not qualified: its ball is a little larger or smaller.

    Only one placing has it: a collision or a wrong rack position, put right for the next one.
    """
    place, sign = int(random.choice(_with_company(scene))), float(random.choice([-1.0, 1.0]))
    changed = scene.placement == place

    def displace(um: float) -> Array:
        centre = np.where(
            changed[:, None], contact_mm(scene, tip_radius_mm=scene.tip_radius_mm - sign * um * 1e-3), 0.0
        )
        return np.where(changed[:, None], centre - scene.centre_mm, 0.0) * 1e3

    return Cause("tip_change", displace, str(place), lambda um: {"um": sign * um})


def servo_lag(scene: Scene, random: Random) -> Cause:
    """A carriage behind its set point: drag grows with the square of the speed, the loop has no integrator.

    Damping and the linear friction are fed forward. Each search is integrated over 3 mm from rest.
    """
    stiffness, damping, step_s = 60.0**2, 2.0 * 0.8 * 60.0, 2e-4
    behind = {}
    for speed in np.unique(scene.speed_mm_s):
        lag, rate = 0.0, 0.0
        for _ in range(int(3.0 / speed / step_s)):
            rate += step_s * (stiffness * (speed**2 / stiffness - lag) - damping * rate)
            lag += step_s * rate
        behind[speed] = lag
    drag = np.array([behind[speed] for speed in scene.speed_mm_s]) * stiffness

    def displace(um: float) -> Array:
        return (um * drag)[:, None] * scene.approach

    return Cause("servo_lag", displace, "", lambda um: {"um_per_mm2_s2": um}, start=0.1)
