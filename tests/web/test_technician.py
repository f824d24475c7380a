"""A technician's whole job in a browser, without a command: from the paper certificate of the gauge to a signed PDF."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from pypdf import PdfReader

import stepgauge as sg
from tests.conftest import ROOT
from tests.web.conftest import TABLET, Served, Watched

SLOW_MS = 90_000
AFTER_TYPING_MS = 400
"""A form that follows what is typed asks after a moment of rest."""


def certificate_as_pasted() -> str:
    """The table of the shipped gauge as a German Excel has it in the clipboard."""
    rows = [line.split(",") for line in (ROOT / "calibration_data/step-gauge-420.csv").read_text().splitlines()[2:]]
    lines = ["\t".join(cell.replace(".", ",") for cell in row) for row in rows]
    return "\n".join(["Fläche\tNennmaß mm\tIstmaß mm\tU (k=2) µm", *lines])


def measured(folder: Path) -> str:
    """What the machine wrote: the points that the program of the page gives, as a table without faces."""
    gauge = sg.read_gauge(next((folder / "gauge").glob("*.toml")))
    machine = sg.read_machine(next((folder / "machine").glob("*.toml")))
    placement = sg.read_placement(folder / "placement.toml", gauge)
    run = sg.simulate(folder / "program.dmi", machine, gauge, placement, seed=4, gauge_temperature_C=20.3)
    frame = run.recording.frame[["x_mm", "y_mm", "z_mm"]].rename(columns={"x_mm": "X", "y_mm": "Y", "z_mm": "Z"})
    return str(frame.to_csv(index=False, sep=";", decimal=",", float_format="%.4f"))


def is_good(watched: Watched) -> None:
    """Readable by everybody, in the width of a tablet, and without words of the command line."""
    page = watched.page
    page.wait_for_timeout(AFTER_TYPING_MS)
    watched.until("!document.querySelector('[aria-busy=true]')")
    assert watched.violations() == []
    assert page.evaluate("document.documentElement.scrollWidth") <= TABLET["width"]
    assert not re.search(r"--[a-z]{2}|stepgauge [a-z]+ [-./a-z]", page.inner_text("main"))


def test_from_the_paper_certificate_to_the_signed_pdf(tmp_path: Path, watched: Watched) -> None:
    page = watched.page
    page.set_default_timeout(SLOW_MS)
    with Served(tmp_path) as server:
        page.goto(server.address)
        page.get_by_role("button", name="Make a project here").click()

        page.get_by_label("Name").fill("Step gauge 420")
        page.get_by_label("Serial number").fill("SG-1")
        page.get_by_label("Number of the certificate").fill("K-2026-1")
        page.get_by_label("Laboratory").fill("A laboratory")
        page.get_by_label("Date of calibration").fill("2026-03-02")
        page.get_by_label("Drift in a year").fill("0,1")
        for name, text in {
            "material": "steel",
            "expansion_per_K": "11,5",
            "expansion_uncertainty_per_K": "0,5",
        }.items():
            page.locator(f"[name={name}]").fill(text)
        page.get_by_label("The table of the certificate").fill(certificate_as_pasted())
        page.get_by_text("42 faces of 21 blocks").wait_for()
        page.get_by_role("button", name="Take this gauge").click()
        page.get_by_text("Width of a block: it is not filled in").wait_for()
        page.get_by_label("Width of a block").fill("20")
        assert page.get_by_text("it is not filled in").count() == 0
        page.get_by_label("Language").select_option("de")
        page.get_by_role("heading", name="Stufenendmaß").wait_for()
        page.wait_for_load_state("networkidle")
        page.get_by_label("Sprache").select_option("en")
        page.get_by_text("42 faces of 21 blocks").wait_for()
        assert page.get_by_label("Width of a block").input_value() == "20"
        page.get_by_label("Height of a block").fill("15")
        is_good(watched)
        page.get_by_role("button", name="Take this gauge").click()
        page.get_by_role("link", name="On to the machine").click()

        page.get_by_label("Name").fill("CMM 3")
        page.get_by_label("Serial number").fill("B7")
        page.get_by_label("Radius of the tip ball").fill("2")
        page.get_by_label("Constant A").fill("2,5")
        page.get_by_label("K in A + L/K").fill("300")
        page.get_by_text("Temperatures and uncertainties").click()
        page.get_by_label("Temperature of the gauge, standard uncertainty").fill("0,1")
        page.get_by_label("Probing, standard uncertainty").fill("0,2")
        is_good(watched)
        page.get_by_role("button", name="Take this machine").click()
        page.get_by_role("link", name="On to the 16 points").click()

        page.get_by_label("A file of points").set_input_files(str(ROOT / "examples/demo/points.csv"))
        page.get_by_role("button", name="Locate").click()
        page.get_by_role("link", name="On to the program").first.click()
        page.get_by_label("Blocks; empty: all").fill("1:5")
        page.get_by_label("Cycles").fill("0")
        page.get_by_text("Cycles: not a number in its range").wait_for()
        assert page.get_by_text("The whole path is clear").count() == 0
        page.get_by_label("Cycles").fill("3")
        page.get_by_text("The whole path is clear").wait_for()
        page.get_by_role("button", name="Write the program").click()
        page.get_by_role("link", name="Bring back what was measured").click()

        page.get_by_label("A file", exact=True).set_input_files(
            {"name": "results.csv", "mimeType": "text/csv", "buffer": measured(tmp_path).encode()}
        )
        page.get_by_label("Temperature of the gauge").fill("20,3")
        page.get_by_label("Day of the measurement").fill("2026-05-04")
        page.get_by_text("All is clear: 30 probings").wait_for()
        is_good(watched)
        page.get_by_role("button", name="Take it into the project").click()
        page.get_by_role("button", name="Evaluate").click()

        page.get_by_text("Not decided yet").first.wait_for()
        page.locator("#errors [data-ready]").wait_for()
        page.get_by_role("button", name="Compute the uncertainty").first.click()
        page.locator(".verdict").get_by_text("U lacks: the resolution").wait_for()
        page.get_by_role("link", name="Machine: Resolution").click()
        page.get_by_role("link", name="Back to: Result").wait_for()
        page.get_by_role("link", name="Back to: Result").click()
        page.get_by_role("heading", name="Uncertainty by source").wait_for()
        assert page.get_by_role("link", name="Back to:").count() == 0
        page.locator("input[name=resolution]").fill("0.1")
        page.get_by_role("button", name="Put these values into the machine file").click()
        page.locator(".verdict").get_by_text("compute the uncertainty first").wait_for()
        page.get_by_role("button", name="Compute the uncertainty").first.click()
        page.locator(".verdict").get_by_text("Pass").wait_for()
        is_good(watched)
        page.get_by_role("link", name="Report or certificate").click()
        page.get_by_role("link", name="Calibration certificate").click()
        for label, text in {
            "Number of the certificate": "2026-017",
            "Date of issue": "2026-05-06",
            "First day of the calibration": "2026-05-04",
            "Last day": "2026-05-05",
            "Manufacturer": "A maker",
        }.items():
            page.get_by_label(label).fill(text)
        page.get_by_role("button", name="Write the certificate").click()
        page.get_by_text("it is not filled in").wait_for()
        for field, text in {
            "laboratory.name": "A laboratory",
            "laboratory.city": "A town",
            "customer.name": "A customer",
            "method.name": "Procedure 7",
            "person.name": "A. Person",
        }.items():
            page.locator(f'[name="{field}"]').fill(text)
        is_good(watched)
        page.get_by_role("button", name="Write the certificate").click()
        page.get_by_role("link", name="Open the PDF").wait_for()
    path = next((tmp_path / "results").glob("certificate-*.pdf"))
    text = " ".join(one.extract_text() for one in PdfReader(path).pages)
    for said in ("2026-017", "A customer", "SG-1", "CMM 3"):
        assert said in text
    found = sg.read_evaluation(next((tmp_path / "results").glob("eval*")), next((tmp_path / "gauge").glob("*.toml")))
    assert np.abs(found.results[0].xm_um[np.isfinite(found.results[0].xm_um)]).max() < 2.5


@pytest.mark.parametrize("language", ["de"])
def test_the_pages_speak_german(served: Served, watched: Watched, language: str) -> None:
    page = watched.page
    page.context.add_cookies([{"name": "language", "value": language, "url": served.address}])
    for name, heading in (("gauge", "Stufenendmaß"), ("machine", "Maschine"), ("importing", "Import")):
        page.goto(f"{served.address}/{name}")
        page.wait_for_load_state("networkidle")
        assert page.get_by_role("heading", level=1).inner_text() == heading
        assert page.get_by_role("banner").bounding_box()["height"] < 80.0
        assert page.evaluate("document.documentElement.scrollWidth") <= TABLET["width"]
