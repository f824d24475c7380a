"""The documentation site: it builds without warnings, and what its pages show can be run."""

from __future__ import annotations

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import matplotlib
import pytest

import stepgauge as sg
from stepgauge.axis.recording import OWN
from stepgauge.cli import VERBS
from stepgauge.effects import effect_kinds
from stepgauge.recording.columns import KNOWN
from tests.conftest import ROOT
from tests.shell import run_blocks, shell_blocks


@pytest.mark.skipif(os.name != "posix", reason="needs a POSIX shell with named pipes")
def test_the_tutorial_runs_in_an_empty_folder(
    tmp_path: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("STEPGAUGE_GAUGE", "STEPGAUGE_MACHINE"):
        monkeypatch.setenv(name, "")
    done = run_blocks(shell_blocks(ROOT / "docs/tutorial.md"), tmp_path_factory.mktemp("pipes"))
    assert done.returncode == 0, done.stderr
    made = tmp_path / "my-machine/results"
    assert (made / "report.pdf").stat().st_size > 10_000
    assert '"verdict": "adequate"' in (made / "diagnosis/diagnosis.json").read_text()


@pytest.mark.skipif(os.name != "posix", reason="needs a POSIX shell with named pipes")
def test_the_page_on_reports_runs_in_the_folder_of_a_measurement(
    tmp_path: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("STEPGAUGE_GAUGE", "step-gauge-420")
    monkeypatch.setenv("STEPGAUGE_MACHINE", "bridge-cmm")
    before = (
        f"stepgauge locate {ROOT}/examples/demo/points.csv -o placement.toml\n"
        "stepgauge plan placement.toml --dialect dmis --cycles 3 --blocks 1:8 -o gauge.dmi\n"
        "stepgauge simulate gauge.dmi -p placement.toml --gauge-temperature 20.4 -o recording.csv\n"
    )
    page = ROOT / "docs/reports.md"
    done = run_blocks([before, *shell_blocks(page)], tmp_path_factory.mktemp("pipes"))
    assert done.returncode == 0, done.stderr
    made = ("report.pdf", "diagnosis.pdf", "explore.html", "explore-diagnosis.html", "overlay.pdf", "overlay.png")
    assert all((tmp_path / name).stat().st_size > 10_000 for name in made)
    matplotlib.use("Agg")
    python = re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.S)
    exec(compile("\n".join(python), str(page), "exec"), {"sg": sg, "gauge": sg.read_gauge("step-gauge-420")})
    assert (tmp_path / "overlay.html").stat().st_size > 10_000


@pytest.mark.skipif(importlib.util.find_spec("sphinx") is None, reason="needs the extra 'docs'")
def test_the_site_builds_without_warnings_and_has_a_page_for_every_verb_and_effect(tmp_path: Path) -> None:
    """With the gallery, whose examples run; a link that leads nowhere is a warning."""
    build = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-d", str(tmp_path / "trees")]
    variables = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [*build, str(ROOT / "docs"), str(tmp_path / "site")], env=variables, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    pages = tmp_path / "site/_reference"
    assert {path.stem for path in (pages / "verbs").glob("*.html")} == {*VERBS, "index"}
    assert {path.stem for path in (pages / "effects").glob("*.html")} == {*effect_kinds(every=True), "index"}


def test_the_columns_of_the_reference_are_those_of_the_readers() -> None:
    """The names without their unit."""
    place = importlib.util.spec_from_file_location("reference", ROOT / "docs/reference.py")
    assert place is not None
    assert place.loader is not None
    reference = importlib.util.module_from_spec(place)
    place.loader.exec_module(reference)
    assert {name for names in reference.RECORDING for name in names.split(", ")} == set(KNOWN)
    assert {name.removesuffix("_UNIT") for name in reference.AXIS_RECORDING} == set(OWN)
