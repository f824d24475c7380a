"""The application on its port, until it is told to end, and how the browser learns the address."""

from __future__ import annotations

import asyncio
import ipaddress
import os
import secrets
import socket
import threading
import webbrowser
from collections.abc import Callable, Iterable, MutableMapping
from dataclasses import dataclass
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory
from types import FrameType
from typing import Any
from urllib.parse import parse_qsl, urlencode

import uvicorn
from starlette.applications import Starlette
from starlette.datastructures import Headers
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import HTMLResponse, PlainTextResponse, RedirectResponse, Response
from starlette.routing import Route
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from stepgauge.errors import InputError, naming
from stepgauge.files.outputs import outside_of_sets
from stepgauge.languages.messages import LANGUAGES
from stepgauge.project.file import Verbs
from stepgauge.project.find import find_project
from stepgauge.web.forms import Form, form_endpoint
from stepgauge.web.pages import all_routes
from stepgauge.web.render import ASSET_ROUTES, LOOKS, error_answer, render, site_of
from stepgauge.web.site import LARGEST_REQUEST_BYTES, Site

LOOPBACK = "127.0.0.1"
PORT = 8420
"""Unless another is stated; where it is taken, any free one."""
WARM_AFTER_S = 0.3
"""The first page has been asked for by then."""


@dataclass(frozen=True)
class Listening:
    """Where the page listens; ``port``: None for :data:`PORT` or any free one, 0 for any free one."""

    host: str = LOOPBACK
    port: int | None = None

    @property
    def is_loopback(self) -> bool:
        """Whether only this computer can reach the address."""
        try:
            return ipaddress.ip_address(self.host).is_loopback
        except ValueError:
            return self.host == "localhost"

    def open(self) -> socket.socket:
        """A socket that listens (:class:`InputError` where it cannot)."""
        for port in (PORT, 0) if self.port is None else (self.port,):
            try:
                family = socket.AF_INET6 if ":" in self.host else socket.AF_INET
                return socket.create_server((self.host, port), family=family)
            except OSError as error:
                failed = error
        expected = "another --port or --host"
        raise InputError(f"{self.host}:{self.port}", "cannot listen here", found=failed.strerror, expected=expected)


def serve(folder: Path, verbs: Verbs, listening: Listening, ready: Callable[[str], None]) -> None:
    """Serve a project until SIGINT or SIGTERM; ``ready`` is told the address, which carries the token."""
    with listening.open() as taken:
        host, port = taken.getsockname()[:2]
        token = secrets.token_urlsafe(24)  # on loopback, too: every user of the computer reaches that
        site = Site(folder, verbs, port, token, listening.is_loopback)
        config = uvicorn.Config(
            make_app(site),
            log_level="warning",
            access_log=False,
            ws="none",
            server_header=False,
            timeout_graceful_shutdown=2,
        )
        shown = f"[{host}]" if ":" in host else host
        address = f"http://{shown}:{port}/?token={token}"
        try:
            asyncio.run(_run(_Server(config, site), taken, lambda: ready(address)))
        except KeyboardInterrupt:  # Ctrl-C is how it ends
            return
        finally:
            site.close()


class _Server(uvicorn.Server):
    """A server that tells the streams of its pages that it ends: they would hold it up."""

    def __init__(self, config: uvicorn.Config, site: Site) -> None:
        super().__init__(config)
        self._site = site

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """A signal to end."""
        self._site.is_ending = True
        super().handle_exit(sig, frame)


async def _run(server: uvicorn.Server, taken: socket.socket, ready: Callable[[], None]) -> None:
    """``ready`` is called as soon as requests are answered."""
    serving = asyncio.create_task(server.serve(sockets=[taken]))
    while not (server.started or serving.done()):
        await asyncio.sleep(0.005)
    if server.started:
        ready()
        asyncio.get_running_loop().call_later(WARM_AFTER_S, threading.Thread(target=_warm, daemon=True).start)
    await serving


def _warm() -> None:
    """Import what most pages need, while the person looks at the first one."""
    import stepgauge.history
    import stepgauge.project.status  # noqa: F401


def serve_project(
    project: str | Path | None,
    verbs: Verbs,
    host: str | None,
    port: int | None,
    with_browser: bool,
    tell: Callable[[str], None],
    ready: Callable[[str], None],
) -> None:
    """Serve a project until it is told to end; errors as :func:`serve`."""
    found = find_project() if project is None else None
    folder = Path(project or (found.parent if found else "."))
    if not folder.is_dir():
        raise InputError(folder, "no such folder", expected="the folder of a project")
    os.chdir(folder)
    listening = Listening(host or LOOPBACK, port)
    with outside_of_sets(), TemporaryDirectory(prefix="stepgauge-") as private:

        def answers(address: str) -> None:
            """Told once requests are answered."""
            if not listening.is_loopback:
                tell("warning: whoever has this address can change the project and move the machine")
            ready(address)
            if with_browser:
                open_browser(address, Path(private))

        serve(Path.cwd(), verbs, listening, answers)


def open_browser(address: str, private: Path) -> None:
    """By a page in a folder of this user: every user of the computer sees what is on a command line."""
    page = private / "stepgauge.html"
    page.write_text(f'<!doctype html><meta http-equiv="refresh" content="0; url={address}">', encoding="ascii")
    threading.Thread(target=webbrowser.open, args=(page.as_uri(),), daemon=True).start()


YEAR_S = 365 * 24 * 3600


def make_app(site: Site) -> Starlette:
    """The pages of a project as an ASGI application."""

    routes = [
        *ASSET_ROUTES,
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


READS = ("GET", "HEAD")
CONTENT_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
    "font-src 'self'; connect-src 'self'; frame-src 'self'; object-src 'none'; base-uri 'none'; form-action 'self'; "
    "frame-ancestors 'self'"
)
"""Scripts come from files of the server alone. ``style-src 'unsafe-inline'``: plotly sets the attribute ``style``."""
HEADERS = {
    "Content-Security-Policy": CONTENT_POLICY,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}


class TooLargeError(Exception):
    """More was sent than is taken."""


class Guard:
    """The outermost layer of the application."""

    def __init__(self, app: ASGIApp, site: Site) -> None:
        self.app, self.site = app, site
        self.cookie = f"stepgauge-token-{site.port}"

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        answer = self._refused(scope, headers) or self._welcomed(scope, headers)
        if answer is not None:
            await answer(scope, receive, _add_headers(send))
            return
        try:
            await self.app(scope, _limited(receive), _add_headers(send))
        except TooLargeError:
            await _too_large()(scope, receive, _add_headers(send))

    def _refused(self, scope: Scope, headers: Headers) -> Response | None:
        """The answer to a request that is not of this page, None where it is."""
        host = headers.get("host", "")
        if self.site.on_loopback and host not in _loopback_hosts(self.site.port):
            return _no(421, f"this page is served at http://127.0.0.1:{self.site.port}")
        if not _is_same_origin(scope, headers, host):
            return _no(403, "only the page itself may ask for this")
        if (length := headers.get("content-length", "0")).isdecimal() and int(length) > LARGEST_REQUEST_BYTES:
            return _too_large()
        return None

    def _welcomed(self, scope: Scope, headers: Headers) -> Response | None:
        """Who brings the token in the address gets a cookie; who has neither is refused."""
        words = parse_qsl(scope["query_string"].decode("latin-1"))
        if scope["method"] in READS and any(key == "token" and self._is_token(value) for key, value in words):
            rest = urlencode([(key, value) for key, value in words if key != "token"])
            answer = _on_to("/" + scope["path"].lstrip("/") + (f"?{rest}" if rest else ""))
            answer.set_cookie(self.cookie, self.site.token, httponly=True, samesite="strict")
            return answer
        brought = (one.strip().partition("=") for one in headers.get("cookie", "").split(";"))
        if any(name == self.cookie and self._is_token(value) for name, _, value in brought):
            return None
        return _no(403, "open the address that 'stepgauge web' has printed: it carries the token")

    def _is_token(self, value: str) -> bool:
        return secrets.compare_digest(value.encode(), self.site.token.encode())


def _loopback_hosts(port: int) -> Iterable[str]:
    """A name that leads here by way of somebody else's name server is none of these."""
    return {f"{host}:{port}" for host in ("127.0.0.1", "localhost", "[::1]")}


def _is_same_origin(scope: Scope, headers: Headers, host: str) -> bool:
    """Whether the page itself asks, or a person who typed the address or followed a link."""
    site = headers.get("sec-fetch-site")
    if scope["method"] in READS:
        return site in (None, "same-origin", "none") or headers.get("sec-fetch-mode") == "navigate"
    origin = headers.get("origin")
    return site == "same-origin" if origin is None else origin == f"{scope['scheme']}://{host}"


def _on_to(address: str) -> Response:
    """A page of ours that leads on: who came from elsewhere brings a strict cookie only to what that asks for."""
    return HTMLResponse(
        f'<!doctype html><title>stepgauge</title><meta http-equiv="refresh" content="0; url={escape(address)}">'
    )


def _no(status: int, text: str) -> Response:
    return PlainTextResponse(f"stepgauge: {text}\n", status)


def _too_large() -> Response:
    return _no(413, f"more than {LARGEST_REQUEST_BYTES // 2**20} MB are not taken")


def _limited(receive: Receive) -> Receive:
    """Counts what arrives, for a request may not say how long it is."""
    taken = 0

    async def counting() -> Message:
        """:class:`TooLargeError` once more than :data:`LARGEST_REQUEST_BYTES` have come."""
        nonlocal taken
        message = await receive()
        taken += len(message.get("body", b""))
        if taken > LARGEST_REQUEST_BYTES:
            raise TooLargeError
        return message

    return counting


def _add_headers(send: Send) -> Send:
    async def sending(message: MutableMapping[str, Any]) -> None:
        """Adds the headers that the answer does not set itself."""
        if message["type"] == "http.response.start":
            known = {name.lower() for name, _ in message["headers"]}
            own = [(name.lower().encode(), value.encode()) for name, value in HEADERS.items()]
            message["headers"] = [*message["headers"], *((name, value) for name, value in own if name not in known)]
        await send(message)

    return sending
