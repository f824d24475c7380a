"""The demo, and the examples that imitate the paper's results."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import pytest
from pypdf import PdfReader

from tests.cli.conftest import Run
from tests.conftest import ROOT


def test_the_demo_ends_in_a_report_and_a_figure_with_progress(run: Run, tmp_path: Path) -> None:
    result = run("demo", "-o", tmp_path / "demo", "--conceal", "backlash", "--seed", 7)
    assert result.code == 0, result.err
    steps = re.findall(r"^\[(\d+)/(\d+)\]", result.err, re.MULTILINE)
    assert [int(n) for n, _ in steps] == list(range(1, int(steps[0][1]) + 1))
    folder = tmp_path / "demo"
    data = json.loads((folder / "result/evaluation.json").read_text())
    # 14 ppm of the scale over 410 mm, and a wave of 0.8 um, with the scatter of 0.4 um
    assert data["band_um"] == pytest.approx(14e-3 * 390, abs=1.5)
    assert data["r_eff_mm"] == pytest.approx(2.0 - 0.003 - 0.00045, abs=0.0008)
    text = "".join(page.extract_text() for page in PdfReader(folder / "report.pdf").pages)
    assert "EXAMPLE-2026-0420" in text
    assert (folder / "result/error.png").stat().st_size > 10_000
    assert (folder / "report.html").exists()
    told = result.err[result.err.index("open the seal") :]
    assert "concealed was backlash of the y axis" in told
    assert "The diagnosis named it" in told
    assert all((folder / name).stat().st_size > 50_000 for name in ("story.html", "story.png"))


def example(run: Run, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict:
    """Run the commands of an example's README as they stand there; the evaluation they end in."""
    for path in (ROOT / "examples" / name).iterdir():
        if path.suffix in (".csv", ".toml"):
            (tmp_path / path.name).write_text(path.read_text())
    monkeypatch.chdir(tmp_path)
    readme = (ROOT / "examples" / name / "README.md").read_text()
    commands = re.findall(r"^stepgauge (.*)$", readme.replace("\\\n", " "), re.MULTILINE)
    assert len(commands) >= 3
    for command in commands:
        result = run(*shlex.split(command))
        assert result.code == 0, result.err
    return json.loads((tmp_path / "results/evaluation/evaluation.json").read_text())


def test_the_x_axis_of_fig_6(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pahk & Kim, Fig 6: a range of 8.5 um over 230 mm, 2s of 5.0 um from 5 cycles."""
    data = example(run, "fig6-x-axis", tmp_path, monkeypatch)
    assert data["span_mm"] == pytest.approx(230.0, abs=0.01)
    assert data["band_um"] == pytest.approx(8.5, abs=0.25)
    assert data["worst_two_sigma_um"] == pytest.approx(5.0, abs=0.25)
    assert data["placements"][0]["cycles"] == [5, 5]


def test_the_diagonal_of_fig_7(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pahk & Kim, Fig 7: 20.5 um over 270 mm from (364, 297, 195) to (225, 64, 195)."""
    data = example(run, "diagonal", tmp_path, monkeypatch)
    assert data["span_mm"] == pytest.approx(270.0, abs=0.01)
    assert data["band_um"] == pytest.approx(20.5, abs=0.4)
    axis = data["placements"][0]["axis"]
    assert axis[:2] == pytest.approx([-139 / 271.3117, -233 / 271.3117], abs=1e-3)


def test_the_program_of_fig_4(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    readme = (ROOT / "examples/fig4/README.md").read_text().replace("\\\n", " ")
    (command,) = re.findall(r"^stepgauge (plan .*)$", readme, re.MULTILINE)
    result = run(*shlex.split(command.replace("-o fig4.jyc", f"-o {tmp_path / 'fig4.jyc'}")))
    assert result.code == 0, result.err
    printed = (ROOT / "tests/data/pahk_kim_fig4.txt").read_text()
    assert (tmp_path / "fig4.jyc").read_text().startswith(printed)
