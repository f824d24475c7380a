"""Who may ask the page for what: hosts, origins, tokens, paths, sizes, and the headers of every answer."""

from __future__ import annotations

import os
import re
import time
from pathlib import Path
from typing import Any

import pytest

from stepgauge.errors import InputError
from stepgauge.web.folder import existing, free_name, inside, listed, relative
from stepgauge.web.server import open_browser
from stepgauge.web.site import LARGEST_REQUEST_BYTES
from tests.web.conftest import Served, make_project


def test_an_answer_forbids_scripts_that_are_not_files_of_the_page(served: Served) -> None:
    for path in ("/", "/static/page.js", "/nowhere"):
        _, headers, body = served.ask(path)
        policy = dict(part.strip().partition(" ")[::2] for part in headers["content-security-policy"].split(";"))
        assert policy["script-src"] == "'self'"
        assert policy["default-src"] == policy["object-src"] == policy["base-uri"] == "'none'"
        assert headers["x-content-type-options"] == "nosniff"
        assert not re.search(rb"<script(?![^>]*src=)|\son\w+=", body) or path.endswith(".js")


def test_only_the_page_itself_may_change_anything(served: Served) -> None:
    origin = served.address
    ways = {
        "another origin": ({"Origin": "http://evil.example"}, 403),
        "no origin": ({}, 403),
        "an origin on another port": ({"Origin": "http://127.0.0.1:1"}, 403),
        "null": ({"Origin": "null"}, 403),
        "its own": ({"Origin": origin}, 303),
    }
    for name, (headers, expected) in ways.items():
        assert served.ask("/preferences", "POST", "language=de", **headers)[0] == expected, name
    assert served.ask("/", Host="evil.example")[0] == 421
    assert served.ask("/project/status", **{"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "no-cors"})[0] == 403
    assert served.ask("/", **{"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate"})[0] == 200


def test_a_page_leads_back_only_to_itself(served: Served) -> None:
    for back, expected in (("/locate", "/locate"), ("//evil.example", "/"), ("/\\evil.example", "/"), ("x:y", "/")):
        body = f"language=de&back={back}"
        kind = "application/x-www-form-urlencoded"
        _, headers, _ = served.ask("/preferences", "POST", body, Origin=served.address, Content_Type=kind)
        assert headers["location"] == expected


def test_what_is_too_large_is_not_taken(served: Served) -> None:
    length = str(LARGEST_REQUEST_BYTES + 1)
    assert served.ask("/preferences", "POST", Origin=served.address, Content_Length=length)[0] == 413
    kind = "application/x-www-form-urlencoded"
    pasted = b"pasted=" + b"1" * LARGEST_REQUEST_BYTES
    assert served.ask("/locate", "POST", pasted, Origin=served.address, Content_Type=kind)[0] == 413


@pytest.mark.parametrize("options", [(), ("--host", "0.0.0.0")])
def test_nobody_gets_in_without_the_token(tmp_path: Path, options: tuple[str, ...]) -> None:
    """On loopback neither: other users of the computer reach it."""
    server = Served(make_project(tmp_path / "open"), options)
    try:
        query = server.start.partition("?")[2]
        for path in ("/", "/?token=wrong", "/?token=", "/static/page.js", "/project", "/run/events?recording=x"):
            status, headers, body = server.ask(path, Cookie="")
            assert (status, body.decode().startswith("stepgauge: open the address that")) == (403, True), path
            assert "set-cookie" not in headers
        assert server.ask("/preferences", "POST", "language=de", Origin=server.address, Cookie="")[0] == 403
        assert server.ask(f"/preferences?{query}", "POST", "a=b", Origin=server.address, Cookie="")[0] == 403
        status, headers, body = server.ask(f"/project?a=%22%3E1&{query}", Cookie="")
        assert (status, b'content="0; url=/project?a=%22%3E1"' in body) == (200, True)
        assert "HttpOnly" in headers["set-cookie"]
        assert "samesite=strict" in headers["set-cookie"].lower()
        cookie = headers["set-cookie"].partition(";")[0]
        assert cookie == "=".join(server.cookie)
        assert server.ask("/", Cookie=cookie)[0] == 200
        assert server.ask("/", Cookie=cookie + "x")[0] == 403
    finally:
        said = server.end()
    assert ("whoever has this address" in said) == bool(options)


def test_the_start_link_is_on_no_command_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    open_browser("http://127.0.0.1:8420/?token=secret", tmp_path)
    while not opened:
        time.sleep(0.01)
    assert opened == [(tmp_path / "stepgauge.html").as_uri()]
    assert "url=http://127.0.0.1:8420/?token=secret" in (tmp_path / "stepgauge.html").read_text()


def test_the_start_link_leads_a_browser_in(browser: Any, served: Served) -> None:
    page = browser.new_page()
    page.goto(served.start)
    page.wait_for_url(f"{served.address}/**")
    page.locator("h1").first.wait_for()
    assert page.locator("h1").first.is_visible()
    page.close()


def test_no_name_leads_out_of_the_project(tmp_path: Path) -> None:
    folder = tmp_path / "project"
    (folder / "sub").mkdir(parents=True)
    (tmp_path / "secret.csv").write_text("no")
    (folder / ".hidden").write_text("no")
    (folder / "mine.csv").write_text("yes")
    os.symlink(tmp_path / "secret.csv", folder / "link.csv")
    for name in ("../secret.csv", "/etc/passwd", "sub/../../secret.csv", "link.csv", ".hidden", "", "a\0b", "x" * 2000):
        with pytest.raises(InputError):
            inside(folder, name)
    assert relative(folder, "sub/../mine.csv") == "mine.csv"
    with pytest.raises(InputError, match="no such file"):
        existing(folder, "other.csv")
    assert free_name(folder, "mine.csv", b"yes").name == "mine.csv"
    assert free_name(folder, "mine.csv", b"else").name == "mine-2.csv"
    assert listed(folder, [".csv"]) == ["mine.csv", "link.csv"] or set(listed(folder, [".csv"])) == {
        "mine.csv",
        "link.csv",
    }
