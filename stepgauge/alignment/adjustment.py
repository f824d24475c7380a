"""The 16 points as one least-squares adjustment: which of them contradicts the others, and by how much.

Observation model. Every point is one observation: the distance of its tip centre from the centre of its block,
perpendicular to its face. In gauge directions (a, s, up), from the centre of its block:

    points 1, 2, 3    a = -l/2 - r + t_s s + t_u up      l: certified size of the block
    point 8           a = +l/2 + r + t_s s + t_u up      t: tilt of the faces of a block, common to front and back
    points 4, 5       s = +(w/2 + r), -(w/2 + r)
    point 6, 7        up = h/2 + r, -h/2 + r             both are probed from above

The 13 unknowns are the position of block C1 (3), the direction of the axis (2), the tip radius r, width w and height h
of the blocks, the difference of C1-C2 from its certified value, and the tilt of the faces of each block (4). Width and
height are nominal, the gauge may be warm, faces may be tilted: prior knowledge of these quantities is added as 7
further observations with standard deviations.

The redundancy number of an observation is the share of its error that shows in its residual (Baarda 1968, A testing
procedure for use in geodetic networks): 0 without any check by the others, 1 with a perfect one. The
normalised residual w = v / (sigma sqrt(redundancy)) is standard normal; an error of 4.13 sigma / sqrt(redundancy) is
detected with a probability of 80 % by a test at 0.1 %.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from stepgauge.alignment.blocks import first_axis, unit, usual_up
from stepgauge.files.arrays import Array
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import block_distance_mm, distance_tolerance_mm

ALONG = np.array([0, 0, 0, 1, 1, 2, 2, 0] * 2)
"""Direction (a, s, up) that each point measures."""
OUTWARD = np.array([-1.0, -1.0, -1.0, 1.0, -1.0, 1.0, 1.0, 1.0] * 2)
"""Sign of the direction from the face to the tip."""
RADIUS, WIDTH, HEIGHT, LONGER = 5, 6, 7, 8
"""Indices of tip radius, width, height and the difference of C1-C2 from its certified value among the unknowns."""
TEST_LIMIT = 3.29
"""Two-sided limit of a standard normal variable at 0.1 %."""
DETECTABLE = 4.13
"""Non-centrality of Baarda's test at 0.1 % with a power of 80 %."""
WIDTH_SIGMA_MM, HEIGHT_SIGMA_MM = 0.15, 0.3
USUAL_RADIUS_MM = 2.0
TILT_SIGMA = np.radians(0.5) / TEST_LIMIT
BY_HAND_MM = np.array([0.02, 0.02, 0.02, 0.02, 0.02, 0.02, 0.05, 0.02] * 2)
"""Standard deviation of a point probed by hand on a real block; the rail is no measuring surface."""
LEFT_OUT_MM = 1e6
"""Standard deviation of a point that gets no weight."""
_STEPS = np.array([1e-3] * 3 + [1e-6] * 2 + [1e-3] * 4 + [1e-6] * 4)
_ITERATIONS = 12


@dataclass(frozen=True)
class Adjustment:
    """The adjusted unknowns and the residuals.

    ``off_mm (16,)``: distance of each point from its adjusted face (outward positive); ``redundancy (16,)``;
    ``normalised (16 + k,)``: normalised residuals of points and of the further observations; ``chi2``: sum of squared
    residuals in units of their standard deviations, infinite, and all else NaN, where the points do not make two
    blocks; ``rotation``: rows a, s, up; ``c1_mm``: centre of the first block.
    """

    off_mm: Array
    redundancy: Array
    normalised: Array
    chi2: float
    rotation: Array
    c1_mm: Array
    unknowns: Array

    @property
    def worst(self) -> float:
        """Largest normalised residual; infinite where the adjustment did not converge."""
        worst = float(np.abs(self.normalised).max())
        return worst if np.isfinite(worst) else np.inf


@dataclass(frozen=True)
class _Model:
    """Misclosures of all observations for batches of unknowns ``(..., 13)``."""

    points: Array
    size_mm: Array
    apart_mm: float
    frame: Array
    up: Array
    nominal_mm: tuple[float, float]

    def misclosures(self, x: Array) -> Array:
        """Observed minus model, mm, shape ``(..., 16)``."""
        q = self.gauge_coordinates(x)
        r, w, h = x[..., RADIUS, None], x[..., WIDTH, None], x[..., HEIGHT, None]
        lean = np.einsum("...bpk,...bk->...bp", q[..., 1:], x[..., 9:13].reshape(*x.shape[:-1], 2, 2))
        a, s, u = q[..., 0] - lean, q[..., 1], q[..., 2]
        half = self.size_mm[:, None] / 2.0 + r[..., None]
        front, back = a[..., :3] + half, a[..., 7:] - half
        side = (w / 2.0 + r)[..., None]
        sides = s[..., 3:5] - side * np.array([1.0, -1.0])
        heights = u[..., 5:7] - (h[..., None] / 2.0) * np.array([1.0, -1.0]) - r[..., None]
        return np.concatenate([front, sides, heights, back], axis=-1).reshape(*x.shape[:-1], 16)

    def gauge_coordinates(self, x: Array) -> Array:
        """The points from the centres of their blocks in gauge directions, shape ``(..., 2, 8, 3)``."""
        q = np.einsum("...pk,...jk->...pj", self.points - x[..., None, :3], self.rotation(x))
        q = q.reshape(*x.shape[:-1], 2, 8, 3)
        q[..., 1, :, 0] -= (self.apart_mm + x[..., LONGER])[..., None]
        return q

    def rotation(self, x: Array) -> Array:
        """Rows a, s, up, shape ``(..., 3, 3)``."""
        a0, s0, u0 = self.frame
        a = unit(a0 + x[..., 3, None] * s0 + x[..., 4, None] * u0)
        u = unit(self.up - a * (a @ self.up)[..., None])
        return np.stack([a, np.cross(a, u), u], axis=-2)

    def known(self, x: Array) -> tuple[Array, Array]:
        """The further observations, observed minus model, and their standard deviations."""
        width, height = self.nominal_mm
        rows = [x[..., WIDTH] - width, x[..., HEIGHT] - height, x[..., LONGER], *np.moveaxis(x[..., 9:], -1, 0)]
        sigma = [WIDTH_SIGMA_MM, HEIGHT_SIGMA_MM, distance_tolerance_mm(self.apart_mm) / TEST_LIMIT, *[TILT_SIGMA] * 4]
        return np.stack(rows, axis=-1), np.array(sigma)


def adjust(
    points: Array,
    gauge: Gauge,
    blocks: tuple[int, int],
    up: Array | None,
    sigma_mm: Array,
) -> Adjustment:
    """Adjust the 16 points.

    Parameters
    ----------
    points : tip centres in mm, shape ``(16, 3)``
    gauge, blocks : the certified gauge, and the numbers of the two blocks
    up : direction from the rail to the blocks, None for machine +z (for a gauge on end, from its points)
    sigma_mm : standard deviation of each point across its face, shape ``(16,)``
    """
    model = _model(points, gauge, blocks, up)
    x = _start(model)
    for _ in range(_ITERATIONS):
        scaled, design = _linear(model, x, sigma_mm)
        x = x + (step := _step(scaled, design))
        if not (np.abs(step) >= _STEPS * 1e-4).any():
            break
    scaled, design = _linear(model, x, sigma_mm)
    orthogonal = np.linalg.qr(design)[0]
    share = np.clip(1.0 - (orthogonal**2).sum(axis=1), 0.0, 1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        normalised = np.where(share > 1e-9, scaled / np.sqrt(share), 0.0)
    off = model.misclosures(x) * OUTWARD
    chi2 = float(scaled @ scaled)
    return Adjustment(off, share[:16], normalised, chi2 if np.isfinite(chi2) else np.inf, model.rotation(x), x[:3], x)


def _step(scaled: Array, design: Array) -> Array:
    """Step of the unknowns ``(13,)``; NaN, which LAPACK must not get, where the points do not make two blocks."""
    if not (np.isfinite(design).all() and np.isfinite(scaled).all()):
        return np.full(design.shape[1], np.nan)
    return np.linalg.lstsq(design, -scaled, rcond=None)[0] / _scale()


def _model(points: Array, gauge: Gauge, blocks: tuple[int, int], up: Array | None) -> _Model:
    axis = first_axis(points, gauge, blocks)
    if up is None:
        up = usual_up(points, axis, gauge)
    across = unit(up - axis * (axis @ up))
    table = gauge.table
    return _Model(
        points,
        gauge.block_size_mm[[blocks[0] - 1, blocks[1] - 1]],
        block_distance_mm(gauge, *blocks),
        np.array([axis, np.cross(axis, across), across]),
        up,
        (table.block_width_mm, table.block_height_mm),
    )


def _start(model: _Model) -> Array:
    x = np.zeros(13)
    x[:3] = np.median(model.points[:8], axis=0)
    x[[RADIUS, WIDTH, HEIGHT]] = USUAL_RADIUS_MM, *model.nominal_mm
    return x


def _scale() -> Array:
    """Scales of the unknowns for the solution: mm, and angles in units of 1 mm over 1 m."""
    return np.where(_STEPS < 1e-3, 1e3, 1.0)


def _linear(model: _Model, x: Array, sigma_mm: Array) -> tuple[Array, Array]:
    """Misclosures and their derivatives by the scaled unknowns, both over the standard deviations."""

    def all_of(at: Array) -> Array:
        known, sigma = model.known(at)
        return np.concatenate([model.misclosures(at) / sigma_mm, known / sigma], axis=-1)

    steps = np.diag(_STEPS)
    design = (all_of(x + steps) - all_of(x - steps)).T / (2.0 * _STEPS * _scale())
    return all_of(x), design


def suspects(
    points: Array, gauge: Gauge, blocks: tuple[int, int], up: Array | None
) -> Iterator[tuple[int, Adjustment]]:
    """Each point (counted from 0) with the adjustment of all others, the best explanation first."""
    found = []
    for point in range(16):
        sigma = BY_HAND_MM.copy()
        sigma[point] = LEFT_OUT_MM
        found.append((point, adjust(points, gauge, blocks, up, sigma)))
    yield from sorted(found, key=lambda item: item[1].chi2)


def expected_place(points: Array, point: int, others: Adjustment, gauge: Gauge, blocks: tuple[int, int]) -> Array:
    """Position of a point expected from the others, machine mm, shape ``(3,)``: on its face, beside the probed point.

    For a point beyond its face the usual position of a point is expected.
    """
    width, height, radius = gauge.table.block_width_mm, gauge.table.block_height_mm, float(others.unknowns[RADIUS])
    half = np.array([gauge.block_size_mm[blocks[point // 8] - 1], width, height]) / 2.0
    apart = np.zeros(3)
    if point >= 8:
        apart[0] = block_distance_mm(gauge, *blocks) + others.unknowns[LONGER]
    q = others.rotation @ (points[point] - others.c1_mm) - apart
    along = int(ALONG[point])
    q[along] -= others.off_mm[point] * OUTWARD[point]
    usual = _usual(point % 8, half, radius)
    if point % 8 == 6:
        beside = half[1] + radius <= abs(q[1]) <= gauge.rail_width_mm / 2.0 and abs(q[0]) <= half[0]
        q[:2] = q[:2] if beside else usual[:2]
    else:
        across = [axis for axis in range(3) if axis != along]
        q[across] = np.where((np.abs(q) <= half)[across], q[across], usual[across])
    return others.c1_mm + (q + apart) @ others.rotation


def _usual(place: int, half: Array, radius_mm: float) -> Array:
    """The usual position on its face of each of the eight points, from the centre of the block."""
    front = {0: (-0.6, -0.5), 1: (0.6, -0.5), 2: (0.0, 0.6)}
    s, up = front.get(place, (0.0, 0.0))
    beside = half[1] + radius_mm + 2.0 if place == 6 else s * half[1]
    return np.array([0.0, beside, up * half[2]])
