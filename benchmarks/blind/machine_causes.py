"""Causes that live in the machine: its scales, guideways, axes and drives, each from how it comes about."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from benchmarks.blind.cause import Cause, on_axis
from benchmarks.blind.scene import Scene

Array = NDArray[np.float64]
Random = np.random.Generator
AXES = "xyz"


def _indicated_along(scene: Scene, axis: int) -> Array:
    return scene.centre_mm[:, axis]


def scale_error(scene: Scene, random: Random, axis: int) -> Cause:
    """Every millimetre of graduation is a little off; the errors of the pitches add up along the scale."""
    grid_mm = np.arange(0.0, scene.travel_mm[axis, 1] + 2.0)
    pitch = np.cumsum(1.0 + 0.02 * random.standard_normal(len(grid_mm)))
    sign = random.choice([-1.0, 1.0])
    slope = float(np.polyfit(grid_mm, pitch, 1)[0])

    def displace(ppm: float) -> Array:
        return on_axis(scene, axis, sign * ppm * 1e-3 * np.interp(_indicated_along(scene, axis), grid_mm, pitch))

    return Cause("scale_error", displace, AXES[axis], lambda ppm: {"ppm": sign * ppm * slope})


def scale_curvature(scene: Scene, random: Random, axis: int) -> Cause:
    """A tape stretched more towards one end: its strain runs linearly through zero at mid-travel and is integrated."""
    grid_m = np.arange(0.0, scene.travel_mm[axis, 1] + 0.5, 0.5) * 1e-3
    strain = 2.0 * (grid_m - scene.travel_mm[axis].mean() * 1e-3)
    bow = np.r_[0.0, np.cumsum((strain[1:] + strain[:-1]) / 2.0 * np.diff(grid_m))]
    sign = random.choice([-1.0, 1.0])

    def displace(um_per_m2: float) -> Array:
        return on_axis(scene, axis, sign * um_per_m2 * np.interp(_indicated_along(scene, axis) * 1e-3, grid_m, bow))

    return Cause("scale_curvature", displace, AXES[axis], lambda um_per_m2: {"um_per_m2": sign * um_per_m2}, start=10.0)


def periodic_scale_error(scene: Scene, random: Random, axis: int) -> Cause:
    """Encoder signals whose Lissajous figure is off centre and slightly elliptic; the angle is read from them."""
    period_mm = float(np.exp(random.uniform(np.log(6.0), np.log(70.0))))
    lead = random.uniform(0.0, 2.0 * np.pi)
    phase = 2.0 * np.pi * _indicated_along(scene, axis) / period_mm

    def displace(offset: float) -> Array:
        cosine = np.cos(phase) + offset * np.cos(lead)
        sine = (1.0 + 0.02 * offset) * np.sin(phase) + offset * np.sin(lead)
        wrong = np.angle((cosine + 1j * sine) * np.exp(-1j * phase))
        return on_axis(scene, axis, wrong * period_mm * 1e3 / (2.0 * np.pi))

    return Cause("periodic_scale_error", displace, AXES[axis], start=1e-3)


def local_scale_defect(scene: Scene, random: Random, axis: int) -> Cause:
    """A chip under the tape: the glued tape bends up over it like a beam on an elastic foundation."""
    used = _indicated_along(scene, axis)
    here = scene.placement == placement_along(scene, axis, random)
    low, high = np.quantile(used[here], [0.2, 0.8])
    at_mm, length_mm = random.uniform(low, high), random.uniform(12.0, 35.0)
    sign = random.choice([-1.0, 1.0])
    away = np.abs(used - at_mm) / length_mm
    lift = np.exp(-away) * (np.cos(away) + np.sin(away))
    return Cause(
        "local_scale_defect",
        lambda um: on_axis(scene, axis, sign * um * lift),
        AXES[axis],
        lambda um: {"at_mm": float(at_mm)},
    )


def placement_along(scene: Scene, axis: int, random: Random) -> int:
    """A placing whose gauge lies along this axis at least in part."""
    leaning = np.abs(scene.axis[:, axis]) > 0.5
    return int(random.choice(np.unique(scene.placement[leaning])))


def squareness(scene: Scene, random: Random, plane: str) -> Cause:
    """The second axis of the plane leans towards the first: true places are solved for the axes as they stand."""
    first, second = AXES.index(plane[0]), AXES.index(plane[1])
    sign = random.choice([-1.0, 1.0])

    def displace(urad: float) -> Array:
        axes = np.eye(3)
        angle = sign * urad * 1e-6
        axes[:, second] = 0.0
        axes[first, second], axes[second, second] = -np.sin(angle), np.cos(angle)
        indicated = np.linalg.solve(axes, scene.centre_mm.T).T
        return (indicated - scene.centre_mm) * 1e3

    return Cause("squareness", displace, plane, lambda urad: {"urad": sign * urad}, start=5.0)


def angular_error(scene: Scene, random: Random, travel: int, rotation: int) -> Cause:
    """A guideway of even curvature turns the carriage as it travels; the tip turns with it as a rigid body.

    The carriage's own line through the origin of the machine is straight (its straightness is corrected), so only the
    arm from that line counts.
    """
    sign = random.choice([-1.0, 1.0])
    grid_m = np.arange(0.0, scene.travel_mm[travel, 1] + 1.0) * 1e-3
    arm_mm = scene.centre_mm.copy()
    arm_mm[:, travel] = 0.0
    spin = np.eye(3)[rotation]

    def displace(urad_per_m: float) -> Array:
        curvature = np.full(len(grid_m) - 1, sign * urad_per_m * 1e-6)
        turned = np.r_[0.0, np.cumsum(curvature * np.diff(grid_m))]
        angle = np.interp(scene.centre_mm[:, travel] * 1e-3, grid_m, turned)[:, None]
        rotated = (
            arm_mm * np.cos(angle)
            + np.cross(spin, arm_mm) * np.sin(angle)
            + spin * (arm_mm @ spin)[:, None] * (1.0 - np.cos(angle))
        )
        return (rotated - arm_mm) * 1e3

    where = f"{AXES[travel]}/{AXES[rotation]}"
    return Cause("angular_error", displace, where, lambda k: {"urad_per_m": sign * k}, start=5.0)


def reversal_error(scene: Scene, random: Random, axis: int) -> Cause:
    """Play between drive and carriage, followed through every corner of the path: the carriage lags behind."""
    sign = random.choice([-1.0, 1.0])
    path_mm = scene.way_mm[:, :, axis].ravel().tolist()

    def displace(um: float) -> Array:
        half_mm, carriage, lag = float(um) * 1e-3 / 2.0, path_mm[0], []
        for drive in path_mm:
            carriage = min(max(carriage, drive - half_mm), drive + half_mm)
            lag.append(drive - carriage)
        return on_axis(scene, axis, sign * np.reshape(lag, (len(scene), -1))[:, 2] * 1e3)

    return Cause("reversal_error", displace, AXES[axis], lambda um: {"um": sign * um}, start=2.0)


def straightness(scene: Scene, random: Random, travel: int, sideways: int) -> Cause:
    """A guideway on two feet sags under its own weight, shear to deflection; the carriage follows the line sideways."""
    grid = np.linspace(0.0, 1.0, 801)
    moment = np.cumsum(0.5 - grid)
    slope = np.cumsum(moment)
    bend = np.cumsum(slope - slope.mean())
    bend /= np.ptp(bend)
    sign = random.choice([-1.0, 1.0])
    fraction = scene.centre_mm[:, travel] / scene.travel_mm[travel, 1]
    line = np.interp(fraction, grid, bend)
    return Cause(
        "straightness", lambda um: on_axis(scene, sideways, sign * um * line), f"{AXES[travel]}/{AXES[sideways]}"
    )
