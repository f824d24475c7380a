"""What the diagnosis of a probe map says, and its form in ``diagnosis.json``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stepgauge.diagnose.maps.data import MapData
from stepgauge.diagnose.maps.model import Terms
from stepgauge.diagnose.maps.select import Step
from stepgauge.diagnose.result import Located, Verdict
from stepgauge.diagnose.solve import Estimate

Array = NDArray[np.float64]


@dataclass(frozen=True)
class MapFinding:
    """A change of the construction.

    ``parameters``: fitted changes and what follows from them; ``confounded_with``: other kinds that this map cannot
    tell from it, with the values they would need; ``rms``: how far it moves each quantity.
    """

    kind: str
    label: str
    choice: str
    parameters: dict[str, Estimate]
    probability: float
    confounded_with: dict[str, dict[str, float]]
    reason: str
    separate_by: str
    rms: dict[str, float]


@dataclass(frozen=True)
class QuantityFit:
    """One quantity before and after: rms, largest share of its value by which it is off, held-out rms.

    ``noise``: rms of the scatter taken; ``quantum``: last printed digit, 0 if none was seen; ``holdout``: what was held
    out -> rms before and after.
    """

    name: str
    unit: str
    noise: float
    quantum: float
    rms_before: float
    rms_after: float
    worst_before: float
    worst_after: float
    holdout: dict[str, tuple[float, float]]
    before: Array
    after: Array


@dataclass(frozen=True)
class MapDiagnosis:
    """The whole answer; ``terms`` are the changes found, ``table`` the ``[probe]`` table with them."""

    verdict: Verdict
    findings: tuple[MapFinding, ...]
    located: tuple[Located, ...]
    unexplained: tuple[Located, ...]
    fits: tuple[QuantityFit, ...]
    chi2_dof_before: float
    chi2_dof_after: float
    scatter: str
    data: MapData
    terms: Terms
    table: dict[str, Any]
    trail: tuple[Step, ...]
    remarks: tuple[str, ...]


def as_json(found: MapDiagnosis) -> dict[str, Any]:
    """The content of ``diagnosis.json``; numbers that do not exist are null."""
    return {
        "verdict": found.verdict,
        "effects": [_effect(each) for each in found.findings],
        "located": [_located(each) for each in found.located],
        "unexplained": [_located(each) for each in found.unexplained],
        "fit": _fit(found),
        "trail": [
            {
                "action": step.action,
                "effect": step.label,
                "chi2_gain": _number(step.gain),
                "log10_p": _number(step.log_p / np.log(10.0)),
                "bic": _number(step.bic),
                "why": step.why,
            }
            for step in found.trail
        ],
        "remarks": list(found.remarks),
        "measured": {"map": found.data.path, "rows": len(found.data), "rows_without_values": found.data.dropped},
    }


def _effect(finding: MapFinding) -> dict[str, Any]:
    return {
        "kind": finding.kind,
        **({"choice": finding.choice} if finding.choice else {}),
        "parameters": {
            name: {"value": _number(p.value), "u": _number(p.u), "unit": p.unit}
            for name, p in finding.parameters.items()
        },
        "probability": _number(finding.probability),
        "confounded_with": list(finding.confounded_with),
        "instead": {kind: _numbers(values) for kind, values in finding.confounded_with.items()},
        "reason": finding.reason,
        "separate_by": finding.separate_by,
        "rms": _numbers(finding.rms),
    }


def _located(located: Located) -> dict[str, Any]:
    return {
        "covariate": located.covariate,
        "side": located.side,
        "form": located.form,
        "where": located.where,
        "share": located.share,
        "p_value": located.p_value,
    }


def _fit(found: MapDiagnosis) -> dict[str, Any]:
    """Per quantity, and with the unit in the name for the first quantity of each unit."""
    quantities = {fit.name: _quantity(fit) for fit in found.fits}
    flat: dict[str, Any] = {}
    for fit in found.fits:
        for key, value in _quantity(fit).items():
            if key in ("noise", "rms_before", "rms_after", "holdout_rms_before", "holdout_rms_after"):
                flat.setdefault(f"{key}_{fit.unit}", value)
    chi2 = {"chi2_dof_before": _number(found.chi2_dof_before), "chi2_dof_after": _number(found.chi2_dof_after)}
    return {**flat, **chi2, "scatter": found.scatter, "quantities": quantities}


def _quantity(fit: QuantityFit) -> dict[str, Any]:
    held = list(fit.holdout.values())
    return {
        "unit": fit.unit,
        "noise": _number(fit.noise),
        "printed_digit": _number(fit.quantum) if fit.quantum else None,
        "rms_before": _number(fit.rms_before),
        "rms_after": _number(fit.rms_after),
        "worst_before_percent": _number(100.0 * fit.worst_before),
        "worst_after_percent": _number(100.0 * fit.worst_after),
        "holdout_rms_before": _number(max((b for b, _ in held), default=np.nan)),
        "holdout_rms_after": _number(max((a for _, a in held), default=np.nan)),
        "holdout": {by: {"rms_before": _number(b), "rms_after": _number(a)} for by, (b, a) in fit.holdout.items()},
    }


def _numbers(values: dict[str, float]) -> dict[str, float | None]:
    return {name: _number(value) for name, value in values.items()}


def _number(value: float | None) -> float | None:
    """Six significant digits, None for what is no number."""
    return float(f"{value:.6g}") if value is not None and np.isfinite(value) else None


def rms(values: Sequence[float] | Array) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(np.square(values))))
