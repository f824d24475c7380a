"""The whole story in a browser: 16 points, a measurement on a machine with a concealed cause, diagnosis, report."""

from __future__ import annotations

from pathlib import Path

import pytest
from pypdf import PdfReader

from stepgauge.diagnosis.result import Diagnosis
from tests.conftest import ROOT
from tests.web.conftest import TABLET, Served, Watched, acted, make_project, opened

MOST_OF_A_BARE_PAGE = 10.0
"""Time of an interaction over that of opening a page of no content; ``benchmarks/web.py`` has larger recordings."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_project(tmp_path_factory.mktemp("story") / "project")


def test_from_sixteen_points_to_the_cause_and_the_printed_report(folder: Path, watched: Watched) -> None:
    with Served(folder) as server:
        page = watched.page
        page.goto(f"{server.address}/locate")
        page.get_by_label("A file of points").set_input_files(str(ROOT / "examples/demo/points.csv"))
        page.get_by_role("button", name="Locate").click()
        page.get_by_text("The gauge is located").wait_for()

        page.goto(f"{server.address}/run")
        page.get_by_label("Cycles").fill("3")
        page.get_by_label("Blocks").fill("1:12")
        page.get_by_label("How fast it moves").select_option("as fast as it can be computed")
        page.get_by_text("A concealed fault").click()
        page.get_by_label("Which").select_option("scale error")
        page.get_by_label("Axis").select_option("y")
        page.get_by_label("Size").fill("25")
        page.get_by_role("button", name="Start the measurement").click()
        page.get_by_text("All points are measured").wait_for()
        page.locator("#errors[data-ready]").wait_for()
        page.get_by_role("link", name="Diagnose", exact=True).click()
        page.get_by_role("button", name="Diagnose", exact=True).click()

        page.locator("#residuals[data-ready]").wait_for()
        page.get_by_text("Known causes explain").wait_for()
        noise, now = float(page.locator("#noise").inner_text()), float(page.locator("#now").inner_text())
        assert now < 1.3 * noise
        page.locator("[data-finding='0']").uncheck()
        watched.until("+document.getElementById('now').textContent > 1.0")
        for covariate in ("y (mm)", "cycle", "time (min)"):
            page.get_by_label("Against").select_option(covariate)
        assert watched.violations() == []
        assert page.evaluate("document.documentElement.scrollWidth") <= TABLET["width"]
        bare = min(opened(page, f"{server.address}/project", "h1") for _ in range(3))
        opened(page, f"{server.address}/diagnosis?result=results/diagnosis-run", "#residuals[data-ready]")
        for selector, change in (("[data-finding]", "toggle"), ("#against", "next")):
            assert min(acted(page, selector, change, "#residuals") for _ in range(3)) < MOST_OF_A_BARE_PAGE * bare
        page.get_by_role("button", name="Plan this measurement").click()
        page.wait_for_url("**/diagnosis/planned?**")
        page.locator(".plot[data-ready]").wait_for()
        assert page.get_by_role("row", name="block 1").get_by_role("cell").count() == 4
        assert watched.violations() == []
        page.get_by_role("link", name="On the virtual CMM").click()
        page.wait_for_url("**/run?program=**")
        assert page.get_by_label("Program").input_value().endswith("separate-1.dmi")

        page.goto(f"{server.address}/report?result=results/diagnosis-run")
        page.get_by_role("button", name="Write the PDF").click()
        page.get_by_role("link", name="Open the PDF").wait_for()
        page.goto(f"{server.address}/report?result=results/diagnosis-run")
        page.get_by_role("button", name="Preview").click()
        page.frame_locator("#paper").get_by_role("heading", name="What to do first").wait_for()
        page.goto(f"{server.address}/project")
        page.get_by_text("results/diagnosis-run").first.wait_for()

    found = Diagnosis.read(folder / "results/diagnosis-run").contents["effects"][0]
    assert "scale_error" in [one["kind"] for one in [found, *found["set"]]]
    text = PdfReader(folder / "results/report-diagnosis-run.pdf").pages[0].extract_text()
    assert "What to do first" in text
