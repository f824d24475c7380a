"""A served project and a real browser, whose every request and complaint is looked at."""

from __future__ import annotations

import html
import http.client
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import urlencode, urlsplit

import pytest
from starlette.applications import Starlette
from starlette.requests import Request

from stepgauge.errors import InputError
from stepgauge.project.create import NewProject, create_project
from stepgauge.verbs.catalogue import VERBS
from stepgauge.web.forms import Form
from stepgauge.web.render import error_answer
from stepgauge.web.site import Site
from tests.conftest import ON_CI, ROOT

CHROMIUM = "/usr/bin/chromium"
QUIET = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
TABLET = {"width": 1024, "height": 768}
PATIENCE_MS = 240_000
"""A busy machine may be ten times as slow as a quiet one, and a verb in a process of its own takes seconds on that."""

ASK_AGAIN_MS = 50


def cannot(why: str) -> None:
    """A test that cannot run says why; on CI that is a failure."""
    if ON_CI:
        pytest.fail(why)
    pytest.skip(why)


SERVERS: list[Served] = []
WINDOWS: list[Any] = []
"""Those that are open: a window has the cookies of all servers, as if their start links had been opened in it."""


@dataclass(eq=False)
class Served:
    """``stepgauge web`` in a process of its own, on a free port."""

    folder: Path
    options: tuple[str, ...] = ()
    process: subprocess.Popen[str] = field(init=False)
    address: str = field(init=False)
    start: str = field(init=False)
    cookie: tuple[str, str] = field(init=False)
    said: str = ""

    def __post_init__(self) -> None:
        line = [sys.executable, "-m", "stepgauge", "web", str(self.folder), "--port", "0", "--no-browser"]
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "STEPGAUGE_GAUGE": "", "STEPGAUGE_MACHINE": ""}
        self.process = subprocess.Popen(
            [*line, *self.options], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment
        )
        assert self.process.stdout is not None
        self.start = self.process.stdout.readline().strip()
        assert self.start, self.end()
        self.address, _, token = self.start.partition("/?token=")
        self.cookie = f"stepgauge-token-{urlsplit(self.start).port}", token
        for context in WINDOWS:
            self.welcome(context)
        SERVERS.append(self)

    @property
    def host(self) -> str:
        return urlsplit(self.address).netloc

    def ask(
        self, path: str, method: str = "GET", body: Any = None, **headers: str
    ) -> tuple[int, dict[str, str], bytes]:
        """A request without a browser: status, headers, body; ``headers`` with _ for -; with the cookie."""
        headers = {"Cookie": "=".join(self.cookie), **headers}
        connection = http.client.HTTPConnection(self.host, timeout=60)
        own = {name.replace("_", "-"): value for name, value in headers.items()}
        connection.request(method, path, body, own)
        answer = connection.getresponse()
        found = answer.status, {name.lower(): value for name, value in answer.getheaders()}, answer.read()
        connection.close()
        return found

    def welcome(self, context: Any) -> None:
        """A window of a browser in which the start link was opened."""
        name, value = self.cookie
        context.add_cookies([{"name": name, "value": value, "url": self.address}])

    def __enter__(self) -> Served:
        return self

    def __exit__(self, *failed: object) -> None:
        said = self.end()
        assert failed[0] is not None or "Traceback" not in said, said

    def end(self, number: int = signal.SIGTERM) -> str:
        """End the server; what it said on stderr."""
        if self.process.poll() is None:
            self.process.send_signal(number)
        if self in SERVERS:
            SERVERS.remove(self)
        if not self.said:
            self.said = self.process.communicate(timeout=30)[1]
        return self.said


@dataclass(frozen=True)
class Asked:
    """The endpoints of a page called as functions, without a server: the fastest way to what a form leads to."""

    folder: Path
    language: str = "en"

    def request(self, path: str, **query: str) -> Request:
        app = Starlette()
        app.state.site = Site(self.folder, VERBS, 8420, "token")
        headers = [(b"accept-language", self.language.encode()), (b"x-part", b"1")]
        scope = {"type": "http", "method": "POST", "app": app, "headers": headers, "path": path}
        return Request({**scope, "query_string": urlencode(query).encode()})

    def post(self, endpoint: Any, texts: dict[str, str], **files: bytes) -> str:
        """The text of the answer to a form; what is empty is not there."""
        request = self.request("/")
        try:
            answer = endpoint(request, Form({key: value for key, value in texts.items() if value.strip()}, files))
        except InputError as error:
            answer = error_answer(request, error)
        return html.unescape(bytes(answer.body).decode())

    def get(self, endpoint: Any, **query: str) -> str:
        """The text of a page, or of a part of one."""
        return html.unescape(bytes(endpoint(self.request("/", **query)).body).decode())


def make_project(folder: Path) -> Path:
    """An empty project with the shipped 420 mm gauge and bridge CMM."""
    create_project(folder, NewProject("step-gauge-420", "bridge-cmm", {"operator": "A. Person"}))
    return folder


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """One server for a module, with a project of its own."""
    with Served(make_project(tmp_path_factory.mktemp("web") / "project")) as server:
        yield server


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """Debian's Chromium, headless."""
    if shutil.which(CHROMIUM) is None:
        cannot(f"needs Chromium at {CHROMIUM}: apt-get install chromium")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        found = playwright.chromium.launch(executable_path=CHROMIUM, headless=True, args=list(QUIET))
        yield found
        found.close()


ACT = """async ([selector, change, figure]) => {
  const one = document.querySelector(selector), place = document.querySelector(figure), before = place.dataset.ready;
  const began = performance.now();
  if (change === "toggle") one.checked = !one.checked;
  else one.selectedIndex = (one.selectedIndex + 1) % one.options.length;
  one.dispatchEvent(new Event("change"));
  while (place.dataset.ready === before) await new Promise(requestAnimationFrame);
  await new Promise(requestAnimationFrame);
  return performance.now() - began;
}"""
"""A change in the page, and how long until the figure that follows it is drawn."""


def opened(page: Any, address: str, ready: str) -> float:
    """From asking for a page until what it draws is there, ms."""
    began = time.perf_counter()
    page.goto(address)
    page.locator(ready).first.wait_for(state="attached")
    return 1e3 * (time.perf_counter() - began)


def acted(page: Any, selector: str, change: str, figure: str) -> float:
    """From ticking a box (``toggle``) or choosing the ``next`` of a list until the figure has followed, ms."""
    return float(page.evaluate(ACT, [selector, change, figure]))


@dataclass
class Watched:
    """A page of the browser; ``complaints`` of its console, and ``hosts`` that it asked for anything."""

    page: Any
    complaints: list[str] = field(default_factory=list)
    hosts: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        self.page.on(
            "console", lambda one: self.complaints.append(f"{one.text} {one.location}") if one.type == "error" else None
        )
        self.page.on("pageerror", lambda one: self.complaints.append(str(one)))
        self.page.on("request", lambda one: self.hosts.add(urlsplit(one.url).hostname or "data"))

    def check(self) -> None:
        """No complaint, and nothing that left this computer."""
        assert self.complaints == []
        assert self.hosts <= {"127.0.0.1", "data"}, self.hosts

    def until(self, holds: str) -> None:
        """A JavaScript expression is true: asked from here, since the page's policy lets no page evaluate text."""
        last = time.monotonic() + PATIENCE_MS / 1e3
        while not self.page.evaluate(holds):
            assert time.monotonic() < last, f"never true: {holds}"
            self.page.wait_for_timeout(ASK_AGAIN_MS)

    def violations(self) -> list[str]:
        """What axe finds of the serious kinds; its script is put in by the driver, past the page's policy."""
        from axe_playwright_python.base import AXE_SCRIPT

        self.page.evaluate(AXE_SCRIPT)
        found = self.page.evaluate("axe.run()")
        grave = [one for one in found["violations"] if one["impact"] in ("serious", "critical")]
        return [f"{one['id']}: {json.dumps([node['html'][:120] for node in one['nodes']][:3])}" for one in grave]


@pytest.fixture
def watched(browser: Any) -> Iterator[Watched]:
    """A new window on a tablet; at the end of the test it must not have complained nor asked elsewhere."""
    context = browser.new_context(viewport=TABLET, locale="en-GB")
    context.set_default_timeout(PATIENCE_MS)
    WINDOWS.append(context)
    for server in SERVERS:
        server.welcome(context)
    found = Watched(context.new_page())
    yield found
    found.check()
    WINDOWS.remove(context)
    context.close()
