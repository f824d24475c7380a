"""The order in which the readings of an axis were taken: whether it is known, and what a drift does where it is not."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from stepgauge.axis.recording import AxisRecording, places_of
from stepgauge.files.arrays import Array

ORDER = "order"
"""Comment of a recording whose rows are stated to be in the order of reading."""
STATED = "as the rows"
IN_SENSE = 0.9
"""Share of the steps within a pass that go its way, from which rows may be in the order of reading."""
BROKEN = 2
"""Blocks of rows per pass up to which passes stand together: a reading that is missing or out of place breaks one."""


def is_order_known(recording: AxisRecording) -> bool:
    """Whether times, a statement, or the rows themselves show which reading came after which."""
    frame = recording.frame
    timed = "time_s" in frame and frame["time_s"].nunique() > 1
    return recording.form != "axis" or timed or recording.comments.get(ORDER) == STATED or goes_as_machine(frame)


def goes_as_machine(frame: pd.DataFrame) -> bool:
    """Whether the rows go along the axis as a machine does: every pass stands together, its targets in its sense.

    A table that is sorted by target, by direction or by column has another order, and shows none. Faces of a gauge are
    touched in both directions in one pass, and each once: they go on from each to the next.
    """
    way, steps = frame["way"].to_numpy(float), np.diff(frame["target"].to_numpy(float))
    if not steps.any():
        return True
    cycle = ["placement", "cycle"]
    if not frame.duplicated([*cycle, "target"]).any() and _stand_together(frame[cycle].to_numpy(float), steps > 0.0):
        return True
    return _stand_together(frame[[*cycle, "way"]].to_numpy(float), steps * way[1:] >= 0.0)


def _stand_together(passes: Array, onward: NDArray[np.bool_]) -> bool:
    """Whether every pass stands together, and its steps go onward."""
    same = ~np.diff(passes, axis=0).any(axis=1)
    together = len(passes) - same.sum() <= BROKEN * len(np.unique(passes, axis=0))
    return bool(together and same.any() and onward[same].mean() > IN_SENSE)


def drift_columns(recording: AxisRecording, away: Array) -> Array:
    """What a drift adds to the readings where either direction may have been the first of a cycle, ``(c, n)``.

    As standard deviations, in the unit of ``away (n,)``, the deviations. A drift by d in every pass changes the
    deviations along each pass by d, and those of the later direction by d more: which one it is, is not known.
    """
    frame = recording.frame
    way, target = frame["way"].to_numpy(float), frame["target"].to_numpy(float)
    along = way * (target - target.mean()) / np.ptp(target)
    between = [way / 2.0] if recording.both_ways else []
    return _drift_in_pass(frame, away, along) * np.array([along, *between])


def _drift_in_pass(frame: pd.DataFrame, away: Array, along: Array) -> float:
    """How much the readings change in a pass: half of what they do from cycle to cycle; of one cycle, along it.

    One cycle in one direction cannot show it.
    """
    spot = pd.DataFrame({"place": places_of(frame["target"].to_numpy(float)), "way": frame["way"].to_numpy()})
    changed = away - pd.Series(away).groupby([spot["place"], spot["way"]]).transform("mean").to_numpy()
    means = pd.Series(changed).groupby([frame["placement"].to_numpy(), frame["cycle"].to_numpy()]).mean()
    steps = means.groupby(level=0).diff().dropna()
    if len(steps):
        return float(steps.abs().mean()) / (2.0 if frame["way"].nunique() > 1 else 1.0)
    if frame["way"].nunique() == 1:
        return 0.0
    columns = np.array([np.ones(len(away)), along, frame["target"].to_numpy(float), frame["way"].to_numpy(float)])
    return abs(float(np.linalg.lstsq(columns.T, away, rcond=None)[0][1]))
