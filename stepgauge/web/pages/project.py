"""Project: what is there, and what is next."""

from __future__ import annotations

from typing import Any

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from stepgauge.errors import InputError, naming
from stepgauge.web.folder import put_away
from stepgauge.web.forms import Form, form_endpoint
from stepgauge.web.judgement import source_name
from stepgauge.web.render import render, site_of, stated_on, words_of

PAGE_OF = {
    "gauge": "/gauge",
    "machine": "/machine",
    "locate": "/locate",
    "plan": "/plan",
    "simulate": "/run",
    "evaluate": "/result",
    "budget": "/result",
    "decide": "/result",
    "diagnose": "/diagnosis",
    "report": "/report",
    "history": "/history",
}
"""The page on which the verb that is next can be done."""


REMOVABLE = {
    "recording": "",
    "evaluation": "/result?evaluation=",
    "budget": "/result?of=",
    "diagnosis": "/diagnosis?result=",
}
"""What a person may have made by mistake, with the page that shows it."""


def show(request: Request) -> Response:
    """The page; what is in the files is read when it is open."""
    if site_of(request).has_project:
        return render(request, "project.html.j2")
    from stepgauge.files.resources import shipped_names

    return render(request, "project.html.j2", gauges=shipped_names("."), machines=shipped_names("machines"))


def status(request: Request) -> Response:
    """What ``stepgauge status`` prints."""
    from stepgauge.project.status import project_status

    found = project_status(site_of(request).project())
    file = found.command.split()[2] if found.step in ("evaluate", "budget", "diagnose", "report") else ""
    there = stated_on(" ".join(how for _, how in found.lacking))
    page = f"/{there[0]}" if there else PAGE_OF.get(found.step, "")
    lacking = [source_name(words_of(request), what) for what, _ in found.lacking]
    content: dict[str, Any] = {"status": found, "file": file, "page": page, "lacking": lacking}
    return render(request, "project_status.html.j2", **content, removable=REMOVABLE)


def remove(request: Request, form: Form) -> Response:
    """A recording or a result into the archive of what was removed."""
    from stepgauge.project.status import project_status

    site, name = site_of(request), form.text("path")
    if not any(name == one.path and one.what in REMOVABLE for one in project_status(site.project()).items):
        raise InputError(name, naming("not_a_choice"))
    with site.writing():
        archive = put_away(site.folder, name)
    return render(request, "removed.html.j2", name=name, archive=archive)


def new(request: Request, form: Form) -> Response:
    """A project file with copies of the shipped files that were chosen; what is one's own is entered next."""
    from stepgauge.files.resources import shipped_names
    from stepgauge.project.create import NewProject, create_project

    site = site_of(request)
    for key, where in (("gauge", "."), ("machine", "machines")):
        if form.has(key) and form.text(key) not in shipped_names(where):
            raise InputError(key, "not a shipped file", found=form.text(key), expected="one of the list")
    with site.writing():
        texts = {"operator": form.text("operator")} if form.text("operator") else {}
        create_project(site.folder, NewProject(form.text("gauge"), form.text("machine"), texts))
    own = next((key for key in ("gauge", "machine") if not form.has(key)), "")
    return render(request, "gone.html.j2", address=f"/{own}")


ROUTES = [
    Route("/", show),
    Route("/project", show),
    Route("/project/status", status),
    Route("/project/remove", form_endpoint(remove), methods=["POST"]),
    Route("/project/new", form_endpoint(new), methods=["POST"]),
]
