"""What only a person can state on a report, of verbs that write one with their result."""

import datetime
from typing import TYPE_CHECKING, Annotated, Any

from stepgauge.files.display import Written
from stepgauge.verbs.define import Of
from stepgauge.verbs.kinds import IsoDate, OneOf, Reads, Text
from stepgauge.verbs.shared import Figure, File, OutputFolder

if TYPE_CHECKING:
    from stepgauge.reports.outcome import StandardTest
    from stepgauge.reports.page import UserStatements

NAMES = ("number", "operator", "customer", "location", "date", "remarks", "language", "template")
Words = Annotated[str | None, Text()]


def stated(
    *,
    number: Words = None,
    operator: Words = None,
    customer: Words = None,
    location: Words = None,
    date: Annotated[datetime.date | None, IsoDate()] = None,
    remarks: Words = None,
    language: Annotated[str, OneOf("en", "de")] = "en",
    template: Annotated[File | None, Reads("FILE")] = None,
) -> "UserStatements":
    """What a person states.

    Parameters
    ----------
    number : number of the report
    operator : who measured; printed at the place for the signature
    customer : for whom the report is made
    location : where the machine stands
    date : date of the report; default: today
    remarks : anything else to print
    language : of what is printed: en or de
    template : your own template, Typst for PDF, Jinja for HTML; start from a copy: 'stepgauge list files report.typ'
    """
    from stepgauge.reports.page import UserStatements

    return UserStatements(date or datetime.date.today(), number, customer, location, operator, remarks, language)


def write_test(
    test: "StandardTest",
    output: OutputFolder,
    *,
    figure: Figure = "png",
    **statement: Annotated[Any, Of(stated, *NAMES)],
) -> Written:
    """Files of a test by a standard.

    Parameters
    ----------
    output : folder for JSON, CSV, figures and the report (PDF) of the test (made if missing)
    """
    template = statement.pop("template", None)
    return test.write(output, figure, template=template, **{key: one for key, one in statement.items() if one})
