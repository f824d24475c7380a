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
        assert page.get_by_role("banner").bounding_box()["height"] < 80.0


def test_the_project_says_what_is_next(served: Served, watched: Watched) -> None:
    watched.page.goto(served.address)
    watched.page.get_by_text("find how the gauge lies").wait_for()
    watched.page.get_by_label("Language").select_option("de")
    watched.page.get_by_role("heading", name="Was als Nächstes kommt").wait_for()
    assert watched.page.get_by_role("link", name="Projekt", exact=True).get_attribute("aria-current") == "page"


@pytest.mark.parametrize("width", [400, 500, 1280])
def test_the_project_is_seen_whole_at_any_width(served: Served, watched: Watched, width: int) -> None:
    page = watched.page
    page.set_viewport_size({"width": width, "height": 900})
    page.goto(served.address)
    page.get_by_text("not there yet").wait_for()
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    hidden = "one => one.scrollHeight - one.clientHeight > 1 || one.scrollWidth - one.clientWidth > 1"
    assert not page.evaluate(f"[...document.querySelectorAll('.scroll')].some({hidden})")
    height = page.evaluate("document.querySelector('td.file').clientHeight")
    assert width < 1000 or height < 45, "names of files are not broken where there is room"


def test_a_folder_without_a_project_gets_one(tmp_path: Path, watched: Watched) -> None:
    server = Served(tmp_path)
    try:
        page: Any = watched.page
        page.goto(server.address)
        page.get_by_label("Gauge").select_option("step-gauge-420")
        page.get_by_label("Machine").select_option("bridge-cmm")
        page.get_by_role("button", name="Make a project here").click()
        page.get_by_role("heading", name="What is next").wait_for()
    finally:
        server.end()
    assert 'machine = "machine/bridge-cmm.toml"' in (tmp_path / "stepgauge.toml").read_text()


def test_the_pages_are_used_by_keyboard_and_printed_without_their_controls(served: Served, watched: Watched) -> None:
    page = watched.page
    page.goto(f"{served.address}/locate")
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.className") == "skip"
    page.keyboard.press("Enter")
    assert page.evaluate("document.activeElement.id") == "content"
    seen = []
    for _ in range(6):
        page.keyboard.press("Tab")
        seen.append(page.evaluate("document.activeElement.name || document.activeElement.tagName"))
    assert seen[:3] == ["SUMMARY", "points", "pasted"]
    page.emulate_media(media="print")
    assert not page.get_by_role("navigation").is_visible()
    assert page.get_by_role("heading", name="Locate").is_visible()


def test_a_choice_that_its_box_cuts_stands_below_it_and_no_button_leaves_its_box(
    served: Served, watched: Watched
) -> None:
    page = watched.page
    page.context.add_cookies([{"name": "language", "value": "de", "url": served.address}])
    page.goto(f"{served.address}/machine")
    page.locator("#temperature_convention").select_option("corrected_to_20")
    told = "schon auf 20 °C korrigiert, von der Maschine oder ihrer Software mit der Teiletemperatur"
    assert page.locator("small.chosen").all_inner_texts().count(told) == 1
    for name in ("locate", "plan", "importing", "run"):
        page.goto(f"{served.address}/{name}")
        page.wait_for_load_state("networkidle")
        outside = page.evaluate(
            "[...document.querySelectorAll('main button, main .button, main select')].filter(one =>"
            " one.getBoundingClientRect().right > one.parentElement.getBoundingClientRect().right + 2)"
            ".map(one => one.textContent)"
        )
        assert outside == [], name
