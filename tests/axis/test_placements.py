"""Several placements of the same targets: the origin of each is free, and a probe reads where it lies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from stepgauge.axis.recording import AxisRecording
from stepgauge.diagnosis.axis.diagnosis import diagnose_axis
from stepgauge.diagnosis.axis.residuals import axis_data

from .made import axis

UNEVEN = np.array([0.0, 13.2, 34.1, 47.9, 70.3, 91.4, 104.8, 130.6, 143.1, 166.7, 188.9, 203.3, 226.1, 240.5])


def placed(sensor: str, *begin: float) -> AxisRecording:
    """The same axis with a wave of 24 mm, whose targets begin at each of ``begin`` by its readings."""
    runs = [
        axis(UNEVEN, lambda t, w, at=at: 3 * np.sin(np.pi * (t + at) / 12), sensor=sensor, seed=n)
        for n, at in enumerate(begin, 1)
    ]
    frames = [
        one.frame.assign(placement=n, reading=one.frame["reading"] + at)
        for n, (one, at) in enumerate(zip(runs, begin, strict=True), 1)
    ]
    return replace(runs[0], frame=pd.concat(frames, ignore_index=True))


@pytest.mark.parametrize("sensor", ["laser", "touch"])
def test_what_is_computed_bears_no_origin_of_a_placement(sensor: str) -> None:
    one = placed(sensor, 0.0, 0.0)
    moved = one.frame.assign(reading=one.frame["reading"] + np.where(one.frame["placement"] == 1, 120.0, 257.3))
    plain, shifted = axis_data(one), axis_data(replace(one, frame=moved))
    assert np.allclose(plain.residuals.um, shifted.residuals.um, atol=1e-6)
    assert plain.repeatability == pytest.approx(shifted.repeatability)


@pytest.mark.parametrize(("sensor", "apart"), [("laser", 0.0), ("touch", 137.3)])
def test_a_probe_alone_reads_where_another_placement_lies(sensor: str, apart: float) -> None:
    data = axis_data(placed(sensor, 120.0, 257.3))
    at = data.residuals.probings.coordinate_mm("x") / data.scaling.position
    second = data.residuals.placement == 1
    assert at[second].mean() - at[~second].mean() == pytest.approx(apart, abs=1e-3)


def test_a_wave_along_the_axis_is_one_wave_in_all_placements() -> None:
    (found,) = diagnose_axis(placed("touch", 120.0, 257.3)).contents["effects"]
    assert found["parameters"]["period_mm"]["value"] == pytest.approx(24.0, abs=0.1)
    assert found["parameters"]["amplitude_um"]["value"] == pytest.approx(3.0, abs=0.2)
