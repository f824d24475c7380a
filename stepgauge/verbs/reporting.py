"""``report``: results to pages to print and sign, to explore in a browser, or laid over each other."""

from __future__ import annotations

import datetime
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stepgauge.errors import InputError, naming
from stepgauge.evaluation.evaluate import Evaluation
from stepgauge.evaluation.files import evaluation_to_dict
from stepgauge.files.dates import check_past
from stepgauge.gauge.certified import Gauge
from stepgauge.machine.file import Machine
from stepgauge.reports.content import make_content
from stepgauge.reports.kinds import FLEET, kind_of
from stepgauge.reports.outcome import StandardTest
from stepgauge.reports.page import UserStatements
from stepgauge.reports.reading import read_checked_evaluation
from stepgauge.reports.render import renderer, write_report
from stepgauge.reports.sources import read_sources
from stepgauge.standards.budget_files import StoredBudget
from stepgauge.verbs.inputs import File, require_kind

if TYPE_CHECKING:
    from stepgauge.diagnosis.result import Diagnosis
    from stepgauge.fleet.hierarchical.answer import FleetInference

SAID = ("number", "customer", "location", "operator", "remarks")
"""What only a person can say."""


def write_result(
    asked: ReportRequest, template: File | None, interactive: bool, recordings: list[Any]
) -> tuple[str, ...]:
    """Write what is asked for; returns notes on the file. Parameters are those of the verb ``report``."""
    _check_date(asked.date)
    kinds = {_kind(one) for one in asked.results}
    if "test" in kinds:
        expected = "its write(folder, operator=..): the report beside its tables and figures"
        raise InputError("results", "a test by a standard writes its own report", found="a test", expected=expected)
    if kinds != {"evaluation"} or len(asked.results) > 1 or interactive:
        asked.check_plain("only the report of one evaluation prints these")
    if len(asked.results) > 1:
        if kinds != {"evaluation"} or interactive:
            raise InputError(
                "results", "several results are laid over each other", expected="evaluations, not interactive"
            )
        return _overlay(asked, template)
    if interactive:
        return _interactive(asked, recordings, template)
    path = asked.path
    renderer(path)
    if kinds == {"evaluation"}:
        return _signed(asked, template)
    story = {"diagnosis": _story, "investigation": _investigation, FLEET: _fleet}[kinds.pop()]
    return write_report(path, {**story(asked.results[0], asked.language), "language": asked.language}, template)


def _check_date(day: object) -> None:
    """:class:`InputError` for what is no date, or has not come yet."""
    if isinstance(day, datetime.datetime):
        raise InputError(naming("date"), "this is a moment", found=day, expected="a date without time")
    if day is not None:
        check_past(require_kind(day, datetime.date, "date"), naming("date"), "the date of the report")


@dataclass(frozen=True)
class ReportRequest:
    """What the verb ``report`` was asked for."""

    results: list[Any]
    path: File
    gauge: File | Gauge | None
    placements: list[Any]
    machine: File | Machine | None
    budget: File | StoredBudget | None
    certificate: File | None
    date: datetime.date | None
    said: dict[str, Any]
    mpe: str | None = None
    language: str = "en"

    def check_plain(self, why: str) -> None:
        """:class:`InputError` for what only a report to sign prints."""
        given = {
            "placements": self.placements,
            "budget": self.budget,
            "certificate": self.certificate,
            "date": self.date,
            "mpe": self.mpe,
        }
        named = [name for name, value in {**given, **self.said}.items() if value]
        if named:
            raise InputError(self.path, why, found=", ".join(named), expected="none of them")


def _kind(result: object) -> str:
    if isinstance(result, File):
        return kind_of(result)
    from stepgauge.fleet.hierarchical.answer import FleetInference

    kinds = {Evaluation: "evaluation", FleetInference: FLEET, StandardTest: "test"}
    return next((name for kind, name in kinds.items() if isinstance(result, kind)), "diagnosis")


def _evaluation_of(result: File | Evaluation, with_inputs: bool = True) -> dict[str, Any]:
    if isinstance(result, File):
        return read_checked_evaluation(result, with_inputs)
    return evaluation_to_dict(require_kind(result, Evaluation, "evaluation"))


def _signed(asked: ReportRequest, template: File | None) -> tuple[str, ...]:
    """A report or a certificate."""
    if asked.certificate is not None and (asked.date is not None or any(asked.said.values())):
        what = "states number, date, customer, place, persons and remarks itself"
        raise InputError(asked.certificate, what, expected="none of them beside it")
    (result,) = asked.results
    data = _evaluation_of(result)
    gauge = result.gauge if asked.gauge is None and isinstance(result, Evaluation) else asked.gauge
    if asked.placements and gauge is None:
        what = "are checked against their gauge, which is missing"
        raise InputError(naming("placements"), what, expected=naming("gauge"))
    budget = asked.budget if asked.budget is not None else _budget_of(result, data)
    sources = read_sources(data, gauge, asked.placements, asked.machine, budget, asked.certificate, asked.mpe)
    stated = UserStatements(asked.date or datetime.date.today(), **asked.said, language=asked.language)
    if sources.laboratory is not None:
        stated = replace(stated, date=sources.laboratory.certificate.issued or stated.date)
    return write_report(asked.path, make_content(data, stated, sources), template)


def _budget_of(result: File | Evaluation, data: dict[str, Any]) -> Path | None:
    """The budget that lies where its files lie; of an object none is known."""
    from stepgauge.reports.made_from import budget_of

    return budget_of(data, result) if isinstance(result, File) else None


def _story(result: File | Diagnosis, language: str) -> dict[str, Any]:
    from stepgauge.diagnosis.result import Diagnosis
    from stepgauge.reports.diagnosis import read_story, story_of

    if isinstance(result, File):
        return read_story(result, language)
    return story_of(require_kind(result, Diagnosis, "diagnosis"), language)


def _investigation(result: File, _: str) -> dict[str, Any]:
    from stepgauge.reports.investigation import read_story

    return read_story(result)


def _fleet(result: File | FleetInference, _: str) -> dict[str, Any]:
    from stepgauge.reports.fleet import fleet_story, read_story

    return read_story(result) if isinstance(result, File) else fleet_story(result.to_dict())


def _overlay(asked: ReportRequest, template: File | None) -> tuple[str, ...]:
    from stepgauge.reports.overlay import write_overlay

    names = [str(one) if isinstance(one, File) else one.path or f"{i}" for i, one in enumerate(asked.results, 1)]
    evaluations = [_evaluation_of(one, with_inputs=False) for one in asked.results]
    stated = UserStatements(datetime.date.today(), language=asked.language)
    return write_overlay(asked.path, evaluations, names, template, stated)


def _interactive(asked: ReportRequest, recordings: list[Any], template: File | None) -> tuple[str, ...]:
    """A page to explore an evaluation, with its recordings, or a diagnosis."""
    if Path(asked.path).suffix.lower() != ".html":
        raise InputError(asked.path, "not a page for a browser", found=repr(Path(asked.path).suffix), expected=".html")
    (result,) = asked.results
    if _kind(result) in ("investigation", FLEET):
        what = f"of an {'investigation' if _kind(result) != FLEET else 'inference'} there is no page to explore"
        raise InputError("interactive", what, expected="an evaluation or a diagnosis")
    make = _diagnosis_page if _kind(result) == "diagnosis" else _evaluation_page
    return write_report(asked.path, make(asked, result, recordings), template)


def _diagnosis_page(_: ReportRequest, result: File | Diagnosis, recordings: list[Any]) -> dict[str, Any]:
    from stepgauge.diagnosis.output.rows import read_rows
    from stepgauge.reports.diagnosis import diagnosis_story, read_said
    from stepgauge.reports.interactive import diagnosis_page

    if recordings:
        raise InputError("recordings", "a diagnosis has its residuals beside it", expected="none")
    if not isinstance(result, File):
        what = "its page is made from the files of a diagnosis"
        raise InputError("result", what, found="a Diagnosis", expected="the folder that Diagnosis.write made")
    said, folder = read_said(result)
    return diagnosis_page(said, diagnosis_story(said), read_rows(folder))


def _evaluation_page(asked: ReportRequest, result: File | Evaluation, recordings: list[Any]) -> dict[str, Any]:
    from stepgauge.reports.interactive import evaluation_page
    from stepgauge.reports.made_from import gauge_of, recordings_of
    from stepgauge.verbs.inputs import joined_recordings, resolve_gauge, resolve_machine
    from stepgauge.verbs.reading import read_evaluation

    if isinstance(result, File):
        data = read_checked_evaluation(result)
        gauge = resolve_gauge(gauge_of(data, result) if asked.gauge is None else asked.gauge)
        files, evaluation = recordings or recordings_of(data, result), read_evaluation(result, gauge)
    else:
        evaluation = require_kind(result, Evaluation, "evaluation")
        files = recordings or [one for one in evaluation.path.split(", ") if one]
    machine = None if asked.machine is None else resolve_machine(asked.machine)
    return evaluation_page(evaluation, joined_recordings(files, machine=machine))


class Reported(tuple[str, ...]):
    """Notes on a report that was written, mostly none."""

    def summary(self) -> str:
        """The notes, a line each."""
        return "\n".join(f"note: {note}" for note in self)
