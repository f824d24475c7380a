"""What a report says, as plain text in plain containers: the one structure that every template prints.

Everything comes from the evaluation, from the files given with it, or from the person who orders the report; what is
missing is listed as not stated, never filled in.
"""

from __future__ import annotations

import datetime
import io
import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from stepgauge import __version__
from stepgauge.certificate_file import Laboratory
from stepgauge.figures.evaluation import describe, evaluation_figure
from stepgauge.figures.style import figure_style
from stepgauge.gauge import Gauge
from stepgauge.machine_file import Machine
from stepgauge.placement import Placement
from stepgauge.report.budget import budget_content, uncertain_faces
from stepgauge.report.certificate import certificate_content, not_stated
from stepgauge.report.numbers import UNDEFINED, clean, number, quantity, uncertain
from stepgauge.report.sections import (
    DATE_MISSING,
    Section,
    certificate_section,
    conditions_section,
    machine_section,
    placement_section,
    radius_section,
    recording_section,
)
from stepgauge.standards.budget_files import StoredBudget
from stepgauge.statements import METHOD

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TITLE, CERTIFICATE_TITLE = "Calibration report", "Calibration certificate"
SUBTITLE = "Linear displacement errors measured with a step gauge"
ERROR_COLUMNS = ("xf", "sf", "xb", "sb", "xm", "xr")


@dataclass(frozen=True)
class Stated:
    """What only a person can say; None where nobody said it."""

    date: datetime.date
    number: str | None = None
    customer: str | None = None
    location: str | None = None
    operator: str | None = None
    remarks: str | None = None


@dataclass(frozen=True)
class Sources:
    """Files given with the evaluation; placements in its order, or none.

    ``laboratory`` makes the report a calibration certificate.
    """

    gauge: Gauge | None = None
    machine: Machine | None = None
    placements: Sequence[Placement] = ()
    budget: StoredBudget | None = None
    laboratory: Laboratory | None = None


def make_content(evaluation: dict[str, Any], stated: Stated, sources: Sources) -> dict[str, Any]:
    """The content of a report.

    Parameters
    ----------
    evaluation : as :func:`stepgauge.report.reading.read_checked_evaluation` gives it
    stated : what the person says
    sources : further files, checked to belong to the evaluation

    Returns
    -------
    Dictionaries and lists of text (``templates/reports`` shows every key); numbers are formatted, figures are SVG. The
    same input gives the same content.
    """
    sections = _sections(evaluation, sources)
    said = sources.laboratory
    return {
        "title": TITLE if said is None else CERTIFICATE_TITLE,
        "subtitle": SUBTITLE,
        "number": _said(stated.number if said is None else said.certificate.number),
        "date": stated.date.isoformat(),
        "date_parts": [stated.date.year, stated.date.month, stated.date.day],
        "example": bool(evaluation["gauge"]["example"]),
        "simulated": "seed" in evaluation["comments"],
        "identity": _identity(evaluation, stated, sources),
        "summary": [_summary(result, sources.budget) for result in evaluation["placements"]],
        "sections": [section.as_dict() for section in sections],
        "remarks": _said(stated.remarks),
        "notes": _notes(evaluation, sources),
        "not_stated": _not_stated(evaluation, stated, sources, sections),
        "method": METHOD,
        "placements": [_placement(result, sources.budget) for result in evaluation["placements"]],
        "signatures": _signatures(stated, said),
        "certificate": None if said is None else certificate_content(evaluation, said, sources.gauge, sources.budget),
        "budget": None if sources.budget is None else budget_content(sources.budget),
        "data": json.dumps(evaluation, indent=1),
        "version": __version__,
    }


def _signatures(stated: Stated, said: Laboratory | None) -> list[dict[str, str | None]]:
    """Places to sign: of a certificate for those who authorise it."""
    if said is None:
        return [{"role": "Measured by", "name": _said(stated.operator)}, {"role": "Approved by", "name": None}]
    signing = [f"{one.name}, {one.role}" if one.role else one.name for one in said.persons if one.signs]
    names: list[str | None] = [clean(name) for name in signing]
    return [{"role": "Authorised by", "name": name} for name in names or [None]]


def _said(text: str | None) -> str | None:
    """Cleaned text; None where nothing but blanks was said."""
    return clean(text) or None if text is not None else None


def _identity(evaluation: dict[str, Any], stated: Stated, sources: Sources) -> list[dict[str, str | None]]:
    machine = sources.machine.table.name if sources.machine else evaluation["comments"].get("machine")
    pairs = (
        ("Report number", stated.number),
        ("Date of report", stated.date.isoformat()),
        ("Customer", stated.customer),
        ("Place of measurement", stated.location),
        ("Machine", machine),
        ("Operator", stated.operator),
    )
    return [{"label": label, "value": _said(value)} for label, value in pairs]


def _summary(result: dict[str, Any], budget: StoredBudget | None) -> dict[str, str]:
    """The result in one line; U of R_eff and the largest of XM are dashes without a budget."""
    lines = [] if budget is None else [q for q in budget.quantities if q.placement == result["placement"]]
    expanded = {
        name: max((q.expanded_um for q in lines if q.quantity == name), default=None) for name in ("r_eff", "xm")
    }
    rows, (fewest, most) = result["faces"], result["cycles"]
    return {
        "placement": str(result["placement"]),
        "blocks": f"{rows[0]['block']} to {rows[-1]['block']}",
        "cycles": str(most) if fewest == most else f"{fewest} to {most}",
        "span": quantity(result["span_mm"], 3, "mm"),
        "band": quantity(result["band_um"], 2, "µm"),
        "two_sigma": quantity(result["worst_two_sigma_um"], 2, "µm"),
        "r_eff": quantity(result["r_eff_mm"], 5, "mm"),
        "u_r_eff": quantity(result["u_r_eff_mm"] * 1e3, 2, "µm"),
        "expanded_r_eff": _expanded(expanded["r_eff"]),
        "expanded_xm": _expanded(expanded["xm"]),
        "band_interval": _band_interval(result["placement"], budget),
    }


def _expanded(value_um: float | None) -> str:
    """An expanded uncertainty to two significant digits; a dash without one."""
    return UNDEFINED if value_um is None else f"{uncertain(None, value_um)[1]} µm"


def _band_interval(placement: int, budget: StoredBudget | None) -> str:
    """95 % interval of the band of XM by Monte Carlo; a dash without one."""
    bands = [] if budget is None else [band for band in budget.bands if band.placement == placement]
    return f"{number(bands[0].low_95_um, 2)} to {quantity(bands[0].high_95_um, 2, 'µm')}" if bands else UNDEFINED


def _sections(evaluation: dict[str, Any], sources: Sources) -> list[Section]:
    placements: list[Placement | None] = [*sources.placements] or [None] * len(evaluation["placements"])
    return [
        certificate_section(evaluation, sources.gauge),
        machine_section(evaluation, sources.machine),
        *(
            placement_section(result, placement)
            for result, placement in zip(evaluation["placements"], placements, strict=True)
        ),
        conditions_section(evaluation, sources.machine),
        radius_section(evaluation, sources.machine, sources.budget),
        recording_section(evaluation),
    ]


def _notes(evaluation: dict[str, Any], sources: Sources) -> list[str]:
    """What the evaluation and the placing remarked, each said once."""
    several = len(evaluation["placements"]) > 1
    notes = []
    for index, result in enumerate(evaluation["placements"]):
        located = sources.placements[index].details.get("notes", []) if sources.placements else []
        prefix = f"Placement {result['placement']}: " if several else ""
        notes += [clean(prefix + note) for note in (*result["notes"], *located)]
    if "seed" in evaluation["comments"]:
        notes.append("The recording was simulated: it names the seed of a virtual machine.")
    return notes


def _not_stated(evaluation: dict[str, Any], stated: Stated, sources: Sources, sections: Sequence[Section]) -> list[str]:
    if sources.laboratory is None:
        asked = (
            ("report number", stated.number),
            ("customer", stated.customer),
            ("place of measurement", stated.location),
            ("operator", stated.operator),
        )
        missing = [what for what, value in asked if not _said(value)]
    else:
        missing = not_stated(sources.laboratory)
    missing += [what for section in sections for what in section.missing]
    if sources.laboratory is not None and sources.laboratory.certificate.performed_to is not None:
        missing = [what for what in missing if what != DATE_MISSING]
    if sources.budget is None:
        missing.append(
            "measurement uncertainty of XF, XB, XM, XR (two sigma is the repeatability of the cycles, no uncertainty)"
        )
    else:
        missing += [f"uncertainty of {gap.what} (not counted)" for gap in sources.budget.not_included]
    return missing


def _placement(result: dict[str, Any], budget: StoredBudget | None) -> dict[str, Any]:
    return {
        "number": str(result["placement"]),
        "caption": f"Placement {result['placement']}: {describe(result)}",
        "figure": figure_svg(evaluation_figure(result)),
        "faces": [_face(row) for row in result["faces"]],
        "uncertain": None if budget is None else uncertain_faces(result, budget),
    }


def figure_svg(figure: Figure) -> str:
    """A figure as SVG, letters as outlines: no font is needed to show it, and the same data give the same text."""
    buffer = io.StringIO()
    with figure_style():
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    return buffer.getvalue()


def _face(row: dict[str, Any]) -> dict[str, Any]:
    """A row of the table: values as text, and which of them are interpolated.

    Two-sigma columns hold twice the standard deviation.
    """
    scale = {"sf": 2.0, "sb": 2.0}
    values = {
        name: number(None if row[f"{name}_um"] is None else scale.get(name, 1.0) * row[f"{name}_um"], 2)
        for name in ERROR_COLUMNS
    }
    return {
        "face": str(row["face"]),
        "block": str(row["block"]),
        "side": row["side"],
        "nominal": number(row["nominal_mm"], 3),
        "position": number(row["position_mm"], 5),
        **values,
        "interpolated": ["xb", "sb"] if row["face"] % 2 else ["xf", "sf"],
        "count": str(row["count"]),
    }
