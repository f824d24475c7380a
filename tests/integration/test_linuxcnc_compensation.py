"""Screw compensation on LinuxCNC itself: a hidden screw error, measured, put into COMP_FILE, measured again."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from stepgauge.evaluation.files import read_evaluation
from tests.conftest import ROOT

EXAMPLE = ROOT / "examples" / "compensation"
LATCH_UM = 0.3
"""3 mm/s for the 100 us between two looks at the probe."""

pytestmark = [
    pytest.mark.linuxcnc,
    pytest.mark.skipif(
        shutil.which("linuxcnc") is None, reason="LinuxCNC is not installed (apt-get install linuxcnc-uspace)"
    ),
]


def xm_um(folder: Path) -> np.ndarray:
    faces = read_evaluation(folder / "evaluation.json")["placements"][0]["faces"]
    return np.array([row["xm_um"] for row in faces if row["xm_um"] is not None])


def test_what_the_controller_measures_shrinks_to_its_latch_error(tmp_path: Path) -> None:
    """With trims (type 1); positions (type 0) are the default of the example and mean the same to the controller."""
    command = [sys.executable, str(EXAMPLE / "linuxcnc.py"), "-o", str(tmp_path / "out"), "--file-type", "1"]
    result = subprocess.run(command, capture_output=True, text=True, timeout=1500, check=False)
    assert result.returncode == 0, result.stdout + result.stderr
    ini = (tmp_path / "out" / "after" / "simulation.ini").read_text()
    assert "COMP_FILE = joint-0.comp\nCOMP_FILE_TYPE = 1\n" in ini
    assert "COMP_FILE" not in (tmp_path / "out" / "before" / "simulation.ini").read_text()
    before, after = xm_um(tmp_path / "out" / "before"), xm_um(tmp_path / "out" / "after")
    assert np.abs(before).max() > 4.0
    # screw.csv bends by up to 1.9 um per 20 mm at its knots: chords between fronts are off by up to a quarter of that
    assert np.abs(after).max() < LATCH_UM + 0.3
    radius = [read_evaluation(tmp_path / "out" / name / "evaluation.json")["r_eff_mm"] for name in ("before", "after")]
    assert radius[0] < 1.998, "the play and the screw make block 1 look small"
    assert abs(radius[1] - 2.0) * 1e3 < LATCH_UM
