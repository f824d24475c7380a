"""``stepgauge measure`` on LinuxCNC itself: stopped and resumed, and what the controller complains about."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from stepgauge.gauge.certified import read_gauge
from stepgauge.gauge.placement import read_placement, write_placement
from tests.build import heed_interrupts
from tests.conftest import ROOT
from tests.integration.test_linuxcnc import EXAMPLE, TIMEOUT_S, pytestmark  # noqa: F401


def start(output: Path, *arguments: object) -> subprocess.Popen[str]:
    """The example with few points."""
    words = [sys.executable, str(EXAMPLE / "measure.py"), "-o", str(output), "--blocks", "1:5", "--cycles", "1"]
    return subprocess.Popen(
        [*words, *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        preexec_fn=heed_interrupts,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )


def test_it_is_stopped_and_resumed_and_finds_the_deviations(tmp_path: Path) -> None:
    process, journal = start(tmp_path), tmp_path / "recording.csv.journal"
    until = time.monotonic() + TIMEOUT_S
    while not journal.exists() or journal.read_bytes().count(b'"point"') < 4:
        assert process.poll() is None, process.communicate()[0]
        assert time.monotonic() < until
        time.sleep(0.02)
    process.send_signal(2)
    told, _ = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == 130, told
    assert "of 10 points measured; the same command with --resume goes on" in told
    assert not (tmp_path / "recording.csv").exists()
    process = start(tmp_path, "--resume")
    told, _ = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == 0, told
    assert "verdict: the deviations of the gauge in HAL are recovered within the latch error" in told
    assert journal.read_bytes().count(b'"point"') == 10


@pytest.mark.parametrize(
    ("up_mm", "along_mm", "said"),
    [(-40.0, 0.0, "no face where the program expects it"), (0.0, -8.0, "the probe touched something on its way")],
)
def test_what_the_controller_complains_about_ends_in_one_line(
    tmp_path: Path, up_mm: float, along_mm: float, said: str
) -> None:
    """A gauge that lies elsewhere in HAL than planned."""
    lies = read_placement(EXAMPLE / "placement.toml", read_gauge("step-gauge-420"))
    shift = up_mm * lies.up + along_mm * lies.axis
    write_placement(tmp_path / "true.toml", replace(lies, c1_mm=lies.c1_mm + shift, c2_mm=lies.c2_mm + shift))
    process = start(tmp_path / "out", "--true-placement", tmp_path / "true.toml")
    told, _ = process.communicate(timeout=TIMEOUT_S)
    assert process.returncode == 2, told
    last = told.strip().splitlines()[-1]
    assert last.startswith("measure.py: error: linuxcnc: ")
    assert said in last
    assert "of 10 points measured; expected the cause removed, then the same command with --resume" in last
