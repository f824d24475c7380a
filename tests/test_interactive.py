"""Pages to explore: one offline file, data that cannot become markup, and clicks that show the right probings."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import stepgauge as sg
from stepgauge.diagnosis.output.rows import read_rows
from stepgauge.evaluation.evaluate import evaluate
from stepgauge.evaluation.files import evaluation_to_dict
from stepgauge.evaluation.probings import probing_errors
from stepgauge.figures.measurement import KINDS, _figures
from stepgauge.files.text import read_json
from stepgauge.reports.diagnosis import diagnosis_story
from stepgauge.reports.interactive import MOST_ROWS, _kept, diagnosis_page, evaluation_page
from stepgauge.reports.render import render_html
from tests.cli.conftest import Run as Command
from tests.cli.conftest import files, made_files, run  # noqa: F401
from tests.diagnosis.made import as_file, made
from tests.measured import named, shipped
from tests.measured import run as measure

NASTY = '</script><script>document.title="broken"</script><img src=x onerror=alert(1)>'
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
MOST_BYTES = 6_000_000


class Scripts(HTMLParser):
    """Contents of the script elements by their id, and all tags."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.found: dict[str, str] = {}
        self.tags: list[str] = []
        self.links: list[str] = []
        self.now: str | None = None
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.links += [value or "" for name, value in attrs if name in ("src", "href")]
        self.now = str(dict(attrs).get("id", "code")) if tag == "script" else None

    def handle_endtag(self, tag: str) -> None:
        self.now = None

    def handle_data(self, data: str) -> None:
        if self.now is not None:
            self.found[self.now] = self.found.get(self.now, "") + data


def scene(page: str) -> dict[str, Any]:
    return dict(json.loads(Scripts(page).found["scene"]))


def browsed(page: Path, script: str, hash_: str = "") -> str:
    """The document after a script has run in a browser, once the page is ready."""
    if CHROMIUM is None:
        pytest.skip("no Chromium on this machine: the page is not clicked")
    wait = (
        "<script>(async () => { while (!document.body.dataset.ready) await new Promise(r => setTimeout(r, 50));"
        f" {script}; await new Promise(r => setTimeout(r, 300)); document.body.dataset.clicked = 'yes'; }})()</script>"
    )
    own = page.with_name(f"clicked-{page.name}")
    own.write_text(page.read_text("utf-8").replace("</body>", f"{wait}</body>"), "utf-8")
    command = [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=20000", "--dump-dom"]
    profile = f"--user-data-dir={page.parent / 'profile'}"
    done = subprocess.run([*command, profile, f"file://{own}{hash_}"], capture_output=True, text=True, timeout=120)
    assert 'data-clicked="yes"' in done.stdout, done.stderr[-2000:]
    return done.stdout


def body_rows(document: str) -> list[list[str]]:
    """The table of single probings."""
    table = re.search(r'<tbody id="rows">(.*?)</tbody>', document, re.S)
    assert table is not None
    return [re.findall(r"<td>(.*?)</td>", row) for row in re.findall(r"<tr.*?</tr>", table[1], re.S)]


@pytest.fixture
def diagnosed(tmp_path: Path) -> Path:
    """The folder of a diagnosis with two findings, one of them a list of outliers."""
    recording, found = made("outliers")
    as_file(tmp_path, recording)
    replace(found, recordings=(recording,)).write(tmp_path / "diagnosis")
    return tmp_path / "diagnosis"


def test_a_page_is_one_file_of_bearable_size_without_links(run: Command, files: Path, tmp_path: Path) -> None:  # noqa: F811
    out = tmp_path / "result"
    done = run("evaluate", files / "recording.csv", "-g", "step-gauge-420", "-o", out)
    assert done.code == 0, done.err
    done = run("report", out, "--interactive", "-o", tmp_path / "x.html")
    assert done.code == 0, done.err
    page = (tmp_path / "x.html").read_text("utf-8")
    read = Scripts(page)
    assert len(page) < MOST_BYTES
    assert read.links == []
    assert read.tags.count("script") == 3
    told = scene(page)["placements"][0]
    assert [row["face"] for row in told["faces"]] == list(range(1, 9))
    assert len(told["probings"]["cycle"]) == len(sg.read_recording(files / "recording.csv").frame)


def test_single_probings_are_those_of_the_evaluation() -> None:
    recording = named(measure(3).recording)
    evaluation = evaluate(recording, shipped()[0])
    told = evaluation_page(evaluation, recording)["scene"]["placements"][0]["probings"]
    (table,) = probing_errors(recording, evaluation)
    assert told["error_um"] == pytest.approx(table["error_um"], abs=1e-4)
    mine = [e for e, face in zip(told["error_um"], told["face"], strict=True) if face == 5]
    (row,) = [row for row in evaluation_to_dict(evaluation)["placements"][0]["faces"] if row["face"] == 5]
    assert np.mean(mine) == pytest.approx(row["xf_um"], abs=1e-3)


def test_readings_that_were_left_out_are_there_and_marked() -> None:
    recording = named(measure(6).recording)
    recording.frame.loc[20, "y_mm"] += 0.5
    evaluation = evaluate(recording, shipped()[0])
    assert [one.row for one in evaluation.results[0].left_out] == [20]
    (table,) = probing_errors(recording, evaluation)
    assert list(np.flatnonzero(~table["used"])) == [20]
    assert abs(table["error_um"][20]) == pytest.approx(500.0, rel=0.01)
    assert table["residual_um"][table["used"]].abs().max() < 5.0


def test_the_figures_of_a_measurement_show_what_is_used(tmp_path: Path) -> None:
    recording = named(measure(6).recording)
    recording.frame.loc[20, "y_mm"] += 0.5
    evaluation = evaluate(recording, shipped()[0])
    (table,) = probing_errors(recording, evaluation)
    drawn = dict(_figures(recording, evaluation, KINDS, None, None))
    dots = [np.asarray(line.get_ydata(), float) for line in drawn["repeatability"].axes[0].get_lines()]
    assert sum(len(one) for one in dots if len(one) > 2) == int(table["used"].sum())
    assert max(np.abs(one).max() for one in dots) < 5.0


def test_text_of_the_data_is_no_markup() -> None:
    recording = named(measure(2).recording).assign_comments(machine=NASTY)
    content = evaluation_page(evaluate(recording, shipped()[0]), recording)
    content["scene"]["hint"] = NASTY
    page = render_html(content).data.decode()
    read = Scripts(page)
    assert read.tags.count("script") == 3
    assert "img" not in read.tags
    assert scene(page)["hint"] == NASTY


def test_a_finding_is_told_with_what_it_does_to_every_reading(run: Command, tmp_path: Path) -> None:  # noqa: F811
    recording, found = made("pair")
    as_file(tmp_path, recording)
    replace(found, recordings=(recording,)).write(tmp_path / "diagnosis")
    done = run("report", tmp_path / "diagnosis", "--interactive", "-o", tmp_path / "x.html")
    assert done.code == 0, done.err
    told = scene((tmp_path / "x.html").read_text("utf-8"))
    assert len(told["findings"]) == len(found.findings)
    assert told["rows"]["before"] == pytest.approx(found.before_um, abs=1e-4)
    for one, finding in zip(told["findings"], found.findings, strict=True):
        assert one["share"] == pytest.approx(found.data.without_origins(finding.share_um), abs=1e-4)
        assert dict(one["facts"])["Probability"]
    assert told["rows"]["row"] == list(range(1, len(recording) + 1))


def test_listed_readings_are_found_again(diagnosed: Path, tmp_path: Path) -> None:
    sg.report(diagnosed, tmp_path / "x.html", interactive=True)
    told = scene((tmp_path / "x.html").read_text("utf-8"))
    (one,) = told["findings"]
    assert [told["rows"]["row"][i] for i in one["rows"]] == [5, 60]
    assert [told["rows"]["used"][i] for i in one["rows"]] == [0, 0]


def test_a_long_recording_is_thinned_evenly_and_keeps_what_is_listed() -> None:
    kept = _kept(3 * MOST_ROWS, [1, 2])
    assert {0, 1, 2, 3 * MOST_ROWS - 1} <= set(kept)
    assert len(kept) <= MOST_ROWS + 2
    assert np.diff(kept).max() <= 4


def test_the_page_of_a_long_recording_stays_small_and_says_what_it_leaves_out(tmp_path: Path) -> None:
    recording, found = made("pair")
    replace(found, recordings=(recording,)).write(tmp_path)
    said, rows = read_json(tmp_path / "diagnosis.json"), read_rows(tmp_path)
    long = pd.concat([rows] * 200, ignore_index=True)
    noise = np.random.default_rng(5).normal(size=(2, len(long)))
    long["before_um"], long["after_um"] = noise
    page = render_html(diagnosis_page(said, diagnosis_story(said), long)).data
    assert len(page) < MOST_BYTES
    assert f"{MOST_ROWS} of {len(long)} readings are shown" in page.decode()


def test_a_click_on_a_face_shows_its_probings(tmp_path: Path) -> None:
    path = tmp_path / "recording.csv"
    measure(4).recording.write(path)
    evaluation = sg.evaluate(path, "step-gauge-420")
    evaluation.write(tmp_path / "result")
    sg.report(evaluation, tmp_path / "x.html", interactive=True)
    click = "document.getElementById('main').emit('plotly_click', {points: [{customdata: 6}]})"
    document = browsed(tmp_path / "x.html", click)
    assert "Face 6, back of block 3, probed backward" in document
    rows = body_rows(document)
    assert [row[0] for row in rows] == ["1", "2", "3", "4"]
    (table,) = probing_errors(sg.read_recording(path), evaluation)
    shown = [float(row[1].replace("−", "-")) for row in rows]
    assert shown == pytest.approx(list(table[table["face"] == 6]["error_um"]), abs=1e-3)


def test_a_click_on_a_finding_tells_it_and_a_link_opens_a_face(diagnosed: Path, tmp_path: Path) -> None:
    sg.report(diagnosed, tmp_path / "x.html", interactive=True)
    document = browsed(tmp_path / "x.html", "document.querySelectorAll('#findings button')[1].click()", "#face=5")
    assert "2 readings are listed" in document
    assert "Face 5" in document
    rows = body_rows(document)
    assert len(rows) == 5
    assert len(re.findall(r'<tr class="out">', document)) == 1


def test_the_map_of_a_probe_has_a_page_with_its_quantities(tmp_path: Path) -> None:
    """Over the noise, so that forces and deflections stand beside each other; findings explain what was removed."""
    fea = Path(__file__).parents[1] / "examples/omp40-fea"
    found = sg.diagnose(fea / "map.csv", probe=fea / "existing-method.toml")
    found.write(tmp_path / "map")
    table = read_rows(tmp_path / "map")
    assert len(table) == len(found.fits) * len(found.data)
    force = table[table["placement"] == 1]
    shares = force[[name for name in table if str(name).startswith("finding_")]].sum(axis=1)
    np.testing.assert_allclose(shares, force["before_sd"] - force["after_sd"], rtol=1e-5, atol=1e-5)
    sg.report(tmp_path / "map", tmp_path / "x.html", interactive=True)
    told = scene((tmp_path / "x.html").read_text("utf-8"))
    assert [one["name"] for one in told["placements"]] == ["trigger force N", "deflection um"]
    assert [one["name"] for one in told["against"]] == ["azimuth (°)", "polar angle (°)", "order of the rows"]
    document = browsed(tmp_path / "x.html", "document.querySelectorAll('#findings button')[1].click()", "#face=3")
    assert re.search(r"Direction [0-9.]+° polar, [0-9.]+° azimuth", document)
    assert "of this quantity are moved by more than the noise" in document


def test_what_a_page_cannot_be_made_from_is_said(run: Command, diagnosed: Path, tmp_path: Path) -> None:  # noqa: F811
    done = run("report", diagnosed, "--interactive", "-o", tmp_path / "x.pdf")
    assert done.code == 2
    assert "not a page for a browser" in done.err
    (diagnosed / "residuals.csv").write_text("recording,row\n")
    done = run("report", diagnosed, "--interactive", "-o", tmp_path / "x.html")
    assert done.code == 2
    assert "residuals.csv: not a table of residuals" in done.err
    evaluate(measure(2).recording, shipped()[0]).write(tmp_path / "result")
    done = run("report", tmp_path / "result", "--interactive", "-g", "step-gauge-420", "-o", tmp_path / "x.html")
    assert done.code == 2
    assert "--recording" in done.err
    assert not (tmp_path / "x.html").exists()
