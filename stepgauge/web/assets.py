"""Files of the page: its own, and plotly's library out of the installed wheel. Nothing comes from elsewhere."""

from __future__ import annotations

from functools import cache
from importlib.metadata import version
from pathlib import Path

from starlette.requests import Request
from starlette.responses import FileResponse, PlainTextResponse, Response
from starlette.routing import Route

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


ROUTES = [
    Route("/favicon.ico", icon),
    Route("/static/plotly-{version}.js", plotly_library),
    Route("/static/{name}", own_file),
]
