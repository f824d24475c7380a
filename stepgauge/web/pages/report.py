"""Report: of an evaluation or a diagnosis; as a preview, printed, or as a PDF."""

from __future__ import annotations

from pathlib import Path

from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.routing import Route

from stepgauge.errors import InputError
from stepgauge.web.evaluations import report_words
from stepgauge.web.fields import options, verb_fields
from stepgauge.web.folder import existing, listed, relative
from stepgauge.web.forms import Form, form_endpoint
from stepgauge.web.render import render, run_verb, site_of, words_of

RESULTS = ("evaluation.json", "diagnosis.json")
SAID = ("number", "customer", "location", "operator", "remarks")
TYPES = {".html": "text/html; charset=utf-8", ".pdf": "application/pdf"}
PAPER_POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; font-src data:; frame-ancestors 'self'; "
    "sandbox allow-same-origin allow-modals"
)
"""A report on paper runs nothing, whatever is in it."""


def show(request: Request) -> Response:
    """What can be reported, the fields, and the page that was made."""
    site, query = site_of(request), request.query_params
    results = [str(Path(one).parent) for one in listed(site.folder, [".json"]) if Path(one).name in RESULTS]
    name = relative(site.folder, query["result"]) if query.get("result") else (results[0] if results else "")
    paper = query.get("paper", "")
    if paper:
        existing(site.folder, paper)
    stated = site.project().common if site.has_project else {}
    said = {key: str(stated.get(key, "")) for key in SAID}
    written = listed(site.folder, [".pdf"])
    return render(
        request,
        "report.html.j2",
        certifiable=(site.folder / name / RESULTS[0]).exists(),
        results=results,
        name=name,
        paper=paper,
        said=said,
        written=written,
        fields=SAID,
    )


def make(request: Request, form: Form) -> Response:
    """``stepgauge report``, as a page of the browser or as a PDF."""
    site = site_of(request)
    result = relative(site.folder, str(existing(site.folder, form.text("result"))))
    suffix = ".pdf" if form.text("as") == "pdf" else ".html"
    target = f"results/report-{Path(result).name}{suffix}"
    relative(site.folder, target)
    of_evaluation = (site.folder / result / RESULTS[0]).exists()  # on no other report a person says something
    words = options(verb_fields("report", only=SAID), form.texts) if of_evaluation else []
    return run_verb(
        request,
        [
            *("report", result, *words, *report_words(site, result)),
            *("--language", words_of(request).language, "-o", target),
        ],
        "/report",
        result=result,
        paper=target,
    )


def paper(request: Request) -> Response:
    """A report that was written, without anything in it that could run."""
    site = site_of(request)
    path = existing(site.folder, request.query_params.get("file", ""))
    if path.suffix not in TYPES or not path.is_file():
        raise InputError(path.name, "this is no report", expected="a file .html or .pdf")
    headers = {"Content-Security-Policy": PAPER_POLICY} if path.suffix == ".html" else {}
    return FileResponse(path, media_type=TYPES[path.suffix], headers=headers)


ROUTES = [
    Route("/report", show),
    Route("/report", form_endpoint(make), methods=["POST"]),
    Route("/report/paper", paper),
]
