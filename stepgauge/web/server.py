"""The application on its port, until it is told to end, and how the browser learns the address."""

from __future__ import annotations

import asyncio
import ipaddress
import os
import secrets
import socket
import threading
import webbrowser
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from types import FrameType

import uvicorn

from stepgauge.errors import InputError
from stepgauge.files.outputs import outside_of_sets
from stepgauge.project.file import Verbs
from stepgauge.project.find import find_project
from stepgauge.web.app import make_app
from stepgauge.web.site import Site

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
