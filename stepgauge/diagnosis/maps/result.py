"""The result of the diagnosis of a probe map."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.maps.data import MapData, Measured
from stepgauge.diagnosis.maps.model import Terms
from stepgauge.diagnosis.maps.scatter import MapScatter
from stepgauge.diagnosis.result import Finding, Located, StatedDiagnosis, rms
from stepgauge.files.arrays import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class QuantityFit:
    """One quantity of a map: its residuals, and what they are without outliers.

    ``noise``: rms of the scatter of the rows; ``before``: residuals ``(n,)``; ``after``: with the named changes;
    ``described``: also without structure; ``kept (n,)``: rows that are no outliers.
    """

    measured: Measured
    noise: float
    before: Array
    after: Array
    described: Array
    kept: NDArray[np.bool_]

    @property
    def name(self) -> str:
        """Of the quantity, with its unit."""
        return self.measured.name

    @property
    def unit(self) -> str:
        """Of the quantity."""
        return self.measured.unit

    @property
    def scale(self) -> float:
        """What residuals are measured by: the noise, or the last digit where that is not known."""
        return self.noise or self.measured.quantum or 1.0

    @property
    def stages(self) -> dict[str, Array]:
        """The residuals without outliers, by stage."""
        stages = {"before": self.before, "after": self.after, "described": self.described}
        return {name: values[self.kept] for name, values in stages.items()}

    def rms(self, stage: str) -> float:
        """Rms of the residuals ``before``, ``after`` or ``described``."""
        return rms(self.stages[stage])

    def worst(self, stage: str) -> float:
        """Largest residual as a share of the measured value."""
        values = self.measured.values[self.kept]
        positive = values > 0.0
        return float(np.max(np.abs(self.stages[stage][positive]) / values[positive], initial=0.0))


@dataclass(frozen=True, repr=False, kw_only=True)
class MapDiagnosis(StatedDiagnosis):
    """The diagnosis of the map of a probe.

    ``share_um`` of the findings has all quantities one after the other, each in its own unit. ``data`` has all rows,
    ``kept (n,)`` marks those that are not outliers; ``terms`` are the changes found, ``probe``
    is the original ``[probe]`` table, ``table`` that with the changes, ``probe_path`` the file that was judged.
    """

    drawn_by: ClassVar[str] = "probe_diagnosis.draw_residuals"
    fits: tuple[QuantityFit, ...]
    chi2_dof_before: float
    chi2_dof_after: float
    noise: MapScatter
    data: MapData
    kept: NDArray[np.bool_]
    probe: dict[str, Any]
    table: dict[str, Any]
    terms: Terms = ()
    lacking: tuple[str, ...] = ()
    probe_path: str = ""

    def shares(self, finding: Finding | Located) -> dict[str, Array]:
        """What a finding or a form adds to each quantity, ``(n,)`` by name, in the unit of the quantity."""
        names = [fit.name for fit in self.fits]
        return dict(zip(names, np.split(finding.share_um, len(names)), strict=True))

    @cached_property
    def contents(self) -> dict[str, Any]:
        """All that is stated, in JSON types."""
        from stepgauge.diagnosis.maps.output import map_to_dict

        return map_to_dict(self)

    def figures(self) -> dict[str, Figure]:
        """Residuals, directions and effects, by the names of their files."""
        from stepgauge.figures.probe_diagnosis import figures_of

        return figures_of(self)

    def outputs(self, folder: Path) -> tuple[Mapping[str, Any], Mapping[str, str]]:
        from stepgauge.diagnosis.maps.output import map_outputs

        return map_outputs(self, folder)
