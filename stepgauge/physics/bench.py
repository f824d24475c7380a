"""What a probe test bench records, and the probe's parameters from it (Ren, Qu and Chen 2020, section 2).

A push rod on a grating ruler pushes the tip while a laser measures the position of the tip. Four positions of the rod
characterise the probe: r0 at first contact of rod and tip, r1 at the trigger, r2 at standstill, r3 where the rod leaves
the tip on its return. Pre-travel is r1 - r0 (Eq 2), hysteresis r3 - r0 (Eq 3), repeatability the range of r1 (Eq 4).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stepgauge.files.arrays import Array

ContactFrom = Literal["signal", "tip"]

# Without a contact signal the meeting point is where the line of the moving tip leaves zero. The first tenth of the
# stroke is left out: there a weak contact has not yet taken up the tip.
_LINE_FROM, _LINE_TO = 0.1, 0.9


class BenchStroke(NamedTuple):
    """One push and return, as arrays of m samples.

    ``rod_mm`` grating reading, growing towards the probe; ``tip_mm`` laser reading of the tip; ``contact`` and
    ``trigger`` logical signals, True (high) at rest, False (low) while touching or triggered.
    """

    time_s: Array
    rod_mm: Array
    tip_mm: Array
    contact: NDArray[np.bool_]
    trigger: NDArray[np.bool_]


class Events(NamedTuple):
    """The rod at the four moments, in mm, and their times in s.

    ``resolution_um`` is the rod's travel between the two samples that enclose the trigger: r1 is their middle.
    """

    r0_mm: float
    r1_mm: float
    r2_mm: float
    r3_mm: float
    t0_s: float
    t1_s: float
    t2_s: float
    t3_s: float
    resolution_um: float

    @property
    def pretravel_um(self) -> float:
        """Rod travel from first contact to trigger (Eq 2)."""
        return 1e3 * (self.r1_mm - self.r0_mm)

    @property
    def hysteresis_um(self) -> float:
        """Shift of the rest position of the tip after the push (Eq 3)."""
        return 1e3 * (self.r3_mm - self.r0_mm)

    @property
    def overtravel_um(self) -> float:
        """Rod travel from trigger to standstill."""
        return 1e3 * (self.r2_mm - self.r1_mm)


@dataclass(frozen=True)
class DirectionResult:
    """The pushes of one direction together: means, ranges and experimental standard deviations, all in um.

    The repeatability of Eq 4 is ``trigger_range_um``; it compares rod positions counted from one zero, so it includes
    drift of the bench, while ``pretravel_range_um`` is free of a drift that moves r0 and r1 alike. The standard
    deviations are None for a single push.
    """

    direction_deg: float
    count: int
    pretravel_um: float
    pretravel_range_um: float
    pretravel_std_um: float | None
    hysteresis_um: float
    hysteresis_range_um: float
    trigger_range_um: float
    trigger_std_um: float | None


@dataclass(frozen=True)
class Anisotropy:
    """Ranges over the directions, in um, and the mean pre-travel over the directions."""

    pretravel_um: float
    hysteresis_um: float
    repeatability_um: float
    mean_pretravel_um: float


def find_events(push: BenchStroke, contact_from: ContactFrom = "signal") -> Events:
    """r0, r1, r2, r3 of one push (Ren Fig 4).

    Parameters
    ----------
    push : the recording; it must contain advance, contact, trigger, standstill and release
    contact_from : ``"signal"`` takes r0 and r3 from the contact signal, ``"tip"`` from the laser alone, for ball and
        rod that do not conduct: the straight line of tip against rod is extrapolated to the tip at rest

    Raises ``ValueError`` naming what the recording lacks.
    """
    turn = int(np.argmax(push.rod_mm))
    trigger = _falling_edge(push.trigger[: turn + 1], "the trigger signal does not fall before the rod turns back")
    if contact_from == "signal":
        touch = _falling_edge(push.contact[: trigger + 1], "the contact signal does not fall before the trigger")
        release = turn + _falling_edge(~push.contact[turn:], "the contact signal does not rise after the rod turned")
        r0, t0 = _between(push.rod_mm, touch), _between(push.time_s, touch)
        r3, t3 = _between(push.rod_mm, release), _between(push.time_s, release)
    else:
        r0, t0 = _departure(push, slice(0, trigger + 1))
        r3, t3 = _departure(push, slice(turn, len(push.rod_mm)))
    step_um = 1e3 * float(push.rod_mm[trigger] - push.rod_mm[trigger - 1])
    r1, t1 = _between(push.rod_mm, trigger), _between(push.time_s, trigger)
    return Events(r0, r1, float(push.rod_mm[turn]), r3, t0, t1, float(push.time_s[turn]), t3, step_um)


def summarise(direction_deg: float, events: Sequence[Events]) -> DirectionResult:
    """The pushes of one direction; ``ValueError`` for none at all."""
    if not events:
        raise ValueError("a direction without a push has no result")
    pretravel = np.array([push.pretravel_um for push in events])
    hysteresis = np.array([push.hysteresis_um for push in events])
    trigger = 1e3 * np.array([push.r1_mm for push in events])
    return DirectionResult(
        direction_deg,
        len(events),
        float(pretravel.mean()),
        float(np.ptp(pretravel)),
        _std(pretravel),
        float(hysteresis.mean()),
        float(np.ptp(hysteresis)),
        float(np.ptp(trigger)),
        _std(trigger),
    )


def anisotropy(results: Sequence[DirectionResult]) -> Anisotropy:
    """How much the directions differ (Ren, after Eq 4)."""
    pretravel = [result.pretravel_um for result in results]
    return Anisotropy(
        float(np.ptp(pretravel)),
        float(np.ptp([result.hysteresis_um for result in results])),
        float(np.ptp([result.trigger_range_um for result in results])),
        float(np.mean(pretravel)),
    )


def diameter_errors_um(measured_mm: ArrayLike, truth_mm: float) -> tuple[float, float]:
    """Mean error of repeated diameters and its standard uncertainty, in um (the use of Ren Table 1)."""
    errors = 1e3 * (np.asarray(measured_mm, dtype=float) - truth_mm)
    return float(errors.mean()), float(errors.std(ddof=1) / np.sqrt(errors.size))


def _falling_edge(high: NDArray[np.bool_], complaint: str) -> int:
    """Index of the first low sample after a high one."""
    falls = np.flatnonzero(high[:-1] & ~high[1:])
    if len(falls) == 0:
        raise ValueError(complaint)
    return int(falls[0]) + 1


def _between(values: Array, index: int) -> float:
    """The middle of the sampling interval that contains the edge."""
    return float(values[index - 1] + values[index]) / 2.0


def _departure(push: BenchStroke, part: slice) -> tuple[float, float]:
    """Rod position and time at which the line of the moving tip meets the tip at rest, on one flank of the push."""
    rod, tip, time = push.rod_mm[part], push.tip_mm[part], push.time_s[part]
    low, stroke = float(tip.min()), float(np.ptp(tip))
    moving = (tip > low + _LINE_FROM * stroke) & (tip < low + _LINE_TO * stroke)
    if stroke <= 0.0 or np.count_nonzero(moving) < 3 or np.ptp(rod[moving]) <= 0.0:
        raise ValueError("the tip reading does not rise and fall with the rod")
    slope, offset = np.polyfit(rod[moving], tip[moving], 1)
    # The first crossing, with the lowest sample, separates the tip at rest; the second is with its mean.
    resting = tip[rod < (low - offset) / slope]
    if len(resting) == 0:
        raise ValueError("the tip is never seen at rest; let the rod start and end clear of it")
    at = float((resting.mean() - offset) / slope)
    order = np.argsort(rod)
    return at, float(np.interp(at, rod[order], time[order]))


def _std(values: Array) -> float | None:
    return float(values.std(ddof=1)) if len(values) > 1 else None
