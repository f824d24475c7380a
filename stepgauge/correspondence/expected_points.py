"""The points a log ought to have, in order: those of the program that was run, or those that its own rows suggest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from stepgauge.correspondence.faces import (
    FaceWords,
    check_mostly_on_blocks,
    cycles_of,
    faces_met,
    faces_touched,
    probed_faces,
)
from stepgauge.correspondence.probe_log import ProbeLog
from stepgauge.correspondence.sequence_alignment import align
from stepgauge.files.arrays import Array, Rows
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.motion.moves import Program
from stepgauge.planning.plan import ORDERS, PlanOptions, faces_in_order

LATERAL_MM = 0.1
"""A machine that searches along a straight line stays this close to it."""
PITCH_MM = 5.0
"""The faces of a gauge are farther apart."""
MOST_DIFFERENT = 0.3
"""A log in which more of the points are off than this was not measured in the order that it is compared with."""


@dataclass(frozen=True)
class ExpectedPoints:
    """Points in the order in which they ought to be measured; arrays have one row per point.

    ``target_mm``: tip centre at nominal contact; ``line``: of the program (0 without one); ``name``: what the point is
    called there; ``search_mm``, ``lateral_mm``: how far a reading may be off along the approach and beside it;
    ``source``: what says so, in words.
    """

    face: Rows
    cycle: Rows
    target_mm: Array
    approach: Array
    line: Rows
    name: Sequence[str]
    search_mm: float
    lateral_mm: float
    source: str
    speed_mm_s: float | None = None

    def __len__(self) -> int:
        return len(self.face)

    def tiled(self, runs: int) -> ExpectedPoints:
        """The same points several times over; the cycles count on."""
        cycle = np.concatenate([self.cycle + run * int(self.cycle.max()) for run in range(runs)])
        names = ("face", "line", "target_mm", "approach")
        arrays: dict[str, Any] = {name: np.concatenate([getattr(self, name)] * runs) for name in names}
        return replace(self, cycle=cycle, name=tuple(self.name) * runs, **arrays)

    def at_surface(self, tip_radius_mm: float) -> ExpectedPoints:
        """The same points where the ball touches, instead of its centre."""
        return replace(self, target_mm=self.target_mm + tip_radius_mm * self.approach)

    @property
    def reach_mm(self) -> float:
        """How far along the approach a reading may be of a point: the search, else less than to the next face."""
        return self.search_mm if np.isfinite(self.search_mm) else PITCH_MM / 2.0

    def title(self, point: int) -> str:
        """``point 4 of the program (line 37)``, counted from 1."""
        return f"point {point + 1} of {self.source}" + (f" (line {self.line[point]})" if self.line[point] else "")

    def place(self, point: int) -> str:
        """``cycle 1, face 4, tip centre at (1.000, 2.000, 3.000)``."""
        return f"cycle {self.cycle[point]}, face {self.face[point]}, near {coordinates(self.target_mm[point])}"


def coordinates(position_mm: Array) -> str:
    """``(1.000, 2.000, 3.000)``, mm."""
    return "(" + ", ".join(f"{value:.3f}" for value in position_mm) + ")"


def expected_by_program(program: Program, gauge: Gauge, placement: Placement) -> ExpectedPoints:
    """The measuring moves of a program (errors as :func:`stepgauge.correspondence.faces.probed_faces`)."""
    measure = program.is_measure
    face = probed_faces(program, gauge, placement)
    return ExpectedPoints(
        face,
        cycles_of(face),
        program.position_mm[measure],
        program.approach[measure],
        program.line[measure],
        [name for name, is_one in zip(program.names, measure, strict=True) if is_one],
        program.settings.search_mm,
        LATERAL_MM,
        "the program",
        program.settings.measuring_speed_mm_s,
    )


def _where(log: ProbeLog) -> FaceWords:
    at = [log.at(row) for row in range(len(log))]
    return FaceWords(at, "the probing", "point", "points of this gauge in this placement")


def check_beside(log: ProbeLog, gauge: Gauge, placement: Placement) -> None:
    """:class:`InputError` where most rows lie beside the blocks: another placement, or another unit."""
    check_mostly_on_blocks(log.position_mm, gauge, placement, _where(log), named=log.form == "table")


def faces_of_log(log: ProbeLog, gauge: Gauge, placement: Placement) -> Rows:
    """The face of every row of a log, from its approaches where it has them, else from its positions."""
    where = _where(log)
    if log.approach is None or log.surface:
        return faces_touched(log.position_mm, gauge, placement, where)
    return faces_met(log.position_mm, log.approach, gauge, placement, where)


def expected_by_log(log: ProbeLog, gauge: Gauge, placement: Placement) -> ExpectedPoints:
    """What a log without its program must have been planned as: the usual order that it differs least from.

    Compared are the orders of ``stepgauge plan`` over the faces that the log has; where it follows none of them, its
    own rows are all there is, and a missing point shows only in the counts.
    """
    face = faces_of_log(log, gauge, placement)
    order = _likeliest_order(face)
    source, faces, cycle = ("no known order", face, cycles_of(face)) if order is None else order
    sign = np.where(faces % 2 == 1, 1.0, -1.0)
    return ExpectedPoints(
        faces,
        cycle,
        _mean_place(log.position_mm, face, faces),
        sign[:, None] * placement.axis,
        np.zeros(len(faces), dtype=np.int64),
        [f"C{c}F{f}" for c, f in zip(cycle, faces, strict=True)],
        np.inf,
        np.inf,
        source,
    )


def _likeliest_order(face: Rows) -> tuple[str, Rows, Rows] | None:
    """Name, faces and cycles of the order with the fewest differences; None where all differ too much."""
    seen, count = np.unique(face, return_counts=True)
    usual = seen[2 * count >= np.median(count)]
    best: tuple[int, str, Rows, Rows] | None = None
    for cycles in sorted({int(np.median(count)), int(count.max())}, reverse=True):
        for order in ORDERS:
            options = PlanOptions((int(seen[0]) + 1) // 2, (int(seen[-1]) + 1) // 2, order=order, cycles=cycles)
            planned = np.array([pair for pair in faces_in_order(options) if pair[1] in usual], dtype=np.int64)
            pairs = align(planned[:, 1].tolist(), face.tolist())
            if pairs is not None:
                edits = _edits(len(planned), len(face), pairs)
                if best is None or edits < best[0]:
                    best = edits, f"the order '{order}' of {cycles} cycles", planned[:, 1], planned[:, 0]
    return None if best is None or best[0] > MOST_DIFFERENT * len(face) else best[1:]


def _edits(planned: int, rows: int, pairs: Rows) -> int:
    """Points missing and rows too much; what a log lacks at its end counts as one, for it is one event."""
    end = planned - 1 - int(pairs[-1, 0]) if len(pairs) else 0
    return planned + rows - 2 * len(pairs) - end + int(end > 0)


def _mean_place(position_mm: Array, face: Rows, wanted: Rows) -> Array:
    place = {int(number): position_mm[face == number].mean(axis=0) for number in np.unique(face)}
    return np.array([place[int(number)] for number in wanted])
