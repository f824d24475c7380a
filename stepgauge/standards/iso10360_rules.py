"""What ISO 10360-2 asks of the length test, checked one by one, and what of a recording it leaves out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from stepgauge.files.notation import percent, plural
from stepgauge.gauge.certified import Gauge
from stepgauge.machine.file import Machine
from stepgauge.standards.iso10360_positions import Position, TestLength
from stepgauge.standards.iso10360_series import E0, E150, NORMAL, LengthSeries
from stepgauge.standards.lengths import LENGTHS, REPEATS
from stepgauge.standards.measuring_line import (
    DIAGONALS,
    LONGEST_SHARE,
    ORIENTATIONS,
    POSITIONS_SOURCE,
    SAME_DIRECTION_DEG,
)
from stepgauge.standards.rules import Excluded, Rule
from stepgauge.standards.tip import TipDiameter

TEST = "ISO 10360-2:2009, clause 6 (acceptance and reverification tests)"
LARGEST_GAP = 0.4
"""No two neighbouring lengths of a position may be farther apart than this share of the longest. The standard asks for
lengths well spread over the line without a number; this one is ours."""
NORMAL_EXPANSION_PER_K = (8e-6, 13e-6)
LOW_EXPANSION_PER_K = 2e-6
"""Below this a gauge is one of low expansion and one more length, of normal expansion, belongs to the test."""


def rules_of(
    series: LengthSeries,
    positions: Sequence[Position],
    numbers: Sequence[int],
    gauge: Gauge,
    tip: TipDiameter | None,
    machine: Machine | None,
    normal_too: bool = False,
) -> tuple[Rule, ...]:
    """Every rule of a series, in the order in which a tester goes through them.

    ``numbers`` are the placements of the recording, of which ``positions`` are the ones used; ``normal_too``: whether a
    length of normal expansion is tested beside this series.
    """
    count, least = len(numbers), series.least_lengths
    lengths = "5 lengths" if least == LENGTHS else "a length" if least == 1 else f"{least} lengths"
    ask = f"{series.positions} positions" if series.positions > 1 else "one position"
    return (
        Rule(POSITIONS_SOURCE, ask, f"{count} in the recording", count >= series.positions),
        *((_diagonals(positions, machine), _free(positions, machine)) if series is E0 else ()),
        _each(positions, f"{lengths} in each position", _count_lengths, least),
        _each(positions, f"{REPEATS} repeats of each length", _count_repeats, REPEATS),
        *((_longest(positions, machine),) if series is E0 else ()),
        *((_spread(positions),) if series is not NORMAL else ()),
        *((_offset(machine),) if series is E150 else ()),
        _bidirectional(tip),
        _expansion(series, gauge, normal_too),
        _temperature(positions),
    )


def _diagonals(positions: Sequence[Position], machine: Machine | None) -> Rule:
    asks = f"{DIAGONALS} of the positions along the four body diagonals of the measuring volume, which are mandatory"
    if machine is None:
        return Rule(POSITIONS_SOURCE, asks, NO_TRAVEL, None)
    seen = {one.orientation_number for one in positions if one.mandatory}
    missing = [one for one in ORIENTATIONS[:DIAGONALS] if one.number not in seen]
    if not missing:
        return Rule(POSITIONS_SOURCE, asks, f"all found, to {SAME_DIRECTION_DEG:g}°", True)
    return Rule(POSITIONS_SOURCE, asks, "not measured: " + "; ".join(one.name for one in missing), False)


NO_TRAVEL = "the machine's travel was not given (--machine)"


def _free(positions: Sequence[Position], machine: Machine | None) -> Rule:
    """Further positions beyond one along each diagonal; which ones is the user's choice."""
    free = E0.positions - DIAGONALS
    asks = f"{free} further positions of the user's choice (by default parallel to the axes)"
    if machine is None:
        return Rule(POSITIONS_SOURCE, asks, NO_TRAVEL, None)
    chosen, seen = [], set()
    for one in positions:
        first = one.mandatory and one.orientation_number not in seen
        seen.add(one.orientation_number)
        chosen += [] if first else [f"position {one.number}: {_direction(one)}"]
    return Rule(POSITIONS_SOURCE, asks, "; ".join(chosen) or "none", len(chosen) >= free)


def _direction(one: Position) -> str:
    if (one.off_deg or 0.0) <= SAME_DIRECTION_DEG:
        return str(one.orientation)
    return f"{one.off_deg:.0f}° off the line {one.orientation}"


OFFSET_MM, OFFSET_WITHIN_MM = 150.0, 15.0


def _offset(machine: Machine | None) -> Rule:
    """The stylus as the machine file has it, square to a vertical ram."""
    source = "ISO 10360-2:2009, error of length measurement with the ram axis stylus tip offset"
    asks = f"the tip {OFFSET_MM:g} mm off the axis of the ram (here: within {OFFSET_WITHIN_MM:g} mm, unconfirmed)"
    if machine is None:
        return Rule(source, asks, "the machine's stylus was not given (--machine)", None)
    probe = machine.probe
    off_mm = float(np.hypot(*probe.stylus_direction[:2])) * (probe.shank_length_mm + probe.body_length_mm)
    return Rule(source, asks, f"{off_mm:.0f} mm by the machine file", abs(off_mm - OFFSET_MM) <= OFFSET_WITHIN_MM)


def _each(positions: Sequence[Position], asks: str, count: Callable[[Position], int], wanted: int) -> Rule:
    fewer = [f"position {one.number}: {count(one)}" for one in positions if count(one) < wanted]
    return Rule(TEST, asks, ", ".join(fewer) or "in all positions measured", not fewer)


def _count_lengths(position: Position) -> int:
    """Of the kind that has fewest; a kind that is missing altogether is another rule's."""
    counts = [len(position.select_kind(kind)) for kind in ("bidirectional", "unidirectional")]
    return min((count for count in counts if count), default=0)


def _count_repeats(position: Position) -> int:
    return min((len(one.cycles) for one in position.lengths), default=0)


def _longest(positions: Sequence[Position], machine: Machine | None) -> Rule:
    asks = f"longest length at least {percent(LONGEST_SHARE)} of the machine's travel along the measured line"
    if machine is None:
        return Rule(TEST, asks, NO_TRAVEL, None)
    short = [
        f"position {one.number}: {one.longest_mm():.1f} mm, asked {LONGEST_SHARE * (one.line_mm or 0.0):.1f} mm"
        for one in positions
        if one.longest_mm() < LONGEST_SHARE * (one.line_mm or 0.0)
    ]
    return Rule(TEST, asks, "; ".join(short) or "in all positions measured", not short)


def _spread(positions: Sequence[Position]) -> Rule:
    asks = f"lengths spread over the line (here: no gap above {percent(LARGEST_GAP)} of the longest)"
    wide = []
    for one in positions:
        sizes = [0.0, *sorted({length.nominal_mm for length in one.lengths})]
        gap = float(np.diff(sizes).max()) if len(sizes) > 1 else 0.0
        if gap > LARGEST_GAP * sizes[-1]:
            wide.append(f"position {one.number}: a gap of {gap:.1f} mm")
    return Rule(TEST, asks, "; ".join(wide) or "in all positions measured", not wide)


def _bidirectional(tip: TipDiameter | None) -> Rule:
    source = "ISO 10360-2:2009, Annex B (bidirectional measurement of test lengths)"
    asks = "bidirectional lengths read with the tip diameter of the machine's own qualification"
    if tip is None:
        return Rule(source, asks, "no block has both faces measured, or no tip diameter", False)
    if tip.own_block:
        found = (
            f"the diameter is from {tip.origin}: an error of size that the qualification leaves is hidden"
            " unless the qualified one is stated"
        )
        return Rule(source, asks, found, False)
    return Rule(source, asks, f"{tip.diameter_mm:.5f} mm, {tip.origin}", True)


def _expansion(series: LengthSeries, gauge: Gauge, normal_too: bool) -> Rule:
    """A gauge of low expansion is sufficient for E0 if a length of normal expansion is tested, too."""
    low, high = NORMAL_EXPANSION_PER_K
    alpha = gauge.table.expansion_per_K
    found = f"{alpha * 1e6:g} × 10⁻⁶ / K"
    met = low <= alpha <= high
    if alpha < LOW_EXPANSION_PER_K and series is E0:
        found += ": low expansion; the further length of normal expansion " + (
            "is tested, too" if normal_too else "is missing (--normal)"
        )
        met = normal_too
    return Rule(
        "ISO 10360-2:2009, terms and definitions (material of normal expansion)",
        f"a gauge of normal expansion, {low * 1e6:g} to {high * 1e6:g} × 10⁻⁶ / K",
        found,
        met,
    )


def _temperature(positions: Sequence[Position]) -> Rule:
    without = [str(one.number) for one in positions if one.table.temperature_C is None]
    found = f"not recorded in positions {', '.join(without)}" if without else "recorded in all positions measured"
    return Rule(
        "ISO 10360-2:2009, environmental conditions",
        "the gauge's temperature known, for its length at that temperature",
        found,
        not without,
    )


def excluded_parts(
    series: LengthSeries, positions: Sequence[Position], numbers: Sequence[int], tip: TipDiameter | None
) -> tuple[Excluded, ...]:
    """Placements, cycles and faces of the recording that the test does not use."""
    parts = [
        Excluded(
            f"placement {number}", f"{series.positions} positions are tested, the first are used", POSITIONS_SOURCE
        )
        for number in numbers[series.positions :]
    ]
    parts += _left(positions, _cycles_left, f"{REPEATS} repeats are tested, the first complete ones are used")
    parts += _left(positions, partial(_faces_left, tip=tip), f"{LENGTHS} lengths of each kind are tested")
    if tip is None:
        parts.append(
            Excluded("all bidirectional lengths", "there is no tip diameter to take off", "ISO 10360-2, Annex B")
        )
    elif tip.own_block:
        parts.append(
            Excluded(
                "the length of a single block",
                "its mean error is zero by construction: the tip diameter comes from a block",
                "ISO 10360-2:2009, Annex B",
            )
        )
    return tuple(parts)


def _left(positions: Sequence[Position], name: Callable[[Position], str], reason: str) -> list[Excluded]:
    """What positions leave out, those together that leave out the same."""
    numbers: dict[str, list[str]] = {}
    for position in positions:
        numbers.setdefault(name(position), []).append(str(position.number))
    return [
        Excluded(f"{plural('position', len(where))} {', '.join(where)}: {what}", reason, TEST)
        for what, where in numbers.items()
        if what
    ]


def _cycles_left(position: Position) -> str:
    used = {cycle for one in position.lengths for cycle in one.cycles}
    left = [str(cycle) for cycle in position.table.cycles if cycle not in used]
    return f"{plural('cycle', len(left))} {', '.join(left)}" if left else ""


def _faces_left(position: Position, tip: TipDiameter | None) -> str:
    """Faces that no length needs; both of the block that the tip diameter comes from are needed."""
    faces = {int(face) for face in position.table.faces}
    used = {face for one in position.lengths for face in one.faces}
    if tip is not None and tip.own_block:
        front = min(face for face in faces if face % 2 and face + 1 in faces)
        used |= {front, front + 1}
    left = sorted(faces - used)
    return f"{len(left)} of {len(faces)} faces (the first is face {left[0]})" if left else ""


def describe(one: TestLength) -> str:
    """A length by its position and faces, for statements."""
    return f"position {one.position}, {one.nominal_mm:g} mm {one.kind} (faces {one.faces[0]} to {one.faces[1]})"
