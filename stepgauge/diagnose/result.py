"""What a diagnosis says, before it is written down."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnose.noise import Noise
from stepgauge.diagnose.residuals import Residuals
from stepgauge.diagnose.select import Step
from stepgauge.diagnose.solve import Estimate
from stepgauge.effects import Effect

Array = NDArray[np.float64]
Verdict = Literal["adequate", "effects", "unknown", "insufficient"]


@dataclass(frozen=True)
class Finding:
    """A named effect.

    ``effect``: ready for a machine file; ``choices``: axis, plane, face, ... ; ``confounded_with``: other kinds that
    this recording cannot tell from it; ``alternatives``: other choices of the same kind; ``reason``: why, in words;
    ``share_um (n,)``: its displacement along the approach.
    """

    kind: str
    label: str
    effect: Effect | None
    choices: dict[str, object]
    parameters: dict[str, Estimate]
    probability: float
    share_um: Array
    confounded_with: tuple[str, ...] = ()
    alternatives: tuple[str, ...] = ()
    reason: str = ""
    separate_by: str = ""


@dataclass(frozen=True)
class Located:
    """Where disagreement lives: covariate, side, form in words, share of the structure, significance.

    ``period``: of a wave with corners, in the covariate's unit.
    """

    covariate: str
    side: str
    form: str
    where: str
    share: float
    p_value: float
    period: float | None = None


@dataclass(frozen=True)
class Fit:
    """How well simulation and recording agree before and after, um."""

    noise_um: float
    noise_dof: int
    rms_before_um: float
    rms_after_um: float
    holdout: dict[str, tuple[float, float]]
    chi2_dof_before: float
    chi2_dof_after: float


@dataclass(frozen=True)
class Diagnosis:
    """The whole answer; ``before_um`` and ``after_um`` are the residuals, origins taken out.

    ``placements``: texts of placement files for the runs that ``separate_by`` of the findings proposes, by file name;
    ``refuted``: what speaks against the law that comes nearest to what is unexplained.
    """

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
