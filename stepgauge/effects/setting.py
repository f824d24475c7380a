"""What all probings of a recording have in common: machine, gauge, probe, and what the recording is of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from stepgauge.files.arrays import Array

if TYPE_CHECKING:
    from stepgauge.gauge.certified import Gauge
    from stepgauge.machine.file import Machine
    from stepgauge.physics.chain import Chain
    from stepgauge.probes import Probe
    from stepgauge.probes.schema import ProbeTable

CARRIER_MM = 14.5
"""From the root of a stylus to the contacts of its probe (Rodrigues 2021, OMP40-2)."""


@dataclass(frozen=True)
class Setting:
    """Data that are common to all probings.

    ``travel_mm (3, 2)``: lowest and highest x, y, z; ``gauge``: the certificate; ``axis``: the true gauge axis by
    placement number (without it front faces are assumed to be probed along the axis and back faces against it);
    ``chain``: of the machine's axes, where it is known; ``styli``: the setting with each further stylus by its
    number in the column ``stylus``; ``longer_mm``: by how much such a stylus is longer than that of the machine
    file; ``recording``: what it is of (:data:`.base.RECORDINGS`); ``turn_mm``: a turn of a rotary axis; ``step_mm``:
    the step of targets that lie evenly.
    """

    travel_mm: Array
    gauge: Gauge | None = None
    probe: ProbeTable | None = None
    sensor: Probe | None = None
    axis: Mapping[int, Array] = field(default_factory=dict)
    scale_expansion_per_K: float | Array = 11.5e-6
    chain: Chain | None = None
    styli: Mapping[int, Setting] = field(default_factory=dict)
    longer_mm: float = 0.0
    recording: str = "gauge"
    turn_mm: float | None = None
    step_mm: float | None = None

    @classmethod
    def of(cls, machine: Machine, gauge: Gauge | None = None, axis: Mapping[int, Array] | None = None) -> Setting:
        """The setting from a machine file and a gauge."""
        expansion = machine.table.scale_expansion_per_K
        own = cls(machine.travel_mm, gauge, machine.probe, machine.sensor, axis or {}, expansion, machine.chain)
        styli = {number: own._shift_limits(other) for number, other in enumerate(machine.styli, 2)}
        return replace(own, styli=styli) if styli else own

    def _shift_limits(self, other: Machine) -> Setting:
        """The carriages travel as before: the limits of the tip are shifted by as much as the tip is elsewhere."""
        assert self.probe is not None
        own, its = self.chain, other.chain
        shift = np.zeros(3) if own is None or its is None else np.subtract(its.tip_mm, own.tip_mm)
        longer_mm = other.probe.shank_length_mm - self.probe.shank_length_mm
        travel_mm = self.travel_mm + shift[:, None]
        return replace(
            self, travel_mm=travel_mm, probe=other.probe, sensor=other.sensor, chain=its, longer_mm=longer_mm
        )

    @property
    def compliance(self) -> float:
        """Compliance of this stylus over that of the machine file's: a beam's grows with the third power of length."""
        if not self.longer_mm or self.probe is None:
            return 1.0
        length_mm = self.probe.shank_length_mm
        return (length_mm / (length_mm - self.longer_mm)) ** 3

    @property
    def pretravel(self) -> float:
        """Pre-travel by the same trigger moment: compliance over lever; the contacts are CARRIER_MM beyond the root."""
        if not self.longer_mm or self.probe is None:
            return 1.0
        lever_mm = self.probe.shank_length_mm + CARRIER_MM
        return self.compliance * (lever_mm - self.longer_mm) / lever_mm
