"""Residuals: recorded minus simulated, along the approach."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from stepgauge.conditions.duplicates import copied_cycles
from stepgauge.effects import Probings, Setting, along_approach_um
from stepgauge.effects.totals import latched_um, scatter_um
from stepgauge.errors import InputError, naming
from stepgauge.files.arrays import Array
from stepgauge.gauge.certified import Gauge
from stepgauge.machine.file import Machine
from stepgauge.machine.readout import machine_effects
from stepgauge.recording import POSITION, Recording
from stepgauge.recording.columns import CORRECTED, STYLUS
from stepgauge.recording.conventions import complete_by_machine, warmer_K
from stepgauge.recording.corrected import corrected_radius_mm, zeroed_face
from stepgauge.recording.identity import axis_from_approaches, certified_mm, check_recording

FEWEST_ROWS = 12
MOST_ALONE = 0.2
"""Share of probings without a repeat at the same speed above which repeats at other speeds also count."""


@dataclass(frozen=True)
class Residuals:
    """One entry per probing.

    ``um``: (recorded - simulated) . approach, with the origin of every placement still in it; ``side``: +1 where the
    approach goes along the gauge axis (fronts), -1 against it; ``placement``: index from 0; ``probings``: the columns
    that effects use, with the simulated coordinates, since a recorded coordinate contains the residual itself;
    ``frame``: the recording, rows as in the file. Of a recording without a gauge, ``unknown (p, n)``: nuisance columns
    of which nothing is known, in place of the origins; ``datum (n,)``: rows that have an origin in common, where every
    cycle was set to zero (default: those of a placement); ``step_um``: the resolution of the readings, None where it is
    not known beforehand; ``ordered``: whether rows are in the order of reading; ``copied``: placements and cycles that
    were left out since they repeat another one; ``of_recording (n,)``: which rows of the recording these are;
    ``program``: file of the program that was run, where it is known;
    ``lengths_um (c, n)``: standard uncertainties that all lengths of the gauge have in common, by its temperature;
    ``radius_stated``: whether the effective radius of the first stylus is known from the file;
    ``grown_um (n,)``: standard deviation that effects in the machine file add to the repeatability; ``latched_um
    (n,)``: that of a latch, which all repeats may have in common.
    """

    um: Array
    side: Array
    placement: NDArray[np.intp]
    face: NDArray[np.int64]
    probings: Probings
    frame: pd.DataFrame
    gauge: Gauge
    machine: Machine
    unknown: Array | None = None
    datum: NDArray[np.intp] | None = None
    step_um: float | None = None
    ordered: bool = True
    grown_um: Array | float = 0.0
    latched_um: Array | float = 0.0
    copied: tuple[tuple[int, int], ...] = ()
    of_recording: NDArray[np.intp] | None = None
    program: str = ""
    radius_stated: bool = True
    lengths_um: Array | None = None

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
        """Index of the set of repeats of a row: the same face of the same placement.

        And the same speed, unless too many probings would then have no repeat.
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
        """Displacements along the approach ``(..., n)``, um, minus the mean of every origin."""
        return um - um @ self._spanned.T @ self._spanned

    @cached_property
    def origins(self) -> Array:
        """Columns ``(p, n)`` of which nothing is known: the origin of every placement along the gauge, or others.

        And the effective radius of every stylus of which nobody stated it: a new one has not been qualified here.
        """
        if self.unknown is not None:
            return self.unknown
        datum = self.placement if self.datum is None else self.datum
        places = (datum == np.unique(datum)[:, None]) * self.side
        return np.vstack([places, self.radii]) if len(self.radii) else places

    @cached_property
    def radii(self) -> Array:
        """Columns ``(s, n)``: a larger effective radius of each stylus without a stated one."""
        unknown = np.unique(self.stylus[self.stylus > int(self.radius_stated)])
        return (self.stylus == unknown[:, None]).astype(float)

    @cached_property
    def _spanned(self) -> Array:
        """Orthonormal rows that span the origins."""
        if self.unknown is None and not len(self.radii):
            return self.origins / np.sqrt(np.abs(self.origins).sum(axis=1, keepdims=True))
        _, size, rows = np.linalg.svd(self.origins, full_matrices=False)
        return np.asarray(rows[size > 1e-9 * size[0]])

    @property
    def columns(self) -> dict[str, Array]:
        """The columns that effects use, each ``(n,)``."""
        return {str(name): self.probings.column(name) for name in self.frame.columns}

    def at(self, rows: NDArray[np.bool_]) -> Residuals:
        """Some of the rows."""
        frame = self.frame[rows].reset_index(drop=True)
        columns = {name: values[rows] for name, values in self.columns.items()}
        return replace(
            self,
            um=self.um[rows],
            side=self.side[rows],
            placement=np.unique(self.placement[rows], return_inverse=True)[1].ravel(),
            face=self.face[rows],
            probings=Probings(pd.DataFrame(columns), self.probings.setting),
            frame=frame,
            unknown=None if self.unknown is None else self.unknown[:, rows],
            datum=None if self.datum is None else self.datum[rows],
            grown_um=np.broadcast_to(self.grown_um, rows.shape)[rows],
            latched_um=np.broadcast_to(self.latched_um, rows.shape)[rows],
            of_recording=self.row[rows],
            lengths_um=None if self.lengths_um is None else self.lengths_um[:, rows],
        )

    @property
    def row(self) -> NDArray[np.intp]:
        """Index of every row in the recording."""
        return np.arange(len(self)) if self.of_recording is None else self.of_recording

    @cached_property
    def stylus(self) -> NDArray[np.int64]:
        """Number of the stylus of a row, 1 for that of the machine file."""
        return stylus_of(self.frame)

    @property
    def is_ordered(self) -> bool:
        """Whether it is known which reading came after which."""
        return self.ordered or self.has_time

    @cached_property
    def has_time(self) -> bool:
        """Whether times were recorded that differ."""
        return "time_s" in self.frame and self.frame["time_s"].nunique() > 1


def make_residuals(recording: Recording, gauge: Gauge, machine: Machine) -> Residuals:
    """Recorded minus simulated positions along the approach.

    The simulation uses the machine file: certified faces at the recorded gauge temperature, tip radius minus
    pre-travel, and the effects in the file, each row with its stylus. The position of the gauge is not known and is
    fitted.

    :class:`InputError` for recordings too small for a diagnosis.
    """
    frame = recording.frame
    if len(frame) < FEWEST_ROWS:
        raise InputError(
            recording.path,
            "the recording is too small for a diagnosis",
            found=f"{len(frame)} probings",
            expected=f"at least {FEWEST_ROWS} probings",
        )
    check_recording(complete_by_machine(recording, machine.table), gauge)
    return unchecked_residuals(recording, gauge, machine)


def unchecked_residuals(recording: Recording, gauge: Gauge, machine: Machine) -> Residuals:
    """The same for a recording that is known to be of this gauge."""
    recording = complete_by_machine(recording, machine.table)
    frame = recording.frame.reset_index(drop=True)
    face = frame["face"].to_numpy()
    numbers, placement = np.unique(frame["placement"].to_numpy(), return_inverse=True)
    position, approach = recording.position_mm, recording.approach
    axes = {
        int(n): axis_from_approaches(approach[placement == i].T, face[placement == i], recording.path)
        for i, n in enumerate(numbers)
    }
    axis = np.array([axes[int(n)] for n in numbers])[placement]
    along = (approach * axis).sum(axis=1)
    setting = Setting.of(machine, gauge, axes)
    probings = Probings(frame, setting)
    simulated_mm = certified_mm(recording, gauge, face) - along * _radius_mm(recording, machine)
    um = ((position * axis).sum(axis=1) - simulated_mm) * along * 1e3
    effects = machine_effects(machine)
    for effect in effects:
        um = um - along_approach_um(effect.expected(), probings)
    side = np.sign(along)
    um = um - side * _origin(um * side, placement)[placement]
    simulated = frame.assign(**dict(zip(POSITION, (position - um[:, None] * 1e-3 * approach).T, strict=True)))
    grown_um, late_um = scatter_um(effects, probings, 0.0)[-1], latched_um(effects, probings)
    seen = Probings(simulated, setting)
    return Residuals(
        *(um, side, placement, face, seen, frame, gauge, machine),
        grown_um=grown_um,
        latched_um=late_um,
        program=recording.comments.get("program", ""),
        datum=_datum((position * axis).sum(axis=1), placement, recording),
        radius_stated=CORRECTED in recording.comments or machine.probe.states_radius,
        lengths_um=_lengths_um(recording, gauge, machine) * side,
    )


def _datum(along_mm: Array, placement: NDArray[np.intp], recording: Recording) -> NDArray[np.intp] | None:
    """Which rows have an origin in common, where the cycles of a placement were each set to zero."""
    face, cycle = recording.columns["face"], recording.columns["cycle"]
    own = np.zeros(len(placement), np.intp)
    for number in range(int(placement.max()) + 1):
        rows = placement == number
        if zeroed_face(along_mm[rows], face[rows], cycle[rows]) is not None:
            own[rows] = cycle[rows]
    return np.unique(np.column_stack([placement, own]), axis=0, return_inverse=True)[1].ravel() if own.any() else None


def _lengths_um(recording: Recording, gauge: Gauge, machine: Machine) -> Array:
    """How uncertain the gauge's temperature and expansion make the position of the face of every row, um, ``(c, n)``.

    S alpha u(T) and S (T - T_0) u(alpha), each common to all rows. A thermometer that was not read has none.
    """
    table, at_um = gauge.table, gauge.position_mm[recording.columns["face"] - 1] * 1e3
    u_K = machine.u_gauge_temperature_K() if "gauge_temperature_C" in recording.columns else 0.0
    expanded = warmer_K(recording, gauge) * table.expansion_uncertainty_per_K
    um = np.array([at_um * table.expansion_per_K * u_K, at_um * expanded])
    return um[um.any(axis=1)]


def without_copies(data: Residuals) -> Residuals:
    """The residuals without cycles that repeat an earlier one in every reading."""
    placement, cycle = (data.frame[name].to_numpy() for name in ("placement", "cycle"))
    copied = copied_cycles(placement, cycle, [data.frame[name].to_numpy() for name in POSITION])
    if not copied:
        return data
    kept = ~pd.MultiIndex.from_arrays([placement, cycle]).isin(copied)
    return replace(data.at(kept), copied=tuple(copied))


def stylus_of(frame: pd.DataFrame) -> NDArray[np.int64]:
    """Number of the stylus of every row, 1 where none is recorded."""
    if STYLUS not in frame:
        return np.ones(len(frame), np.int64)
    return np.asarray(np.nan_to_num(np.rint(frame[STYLUS].to_numpy(float)), nan=1.0), np.int64)


def _radius_mm(recording: Recording, machine: Machine) -> Array:
    """Tip radius minus pre-travel of every row ``(n,)``; :class:`InputError` for a stylus that is not stated.

    Readings that had been corrected for the tip have nothing of the machine file's: only what that correction left.
    """
    if (radius := corrected_radius_mm(recording)) is not None:
        return np.full(len(recording), radius)
    styli, approach, radius_mm = stylus_of(recording.frame), recording.approach, np.empty(len(recording))
    for one in np.unique(styli).tolist():
        try:
            own, rows = machine.select_stylus(one), styli == one
        except InputError:
            what = f"the recording was made with stylus {one}, which is not stated"
            expected = naming("further_styli", words="{} with a machine file of each further stylus")
            raise InputError(recording.path, what, expected=expected) from None
        radius_mm[rows] = own.probe.tip_radius_mm - own.sensor.pretravel_um(approach[rows]) * 1e-3
    return radius_mm


def _origin(along_um: Array, placement: NDArray[np.intp]) -> Array:
    """First estimate of the origin of each placement, so that numbers stay small."""
    return np.array([np.median(along_um[placement == i]) for i in range(placement.max() + 1)])
