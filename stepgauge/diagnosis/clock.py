"""The clock of a recording that had run long before the first touch: since 1970, since midnight, since switching on.

Then a drift since the zero of the clock is practically constant, and the phase of an oscillation at this zero depends
on its period through thousands of cycles. So the search counts time from the first touch, and results are converted to
the clock.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from stepgauge.diagnosis.fits.solve import Estimate
from stepgauge.diagnosis.residuals import Residuals
from stepgauge.diagnosis.result import Finding
from stepgauge.effects import Effect, Probings

LONG = 0.1
"""Latest time of the first touch, over the duration, at which the clock counts as started with the measurement."""
UNTOLD_DEG = 360.0 / math.sqrt(12.0)
"""Standard deviation of an unknown phase."""


def clock_start_s(data: Residuals) -> float:
    """Time of the clock at the first touch, s; 0 if it started with the measurement, or if there is none."""
    if not data.has_time:
        return 0.0
    time_s = data.frame["time_s"]
    first, last = float(time_s.min()), float(time_s.max())
    return 0.0 if 0.0 <= first <= LONG * (last - first) else first


def counted_from(data: Residuals, start_s: float) -> Residuals:
    """The same residuals with all times counted from a time of the clock, s."""
    if start_s == 0.0:
        return data
    time_s = data.frame["time_s"] - start_s
    probings = Probings({**data.columns, "time_s": time_s.to_numpy()}, data.probings.setting)
    return replace(data, frame=data.frame.assign(time_s=time_s), probings=probings)


def on_recording_clock(finding: Finding, start_s: float) -> Finding:
    """A finding whose times were counted from a time of the clock, s, converted to the clock."""
    effect = finding.effect
    if start_s == 0.0:
        return finding
    choices = dict(finding.choices)
    if effect is None:
        return replace(finding, choices=choices)
    times = [p.name for p in effect.parameters() if p.clock]
    for name in times:
        if isinstance(since := getattr(effect, name), float) and name not in finding.parameters:
            choices[name] = since + start_s
    moved: dict[str, Any] = {name: getattr(effect, name) + start_s for name in times}
    if effect.when is not None and effect.when.startswith("time_s "):
        name, sense, edge = effect.when.split()
        moved["when"] = f"{name} {sense} {float(edge) + start_s:.12g}"
    parameters = dict(finding.parameters)
    for name in set(times) & set(parameters):
        parameters[name] = replace(parameters[name], value=parameters[name].value + start_s)
    phase = effect.phase()
    if phase is not None and phase.name in parameters and _turns(effect, start_s):
        parameters[phase.name] = _phase(effect, parameters, start_s)
        moved[phase.name] = parameters[phase.name].value
    where = moved.get("when", finding.where)
    return replace(finding, effect=effect.replace_values(**moved), choices=choices, parameters=parameters, where=where)


def _turns(effect: Effect, start_s: float) -> float:
    """Cycles of an oscillation in time since the zero of the clock; 0 for one along the travel."""
    name, inverse = effect.rhythm()
    if "time" not in effect.covariates or not name:
        return 0.0
    rate = float(getattr(effect, name))
    return start_s * rate if inverse else start_s / rate


def _phase(effect: Effect, parameters: dict[str, Estimate], start_s: float) -> Estimate:
    """The phase at the zero of the clock, without an uncertainty if the period does not determine it."""
    declared = effect.phase()
    assert declared is not None
    phase, turns, rate = parameters[declared.name], _turns(effect, start_s), parameters[effect.rhythm()[0]]
    value = (phase.value - 360.0 * turns + 180.0) % 360.0 - 180.0
    if phase.u is None or rate.u is None:
        return replace(phase, value=value, u=None)
    u = math.hypot(phase.u, 360.0 * turns * rate.u / rate.value)
    return replace(phase, value=value, u=u if u < UNTOLD_DEG else None)
