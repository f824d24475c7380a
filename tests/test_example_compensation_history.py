"""The commands of examples/compensation and examples/history, and the numbers that their READMEs state."""

from __future__ import annotations

import importlib.util
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import ROOT


def run_example(script: str, folder: Path) -> str:
    command = [sys.executable, str(ROOT / "examples" / script), "-o", str(folder)]
    result = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert result.returncode == 0, result.stderr
    return result.stdout


def test_the_virtual_compensation(tmp_path: Path) -> None:
    said = run_example("compensation/virtual.py", tmp_path)
    bands = dict(re.findall(r"(before|after): range of XM ([\d.]+) um", said))
    readme = (ROOT / "examples/compensation/README.md").read_text()
    stated = dict(re.findall(r"^\| (before|after) \| ([\d.]+) um", readme, re.M)[:2])
    assert {name: float(band) for name, band in bands.items()} == pytest.approx(
        {name: float(band) for name, band in stated.items()}, abs=0.06
    )
    for name in ("x.csv", "x.comp", "AX1_EEC.INI", "x.png", "x.csv.json"):
        assert (tmp_path / name).stat().st_size > 300


def test_the_history(tmp_path: Path) -> None:
    """Put in: 1.94 um/m a year on x, a reversal that is 2.4 um larger at one date."""
    spec = importlib.util.spec_from_file_location("history_example", ROOT / "examples/history/make.py")
    assert spec is not None
    assert spec.loader is not None
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    example.main(["-o", str(tmp_path)], standalone_mode=False)
    data = json.loads((tmp_path / "history" / "history.json").read_text())
    (scale,) = [s for s in data["series"] if (s["quantity"], s["direction"]) == ("scale_ppm", "x")]
    assert scale["trend"]["per_year"] == pytest.approx(1.94, abs=3 * scale["trend"]["u_per_year"])
    control = [w for w in data["warnings"] if w["kind"] == "control"]
    assert [(w["quantity"], w["measured_at"][:10]) for w in control] == [("r_eff_change_um", "2025-04-09")]
    (r_eff,) = [s for s in data["series"] if (s["quantity"], s["direction"]) == ("r_eff_change_um", "x")]
    assert r_eff["values"][5] - r_eff["values"][4] == pytest.approx(-2.4 / 2, abs=0.5)
