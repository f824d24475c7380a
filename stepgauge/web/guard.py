"""Who may ask, and for how much: host, token, same origin, size of a request, and the headers of every answer."""

from __future__ import annotations

import secrets
from collections.abc import Iterable, MutableMapping
from html import escape
from typing import Any
from urllib.parse import parse_qsl, urlencode

from starlette.datastructures import Headers
from starlette.responses import HTMLResponse, PlainTextResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from stepgauge.web.site import LARGEST_REQUEST_BYTES, Site

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
