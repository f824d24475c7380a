"""The figure of the laws of an axis: means by direction, their sum with its uncertainty, and what is left."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from stepgauge.diagnosis.axis.diagnosis import AxisDiagnosis, diagnose_axis
from stepgauge.diagnosis.result import Diagnosis
from tests.axis.made import CYCLES, axis

TARGETS = np.linspace(0.0, 500.0, 11) + np.array([0.0, 3, -2, 1, 4, -4, 2, -1, 3, -3, 0])
NOISE_UM = 0.3


@pytest.fixture(scope="module")
def told() -> AxisDiagnosis:
    return diagnose_axis(axis(TARGETS, lambda x, way: 12e-3 * x + 2.0 * way, noise=NOISE_UM))


def test_the_uncertainty_of_the_sum_of_laws_is_that_of_a_fit_of_all_of_them(told: AxisDiagnosis) -> None:
    """Beside least squares of a line and a difference of the directions, less the origin."""
    assert sorted(one["kind"] for one in told.contents["effects"]) == ["reversal_error", "scale_error"]
    frame = told.data.recording.frame
    columns = np.array([frame["target"] - frame["target"].mean(), frame["way"] / 2.0])
    u_um = NOISE_UM * np.sqrt(np.einsum("in,ij,jn->n", columns, np.linalg.inv(columns @ columns.T), columns))
    np.testing.assert_allclose(told.drawn().two_u / 2.0, u_um, rtol=0.15)


def test_means_stand_on_the_curve_of_the_laws_within_their_bars(told: AxisDiagnosis) -> None:
    above, below = told.figures()["laws"].axes
    assert (above.get_ylabel(), below.get_ylabel()) == ("deviation (µm)", "residual (µm)")
    curves = {line.get_color(): line for line in above.lines if line.get_label() == "sum of the named causes"}
    assert len(curves) == 2
    for bars in above.containers:
        points = bars.lines[0]
        curve = curves[points.get_color()]
        order = np.argsort(points.get_xdata())
        off = np.abs(points.get_ydata()[order] - curve.get_ydata())
        assert off.max() < 4.0 * NOISE_UM / np.sqrt(CYCLES)
        np.testing.assert_allclose(np.diff(curve.get_ydata()) / np.diff(curve.get_xdata()), 12e-3, rtol=0.05)


def test_it_is_drawn_again_from_its_folder_and_on_axes_of_somebody_else(told: AxisDiagnosis, tmp_path: Path) -> None:
    told.write(tmp_path)
    assert list(Diagnosis.read(tmp_path).figures()) == ["laws", "residuals"]
    assert (tmp_path / "laws.png").stat().st_size > 10_000
    assert next(one.get_text() for one in told.plot().get_legend().get_texts()) == "sum of the named causes"


def test_without_a_law_there_is_no_curve() -> None:
    assert list(diagnose_axis(axis(TARGETS, lambda x, way: 0.0 * x)).figures()) == ["residuals"]
