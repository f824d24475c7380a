"""What a log does that nobody told the program: alarms, inches, another origin, every point touched again.

Each is a hypothesis about the whole log. Where the geometry of the gauge leaves one of them alone it is used and told;
where it does not, the log is refused with the option that settles it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from stepgauge.correspondence.differences import SHOWN
from stepgauge.correspondence.expected_points import PITCH_MM, check_beside, coordinates
from stepgauge.correspondence.faces import AT_FACE_MM, are_beside_blocks, nearest_faces
from stepgauge.correspondence.probe_log import ProbeLog
from stepgauge.errors import InputError, at_row, naming
from stepgauge.files.arrays import Array
from stepgauge.files.units import LENGTH_MM
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.motion.moves import Program

Settled = tuple[ProbeLog, Placement, Program | None, tuple[str, ...]]
ALARM, SHIFT, REPEATS = "alarm", "shift", "repeats"
TABLES = ("table", "workbook")
UNITS = ("inch", "m", "um")
"""Units of length, beside mm, that an option may state."""
ORIGIN = "coordinates of the workpiece in one, of the machine in the other?"
TOGETHER_MM = 0.5
"""Touches of one point in succession lie this close together: far less than two faces are apart."""
MOST = 0.9
"""Share of the points for which a convention holds; the others are differences, named one by one."""
CHANCE = 0.75
"""Share of differences of one sign up to which they are chance; between this and :data:`MOST` nobody can tell."""
ONE_AXIS = 0.7
"""Smallest cosine between approaches of one placement: two placements are at right angles, or in diagonals."""
FEWEST = 4
"""Points of a side from which differences that all have one sign are no chance (1 in 8, of both sides 1 in 64)."""


def settle(
    log: ProbeLog, gauge: Gauge, placement: Placement, program: Program | None, accept: Sequence[str]
) -> Settled:
    """The log in mm with one row a point; placement and program in its coordinates; and what was settled, in words.

    :class:`InputError` for an alarm with readings behind it, and for points beside the gauge, with the unit or the
    shift that would bring them onto it.
    """
    alarms = _alarm_words(log, accept)
    log, inches = _settle_unit(log, gauge, placement)
    shifted: tuple[str, ...] = ()
    shift = _shift_mm(log, gauge, placement, program)
    if shift.any():
        words = f"{coordinates(shift)} mm"
        if program is None or SHIFT not in accept:
            _refuse_shift(log, words, program)
        placement = replace(placement, c1_mm=placement.c1_mm + shift, c2_mm=placement.c2_mm + shift)
        program = replace(program, position_mm=program.position_mm + shift)
        shifted = (f"shifted by {words} from the program; the recording has the coordinates of the log",)
    check_beside(log, gauge, placement)
    log, touches = _settle_touches(log, gauge, placement, program, accept)
    return log, placement, program, (*alarms, *inches, *shifted, *touches)


def _alarm_words(log: ProbeLog, accept: Sequence[str]) -> tuple[str, ...]:
    """After an alarm the position may be lost, and moves of the program are; other failures are told."""
    told = ", ".join(f"{name} in line {at}" for at, name in log.failures[:SHOWN])
    if not log.alarms:
        return (f"reported by the controller: {told}",) if told else ()
    line, text = log.alarms[0]
    after = int((log.line > line).sum())
    if after and ALARM not in accept:
        words = f"a run without an alarm, or {{}} {ALARM} where the machine kept its position or was homed again"
        raise InputError(
            at_row(log.path, line),
            "an alarm in the middle of the run: the position may be lost",
            found=f"{text}, and {after} of {len(log)} contacts after it",
            expected=naming("accept", words=words),
        )
    if not after:
        return (f"warning: the log ends in an alarm: {told}; look there, home the machine, and run the program again",)
    return (f"warning: {told}; {after} of {len(log)} contacts came after it",)


def _settle_unit(log: ProbeLog, gauge: Gauge, placement: Placement) -> tuple[ProbeLog, tuple[str, ...]]:
    """Of the units that a log leaves open, the one in which its points lie on the gauge."""
    named = log.form in TABLES and "face" in log.columns  # compared with the faces that it states, unit and all
    if named or log.units == ("mm",) or _on_gauge(log.position_mm, gauge, placement):
        return log, ()
    fitting = [name for name in UNITS if _on_gauge(log.position_mm * LENGTH_MM[name], gauge, placement)]
    if not fitting:
        return log, ()
    if fitting[0] in log.units and log.form not in TABLES:
        words = f"the program was in {fitting[0]}, and in that unit the points are on the gauge"
        return log.convert_unit(fitting[0]), (words,)
    raise InputError(
        log.at(0),
        f"the points are beside the gauge as placed, and on it where they are in {fitting[0]}",
        found="no unit in the log" if log.form not in TABLES else "coordinates that were taken as mm",
        expected=naming("unit", words=f"{{}} {fitting[0]}, or the placement of this run"),
    )


def _on_gauge(position_mm: Array, gauge: Gauge, placement: Placement) -> bool:
    """Whether most points lie on the blocks, along the gauge, too."""
    tip = placement.to_gauge(gauge, position_mm)
    first, last = gauge.position_mm[[0, -1]]
    along = (tip[:, 0] > first - AT_FACE_MM) & (tip[:, 0] < last + AT_FACE_MM)
    return bool((along & ~are_beside_blocks(tip, gauge)).mean() > 0.5)


def _shift_mm(log: ProbeLog, gauge: Gauge, placement: Placement, program: Program | None) -> Array:
    """How far a log lies, as a whole, from where it should: 0 where it does not, or not as a whole; ``(3,)``.

    Without a program what lies across the gauge can be known, and along it about how far beyond its ends.
    """
    if program is None:
        tip = placement.to_gauge(gauge, log.position_mm)
        off = np.median(tip, axis=0)
        tip[:, 1:] -= off[1:]
        length, longest = np.ptp(tip[:, 0]), np.ptp(gauge.position_mm) + 2.0 * AT_FACE_MM
        odd = are_beside_blocks(tip, gauge).mean() > 1.0 - MOST or not PITCH_MM < length < longest
        if odd or _on_gauge(log.position_mm, gauge, placement):
            return np.zeros(3)
        beyond = abs(off[0] - np.mean(gauge.position_mm[[0, -1]])) > longest / 2.0
        off[0] = off[0] - np.mean(gauge.position_mm[[0, -1]]) if beyond else 0.0
        return np.asarray(off @ [placement.axis, placement.side, placement.up])
    target, search = program.position_mm[program.is_measure], program.settings.search_mm
    from scipy.spatial import KDTree  # long to load, and only a log with a program asks for it

    shift = _middle(log.position_mm) - _middle(target)
    here, there = (KDTree(target).query(log.position_mm - off)[0] <= search for off in (0.0, shift))
    return shift if here.mean() < 0.5 and there.mean() >= MOST else np.zeros(3)


def _middle(position_mm: Array) -> Array:
    return np.asarray((position_mm.min(axis=0) + position_mm.max(axis=0)) / 2.0)


def _refuse_shift(log: ProbeLog, words: str, program: Program | None) -> NoReturn:
    """The error of a log with another origin."""
    if program is None:
        found = f"all points {words} beside the gauge as placed"
        expected = naming("placement", "program", words="{} located in the coordinates of the log, or {}")
    else:
        found = f"all points {words} from those of the program"
        expected = naming("accept", words=f"a log and a placement in the same coordinates, or {{}} {SHIFT}")
    raise InputError(log.at(0), f"the log is shifted as a whole: {ORIGIN}", found=found, expected=expected)


def _settle_touches(
    log: ProbeLog, gauge: Gauge, placement: Placement, program: Program | None, accept: Sequence[str]
) -> tuple[ProbeLog, tuple[str, ...]]:
    """Every point touched several times in a row: first fast, then slowly, or the same again and again.

    The first is coarse where it lies, at every face of a side, to the same side of the last; the last is then the
    reading. Touches that differ by chance are repeats, which stay. A point with fewer touches than the others is left
    out: which of them it has, nobody knows.
    """
    face, before_mm = nearest_faces(log.position_mm, gauge, placement)
    first = np.flatnonzero(np.r_[True, _is_another(log, face)])
    size = np.diff(np.r_[first, len(log)])
    if "cycle" in log.columns or (size > 1).mean() < 0.5 or len(np.unique(face)) < 3:
        return log, ()
    touches = int(np.median(size[size > 1]))
    first = first[size == touches]
    last = first + touches - 1
    further_um = 1e3 * (before_mm[last] - before_mm[first])
    sides = [further_um[face[first] % 2 == side] for side in (1, 0)]
    coarse, chance = all(map(_is_systematic, sides)), all(map(_is_chance, sides))
    words = f"every point was touched {touches} times in a row"
    if not coarse and "doubled" not in accept:
        if program is None and not chance and REPEATS not in accept:
            _refuse_touches(log, words, further_um)
        return log, () if program is not None else (f"{words}: repeats, each in a cycle of its own",)
    medians = " and ".join(f"{np.median(side):+.1f}" for side in sides if side.size)
    odd = int((size != touches).sum())
    left = f"; {odd} points that were touched another number of times are left out" if odd else ""
    told = (
        f"{words}, the first {medians} um (fronts, backs) further than the last{': first fast, then slowly' * coarse}."
        f" The last is used; dropped: {len(log) - len(last)} rows{left}"
    )
    return log.taken(np.isin(np.arange(len(log)), last)), (told,)


def _is_another(log: ProbeLog, face: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Whether each row after the first is of another point than the one before: by its number or name, else its place.

    ``(n - 1,)``.
    """
    name = log.label if log.label is not None else log.number
    if name is not None:
        return np.asarray([one != other for one, other in pairwise(name)], dtype=bool)
    apart = np.linalg.norm(np.diff(log.position_mm, axis=0), axis=1) > TOGETHER_MM
    return np.asarray(apart | (np.diff(face) != 0))


def _refuse_touches(log: ProbeLog, words: str, further_um: Array) -> NoReturn:
    expected = naming("accept", words=f"{{}} doubled (the last touch is the reading) or {REPEATS} (all are, in cycles)")
    found = f"the first {further_um.min():+.1f} to {further_um.max():+.1f} um further than the last"
    raise InputError(log.at(0), f"{words}: fast and then slowly, or repeats?", found=found, expected=expected)


def _is_systematic(difference: Array) -> bool:
    """Whether differences have the same sign, nearly all, and are too many for that to be chance."""
    return len(difference) >= FEWEST and _alike(difference) >= MOST


def _is_chance(difference: Array) -> bool:
    """Whether differences have both signs, about as often."""
    return len(difference) >= FEWEST and _alike(difference) <= CHANCE


def _alike(difference: Array) -> float:
    return float(max((difference > 0.0).mean(), (difference < 0.0).mean()))


def count_placements(log: ProbeLog, accept: Sequence[str]) -> tuple[ProbeLog, list[str]]:
    """The log with its placements counted, where it states none, its approaches turn, and that is accepted; words."""
    assert log.approach is not None
    turns = np.abs(np.einsum("ij,ij->i", log.approach[1:], log.approach[:-1])) < ONE_AXIS
    if "placement" in log.columns or not turns.any():
        return log, []
    number = 1 + np.cumsum(np.r_[False, turns])
    if "placements" not in accept:
        raise InputError(
            log.at(int(turns.argmax()) + 1),
            "the approaches turn to another axis: the file has several placements of the gauge, and does not say so",
            found=f"{number[-1]} by the axes",
            expected=naming("accept", words="a column placement, or {} placements, which counts them by the axes"),
        )
    words = f"placements: {number[-1]}, counted by the axes of the approaches (the file states none)"
    return replace(log, columns={**log.columns, "placement": number}), [words]
