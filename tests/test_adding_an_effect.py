"""The page docs/adding-an-effect.md does what it says, with its own code and nothing else changed."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

PAGE = Path(__file__).resolve().parent.parent / "docs" / "adding-an-effect.md"
PREPARE = "import sys, stepgauge.effects; stepgauge.effects.__path__.append(sys.argv[1])\n"
"""As if the folder's modules were in ``stepgauge/effects/``."""
RUN = """
from dataclasses import replace
import numpy as np
from stepgauge.gauge.certified import read_gauge
from stepgauge.machine.virtual import probing_settings, run_program
from stepgauge.machine.file import read_machine
from stepgauge.gauge.placement import make_placement
from stepgauge.planning.plan import PlanOptions, make_program

gauge, machine = read_gauge("step-gauge-420"), read_machine("bridge-cmm")
machine = replace(machine, effects=({"kind": "resolution", "axis": "x", "step_um": 50.0},))
placement = make_placement([100, 100, 100], [500, 100, 100], 1, gauge.n_blocks)
program = make_program(placement, gauge, PlanOptions(1, 21, cycles=1), probing_settings(machine, 2.0))
table = machine.table.model_copy(update={"repeatability_um": 0.0})
run = run_program(program, replace(machine, table=table), gauge, placement, 1, explain=True)
steps = run.recording.position_mm[:, 0] / 0.05
print(np.abs(steps - np.round(steps)).max() < 1e-6, *run.shares)
"""
"""Whether all readings are whole steps, and the names of the shares."""


@pytest.fixture
def code() -> list[str]:
    return re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), flags=re.S)


def python(text: str, folder: Path) -> str:
    command = [sys.executable, "-W", "error", "-c", PREPARE + text, str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture
def folder(code: list[str], tmp_path: Path) -> Path:
    (tmp_path / "resolution.py").write_text(code[0], encoding="utf-8")
    return tmp_path


def test_it_is_under_40_lines(code: list[str]) -> None:
    assert len(code[0].splitlines()) < 40


def test_its_own_test_passes_and_fails_without_the_effect(code: list[str], folder: Path) -> None:
    assert python(code[1], folder) == ""
    with pytest.raises(AssertionError, match=r"Not equal to tolerance"):
        python(code[1].replace('"step_um": 0.5', '"step_um": 0.25'), folder)


def test_the_simulator_applies_and_explains_it(folder: Path) -> None:
    whole, *shares = python(RUN, folder).split()
    assert whole == "True"
    assert "share_resolution_x_um" in shares


def test_the_command_line_lists_and_explains_it(folder: Path) -> None:
    said = python("from stepgauge.cli import main\nmain(['list', 'effects'])", folder)
    assert re.search(r"^resolution +The scale reads in whole steps$", said, flags=re.M)
    said = python("from stepgauge.cli import main\nmain(['list', 'effects', 'resolution'])", folder)
    assert "step of the scale, um; above 0 to 1000; usually 0.01 to 5; nonlinear" in said


def test_it_is_a_candidate_like_any_other(folder: Path) -> None:
    said = python(
        "print({k: [p.name for p in e.parameters()] for k, e in stepgauge.effects.effect_kinds().items()})", folder
    )
    assert "'resolution': ['axis', 'step_um']" in said
