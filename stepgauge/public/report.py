"""``report``: an evaluation to pages to print and sign."""

from __future__ import annotations

import datetime
from collections.abc import Iterable
from dataclasses import replace

from stepgauge.errors import InputError, naming
from stepgauge.evaluation.evaluate import Evaluation
from stepgauge.evaluation.files import evaluation_to_dict
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.machine.file import Machine
from stepgauge.public.inputs import File, of_kind, several
from stepgauge.reports.content import make_content
from stepgauge.reports.page import Stated
from stepgauge.reports.reading import read_checked_evaluation
from stepgauge.reports.render import renderer, write_report
from stepgauge.reports.sources import read_sources
from stepgauge.standards.budget_files import StoredBudget


def report(
    evaluation: File | Evaluation,
    path: File,
    *,
    gauge: File | Gauge | None = None,
    placements: File | Placement | Iterable[File | Placement] = (),
    machine: File | Machine | None = None,
    budget: File | StoredBudget | None = None,
    certificate: File | None = None,
    number: str | None = None,
    customer: str | None = None,
    location: str | None = None,
    operator: str | None = None,
    date: datetime.date | None = None,
    remarks: str | None = None,
    template: File | None = None,
) -> tuple[str, ...]:
    """Write a report, or with ``certificate`` a calibration certificate, to print and sign.

    Parameters
    ----------
    evaluation : the evaluation, its folder or its ``evaluation.json``
    path : the report to write, ``NAME.pdf`` or ``NAME.html``
    gauge : adds the uncertainties of its certificate; default: that of an evaluation given as an object
    placements : add angles and uncertainties, once per placement, in order; they need the gauge
    machine : adds travel, speeds, probe and temperature of the scales
    budget : adds the expanded uncertainties
    certificate : ``certificate.toml``; excludes number, customer, location, operator, date and remarks
    number, customer, location, operator, remarks : what only a person can say; None is printed as not stated
    date : of the report; default: today
    template : Typst for PDF, Jinja for HTML, instead of the shipped one

    Returns
    -------
    Notes on the file, mostly none.

    Raises
    ------
    InputError
        files that are not of this evaluation, a template that fails
    """
    renderer(path)
    said = {"number": number, "customer": customer, "location": location, "operator": operator, "remarks": remarks}
    if certificate is not None and (date is not None or any(said.values())):
        what = "states number, date, customer, place, persons and remarks itself"
        raise InputError(certificate, what, expected="none of them beside it")
    if isinstance(evaluation, File):
        data = read_checked_evaluation(evaluation)
    else:
        data = evaluation_to_dict(of_kind(evaluation, Evaluation, "evaluation"))
        gauge = evaluation.gauge if gauge is None else gauge
    lies = several(placements)
    if lies and gauge is None:
        raise InputError(
            naming("placements"), "are checked against their gauge, which is missing", expected=naming("gauge")
        )
    sources = read_sources(data, gauge, lies, machine, budget, certificate)
    stated = Stated(date or datetime.date.today(), **said)
    if sources.laboratory is not None:
        stated = replace(stated, date=sources.laboratory.certificate.issued or stated.date)
    return write_report(path, make_content(data, stated, sources), template)
