"""Recorded minus simulated, along the approach: what a diagnosis explains."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from stepgauge.effects import Probings, Setting, along_approach_um
from stepgauge.errors import InputError
from stepgauge.gauge.certified import Gauge
from stepgauge.machine.file import Machine
from stepgauge.machine.readout import machine_effects
from stepgauge.recording import APPROACH, POSITION, Recording
from stepgauge.recording.identity import axis_from_approaches, certified_mm, check_recording

Array = NDArray[np.float64]
FEWEST_ROWS = 12
MOST_ALONE = 0.2
"""Share of probings without a repeat at the same speed above which repeats at other speeds count, too."""


@dataclass(frozen=True)
class Residuals:
    """One entry per probing.

    ``um``: (recorded - simulated) . approach, with the origin of every placement still in it; ``side``: +1 where the
    approach goes along the gauge axis (fronts), -1 against it; ``placement``: index from 0; ``probings``: the columns
    that effects see, with the simulated coordinates: a recorded one holds the very residual that is to be explained;
    ``frame``: the recording, rows as in the file.
    """

    um: Array
    side: Array
    placement: NDArray[np.intp]
    face: NDArray[np.int64]
    probings: Probings
    frame: pd.DataFrame
    gauge: Gauge
    machine: Machine

    def __len__(self) -> int:
        return len(self.um)

    @cached_property
    def order(self) -> NDArray[np.intp]:
        """Rows in the order of probing: by time where it was recorded, else by placement and row."""
        if "time_s" in self.frame:
            return np.lexsort((self.frame["time_s"].to_numpy(), self.placement))
        return np.lexsort((np.arange(len(self)), self.placement))

    @cached_property
    def group(self) -> NDArray[np.intp]:
        """Index of the set of repeats a row belongs to: the same face of the same placement.

        At the same speed, too, unless that left too many probings alone.
        """
        face = np.column_stack([self.placement, self.face])
        sets = np.unique(np.column_stack([face, self.speed]), axis=0, return_inverse=True)[1].ravel()
        alone = (np.bincount(sets)[sets] == 1).mean()
        return sets if alone < MOST_ALONE else np.unique(face, axis=0, return_inverse=True)[1].ravel()

    @cached_property
    def speed(self) -> NDArray[np.intp]:
        """Index of the measuring speed of a row, 0 where none is recorded."""
        if "speed_mm_s" not in self.frame:
            return np.zeros(len(self), np.intp)
        return np.unique(self.frame["speed_mm_s"], return_inverse=True)[1].ravel()

    def without_origins(self, um: Array) -> Array:
        """Displacements along the approach ``(..., n)``, um, with the mean origin of every placement taken out."""
        own = (self.placement == np.arange(self.placement.max() + 1)[:, None]) * self.side
        return um - um @ (own.T / np.abs(own).sum(axis=1)) @ own

    @property
    def has_time(self) -> bool:
        return "time_s" in self.frame and self.frame["time_s"].nunique() > 1


def make_residuals(recording: Recording, gauge: Gauge, machine: Machine) -> Residuals:
    """Recorded minus simulated positions along the approach.

    The simulation is the machine file's: certified faces at the recorded gauge temperature, tip radius less pre-travel,
    and the effects that the file already knows. Where the gauge lies is not known and left to the fits.

    :class:`InputError` for recordings too small to say anything about.
    """
    frame = recording.frame
    if len(frame) < FEWEST_ROWS:
        raise InputError(
            recording.path,
            "the recording is too small for a diagnosis",
            found=f"{len(frame)} probings",
            expected=f"at least {FEWEST_ROWS} probings",
        )
    check_recording(recording, gauge)
    return unchecked_residuals(recording, gauge, machine)


def unchecked_residuals(recording: Recording, gauge: Gauge, machine: Machine) -> Residuals:
    """The same for a recording that is known to be of this gauge."""
    frame = recording.frame.reset_index(drop=True)
    face = frame["face"].to_numpy()
    numbers, placement = np.unique(frame["placement"].to_numpy(), return_inverse=True)
    position, approach = frame[POSITION].to_numpy(float), frame[APPROACH].to_numpy(float)
    axes = {
        int(n): axis_from_approaches(approach[placement == i].T, face[placement == i], recording.path)
        for i, n in enumerate(numbers)
    }
    axis = np.array([axes[int(n)] for n in numbers])[placement]
    along = (approach * axis).sum(axis=1)
    setting = Setting.of(machine, gauge, axes)
    probings = Probings(frame, setting)
    radius_mm = machine.probe.tip_radius_mm - machine.sensor.pretravel_um(approach) * 1e-3
    simulated_mm = certified_mm(recording, gauge, face) - along * radius_mm
    um = ((position * axis).sum(axis=1) - simulated_mm) * along * 1e3
    for effect in machine_effects(machine):
        um = um - along_approach_um(effect, probings)
    side = np.sign(along)
    um = um - side * _origin(um * side, placement)[placement]
    simulated = frame.assign(**dict(zip(POSITION, (position - um[:, None] * 1e-3 * approach).T, strict=True)))
    return Residuals(um, side, placement, face, Probings(simulated, setting), frame, gauge, machine)


def _origin(along_um: Array, placement: NDArray[np.intp]) -> Array:
    """A first guess of each placement's origin, so that numbers stay small."""
    return np.array([np.median(along_um[placement == i]) for i in range(placement.max() + 1)])
