"""Positions of the faces along the gauge, as a report of a CMM lists them: what they show, and what they cannot."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import stepgauge as sg
from stepgauge.gauge.certified import Gauge
from stepgauge.importing.result import Imported
from stepgauge.recording import Recording
from tests.conftest import ROOT


def radius_mm(imported: Imported, gauge: Gauge) -> float:
    """The effective tip radius of all blocks."""
    recording = imported.settled()
    assert isinstance(recording, Recording)
    return sg.evaluate(recording, gauge, r_eff_origin="all").r_eff_mm


def test_positions_along_the_gauge_take_the_radius_that_the_machine_has() -> None:
    """They do not show it: with that of the 16 points a diagnosis named an error of the probe that nobody could see."""
    steps, machine = sg.read_gauge("step-gauge-420"), sg.read_machine("bridge-cmm")
    placement = sg.locate(ROOT / "examples/demo/points.csv", steps, machine=machine)
    noise_mm = np.random.default_rng(5).normal(0.0, 3e-4, (42, 3))
    scaled = steps.position_mm[:, None] * (1.0 + 4e-6) + noise_mm
    table = pd.DataFrame({"Face": np.arange(1, 43), "Nominal [mm]": steps.nominal_mm})
    table = table.assign(**{f"Actual {run} [mm]": scaled[:, run - 1] for run in (1, 2, 3)})
    imported = sg.import_recording(table, sensor="touch", gauge=steps, placement=placement, machine=machine)
    assert any("do not show the tip radius" in line for line in imported.report)
    expected_mm = machine.probe.tip_radius_mm - 3e-3
    block_um = 4e-6 * 1e3 * float(np.diff(steps.position_mm)[::2].mean())
    assert radius_mm(imported, steps) == pytest.approx(expected_mm - block_um / 2e3, abs=1.5e-4)
    assert placement.tip_radius_mm is not None
    assert abs(placement.tip_radius_mm - expected_mm) > 1e-5
    stated = sg.import_recording(table, sensor="touch", gauge=steps, placement=placement, tip_radius_mm=1.5)
    assert radius_mm(stated, steps) == pytest.approx(1.5, abs=1.5e-4)
