"""Effects hidden in a real controller's HAL and INI files, diagnosed from its log. Needs linuxcnc-uspace."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from stepgauge.gauge.certified import read_gauge
from stepgauge.gauge.placement import read_placement
from stepgauge.recording import Recording, read_recording
from tests.conftest import ROOT

EXAMPLE = ROOT / "examples" / "linuxcnc-concealed"
CASES = ("nothing", "drift")
"""A false alarm, and what needs the clock; the command of the README runs all cases, in four minutes."""
TIMEOUT_S = 2400.0

pytestmark = [
    pytest.mark.linuxcnc,
    pytest.mark.skipif(
        shutil.which("linuxcnc") is None, reason="LinuxCNC is not installed (apt-get install linuxcnc-uspace)"
    ),
]


@dataclass(frozen=True)
class Whole:
    """What the cases left: the folder, what was printed, and how the commands ended."""

    folder: Path
    printed: str
    codes: list[int]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Whole:
    """The command of the README, once for each half of the cases: one half is diagnosed while the other is run."""
    folder = tmp_path_factory.mktemp("concealed")

    def run(cases: tuple[str, ...]) -> subprocess.CompletedProcess[str]:
        names = [word for case in cases for word in ("--case", case)]
        command = [sys.executable, str(EXAMPLE / "run.py"), "-o", str(folder), *names]
        return subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_S, check=False)

    with ThreadPoolExecutor(2) as pool:
        results = list(pool.map(run, (CASES[::2], CASES[1::2])))
    return Whole(folder, "".join(r.stdout + r.stderr for r in results), [r.returncode for r in results])


def line_of(whole: Whole, case: str) -> str:
    found = re.search(rf"^{case} .*$", whole.printed, re.M)
    assert found, whole.printed
    return found[0]


def late_um(recording: Recording) -> np.ndarray:
    """How far beyond the certified face a point was read, in plain vectors from the placement file."""
    name = Path(recording.path).parent.name.rpartition("-mm-s")[0].rpartition("-")[0]
    gauge = read_gauge("step-gauge-420")
    placement = read_placement(EXAMPLE / f"{name}.toml", gauge)
    along = (recording.position_mm - placement.c1_mm) @ placement.axis + gauge.position_mm[:2].mean()
    face = recording.frame["face"].to_numpy()
    sign = np.where(face % 2 == 1, 1.0, -1.0)
    return ((along - gauge.position_mm[face - 1]) * sign + 2.0) * 1e3


@pytest.mark.parametrize("case", CASES)
def test_what_is_hidden_in_the_controller_is_named_with_its_value(whole, case: str):
    assert " yes " in line_of(whole, case), line_of(whole, case)


def test_the_commands_end_well(whole):
    assert whole.codes == [0, 0], whole.printed


def test_the_scatter_is_that_of_the_latch_and_no_other(whole):
    """With nothing hidden a contact is read 0 to v T late, evenly spread, beside what the certificate leaves open."""
    recordings = [read_recording(path) for path in sorted(whole.folder.glob("nothing/*/recording.csv"))]
    assert len(recordings) == 2
    for recording in recordings:
        by_face = [group for _, group in recording.frame.assign(late=late_um(recording)).groupby("face")["late"]]
        apart = np.array([np.ptp(group) for group in by_face])
        step_um = 4.0 * 0.1  # 4 mm/s for 0.1 ms
        assert apart.max() < step_um + 1e-3
        assert 0.15 * step_um < apart.mean() < 0.55 * step_um, "two even draws are a third of their range apart"


def test_the_clock_of_hal_gives_every_point_its_time(whole):
    for path in whole.folder.glob("drift/*/recording.csv"):
        time_s = read_recording(path).frame["time_s"].to_numpy()
        assert (np.diff(time_s) > 0.1).all()
        assert np.ptp(time_s) < 60.0


def test_the_truth_is_refused_to_the_diagnosis(whole, tmp_path: Path):
    """The process that diagnoses ends when anything in it opens a sealed file."""
    sealed = whole.folder / "nothing" / "along-x-4-mm-s" / "recording.csv"
    verb = ["diagnose", sealed, "-g", "step-gauge-420", "-m", EXAMPLE / "machine.toml", "-o", tmp_path / "out"]
    result = subprocess.run(
        [sys.executable, EXAMPLE / "sealed.py", sealed, "--", *verb],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert result.returncode == 3
    assert result.stderr == "error: recording.csv is sealed\n"
    assert not (tmp_path / "out").exists()


def test_no_recording_nor_diagnosis_carries_the_truth(whole):
    """Nothing of what the concealer set has reached the files that the diagnosis read or wrote."""
    words = ("scale_ppm", "play_um", "debounce_samples", "debounce.0", "drift_um", "servo", "truth")
    for path in [*whole.folder.glob("*/*/recording.csv"), *whole.folder.glob("*/*/program.ngc")]:
        assert not [word for word in words if word in path.read_text()], path
    for path in whole.folder.glob("*/diagnosis/diagnosis.json"):
        read = json.loads(path.read_text())["inputs"]["recordings"]
        assert all(Path(one["path"]).name == "recording.csv" for one in read)
