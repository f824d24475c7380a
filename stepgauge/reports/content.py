"""Content of the report of an evaluation, as plain text in plain containers.

Everything comes from the evaluation, from the files given with it, or from the person who orders the report; what is
missing is listed as not stated, never filled in. It is a calibration certificate only where a laboratory stated who,
what and when and no contribution of the uncertainty budget is missing; else it is a report of measurement.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from stepgauge.figures.budget import budget_figure
from stepgauge.figures.evaluation import describe, evaluation_figure
from stepgauge.files.notation import UNDEFINED, clean, number, printed, printed_unit, quantity, uncertainty
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.machine.file import Machine
from stepgauge.reports.certificate import closing_sections, end_mark, identity_sections, not_stated
from stepgauge.reports.certificate_file import Laboratory, is_example
from stepgauge.reports.page import (
    Page,
    PrintedTable,
    TableColumn,
    UserStatements,
    identity_section,
    measured_and_approved,
    unsaid,
)
from stepgauge.reports.result_table import faces_table, result_table, warnings
from stepgauge.reports.sections import (
    DATE_MISSING,
    Section,
    certificate_section,
    conditions_section,
    machine_section,
    placement_section,
    radius_section,
    recording_section,
    u_of_radius,
)
from stepgauge.reports.statements import METHOD, measurand_text, reference_text
from stepgauge.standards.budget_files import StoredBudget, StoredLine, StoredSource, dof_text, farthest, label
from stepgauge.standards.conformity import conformity
from stepgauge.standards.mpe import Mpe

TITLE, CERTIFICATE_TITLE = "Report of measurement", "Calibration certificate"
SUBTITLE = "Linear displacement errors measured with a step gauge"
BUDGET_MISSING = "measurement uncertainty of XF, XB, XM, XR (2s is the repeatability of the cycles, not an uncertainty)"


@dataclass(frozen=True)
class Sources:
    """Files given with the evaluation; placements in its order, or none.

    ``mpe``: that the errors are judged by; ``laboratory`` makes the report a calibration certificate, if the ``budget``
    is complete.
    """

    gauge: Gauge | None = None
    machine: Machine | None = None
    placements: Sequence[Placement] = ()
    budget: StoredBudget | None = None
    laboratory: Laboratory | None = None
    mpe: Mpe | None = None

    @property
    def certifies(self) -> bool:
        """Whether this may be called a calibration certificate."""
        return self.laboratory is not None and self.budget is not None and not self.budget.not_included


def make_content(evaluation: dict[str, Any], stated: UserStatements, sources: Sources) -> dict[str, Any]:
    """The content of a report.

    Parameters
    ----------
    evaluation : as :func:`stepgauge.reports.reading.read_checked_evaluation` gives it
    stated : statements of the user
    sources : further files, checked to belong to the evaluation

    Returns
    -------
    Dictionaries and lists of text (:class:`stepgauge.reports.page.Page` shows every key); numbers are formatted,
    figures are SVG. The same input gives the same content.
    """
    laboratory, budget, placed = sources.laboratory, sources.budget, evaluation["placements"]
    judged = None if sources.mpe is None else conformity(evaluation, budget, sources.mpe)
    warned = warnings(evaluation, budget, sources.machine, laboratory is not None)
    sections = _sections(evaluation, sources)
    title = CERTIFICATE_TITLE if sources.certifies else TITLE
    page = Page(
        title,
        SUBTITLE,
        _identity(evaluation, stated, sources),
        result_table(evaluation, budget),
        ("evaluation.json", evaluation),
        warnings=[one for one in warned if judged is None or one != judged.prevented],  # the decision says it already
        overall="" if judged is None else judged.text,
        statements=[measurand_text(evaluation, budget), *([] if laboratory else [reference_text(evaluation)])],
        figures=[
            (evaluation_figure(result, sources.mpe), f"Placement {result['placement']}: {describe(result)}")
            for result in placed
        ],
        sections=sections,
        tables=[*(faces_table(result, budget, judged) for result in placed), *budget_tables(budget)],
        lists=[("Notes", _notes(evaluation, sources)), ("Assumptions of the budget", _assumptions(budget))],
        closing=[] if laboratory is None else closing_sections(evaluation, laboratory, budget, judged),
        method=METHOD,
        not_stated=_not_stated(evaluation, stated, sources, sections),
        signatures=measured_and_approved(stated) if laboratory is None else _authorised(laboratory),
        end=None if laboratory is None else end_mark(laboratory, title),
        issued=None if laboratory is None else _issued(laboratory),
        example=is_example(laboratory, evaluation),
        mark=(laboratory and laboratory.certificate.mark) or "",
        own=[] if laboratory is None else laboratory.words,
        more={"summary": [_summary(result, budget) for result in placed]},
    )
    number = stated.number if laboratory is None else laboratory.certificate.number
    return page.to_dict(replace(stated, number=number))


def _authorised(laboratory: Laboratory) -> list[tuple[str, str | None]]:
    """Places to sign for those who authorise a certificate."""
    signing = [f"{one.name}, {one.role}" if one.role else one.name for one in laboratory.persons if one.signs]
    return [("Authorised by", name) for name in signing] or [("Authorised by", None)]


def _issued(laboratory: Laboratory) -> str:
    issued = laboratory.certificate.issued
    return issued.isoformat() if issued else "no date of issue stated"


def _identity(evaluation: dict[str, Any], stated: UserStatements, sources: Sources) -> list[Section]:
    if sources.laboratory is not None:
        return identity_sections(evaluation, sources.laboratory)
    machine = sources.machine.table.name if sources.machine else evaluation["comments"].get("machine")
    return [identity_section(stated, machine)]


def _assumptions(budget: StoredBudget | None) -> list[str]:
    return [] if budget is None else budget.assumptions


def _summary(result: dict[str, Any], budget: StoredBudget | None) -> dict[str, str]:
    """The result by name, for people's own templates; a dash where there is no budget."""
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
        "u_r_eff": u_of_radius(result),
        "expanded_r_eff": _expanded(expanded["r_eff"]),
        "expanded_xm": _expanded(expanded["xm"]),
    }


def _expanded(value_um: float | None) -> str:
    """An expanded uncertainty to two significant digits; a dash without one."""
    return UNDEFINED if value_um is None else f"{uncertainty(value_um)} µm"


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
    """Remarks of evaluation and placement, each once."""
    several = len(evaluation["placements"]) > 1
    notes = []
    for index, result in enumerate(evaluation["placements"]):
        located = sources.placements[index].details.get("notes", []) if sources.placements else []
        prefix = f"Placement {result['placement']}: " if several else ""
        notes += [printed(clean(prefix + note)) for note in (*result["notes"], *located)]
    return notes


def _not_stated(
    evaluation: dict[str, Any], stated: UserStatements, sources: Sources, sections: Sequence[Section]
) -> list[str]:
    missing = unsaid(stated) if sources.laboratory is None else not_stated(evaluation, sources.laboratory)
    missing += [what for section in sections for what in section.missing]
    if sources.laboratory is not None and sources.laboratory.certificate.performed_to is not None:
        missing = [what for what in missing if what != DATE_MISSING]
    return [*missing, BUDGET_MISSING] if sources.budget is None else missing


ERRORS = ("xf", "xb", "xm", "xr")
NOTE = (
    "Contributions to the standard uncertainty, each with the sensitivity of its quantity; ν: effective degrees of"
    " freedom. R_eff is found from readings and certified positions that the errors need, too: its share is part of"
    " theirs, not a further one."
)


def budget_tables(budget: StoredBudget | None) -> list[PrintedTable]:
    """A table per placement; none without a budget."""
    if budget is None:
        return []
    return [_placement(budget, number) for number in sorted({line.placement for line in budget.quantities})]


def _placement(budget: StoredBudget, placement: int) -> PrintedTable:
    found = [budget.find("r_eff", placement, None), *(farthest(budget, placement, name) for name in ERRORS)]
    lines = [line for line in found if line is not None]
    columns = [
        TableColumn("Source", words=True),
        TableColumn("Type", words=True),
        TableColumn("Standard uncertainty", words=True),
        TableColumn("ν", words=True),
        *(TableColumn(label(line).split(" at ")[0], "µm", place=_place(line)) for line in lines),
    ]
    sources, totals = [_source(source, lines) for source in budget.sources], _totals(lines, budget)
    return PrintedTable(
        f"Uncertainty budget, placement {placement}",
        columns,
        [*sources, *([name, "", "", "", *values] for name, values, _ in totals)],
        NOTE + _range_note(budget, placement),
        strong=[len(sources) + i for i, (_, _, strong) in enumerate(totals) if strong],
        ruled=[len(sources)],
        stripe=0,
        figure=(budget_figure(budget, placement), _caption(budget, placement)),
    )


def _place(line: StoredLine) -> str:
    return "" if line.face is None else f"face\u00a0{line.face}, {number(line.position_mm, 0)}\u00a0mm"


def _caption(budget: StoredBudget, placement: int) -> str:
    tail = ", with the Monte Carlo beside it" if budget.monte_carlo_runs else ""
    return (
        f"Placement {placement}: contributions to the uncertainty of R_eff and of the farthest XM; u and U of XM"
        " along the"
        f" gauge{tail}"
    )


def _range_note(budget: StoredBudget, placement: int) -> str:
    """The range is no linear quantity; what the Monte Carlo says of it."""
    found = next((band for band in budget.bands if band.placement == placement), None)
    if found is None:
        return ""
    return (
        f" Range of XM: {quantity(found.value_um, 2, 'µm')} observed; 95 % coverage interval by Monte Carlo"
        f" {number(found.low_95_um, 2)} µm to {quantity(found.high_95_um, 2, 'µm')}. Noise biases a range upwards: the"
        " interval need not contain the observed value."
    )


def _source(source: StoredSource, lines: Sequence[StoredLine]) -> list[str]:
    low, high = _short(source.u_min), _short(source.u_max)
    unit = printed_unit(source.unit)
    u = f"{low if low == high else f'{low} to {high}'} {unit}"
    return [
        source.label,
        source.type,
        u,
        dof_text(source.dof),
        *(number(line.contributions_um.get(source.name), 3) for line in lines),
    ]


def _short(value: float) -> str:
    """Three digits; small values as powers of ten."""
    text = f"{value:.3g}"
    if "e" not in text:
        return text
    digits, power = text.split("e")
    return f"{digits} × 10{str(int(power)).translate(str.maketrans('-0123456789', '⁻⁰¹²³⁴⁵⁶⁷⁸⁹'))}"


def _totals(lines: Sequence[StoredLine], budget: StoredBudget) -> list[tuple[str, list[str], bool]]:
    """Rows below the sources, and whether they are bold: via R_eff, u, degrees of freedom, k, U, Monte Carlo."""
    rows = [
        ("of which via R_eff", [number(line.through_r_eff_um, 3) for line in lines], False),
        ("Combined u", [uncertainty(line.u_um) for line in lines], True),
        ("Effective degrees of freedom", [dof_text(line.dof) for line in lines], False),
        ("Coverage factor k", [f"{line.k:.2f}" for line in lines], False),
        (f"Expanded U ({budget.coverage_percent:g} %)", [uncertainty(line.expanded_um) for line in lines], True),
    ]
    if any(line.monte_carlo for line in lines):
        runs = [UNDEFINED if line.monte_carlo is None else uncertainty(line.monte_carlo.u_um) for line in lines]
        rows.append(("u of the sources in the Monte Carlo", [uncertainty(x.same_terms_u_um) for x in lines], False))
        rows.append((f"u by Monte Carlo, {budget.monte_carlo_runs} runs", runs, False))
    return rows
