"""What an engineer does in the office: plan, look at a result, compare, try a budget, follow the history, the probe."""

from __future__ import annotations

from pathlib import Path

import pytest

import stepgauge as sg
from tests.conftest import ROOT
from tests.web.conftest import TABLET, Served, Watched, make_project

GAUGE, MACHINE = "gauge/step-gauge-420.toml", "machine/bridge-cmm.toml"
SLOW_MS = 90_000
"""A busy machine."""
DATES = ("2026-03-02", "2026-06-01", "2026-09-02")


@pytest.fixture(scope="module")
def office(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A project with a placement and three evaluations of four blocks."""
    folder = make_project(tmp_path_factory.mktemp("office") / "project")
    gauge, machine = sg.read_gauge(folder / GAUGE), sg.read_machine(folder / MACHINE)
    placement = sg.locate(ROOT / "examples/demo/points.csv", gauge, machine=machine)
    placement.write(folder / "placement.toml")
    program = folder / "gauge.dmi"
    sg.plan(placement, gauge, machine, cycles=3, blocks="1:4").write(program)
    for seed, date in enumerate(DATES):
        recording = folder / f"recordings/{date}.csv"
        sg.simulate(program, machine, gauge, placement, seed=seed, gauge_temperature_C=20.4).recording.write(recording)
        sg.evaluate(recording, folder / GAUGE, measured_at=date).write(folder / f"results/{date}")
    return folder


def is_readable(watched: Watched) -> None:
    """By everybody, and on a tablet."""
    assert watched.violations() == []
    assert watched.page.evaluate("document.documentElement.scrollWidth") <= TABLET["width"]


def click_point(watched: Watched, where: str) -> None:
    """The middle of a point of a chart, as a hand does it: plotly looks at what is under the pointer first."""
    place = watched.page.locator(where)
    place.scroll_into_view_if_needed()
    box = place.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    watched.page.mouse.move(x - 3, y)
    watched.page.mouse.move(x, y)
    watched.page.locator(".hoverlayer .hovertext").first.wait_for()
    watched.page.mouse.click(x, y)


def test_a_plan_is_tried_played_back_refused_and_written(office: Path, watched: Watched) -> None:
    page = watched.page
    page.set_default_timeout(SLOW_MS)
    with Served(office) as server:
        page.goto(f"{server.address}/plan")
        page.get_by_text("The whole path is clear").wait_for()
        page.locator("[data-ready]").wait_for()
        page.get_by_label("Time").focus()
        page.keyboard.press("End")
        page.locator("output").filter(has_text="lift").wait_for()
        page.get_by_label("Gap between ball and blocks").fill("0,2")
        page.get_by_role("alert").get_by_text("comes too close to block 1").wait_for()
        page.locator("[data-ready]").wait_for()
        page.get_by_role("button", name="Show").first.click()
        page.locator("output").filter(has_text="advance").wait_for()
        is_readable(watched)
        page.get_by_label("Gap between ball and blocks").fill("5")
        page.get_by_label("Blocks; empty: all").fill("1:3")
        page.get_by_label("Controller").select_option("linuxcnc")
        page.locator("pre").get_by_text("G38.2").wait_for()
        page.get_by_role("button", name="Write the program").click()
        with page.expect_download() as download:
            page.get_by_role("link", name="Download").click()
        planned = sg.plan(office / "placement.toml", office / GAUGE, office / MACHINE, blocks="1:3")
        assert Path(download.value.path()).read_text() == str(planned.text("linuxcnc"))
        assert server.ask("/plan/file?name=stepgauge.toml")[0] == 422
        assert server.ask("/plan/file?name=../../etc/passwd")[0] == 422


def test_a_result_is_looked_into_compared_and_its_uncertainty_tried(office: Path, watched: Watched) -> None:
    page = watched.page
    page.set_default_timeout(SLOW_MS)
    with Served(office) as server:
        page.goto(f"{server.address}/result")
        page.locator("#errors [data-ready]").wait_for()
        shown = sg.read_evaluation(office / f"results/{DATES[-1]}", office / GAUGE).results[0]
        assert page.locator("#errors .numbers").inner_text().split("\n")[1] == f"{shown.band_um:.2f} µm"
        click_point(watched, "#errors .scatterlayer .points path >> nth=2")
        page.get_by_role("heading", name="Probings of face").wait_for()
        page.locator("#errors select[name=face]").select_option("4")
        page.get_by_role("button", name="Show its probings").click()
        page.get_by_role("heading", name="Probings of face 4").wait_for()
        assert page.locator("#probings tbody tr").count() == 3
        page.get_by_text("Lay other runs").click()
        page.locator(f"[name=over][value*='{DATES[0]}']").check()
        page.get_by_text("this run minus the others").wait_for()
        page.locator("#errors [data-ready]").wait_for()
        page.locator("#budget table").wait_for()
        assert "temperature of the gauge" in page.locator("#budget .warning").inner_text()
        page.locator("input[name=gauge_temperature]").fill("0.5")
        page.locator("#budget form[action='/result/state'] input[value='0.5']").wait_for(state="attached")
        assert page.locator("#budget tbody tr").first.inner_text().startswith("the temperature of the gauge")
        page.get_by_text("All faces as a table").click()
        is_readable(watched)
        assert server.ask("/result?evaluation=../elsewhere")[0] == 422
        assert server.ask("/result/errors?evaluation=results/nothing")[0] == 422


def test_the_history_leads_to_a_run_and_the_probe_has_a_body(office: Path, watched: Watched) -> None:
    page = watched.page
    page.set_default_timeout(SLOW_MS)
    with Served(office) as server:
        page.goto(f"{server.address}/history")
        page.get_by_text("Limits", exact=True).click()
        page.get_by_label("Largest repeatability 2s").fill("0.01")
        page.get_by_text("beyond the limit 0.01").first.wait_for()
        page.locator("#history [data-ready]").wait_for()
        is_readable(watched)
        click_point(watched, "#history .scatterlayer .points path >> nth=0")
        page.wait_for_url("**/result?evaluation=**")
        page.goto(f"{server.address}/probe?probe=omp40-2-50mm")
        page.locator("[data-ready]").nth(1).wait_for()
        found = sg.probe_map("omp40-2-50mm", polar_deg="0:90:5", azimuth_deg="0:360:5").pretravel_um
        cells = page.locator("#probe tbody tr").first.inner_text().split("\t")
        assert [float(one) for one in cells[1:]] == pytest.approx([found.min(), found.mean(), found.max()], abs=6e-4)
        is_readable(watched)
        assert not (office / "results/history").exists()
