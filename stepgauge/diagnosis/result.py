"""The result of a diagnosis, before it is written to files."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from stepgauge.diagnosis.fits.solve import Estimate
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.effects import Effect
from stepgauge.files.outputs import open_set
from stepgauge.files.shown import Shown, as_lines
from stepgauge.inference.search import Step
from stepgauge.recording import Recording

if TYPE_CHECKING:
    from stepgauge.diagnosis.forms.formula import UnknownLaw

Array = NDArray[np.float64]
NUMBERS = ["kind", "effect", "probability", "parameter", "value", "u", "unit"]
"""Columns of the table of a diagnosis."""
Verdict = Literal["adequate", "effects", "unknown", "insufficient"]


@dataclass(frozen=True)
class Noise:
    """Scatter of a single probing.

    ``sigma_um``: standard deviation of a typical row; ``by_row_um (n,)``: of each row, infinite for outliers;
    ``dof``: its degrees of freedom; ``outliers``: indices of rows; ``repeats``: whether faces were
    repeated, and repeats show it; ``least``: whether less is left than the least that a reading can have.
    """

    sigma_um: float
    by_row_um: Array
    dof: int
    outliers: NDArray[np.intp]
    repeats: bool
    least: bool = False


@dataclass(frozen=True)
class FindingMember:
    """One law of a set: its label, share of the set's probability, and its own values."""

    kind: str
    label: str
    share: float
    effect: Effect
    choices: dict[str, object]
    parameters: dict[str, Estimate]


@dataclass(frozen=True)
class Replacement:
    """Laws that may be in place of a finding, and of ``others`` with it; their odds against what is stated."""

    laws: tuple[str, ...]
    others: tuple[str, ...]
    odds: float


@dataclass(frozen=True)
class Finding:
    """A named effect.

    ``effect``: ready for a machine file; ``effects``: those of a finding that is many errors at once; ``choices``:
    axis, plane, face, ... ; ``own``: its probability, ``probability``: with all of ``confounded_with``, the other kinds
    that this recording cannot discriminate from it; ``alternatives``: other choices of the same kind;
    ``members``: all of the set with their own values; ``several``: laws that may replace it together; ``where``: the
    part of the record in which it acts, empty for all of it; ``reason``: why the set cannot be discriminated;
    ``share_um (n,)``: its displacement.
    """

    kind: str
    label: str
    effect: Effect | None
    choices: dict[str, object]
    parameters: dict[str, Estimate]
    probability: float
    share_um: Array
    own: float = 1.0
    confounded_with: tuple[str, ...] = ()
    alternatives: tuple[str, ...] = ()
    members: tuple[FindingMember, ...] = ()
    several: tuple[Replacement, ...] = ()
    where: str = ""
    reason: str = ""
    separate_by: str = ""
    effects: tuple[Effect, ...] = ()


@dataclass(frozen=True)
class Located:
    """Where residuals are systematic: covariate, side, form, in words, share of the structure, probability.

    ``beside``: a second covariate that the form depends on; ``numbers``: numbers of the form: a period, a lag.
    """

    covariate: str
    side: str
    form: str
    where: str
    share: float
    probability: float
    beside: str = ""
    numbers: Any = None


@dataclass(frozen=True)
class Fit:
    """Agreement of simulation and recording before and after, um."""

    noise_um: float
    noise_dof: int
    rms_before_um: float
    rms_after_um: float
    holdout: dict[str, tuple[float, float]]
    chi2_dof_before: float
    chi2_dof_after: float


@dataclass(frozen=True)
class Check:
    """One part of the posterior predictive check: its name, and the deviation in standard deviations."""

    name: str
    deviation: float
    passed: bool
    words: str


@dataclass(frozen=True)
class Diagnosis(Shown):
    """The whole result; ``before_um`` and ``after_um`` are the residuals without origins.

    ``placements``: texts of placement files for the runs that ``separate_by`` of the findings proposes, by file name;
    ``refuted``: the odds against the law nearest to the unexplained forms; ``odds``: probabilities of all
    statements; ``checks``: the posterior predictive check.
    """

    drawn_by: ClassVar[str] = "diagnosis.draw_residuals"
    verdict: Verdict
    findings: tuple[Finding, ...]
    located: tuple[Located, ...]
    unexplained: tuple[Located, ...]
    fit: Fit
    noise: Noise
    data: Residuals
    before_um: Array
    after_um: Array
    trail: tuple[Step, ...]
    placements: dict[str, str] = field(default_factory=dict)
    remarks: tuple[str, ...] = field(default_factory=tuple)
    refuted: tuple[str, ...] = field(default_factory=tuple)
    odds: dict[str, Any] = field(default_factory=dict)
    checks: tuple[Check, ...] = ()
    recordings: tuple[Recording, ...] = ()

    @cached_property
    def laws(self) -> list[UnknownLaw]:
        """The empirical laws of the forms that no known effect explains."""
        from stepgauge.diagnosis.forms.formula import model_unknown

        return model_unknown(self)

    def summary(self) -> str:
        """Verdict, effects and fit in a line."""
        from stepgauge.diagnosis.output.summary import summary_line

        return as_lines(summary_line(self, self.laws))

    def to_frame(self) -> pd.DataFrame:
        """One row per number of a finding: probability of the finding, value, standard uncertainty u, and the unit."""
        rows = [
            {"kind": one.kind, "effect": one.label, "probability": one.probability, "parameter": name, **number}
            for one in self.findings
            for name, number in _numbers(one)
        ]
        return pd.DataFrame(rows, columns=NUMBERS)

    def write(self, folder: str | Path, figure: str = "png") -> list[Path]:
        """Write ``diagnosis.json``, ``diagnosis.md``, the diagnosed machine file and the figures; returns the paths."""
        from stepgauge.diagnosis.output.files import write_diagnosis

        with open_set():
            return write_diagnosis(folder, self, self.recordings, figure, self.laws)


def _numbers(finding: Finding) -> Iterator[tuple[str, dict[str, object]]]:
    """The parameters of a finding; one without any has a row all the same."""
    for name, estimate in finding.parameters.items():
        yield name, {"value": estimate.value, "u": estimate.u, "unit": estimate.unit}
    if not finding.parameters:
        yield "", {"value": math.nan, "u": math.nan, "unit": ""}


def rms(values: Sequence[float] | Array) -> float:
    """Root mean square, NaN of nothing."""
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else float("nan")
