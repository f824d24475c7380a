"""Readings that their repeats contradict: found by the scatter of the recording itself, and left out by name.

The repeats of a face (its readings in the other cycles) say how well the machine repeats. A reading that lies many
times that scatter from the median of its face, while the others agree, is a slip: a hair, a knock, a typing error. What
happens to more than a few readings is how the machine measures, and is kept.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from stepgauge.files.notation import rounded
from stepgauge.recording.by_face import ByFace

Array = NDArray[np.float64]
Rows = NDArray[np.int64]
TIMES = 8.0
"""A reading is left out beyond so many standard deviations of one probing: by chance once in 1e15 readings."""
ODD_TIMES = 6.0
"""A face or a block is said to stand out beyond so many: it is used all the same, so a false alarm costs a glance."""
LEAST_UM = 2.0
"""Nothing nearer than this to its repeats is left out, however well they agree."""
STEPS = 4.0
"""Nor anything nearer than so many steps of the resolution."""
FEW = 0.02
"""Share of readings up to which they are slips."""
CALM, CALM_SIGMA = 0.3, 0.385
"""Share of the faces that one odd face leaves alone even among six, and that quantile of a normal |value|."""
NEIGHBOURS = 2
"""Faces of its side before and after a face whose scatter counts as its own: noise may grow along the gauge, and
fronts need not repeat as backs do."""
SUSPECT = 0.58
"""Share of the limit, from the mean, at which a face is looked at: two slips in five pull the mean along by 0.4."""
SAMPLE = 50_000
"""Readings that the common scatter is taken from."""
SHOWN = 10
_TO_SIGMA, _CALM_TO_SIGMA = 1.4826, 1.6


@dataclass(frozen=True)
class LeftOut:
    """A reading that is not used: ``row`` in the placement, counted from 0; how far from its repeats, and the limit.

    A file of results does not hold the row; it is -1 where it was read from one.
    """

    placement: int
    cycle: int
    face: int
    row: int = field(compare=False)
    off_um: float
    limit_um: float

    def as_dict(self) -> dict[str, float | int]:
        """Plain JSON types."""
        return {
            "placement": self.placement,
            "cycle": self.cycle,
            "face": self.face,
            "off_um": self.off_um,
            "limit_um": self.limit_um,
        }

    def __str__(self) -> str:
        off, limit = rounded(self.off_um, 4, plus=True), rounded(self.limit_um, 2)
        return f"face {self.face} in cycle {self.cycle} ({off} um, limit {limit} um)"


def slips(readings: ByFace, resolution_mm: float = 0.0) -> tuple[Rows, Array, Array]:
    """Rows that their repeats contradict, how far from the median of their face they lie, and the limit, um.

    Parameters
    ----------
    readings : positions along the gauge minus certified positions, one series
    resolution_mm : smallest step of the coordinates
    """
    off_mm, face, count = readings.off_mm, readings.face, readings.count
    often = count[count > 2]
    if not often.size:
        return _none()
    repeated = slice(None) if often.sum() == len(face) else count[face] > 2
    from_mean = np.abs(readings.from_mean_mm)
    typical = float(np.median(often))
    sample = from_mean[repeated][:: max(1, int(often.sum()) // SAMPLE)]
    sigma_mm = _TO_SIGMA * float(np.median(sample)) * np.sqrt(typical / (typical - 1.0))
    least_mm = max(LEAST_UM * 1e-3, STEPS * resolution_mm)
    far = from_mean > SUSPECT * max(TIMES * sigma_mm, least_mm)
    if not far.any():
        return _none()
    far &= count[face] > 2
    rows, off_um, limit_um = list[int](), list[float](), list[float]()
    for one in np.unique(face[far]):
        here = np.flatnonzero(face == one)
        from_middle = off_mm[here] - np.median(off_mm[here])
        limit_mm = max(TIMES * sigma_mm, least_mm)
        if np.abs(from_middle).max() <= limit_mm:
            continue
        limit_mm = max(limit_mm, TIMES * _scatter_mm(off_mm, face, int(one)))
        out = np.abs(from_middle) > limit_mm
        if 0 < out.sum() < len(here) / 2.0:
            rows += here[out].tolist()
            off_um += (from_middle[out] * 1e3).tolist()
            limit_um += [limit_mm * 1e3] * int(out.sum())
    return np.array(rows, np.int64), np.array(off_um), np.array(limit_um)


def _none() -> tuple[Rows, Array, Array]:
    return np.zeros(0, np.int64), np.zeros(0), np.zeros(0)


def _scatter_mm(off_mm: Array, face: Rows, one: int) -> float:
    """Standard deviation of one probing at a face and its neighbours of the same side.

    The worst quarter of each face is left aside, which the factor :data:`_CALM_TO_SIGMA` makes good.
    """
    total, freedom = 0.0, 0.0
    for near in range(one - 2 * NEIGHBOURS, one + 2 * NEIGHBOURS + 1, 2):
        values = off_mm[face == near]
        if len(values) > 2:
            from_middle = np.sort(np.abs(values - np.median(values)))
            kept = from_middle[: max(int(np.ceil(0.75 * len(values))), 2)]
            total += float((kept**2).sum())
            freedom += len(kept) - 1
    return _CALM_TO_SIGMA * float(np.sqrt(total / freedom)) if freedom else 0.0


def find_left_out(
    readings: ByFace, cycle: Rows, placement: int, resolution_mm: float
) -> tuple[tuple[LeftOut, ...], str | None]:
    """The readings of a placement to be left out, and a remark on those that are kept although they stand out."""
    face = readings.face
    rows, off_um, limit_um = slips(readings, resolution_mm)
    if not rows.size:
        return (), None
    if rows.size > max(2.0, FEW * len(face)):
        share = f"{rows.size} of {len(face)} readings"
        return (), f"{share} are far from their repeats: too many to be slips, so all are used"
    return tuple(
        LeftOut(placement, int(cycle[row]), int(face[row]), int(row), float(off), float(limit))
        for row, off, limit in zip(rows, off_um, limit_um, strict=True)
    ), None


def resolution_mm(position_mm: Array) -> float:
    """The power of ten that all coordinates are whole multiples of, 1e-7 to 1 mm; 0 where there is none."""
    for decimals in range(8):
        if np.allclose(position_mm, np.round(position_mm, decimals), rtol=0.0, atol=1e-9):
            return float(10.0**-decimals)
    return 0.0


def left_out_words(left_out: tuple[LeftOut, ...]) -> str:
    """What was left out, as a note; further ones than :data:`SHOWN` are counted."""
    shown = ", ".join(map(str, left_out[:SHOWN]))
    more = f" and {len(left_out) - SHOWN} more" if len(left_out) > SHOWN else ""
    readings = "1 reading" if len(left_out) == 1 else f"{len(left_out)} readings"
    return f"left out: {readings} that the repeats contradict: {shown}{more}"


def odd_faces(faces: Rows, at_mm: Array, level_um: Array, u_um: Array) -> list[tuple[int, float]]:
    """Faces that lie off the line between their neighbours of the same side, whatever the cycle, with the distance, um.

    ``level_um``: mean error of every face, NaN where it was not measured; ``u_um``: its standard uncertainty. Repeats
    cannot tell whether such a face is off, its certificate, or the scale there; the limit is that of a reading, with
    the scatter of all faces about such lines in place of the repeats.
    """
    found: list[tuple[int, float]] = []
    for side in (1, 0):
        rows = np.flatnonzero((faces % 2 == side) & np.isfinite(level_um))
        if len(rows) < 5:
            continue
        off, weight = _beside_neighbours(at_mm[rows], level_um[rows])
        scatter = float(np.quantile(np.abs(off / weight), CALM)) / CALM_SIGMA
        limit = weight * np.maximum(ODD_TIMES * scatter, LEAST_UM + 4.0 * u_um[rows])
        size = np.abs(off) / limit
        peak = (size > 1.0) & (size >= np.r_[0.0, size[:-1]]) & (size >= np.r_[size[1:], 0.0])
        found += [(int(faces[rows[i]]), float(off[i])) for i in np.flatnonzero(peak)]
    return sorted(found)


def odd_blocks(faces: Rows, level_um: Array, u_um: Array) -> list[tuple[int, float]]:
    """Blocks that are read longer or shorter than the others, whatever the cycle, and by how much, um.

    The tip makes all blocks longer alike, so their sizes agree to the certificate and the scatter; arguments as for
    :func:`odd_faces`. A block of which R_eff is taken would pass its error on to every back face.
    """
    fronts = np.flatnonzero((faces[:-1] % 2 == 1) & np.isfinite(level_um[:-1]) & np.isfinite(level_um[1:]))
    if len(fronts) < 4:
        return []
    size = level_um[fronts + 1] - level_um[fronts]
    off = size - np.median(size)
    u = np.hypot(u_um[fronts], u_um[fronts + 1])
    limit = np.maximum(ODD_TIMES * _TO_SIGMA * np.median(np.abs(off)), LEAST_UM / 2.0 + 4.0 * u)
    rows = np.flatnonzero(np.abs(off) > limit)
    few = max(1.0, len(fronts) / 4.0)
    return [(int(faces[fronts[i]] + 1) // 2, float(off[i])) for i in rows] if 0 < rows.size <= few else []


def _beside_neighbours(x: Array, y: Array) -> tuple[Array, Array]:
    """Distance of every value from the line through its two nearest, and how much wider it scatters than one value."""
    n = len(x)
    low = np.clip(np.arange(n) - 1, 0, n - 3)
    one, two = low + (np.arange(n) == 0), low + 2 - (np.arange(n) == n - 1)
    share = (x - x[one]) / (x[two] - x[one])
    off = y - (y[one] + share * (y[two] - y[one]))
    return off, np.sqrt(1.0 + share**2 + (1.0 - share) ** 2)
