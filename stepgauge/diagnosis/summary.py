"""A diagnosis in a line."""

from __future__ import annotations

from collections.abc import Sequence

from stepgauge.diagnosis.practice import counted, name_of
from stepgauge.diagnosis.result import Diagnosis
from stepgauge.diagnosis.unknown_law import UnknownLaw, rest_rms_um


def summary_line(found: Diagnosis, laws: Sequence[UnknownLaw] = ()) -> str:
    """Verdict, effects and fit in a line; ``laws``: the empirical laws of the forms."""
    fit = found.fit
    names = counted([_name(f.label, (*f.confounded_with, *f.alternatives)) for f in found.findings])
    left = [one.where for one in found.unexplained[:1]]
    said = ", ".join(names + [f"without a law: {where}" for where in left])
    imitated = f"{rest_rms_um(found, laws):.2f} um with the form imitated, " if laws else ""
    numbers = f"rms {fit.rms_before_um:.2f} -> {fit.rms_after_um:.2f} um, {imitated}noise {fit.noise_um:.2f} um"
    return f"{found.verdict}{f': {said}' if said else ''} ({numbers})"


def _name(label: str, others: Sequence[str]) -> str:
    return name_of(label) + (f" (or {', '.join(name_of(kind) for kind in others)})" if others else "")
