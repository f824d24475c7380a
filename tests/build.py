"""Gauges, poses and probed points made up by the tests, independently of the code that finds them again."""

from __future__ import annotations

import datetime
import signal
from dataclasses import dataclass

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from stepgauge.gauge.certified import CertificateTable, Gauge, GaugeTable
from stepgauge.gauge.placement import Placement
from stepgauge.machine.file import Machine, MachineTable
from stepgauge.probes.schema import ConstantTable

Array = NDArray[np.float64]


def make_gauge(
    blocks: int = 5,
    size: float = 10.0,
    gap: float = 10.0,
    width: float = 20.0,
    height: float = 15.0,
    deviation_um: Array | None = None,
    u_um: float = 0.1,
    expansion: float = 11.5e-6,
) -> Gauge:
    """A gauge of equal blocks whose faces are off nominal by ``deviation_um`` (first entry 0)."""
    nominal = np.empty(2 * blocks)
    nominal[0::2] = (size + gap) * np.arange(blocks)
    nominal[1::2] = nominal[0::2] + size
    position = nominal + (0.0 if deviation_um is None else deviation_um * 1e-3)
    table = GaugeTable(
        name="Test gauge",
        serial="T-1",
        material="steel",
        expansion_per_K=expansion,
        expansion_uncertainty_per_K=0.5e-6,
        reference_temperature_C=20.0,
        block_width_mm=width,
        block_height_mm=height,
        faces="none",
    )
    certificate = CertificateTable(
        number="T", laboratory="Test", date=datetime.date(2026, 1, 1), coverage_factor=2.0, example=True
    )
    return Gauge(table, certificate, nominal, position, np.full(2 * blocks, u_um), "test-gauge.toml")


def make_machine(**probe: float) -> Machine:
    """A machine without errors and with all the room it needs."""
    table = MachineTable(
        name="Test machine",
        travel_mm={"x": [-5000, 5000], "y": [-5000, 5000], "z": [-5000, 5000]},
        repeatability_um=0.0,
        measuring_speed_mm_s=3.0,
        travel_speed_mm_s=50.0,
    )
    return Machine(
        table, ConstantTable(**{"tip_radius_mm": 2.0, "pretravel_um": 3.0, "stylus_diameter_mm": 2.0, **probe})
    )


@dataclass(frozen=True)
class Pose:
    """Rows of ``rotation`` are a, s, up in machine directions; ``origin`` is the middle of face 1."""

    rotation: Array
    origin: Array

    def place(self, points: Array) -> Array:
        """Gauge coordinates into machine coordinates."""
        return self.origin + points @ self.rotation

    def placement(self, gauge: Gauge) -> Placement:
        """The placement of a gauge that lies so."""
        a, _, up = self.rotation
        middle = (gauge.position_mm[0::2] + gauge.position_mm[1::2]) / 2.0
        c1, c2 = self.origin + a * middle[0], self.origin + a * middle[-1]
        return Placement(c1, c2, a, up, 1, gauge.n_blocks)


def make_pose(
    yaw: float, pitch: float, roll: float = 0.0, origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> Pose:
    """A pose from yaw (about z), pitch (rise) and roll (about the axis), rad; without roll the blocks look up."""
    cy, sy, cp, sp, cr, sr = np.cos(yaw), np.sin(yaw), np.cos(pitch), np.sin(pitch), np.cos(roll), np.sin(roll)
    a = np.array([cy * cp, sy * cp, sp])
    level_up = np.array([-cy * sp, -sy * sp, cp])
    level_side = np.array([sy, -cy, 0.0])
    up = cr * level_up + sr * level_side
    return Pose(np.array([a, np.cross(a, up), up]), np.array(origin))


def make_points(gauge: Gauge, pose: Pose, radius: float, blocks: tuple[int, int], shift: Array | None = None) -> Array:
    """16 tip centres; ``shift (16, 3)`` moves each within its face, in units of half the room there is.

    Along the gauge the width limits: a long, narrow block has room for side points more askew than 12 deg.
    """
    shift = np.zeros((16, 3)) if shift is None else shift
    width, height = gauge.table.block_width_mm, gauge.table.block_height_mm
    points = []
    for i, block in enumerate(blocks):
        front, back = gauge.position_mm[2 * block - 2 : 2 * block]
        a, half_w, half_h = (front + back) / 2.0, width / 2.0, height / 2.0
        da, ds, du = (shift[8 * i : 8 * i + 8] * [min((back - front) / 6.0, width / 8.0), width / 8.0, height / 8.0]).T
        points += [
            (front - radius, -0.6 * half_w + ds[0], -0.5 * half_h + du[0]),
            (front - radius, 0.6 * half_w + ds[1], -0.5 * half_h + du[1]),
            (front - radius, ds[2], 0.6 * half_h + du[2]),
            (a + da[3], half_w + radius, du[3]),
            (a + da[4], -half_w - radius, du[4]),
            (a + da[5], ds[5], half_h + radius),
            (a + da[6], half_w + radius + 2.0 + abs(ds[6]), -half_h + radius),
            (back + radius, ds[7], du[7]),
        ]
    return pose.place(np.array(points))


def heed_interrupts() -> None:
    """For a child process: a shell that starts the tests in the background makes it ignore Ctrl-C otherwise."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


angles = st.floats(-np.pi, np.pi)
inclinations = st.floats(-1.5, 1.5)
positions = st.tuples(*[st.floats(-500.0, 500.0)] * 3)


@st.composite
def gauges(draw: st.DrawFn, largest: int = 6) -> Gauge:
    """Gauges of 2 to ``largest`` blocks with deviations of some um."""
    blocks = draw(st.integers(2, largest))
    deviation = draw(st.lists(st.floats(-5.0, 5.0), min_size=2 * blocks, max_size=2 * blocks))
    return make_gauge(
        blocks,
        size=draw(st.floats(6.0, 20.0)),
        gap=draw(st.floats(8.0, 20.0)),
        width=draw(st.floats(8.0, 30.0)),
        height=draw(st.floats(10.0, 25.0)),
        deviation_um=np.array([0.0, *deviation[1:]]),
    )
