"""From trigger positions to the indications of the machine: effects, scales, repeatability, and their shares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stepgauge.effects import Effect, Probings, along_approach_um, make_effects, total_displacement_um
from stepgauge.effects.scatter import Outliers
from stepgauge.effects.thermal import UncompensatedScales
from stepgauge.effects.totals import scatter_um
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.gauge.certified import Gauge
from stepgauge.machine.file import Machine
from stepgauge.recording import POSITION, Recording
from stepgauge.recording.conventions import KEY as CONVENTION
from stepgauge.recording.conventions import REFERENCE_C

if TYPE_CHECKING:
    import pandas as pd

SHARE = "share_{}_um"
TOTAL_SHARE = SHARE.format("total")


@dataclass(frozen=True)
class ReadOut:
    """Displacements that the machine adds to the trigger positions.

    ``displacement_um (n, 3)`` in machine axes; ``noise (n,)`` standard normal numbers of the repeatability.
    """

    displacement_um: Array
    effects: Sequence[Effect]
    probings: Probings
    repeatability_um: float
    noise: Array

    def shares_um(self) -> pd.DataFrame:
        """The share of every effect and of the repeatability along the approach, um, and their total, by row.

        The total is the projection of what was added to the coordinates, not the sum of the other columns.
        """
        import pandas as pd

        shares: dict[str, Array] = {}
        steps = scatter_um(self.effects, self.probings, self.repeatability_um)
        for effect, before, after in zip(self.effects, steps[:-1], steps[1:], strict=True):
            share = along_approach_um(effect, self.probings) + (after - before) * self.noise
            shares[_new_name(effect.label, shares)] = share
        shares["repeatability"] = steps[0] * self.noise
        approach = [self.probings.approach(axis) for axis in "xyz"]
        total = sum(um * p for um, p in zip(self.displacement_um.T, approach, strict=True))
        columns = {SHARE.format(name): um for name, um in shares.items()}
        return pd.DataFrame({**columns, TOTAL_SHARE: total})


def machine_effects(machine: Machine) -> list[Effect]:
    """The effects of a machine file, with that of its scales if their temperature is not compensated."""
    effects = make_effects(machine.effects, machine.path)
    if machine.table.scales_compensated:
        return effects
    return [UncompensatedScales(temperature_C=machine.table.temperature_C), *effects]


def read_out(probings: Probings, machine: Machine, random: np.random.Generator) -> ReadOut:
    """Displacement of all probings by the machine's effects and, along the approach, by its repeatability.

    :class:`InputError` names the machine file and an effect that cannot be computed for these probings.
    """
    effects = machine_effects(machine)
    try:
        displacement_um = total_displacement_um(effects, probings)
        sigma_um = scatter_um(effects, probings, machine.table.virtual_repeatability_um)[-1]
    except InputError as error:
        raise error.at(f"{machine.path}: {error.where}") from None
    noise = random.standard_normal(len(probings)) if np.any(sigma_um) else np.zeros(len(probings))
    noise_um = sigma_um * noise
    for column, axis in enumerate("xyz"):
        displacement_um[:, column] += noise_um * probings.approach(axis)
    return ReadOut(displacement_um, effects, probings, machine.table.virtual_repeatability_um, noise)


def rows_beyond(effects: Sequence[Effect], n_rows: int, path: str) -> tuple[str, ...]:
    """A note for every effect with row numbers beyond the ``n_rows`` of the recording: these have no influence."""
    notes = []
    for effect in effects:
        beyond = [row for row in effect.rows if row > n_rows] if isinstance(effect, Outliers) else []
        if beyond:
            rows = ", ".join(map(str, beyond))
            notes.append(f"{path}: effect outliers: rows {rows} do nothing, the recording has {n_rows}")
    return tuple(notes)


def _new_name(label: str, taken: dict[str, Array]) -> str:
    """The label, numbered from the second effect of that name on."""
    number = 2
    name = label
    while name in taken:
        name = f"{label}_{number}"
        number += 1
    return name


def correct_temperature(recording: Recording, machine: Machine, gauge: Gauge, origin_mm: Array) -> Recording:
    """The readings of a virtual CMM as its machine hands them over, with its convention in their comments.

    One that corrects readings to 20 deg C takes off the expansion of the gauge at its recorded temperature, by the
    coefficient of the certificate, about ``origin_mm (3,)``, mm. The shares of the effects are those before it.
    """
    stated = machine.table.temperature_convention or "as_read"
    recording = recording.assign_comments(**{CONVENTION: stated})
    if stated != "corrected_to_20" or "gauge_temperature_C" not in recording.columns:
        return recording
    warmer_K = np.asarray(recording.columns["gauge_temperature_C"], float)[:, None] - REFERENCE_C
    position = origin_mm + (recording.position_mm - origin_mm) / (1.0 + gauge.table.expansion_per_K * warmer_K)
    return recording.assign_columns(**dict(zip(POSITION, position.T, strict=True)))
