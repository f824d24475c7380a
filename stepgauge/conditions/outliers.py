"""Readings that their repeats contradict: found by the scatter of the whole recording, and left out by name.

The differences of readings of one face in successive cycles, less what moves a whole cycle, say how well the machine
repeats: their median, over all faces of both sides, so that no single reading sets its own limit. A reading beyond many
times that scatter from the others of its face is a slip: a hair, a knock, a typing error. What happens to more than a
few readings is how the machine measures, and is kept.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from stepgauge.files.arrays import Array, Rows
from stepgauge.files.notation import rounded
from stepgauge.physics.robust import TO_SIGMA, group_medians, mad_sigma
from stepgauge.recording.face_readings import FaceReadings

TIMES = 8.0
"""A reading is left out beyond so many standard deviations of one probing: by chance once in 1e15 readings."""
FEW_FREEDOMS = 6.0
"""The limit is wider by this over the degrees of freedom of the scatter: few readings may agree by chance."""
ODD_TIMES = 6.0
"""A face or a block is said to stand out beyond so many: it is used all the same, so a false alarm costs a glance."""
LEAST_UM = 2.0
"""Nothing nearer than this to its repeats is left out, however well they agree."""
STEPS = 4.0
"""Nor anything nearer than so many steps of the resolution."""
FEW = 0.03
"""Share of readings up to which they are slips."""
CALM, CALM_SIGMA = 0.3, 0.385
"""Share of the faces that one odd face leaves alone even among six, and that quantile of a normal |value|."""
NEIGHBOURS = 2
"""Faces of its side before and after a face whose scatter counts as its own: noise may grow along the gauge, and
fronts need not repeat as backs do."""
OF_CYCLE = 6
"""Readings of a cycle from which their median is what moves the whole cycle."""
CLEARER = 3.0
"""Of two repeats one is named where the other lies so many times nearer to the line between the neighbours."""
SHOWN = 10
_CALM_TO_SIGMA = 1.6
_OF_DIFFERENCE = TO_SIGMA / np.sqrt(2.0)
"""Standard deviation of a reading over the median of the size of the difference of two."""


@dataclass(frozen=True)
class ExcludedReading:
    """A reading that is not used: ``row`` in the placement, counted from 0; how far from its repeats, and the limit.

    A file of results does not hold the row; it is -1 where it was read from one.
    """

    placement: int
    cycle: int
    face: int
    row: int = field(compare=False)
    off_um: float
    limit_um: float

    def to_dict(self) -> dict[str, float | int]:
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


@dataclass(frozen=True)
class OutlierSearch:
    """Rows that their repeats contradict, how far from them, and the limit, um, each ``(m,)``.

    ``unclear``: faces whose repeats contradict each other, and nothing tells which of them is right.
    """

    rows: Rows
    off_um: Array
    limit_um: Array
    unclear: tuple[int, ...] = ()


NONE_FOUND = OutlierSearch(np.zeros(0, np.int64), np.zeros(0), np.zeros(0))


def find_outliers(readings: FaceReadings, cycle: Rows, resolution_mm: float = 0.0) -> OutlierSearch:
    """Readings that their repeats contradict.

    Parameters
    ----------
    readings : positions along the gauge minus certified positions, one series
    cycle : of every reading, (n,)
    resolution_mm : smallest step of the coordinates
    """
    face, count = readings.face, readings.count
    if not (count > 1).any():
        return NONE_FOUND
    from_middle = _deviations_from_median(readings.off_mm, face, cycle)
    order = np.lexsort((np.arange(len(face)), face))
    apart = np.abs(np.diff(from_middle[order]))
    same = np.diff(face[order]) == 0
    sigma_mm = _OF_DIFFERENCE * float(np.median(apart[same]))
    wider = 1.0 + FEW_FREEDOMS / float(same.sum())
    least_mm = max(LEAST_UM * 1e-3, STEPS * resolution_mm)
    suspect = np.unique(face[order][1:][same & (apart > max(TIMES * wider * sigma_mm, least_mm))])
    if not suspect.size:
        return NONE_FOUND
    local = {one: _near_mm(from_middle, face, one) for one in suspect.tolist()}
    limit_mm = {one: max(TIMES * wider * max(sigma_mm, near), least_mm) for one, near in local.items()}
    return _named(from_middle, readings, limit_mm)


def _deviations_from_median(off_mm: Array, face: Rows, cycle: Rows) -> Array:
    """Every reading minus the median of its face and minus what moves its whole cycle, ``(n,)``."""
    rest = off_mm - group_medians(off_mm, face)
    cycle = np.unique(cycle, return_inverse=True)[1].ravel()
    moved = np.where(np.bincount(cycle)[cycle] >= OF_CYCLE, group_medians(rest, cycle), 0.0)
    value = off_mm - moved
    return np.asarray(value - group_medians(value, face))


def _near_mm(from_middle: Array, face: Rows, one: int) -> float:
    """Standard deviation of one probing at a face and its neighbours of the same side.

    Of every face the worst quarter, one reading at least, is left aside, which :data:`_CALM_TO_SIGMA` makes good; of
    two readings neither can be, so that the face itself does not count.
    """
    total, freedom = 0.0, 0
    for near in range(one - 2 * NEIGHBOURS, one + 2 * NEIGHBOURS + 1, 2):
        off = np.sort(np.abs(from_middle[face == near]))
        if len(off) > 2 or (len(off) == 2 and near != one):
            kept = off[: len(off) - max(1, len(off) // 4)] if len(off) > 2 else off
            total, freedom = total + float((kept**2).sum()), freedom + max(len(kept) - 1, 1)
    return _CALM_TO_SIGMA * float(np.sqrt(total / freedom)) if freedom else 0.0


def _named(from_middle: Array, readings: FaceReadings, limit_mm: dict[int, float]) -> OutlierSearch:
    """The readings beyond the limit of their face, by rows that rise; faces where two or three contradict each other
    are unclear unless their neighbours tell."""
    rows, unclear, off, limit = list[int](), list[int](), list[float](), list[float]()
    for one, most in limit_mm.items():
        here = np.flatnonzero(readings.face == one)
        value = from_middle[here]
        out = np.abs(value) > most if len(here) > 2 else _farther_of_two(readings, here, most)
        if 0 < out.sum() < len(here) / 2.0 or (len(here) == 2 and out.sum() == 1):
            rows += here[out].tolist()
            off += (value[out] - np.median(value[~out])).tolist()
            limit += [most] * int(out.sum())
        elif len(here) < 5 and (out.any() or (len(here) == 2 and np.ptp(value) > most)):
            unclear.append(one)
    order = np.argsort(rows, kind="stable")
    off_um, limit_um = (np.array(numbers, float)[order] * 1e3 for numbers in (off, limit))
    return OutlierSearch(np.array(rows, np.int64)[order], off_um, limit_um, tuple(unclear))


def _farther_of_two(readings: FaceReadings, here: Rows, most_mm: float) -> NDArray[np.bool_]:
    """Of two readings of a face the one that lies beyond the limit from the line between the neighbours of its side,
    where the other lies far nearer; none where that is not clear."""
    one = int(readings.face[here[0]])
    seen = np.flatnonzero(readings.count)
    beside = seen[(seen % 2 == one % 2) & (seen != one)]
    if len(beside) < 2 or np.ptp(readings.off_mm[here]) <= most_mm:
        return np.zeros(2, np.bool_)
    near = beside[np.argsort(np.abs(beside - one), kind="stable")[: 2 * NEIGHBOURS]]
    middle = np.array([np.median(readings.off_mm[readings.face == other]) for other in near])
    off = np.abs(readings.off_mm[here] - np.polyval(np.polyfit(near, middle, 1), one))
    return np.asarray((off > most_mm) & (off > CLEARER * off[::-1]))


@dataclass(frozen=True)
class Judged:
    """Readings to be left out; ``unclear``: faces whose repeats contradict each other; ``many``: in words, what was
    found where it is too much to be slips."""

    left_out: tuple[ExcludedReading, ...] = ()
    unclear: tuple[int, ...] = ()
    many: str = ""

    @property
    def nothing(self) -> bool:
        """Whether all readings agree."""
        return self == NOTHING_JUDGED


NOTHING_JUDGED = Judged()


def judge(readings: FaceReadings, cycle: Rows, placement: int, resolution_mm: float) -> Judged:
    """The readings of a placement that their repeats contradict, as :func:`find_outliers` finds them."""
    found = find_outliers(readings, cycle, resolution_mm)
    many = found.rows.size + len(found.unclear)
    if many > max(3.0, FEW * len(readings.face)):
        share = f"{many} of {len(readings.face)} readings"
        return Judged(many=f"{share} are far from their repeats: too many to be slips, so all are used")
    left_out = tuple(
        ExcludedReading(placement, int(cycle[row]), int(readings.face[row]), int(row), float(off), float(limit))
        for row, off, limit in zip(found.rows, found.off_um, found.limit_um, strict=True)
    )
    return Judged(left_out, found.unclear)


def left_out_words(left_out: tuple[ExcludedReading, ...]) -> str:
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
        off, weight = _distances_from_neighbours(at_mm[rows], level_um[rows])
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
    limit = np.maximum(ODD_TIMES * mad_sigma(off), LEAST_UM / 2.0 + 4.0 * u)
    rows = np.flatnonzero(np.abs(off) > limit)
    few = max(1.0, len(fronts) / 4.0)
    return [(int(faces[fronts[i]] + 1) // 2, float(off[i])) for i in rows] if 0 < rows.size <= few else []


def _distances_from_neighbours(x: Array, y: Array) -> tuple[Array, Array]:
    """Distance of every value from the line through its two nearest, and how much wider it scatters than one value."""
    n = len(x)
    low = np.clip(np.arange(n) - 1, 0, n - 3)
    one, two = low + (np.arange(n) == 0), low + 2 - (np.arange(n) == n - 1)
    share = (x - x[one]) / (x[two] - x[one])
    off = y - (y[one] + share * (y[two] - y[one]))
    return off, np.sqrt(1.0 + share**2 + (1.0 - share) ** 2)
