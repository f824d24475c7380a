"""The result of the diagnosis of a probe map."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnosis.fits.solve import Estimate
from stepgauge.diagnosis.maps.data import MapData
from stepgauge.diagnosis.maps.model import Terms
from stepgauge.diagnosis.maps.scatter import MapScatter
from stepgauge.diagnosis.result import Check, Diagnosis, Finding, Located, Verdict
from stepgauge.files.arrays import Array
from stepgauge.files.outputs import open_set
from stepgauge.inference.search import Step

if TYPE_CHECKING:
    from matplotlib.figure import Figure

OUTLIERS = "outliers"


@dataclass(frozen=True)
class EmpiricalMapLaw:
    """A form as an empirical law of the probe file; ``share (n,)`` in the unit of the quantity."""

    located: Located
    quantity: str
    unit: str
    formula: str
    coefficients: dict[str, Estimate]
    share: Array


@dataclass(frozen=True)
class QuantityFit:
    """One quantity before and after: rms, largest relative residual, held-out rms.

    ``noise``: rms of the scatter of the rows; ``quantum``: resolution of the printed values, 0 if none was seen;
    ``holdout``: groups held out -> rms before and after. ``after`` is with the named changes, ``described`` also with
    the empirical laws; no rms includes outliers.
    """

    name: str
    unit: str
    noise: float
    quantum: float
    rms_before: float
    rms_after: float
    rms_described: float
    worst_before: float
    worst_after: float
    holdout: dict[str, tuple[float, float]]
    holdout_described: dict[str, float]
    before: Array
    after: Array
    described: Array


@dataclass(frozen=True, repr=False)
class MapDiagnosis(Diagnosis):
    """The diagnosis of the map of a probe.

    ``share_um`` of the findings has all quantities one after the other, each in its own unit. ``data`` has all rows,
    ``kept (n,)`` marks those that are not outliers; ``terms`` are the changes found, with the empirical laws, ``probe``
    is the original ``[probe]`` table, ``table`` that with the changes, ``probe_path`` the file that was judged.
    """

    drawn_by: ClassVar[str] = "probe_diagnosis.draw_residuals"
    verdict: Verdict
    fits: tuple[QuantityFit, ...]
    chi2_dof_before: float
    chi2_dof_after: float
    noise: MapScatter
    data: MapData
    kept: NDArray[np.bool_]
    probe: dict[str, Any]
    table: dict[str, Any]
    terms: Terms = ()
    findings: tuple[Finding, ...] = ()
    located: tuple[Located, ...] = ()
    unexplained: tuple[Located, ...] = ()
    laws: tuple[EmpiricalMapLaw, ...] = ()
    trail: tuple[Step, ...] = ()
    remarks: tuple[str, ...] = ()
    refuted: tuple[str, ...] = ()
    lacking: tuple[str, ...] = ()
    odds: dict[str, Any] = field(default_factory=dict)
    checks: tuple[Check, ...] = ()
    probe_path: str = ""

    path: str = ""

    def shares(self, finding: Finding) -> dict[str, Array]:
        """What a finding adds to each quantity, ``(n,)`` by name, in the unit of the quantity."""
        names = [fit.name for fit in self.fits]
        return dict(zip(names, np.split(finding.share_um, len(names)), strict=True))

    @cached_property
    def said(self) -> dict[str, Any]:
        """All that is stated, in JSON types."""
        from stepgauge.diagnosis.maps.said import as_json

        return as_json(self, self.probe_path)

    def figures(self) -> dict[str, Figure]:
        """Residuals, directions and effects, by the names of their files."""
        from stepgauge.figures.probe_diagnosis import figures_of

        return figures_of(self)

    def write(self, folder: str | Path, figure: str = "png") -> list[Path]:
        """Write ``diagnosis.json``, ``diagnosis.md``, the changed probe file and the figures; returns the paths."""
        from stepgauge.diagnosis.maps.output import write_map_diagnosis

        with open_set():
            return write_map_diagnosis(self, self.probe_path, folder, figure)
