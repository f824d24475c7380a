"""Sentences that the printed and the digital certificate share."""

from __future__ import annotations

from typing import Any

from stepgauge.recording.conventions import AT_20, calibrated_object
from stepgauge.reports.certificate_file import Laboratory
from stepgauge.standards.budget_files import StoredBudget

ONLY_ITEMS = "The results relate only to the item calibrated, in the condition and at the time of the calibration."
IN_FULL = "This certificate is not to be reproduced except in full without the written approval of the laboratory."
METHOD = (
    "Positions are those of the centre of the stylus tip, projected on the gauge axis; the front of the first used "
    "block is the reference. "
    "XF is the error at faces probed along the axis (fronts), XB at faces probed against it (backs, less twice the "
    "effective radius), each the mean over the cycles; between two such faces the value is interpolated. "
    "XM = (XF + XB) / 2 is the mean error, XR = XB − XF the reversal, in which a scale error c alone shows as −c P / 2 "
    "(P: pitch of the blocks); s is the standard deviation over the cycles. "
    "The range of XM is its largest minus its smallest value. (H. Pahk and J. Kim, equations 1 to 13.)"
)


def measurand_text(evaluation: dict[str, Any], budget: StoredBudget | None = None) -> str:
    """What was measured, in one sentence (VIM 2.3)."""
    of = calibrated_object(evaluation["comments"], budget is not None and budget.measurand == AT_20)
    faces = evaluation["placements"][0]["faces"]
    first, last = evaluation["blocks"]
    return (
        f"Measurand: the error of indicated position of {of}, along the gauge at the faces of blocks"
        f" {first} to {last} ({faces[0]['position_mm']:.0f} mm to {faces[-1]['position_mm']:.0f} mm), relative to"
        " the front of"
        f" block {first}: XF probed along, XB probed against the gauge axis, mean XM = (XF + XB) / 2, reversal XR"
        " = XB − XF."
    )


def reference_text(evaluation: dict[str, Any]) -> str:
    """The reference standard and its certificate, to which the result is traceable (VIM 5.1)."""
    own = evaluation["gauge"]
    return (
        f"Reference standard: {own['name']}, serial number {own['serial']}, certificate {own['certificate']} of"
        f" {own['laboratory']}, {own['date']}."
    )


def traceability(said: Laboratory, evaluation: dict[str, Any]) -> str:
    """How the results are traceable: through the gauge's certificate, and what the laboratory adds."""
    own = evaluation["gauge"]
    text = (
        f"The lengths are traceable through {own['name']}, serial number {own['serial']}, certificate"
        f" {own['certificate']} of {own['laboratory']}, {own['date']}."
    )
    return f"{text} {said.statements.traceability}" if said.statements.traceability else text


def uncertainty_text(budget: StoredBudget, assumptions: bool = True) -> str:
    """What the expanded uncertainties are, what they leave out and, if asked for, what they assume."""
    factors = [line.k for line in budget.quantities]
    low, high = f"{min(factors):.2f}", f"{max(factors):.2f}"
    text = (
        "Expanded uncertainty U = k u by the Guide to the Expression of Uncertainty in Measurement (JCGM 100:2008); "
        f"k is Student's t for a coverage probability of {budget.coverage_percent:g} % and the effective degrees of "
        f"freedom, here {low if low == high else f'{low} to {high}'}. "
        f"Contributions: {', '.join(source.label for source in budget.sources)}."
    )
    text += "".join(f" Assumed: {one}." for one in budget.assumptions if assumptions)
    if budget.not_included:
        text += f" Contributions not evaluated: {', '.join(gap.what for gap in budget.not_included)}."
    return text
