"""Pages and parts of pages: Jinja templates of the package, with the language and the look that the browser keeps."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import jinja2
from markupsafe import Markup
from starlette.requests import Request
from starlette.responses import FileResponse, HTMLResponse, PlainTextResponse, Response
from starlette.routing import Route

from stepgauge import __version__
from stepgauge.errors import InputError
from stepgauge.files.notation import printed, printed_unit
from stepgauge.languages.messages import LANGUAGES, figure_words
from stepgauge.web.site import Site
from stepgauge.web.texts import Words, best_language

LOOKS = ("auto", "light", "dark")
PARTIAL = "x-part"
"""Header of a request that takes the answer into a part of a page."""


@cache
def templates() -> jinja2.Environment:
    """Where the templates of the pages are found, and what they may use."""
    loader = jinja2.PackageLoader("stepgauge.web", "templates")
    environment = jinja2.Environment(
        loader=loader, autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters |= {"printed": printed, "printed_unit": printed_unit, "stated_on": stated_on}
    return environment


def stated_on(text: str) -> list[str]:
    """The pages with fields for what a text of the program names by its keys, in the order of the navigation."""
    from stepgauge.web.pages import gauge, machine

    fields = {
        "gauge": {one.name for some in gauge.fields() for one in some},
        "machine": {one.name for some in machine.groups().values() for one in some},
        "importing": {"gauge_temperature_C", "temperature_convention"},
    }
    return [page for page, names in fields.items() if names & Words.keys(text)]


def site_of(request: Request) -> Site:
    """The project that is served."""
    site: Site = request.app.state.site
    return site


def words_of(request: Request) -> Words:
    """The texts in the language that was chosen, or that the browser asks for."""
    return Words(request.cookies.get("language") or best_language(request.headers.get("accept-language", "")))


def render(request: Request, template: str, code: int = 200, **content: Any) -> Response:
    """A template as the answer: a page extends ``base.html.j2``, a part stands alone.

    Every template has ``t`` (texts), ``number``, ``site``, ``pages`` (the navigation), ``here`` (the path),
    ``section`` (that of the navigation to which it belongs) and ``plotly`` (its script element).
    """
    from stepgauge.web.pages import NAVIGATION, SECTIONS

    words = words_of(request)
    look = request.cookies.get("look", "auto")
    given = {
        "t": words,
        "number": words.number,
        "language": words.language,
        "languages": LANGUAGES,
        "look": look if look in LOOKS else "auto",
        "looks": LOOKS,
        "pages": NAVIGATION,
        "here": request.url.path,
        "section": SECTIONS.get(request.url.path.split("/")[1], ""),
        "back": request.url.path + (f"?{request.url.query}" if request.url.query else ""),
        "site": site_of(request),
        "plotly": _plotly_tag,
        "version": __version__,
    }
    return HTMLResponse(templates().get_template(template).render(given | content), code)


def _plotly_tag() -> Markup:
    """The script element of plotly's library, for pages that draw."""
    return Markup('<script src="/static/plotly-{}.js" defer></script>').format(plotly_version())


def json_answer(request: Request, text: str) -> Response:
    """JSON of a figure that is text already, with its own words in the language of the page; keys stay."""
    known, before_numbers, spelled = _figure_words(words_of(request).language)
    if spelled:
        text = before_numbers.sub(lambda found: spelled[found[0]], known.sub(lambda found: spelled[found[0]], text))
    return Response(text, media_type="application/json")


@cache
def _figure_words(language: str) -> tuple[re.Pattern[str], re.Pattern[str], dict[str, str]]:
    """The words of figures as JSON spells them, the same before a number or in a template, and those of a language."""
    pairs = figure_words() if language == "de" else []
    spelled = {json.dumps(one, ensure_ascii=o): json.dumps(other) for one, other in pairs for o in (True, False)}
    whole = re.compile(rf"(?:{'|'.join(map(re.escape, spelled))})(?!\s*:)")
    single = {one: other for one, other in pairs if re.fullmatch("[a-z]{4,}", one)}
    every = "|".join(re.escape(one) for one, _ in pairs)
    led = re.compile(rf"(?<=[\" >])(?:{'|'.join(single)})(?= (?:%\{{|-?\d))|(?<=<extra>)(?:{every})(?=</extra>)")
    return whole, led, spelled | dict(pairs)


def address(path: str, **query: str) -> str:
    """An address of the page, whatever signs are in the names that it carries."""
    return f"{path}?{urlencode(query)}" if query else path


def run_verb(request: Request, arguments: Sequence[str], path: str, **query: str) -> Response:
    """A verb in a process of its own; the page shows how far it is, then goes to the address of its result."""
    work = site_of(request).works.start(arguments, address(path, **query))
    return render(request, "work.html.j2", work=work)


def error_answer(request: Request, error: Exception) -> Response:
    """What was wrong with what was given: as a part where a part was asked for, else as a page.

    A part is a proper answer (200), for a browser takes any other for a fault of the page.
    """
    assert isinstance(error, InputError)
    if PARTIAL in request.headers:
        return render(request, "error_part.html.j2", error=error)
    return render(request, "error.html.j2", 422, error=error)


OWN = Path(__file__).with_name("static")
TYPES = {".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml"}
KEEP = {"Cache-Control": "private, max-age=31536000, immutable"}


@cache
def plotly_version() -> str:
    """It stands in the address, so that a browser may keep the file."""
    return version("plotly")


def plotly_library(request: Request) -> Response:
    """As it lies in the installed wheel."""
    from importlib.util import find_spec

    spec = find_spec("plotly")
    assert spec is not None
    assert spec.origin is not None
    library = Path(spec.origin).parent / "package_data/plotly.min.js"
    return FileResponse(library, media_type="text/javascript", headers=KEEP)


def own_file(request: Request) -> Response:
    """A file of :data:`OWN`."""
    name = request.path_params["name"]
    found = {path.name: path for path in OWN.iterdir() if path.suffix in TYPES}
    if name not in found:
        return PlainTextResponse("not found", 404)
    return FileResponse(found[name], media_type=TYPES[found[name].suffix], headers={"Cache-Control": "no-cache"})


def icon(request: Request) -> Response:
    """What browsers ask for before they have read where it is."""
    return FileResponse(OWN / "icon.svg", media_type=TYPES[".svg"])


ASSET_ROUTES = [
    Route("/favicon.ico", icon),
    Route("/static/plotly-{version}.js", plotly_library),
    Route("/static/{name}", own_file),
]
