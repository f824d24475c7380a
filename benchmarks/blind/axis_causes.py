"""Further causes along the axes: joined scales, worn screws, friction, guideways of third order."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from benchmarks.blind.cause import Cause, on_axis
from benchmarks.blind.machine_causes import placement_along
from benchmarks.blind.scene import Scene

Array = NDArray[np.float64]
Random = np.random.Generator
AXES = "xyz"


def _sign(random: Random) -> float:
    return float(random.choice([-1.0, 1.0]))


def scale_joint(scene: Scene, random: Random, axis: int) -> Cause:
    """Two tapes end to end, from two batches: beyond the joint every pitch is longer. The first is taken as right."""
    used = scene.centre_mm[:, axis][scene.placement == placement_along(scene, axis, random)]
    at_mm = float(random.uniform(*np.quantile(used, [0.3, 0.7])))
    grid_mm = np.arange(0.0, scene.travel_mm[axis, 1] + 2.0, 0.25)
    pitch = np.where(grid_mm > at_mm, 0.25 * (1.0 + 0.02 * random.standard_normal(len(grid_mm))), 0.0)
    longer, sign = np.interp(scene.centre_mm[:, axis], grid_mm, np.cumsum(pitch)), _sign(random)
    return Cause(
        "scale_joint",
        lambda ppm: on_axis(scene, axis, sign * ppm * 1e-3 * longer),
        f"{AXES[axis]}/1",
        lambda ppm: {"at_mm": at_mm, "size": sign * ppm},
        start=5.0,
    )


def scale_gap(scene: Scene, random: Random, axis: int) -> Cause:
    """The same two tapes, alike, but with a gap between their ends: all beyond it reads off by the gap."""
    used = scene.centre_mm[:, axis][scene.placement == placement_along(scene, axis, random)]
    at_mm, sign = float(random.uniform(*np.quantile(used, [0.3, 0.7]))), _sign(random)
    beyond = (scene.centre_mm[:, axis] > at_mm).astype(float)
    return Cause(
        "scale_joint",
        lambda um: on_axis(scene, axis, sign * um * beyond),
        f"{AXES[axis]}/0",
        lambda um: {"size": sign * um},
    )


def reversal_wear(scene: Scene, random: Random, axis: int) -> Cause:
    """A screw worn where it was used most: play is what all strokes of its life have rubbed off (Archard)."""
    used = scene.centre_mm[:, axis][scene.placement == placement_along(scene, axis, random)]
    favourite, spread_mm = random.uniform(*np.quantile(used, [0.3, 0.7])), random.uniform(15.0, 50.0)
    from_mm = random.normal(favourite, spread_mm, 4000)
    to_mm = from_mm + np.abs(random.normal(0.0, spread_mm, 4000)) * random.choice([-1.0, 1.0], 4000)
    grid_mm = np.arange(0.0, scene.travel_mm[axis, 1] + 1.0)
    passed = [(np.minimum(from_mm, to_mm) < at) & (at < np.maximum(from_mm, to_mm)) for at in grid_mm]
    worn = np.mean(passed, axis=1)
    play = np.interp(scene.centre_mm[:, axis], grid_mm, worn / worn.max())
    sense, sign = np.sign(scene.approach[:, axis]), _sign(random)
    return Cause(
        "reversal_wear",
        lambda um: on_axis(scene, axis, sign * um / 2.0 * play * sense),
        AXES[axis],
        lambda um: {"at_mm": float(grid_mm[worn.argmax()])},
        start=2.0,
    )


def stick_slip(scene: Scene, random: Random, axis: int) -> Cause:
    """Bristles between slide and way (Dahl) followed through the path: bent by travel, they give way over some mm."""
    slip_mm, sign = float(random.uniform(4.0, 25.0)), _sign(random)
    bend, bent, before = 0.0, [], scene.way_mm[0, 0, axis]
    for at in scene.way_mm[:, :, axis].ravel().tolist():
        go = at - before
        bend = np.sign(go) + (bend - np.sign(go)) * np.exp(-abs(go) / slip_mm) if go else bend
        bent.append(float(bend))
        before = at
    held = np.reshape(bent, (len(scene), -1))[:, 2] - np.sign(scene.approach[:, axis])
    return Cause("stick_slip", lambda um: on_axis(scene, axis, sign * um / 2.0 * held), AXES[axis], start=2.0)


def _s_curve(scene: Scene, travel: int) -> tuple[Array, Array]:
    """A way bent in opposite senses at its ends: slope and deflection at the carriage, rad and m per 1/m2.

    The curvature runs linearly through zero in the middle, where the way was levelled; it is integrated twice.
    """
    grid_m = np.linspace(scene.travel_mm[travel, 0], scene.travel_mm[travel, 1], 2801) * 1e-3
    middle, step_m, half = grid_m.mean(), grid_m[1] - grid_m[0], len(grid_m) // 2
    curvature = grid_m - middle
    slope = np.r_[0.0, np.cumsum((curvature[1:] + curvature[:-1]) / 2.0) * step_m]
    slope -= slope[half]
    line = np.r_[0.0, np.cumsum((slope[1:] + slope[:-1]) / 2.0) * step_m]
    at_m = scene.centre_mm[:, travel] * 1e-3
    return np.interp(at_m, grid_m, slope), np.interp(at_m, grid_m, line - line[half])


def cubic_straightness(scene: Scene, random: Random, travel: int, sideways: int) -> Cause:
    """The carriage follows an S-shaped way sideways (its yaw has no arm: the probe is on the line of the way)."""
    _, line = _s_curve(scene, travel)
    sign = _sign(random)
    where = f"{AXES[travel]}/{AXES[sideways]}/3"
    return Cause("error_motion", lambda k: on_axis(scene, sideways, sign * k * 6.0 * line), where, start=20.0)


def cubic_scale(scene: Scene, random: Random, axis: int) -> Cause:
    """A tape heated in its middle when it was glued: its strain grows with the square of the distance from there."""
    grid_m = np.linspace(scene.travel_mm[axis, 0], scene.travel_mm[axis, 1], 2801) * 1e-3
    strain = 3.0 * (grid_m - grid_m.mean()) ** 2
    course = np.r_[0.0, np.cumsum((strain[1:] + strain[:-1]) / 2.0) * (grid_m[1] - grid_m[0])]
    course -= course[len(grid_m) // 2]
    off, sign = np.interp(scene.centre_mm[:, axis] * 1e-3, grid_m, course), _sign(random)
    where = f"{AXES[axis]}/{AXES[axis]}/3"
    return Cause("error_motion", lambda k: on_axis(scene, axis, sign * k * off), where, start=50.0)


def curved_rotation(scene: Scene, random: Random, travel: int, rotation: int) -> Cause:
    """The carriage turns by the slope of an S-shaped way, the tip with it, as a rigid body about the scale's line."""
    slope, _ = _s_curve(scene, travel)
    arm_mm, spin, sign = scene.centre_mm.copy(), np.eye(3)[rotation], _sign(random)
    arm_mm[:, travel] = 0.0

    def displace(urad: float) -> Array:
        angle = (sign * urad * 1e-6 * 2.0 * slope)[:, None]
        turned = arm_mm * np.cos(angle) + np.cross(spin, arm_mm) * np.sin(angle)
        return np.asarray(turned + spin * (arm_mm @ spin)[:, None] * (1.0 - np.cos(angle)) - arm_mm) * 1e3

    where = f"{AXES[travel]}/r{AXES[rotation]}/2"
    return Cause("error_motion", displace, where, start=50.0)
