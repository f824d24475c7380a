"""What a diagnosis explains: readings minus the simulation of the machine file."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import stepgauge as sg
from stepgauge.diagnosis.residuals import make_residuals
from stepgauge.recording import join_recordings
from tests.conftest import ROOT


def test_readings_corrected_for_the_tip_show_no_pretravel_of_the_machine_file() -> None:
    """Positions of faces, as a report lists them: what radius they are turned back with is nothing of the probe."""
    gauge, machine = sg.read_gauge("step-gauge-420"), sg.read_machine("bridge-cmm")
    placement = sg.locate(ROOT / "examples/demo/points.csv", gauge, machine=machine)
    noise = np.random.default_rng(5).normal(0.0, 3e-4, (gauge.n_faces, 3))
    runs = {f"Run {k + 1} [mm]": gauge.position_mm + noise[:, k] for k in range(3)}
    table = pd.DataFrame({"Face": np.arange(gauge.n_faces) + 1, "Nominal [mm]": gauge.nominal_mm, **runs})
    given = {"gauge": gauge, "placement": placement, "sensor": "touch", "gauge_temperature_C": 20.0}
    recordings = [sg.import_recording(table, tip_radius_mm=radius, **given).recording for radius in (None, 1.998)]
    for recording in recordings:
        data = make_residuals(recording, gauge, machine)
        assert data.um[data.side > 0].mean() + data.um[data.side < 0].mean() == pytest.approx(0.0, abs=0.1)
        assert "had been corrected for the tip" in sg.evaluate(recording, gauge).summary()
    one, other = (make_residuals(join_recordings(some), gauge, machine) for some in (recordings, recordings[::-1]))
    np.testing.assert_allclose(one.um, other.um, atol=1e-6)  # whichever radius both are turned back with
