"""The application: routes of all pages behind the guard."""

from __future__ import annotations

from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response
from starlette.routing import Route

from stepgauge.errors import InputError, naming
from stepgauge.languages.messages import LANGUAGES
from stepgauge.web import assets
from stepgauge.web.forms import Form, form_endpoint
from stepgauge.web.guard import Guard
from stepgauge.web.pages import all_routes
from stepgauge.web.render import LOOKS, error_answer, render, site_of
from stepgauge.web.site import Site

YEAR_S = 365 * 24 * 3600


def make_app(site: Site) -> Starlette:
    """The pages of a project as an ASGI application."""

    routes = [
        *assets.ROUTES,
        *all_routes(),
        Route("/preferences", form_endpoint(_prefer), methods=["POST"]),
        Route("/work/{number:int}", _show_work),
        Route("/work/{number:int}/stop", form_endpoint(_stop_work), methods=["POST"]),
    ]
    handlers = {InputError: error_answer, 404: _not_found}
    app = Starlette(routes=routes, middleware=[Middleware(Guard, site=site)], exception_handlers=handlers)
    app.state.site = site
    return app


def _not_found(request: Request, _: Exception) -> Response:
    error = InputError(request.url.path, naming("no_such_page"))
    return render(request, "error.html.j2", 404, error=error)


def _prefer(_: Request, form: Form) -> Response:
    """Language and look, which the browser keeps; back to the page that was open."""
    back = form.text("back", "/")
    answer = RedirectResponse(back if back.startswith("/") and not back.startswith(("//", "/\\")) else "/", 303)
    for name, choices in (("language", LANGUAGES), ("look", LOOKS)):
        if form.text(name) in choices:
            answer.set_cookie(name, form.text(name), YEAR_S, httponly=True, samesite="strict")
    return answer


def _show_work(request: Request) -> Response:
    return render(request, "work.html.j2", work=site_of(request).works.get(request.path_params["number"]))


def _stop_work(request: Request, _: Form) -> Response:
    work = site_of(request).works.get(request.path_params["number"])
    work.stop()
    return render(request, "work.html.j2", work=work)
