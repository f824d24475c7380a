"""An installed wheel works outside the checkout, with its own copies of the shipped files."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from tests.conftest import ROOT


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the unpacked wheel, built from this checkout."""
    folder = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    done = subprocess.run(build, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    (wheel,) = folder.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder / "site")
    return folder / "site"


def outside(installed: Path, tmp_path: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the installed package in an empty folder."""
    environment = {**os.environ, "PYTHONPATH": str(installed)}
    line = [sys.executable, "-m", "stepgauge", *arguments]
    return subprocess.run(line, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)


def test_the_wheel_is_what_runs(installed: Path, tmp_path: Path) -> None:
    script = "import stepgauge, stepgauge.files.resources as r; print(stepgauge.__file__); print(r.folder('templates'))"
    environment = {**os.environ, "PYTHONPATH": str(installed)}
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=tmp_path, env=environment, capture_output=True, text=True, check=True
    )
    assert all(line.startswith(str(installed)) for line in done.stdout.splitlines())


def test_the_demo_runs_from_the_wheel(installed: Path, tmp_path: Path) -> None:
    done = outside(installed, tmp_path, "demo")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "stepgauge-demo/report.pdf").read_bytes().startswith(b"%PDF")


def test_the_wheel_ships_what_a_user_may_copy(installed: Path, tmp_path: Path) -> None:
    listed = outside(installed, tmp_path, "list", "files").stdout
    for folder in ("calibration_data", "calibration_data/machines", "templates/programs", "templates/reports"):
        for path in (ROOT / folder).iterdir():
            if path.suffix in (".toml", ".j2", ".typ"):
                assert path.name in listed
