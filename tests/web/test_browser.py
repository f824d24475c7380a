"""The pages in a real browser: what one sees, at 1024 px, by keyboard, light and dark, in both languages."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from stepgauge.web.pages import PAGES
from tests.web.conftest import TABLET, Served, Watched


@pytest.mark.parametrize("name", PAGES)
def test_a_page_has_no_complaints_and_can_be_read_by_everybody(served: Served, watched: Watched, name: str) -> None:
    page = watched.page
    for look in ("light", "dark"):
        page.context.add_cookies([{"name": "look", "value": look, "url": served.address}])
        page.goto(f"{served.address}/{name}")
        page.wait_for_load_state("networkidle")
        assert watched.violations() == []
        assert page.evaluate("document.documentElement.scrollWidth") <= TABLET["width"]


def test_the_project_says_what_is_next(served: Served, watched: Watched) -> None:
    watched.page.goto(served.address)
    watched.page.get_by_text("find how the gauge lies").wait_for()
    watched.page.get_by_label("Language").select_option("de")
    watched.page.get_by_role("heading", name="Was als Nächstes kommt").wait_for()
    assert watched.page.get_by_role("link", name="Projekt", exact=True).get_attribute("aria-current") == "page"


def test_a_folder_without_a_project_gets_one(tmp_path: Path, watched: Watched) -> None:
    server = Served(tmp_path)
    try:
        page: Any = watched.page
        page.goto(server.address)
        page.get_by_label("Machine").select_option("bridge-cmm")
        page.get_by_role("button", name="Make a project here").click()
        page.get_by_role("heading", name="What is next").wait_for()
    finally:
        server.end()
    assert 'machine = "machine/bridge-cmm.toml"' in (tmp_path / "stepgauge.toml").read_text()
