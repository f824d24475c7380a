"""The figures of a measurement carry its numbers: single probings, repeatability, arrows, run chart, MPE, history."""

from __future__ import annotations

import io

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stepgauge.errors import InputError
from stepgauge.evaluation.evaluate import evaluate
from stepgauge.evaluation.files import evaluation_to_dict
from stepgauge.evaluation.probings import probing_errors
from stepgauge.figures.arrows import across, arrows_figure
from stepgauge.figures.compensation import compensation_figure
from stepgauge.figures.evaluation import evaluation_figure
from stepgauge.figures.history import history_figure
from stepgauge.figures.measurement import run_chart_figure
from stepgauge.figures.probings import bidirectional_figure, repeatability_figure
from stepgauge.history import make_series
from stepgauge.recording import Recording, join_recordings
from stepgauge.standards.mpe import Mpe
from tests.measured import ALONG_X, run, shipped
from tests.test_compensation import GAUGE, measured, table_of
from tests.test_history import entry


@pytest.fixture(scope="module")
def recording() -> Recording:
    """Two placements, three and two cycles."""
    return join_recordings([run(3).recording, run(2, ALONG_X).recording])


@pytest.fixture(scope="module")
def evaluation(recording: Recording):
    return evaluate(recording, shipped()[0])


def fits(figure: Figure) -> bool:
    """Nothing is drawn beyond the sheet, legends included."""
    figure.savefig(io.BytesIO(), format="png", dpi=60)
    box = figure.get_tightbbox()
    width, height = figure.get_size_inches()
    return bool(box.x0 > -0.02 and box.y0 > -0.02 and box.x1 < width + 0.02 and box.y1 < height + 0.02)


def points(axes: Axes, marker: str) -> np.ndarray:
    """All points drawn with a marker, shape (n, 2)."""
    found = [line.get_xydata() for line in axes.get_lines() if line.get_marker() == marker]
    return np.concatenate([np.asarray(one, float) for one in found]) if found else np.empty((0, 2))


def test_errors_of_single_probings_have_the_means_of_the_evaluation(recording, evaluation) -> None:
    for table, result in zip(probing_errors(recording, evaluation), evaluation.results, strict=True):
        own = np.where(result.face % 2 == 1, result.xf_um, result.xb_um)
        by_face = table.groupby("face")
        np.testing.assert_allclose(by_face["error_um"].mean(), own, atol=1e-9)
        sigma = np.where(result.face % 2 == 1, result.sf_um, result.sb_um)
        np.testing.assert_allclose(by_face["error_um"].std(), sigma, atol=1e-9)
        np.testing.assert_allclose(by_face["residual_um"].mean(), 0.0, atol=1e-9)


def test_residuals_are_along_the_gauge() -> None:
    """In the second cycle every face reads some um farther along the axis: it and its fellow are half of that off."""
    frame = measured(GAUGE).frame.copy()
    farther_um = 5.0 * np.cos(2.0 * frame["face"].to_numpy()) * (frame["cycle"] == 2)
    frame["x_mm"] += 1e-3 * farther_um
    moved = Recording(frame, {}, "moved.csv")
    (table,) = probing_errors(moved, evaluate(moved, GAUGE))
    half_um = 2.5 * np.cos(2.0 * table["face"])
    np.testing.assert_allclose(table["residual_um"], np.where(table["cycle"] == 2, half_um, -half_um), atol=1e-6)


def test_bidirectional_shows_means_and_every_probing(recording, evaluation) -> None:
    table = probing_errors(recording, evaluation)[0]
    figure = bidirectional_figure(table, Mpe.parse("1.8 + L/350"))
    axes = figure.axes[0]
    result = evaluation.results[0]
    front = result.face % 2 == 1
    np.testing.assert_allclose(np.unique(points(axes, ">")[:, 1]), np.unique(result.xf_um[front]), atol=1e-9)
    np.testing.assert_allclose(np.unique(points(axes, "<")[:, 1]), np.unique(result.xb_um[~front]), atol=1e-9)
    np.testing.assert_allclose(np.sort(points(axes, ".")[:, 1]), np.sort(table["error_um"]), atol=1e-9)
    assert fits(figure)


def test_repeatability_shows_two_sigma_and_range(recording, evaluation) -> None:
    table = probing_errors(recording, evaluation)[0]
    figure = repeatability_figure(table)
    single, spread = figure.axes
    np.testing.assert_allclose(
        np.sort(np.r_[points(single, ">")[:, 1], points(single, "<")[:, 1]]), np.sort(table["residual_um"]), atol=1e-9
    )
    by_face = table[table["front"]].groupby("face")["error_um"]
    expected = np.r_[2 * by_face.std(), by_face.max() - by_face.min()]
    np.testing.assert_allclose(np.sort(points(spread, ">")[:, 1]), np.sort(expected), atol=1e-9)
    assert fits(figure)


def test_a_single_cycle_is_drawn_without_spread() -> None:
    one = run(1).recording
    (table,) = probing_errors(one, evaluate(one, shipped()[0]))
    for figure in (bidirectional_figure(table), repeatability_figure(table), run_chart_figure([table])):
        assert fits(figure)


def test_mpe_lines_start_at_the_reference_face(evaluation) -> None:
    placement = evaluation_to_dict(evaluation)["placements"][0]
    limit = Mpe.parse("1.5 + L/100")
    figure = evaluation_figure(placement, limit)
    (upper,) = [line for line in figure.axes[0].get_lines() if "MPE" in str(line.get_label())]
    x, y = np.asarray(upper.get_xydata(), float).T
    np.testing.assert_allclose(y, 1.5 + (x - x[0]) / 100.0)
    assert x[0] == placement["faces"][0]["nominal_mm"]
    assert fits(figure)


def test_arrows_stand_across_the_gauge_with_the_stated_magnification(evaluation) -> None:
    travel = np.array([[0.0, 700.0], [0.0, 1200.0], [0.0, 600.0]])
    figure = arrows_figure(evaluation.results, travel, "CMM")
    text = " ".join(one.get_text() for one in figure.texts)
    magnification = float(text.split("magnified ")[1].split(" times")[0].replace(" ", ""))
    assert f"1 µm is drawn as {magnification * 1e-3:g} mm" in text
    result = evaluation.results[0]
    known = np.isfinite(result.xm_um)
    foot = result.origin_mm + np.outer(result.position_mm - result.position_mm[0], result.axis)
    tips = (foot + np.outer(result.xm_um * 1e-3 * magnification, [0.0, 0.0, 1.0]))[known]
    drawn = [np.array(line.get_data_3d()).T for line in figure.axes[0].get_lines()]
    same = [
        one for one in drawn if one.shape == tips.shape and np.allclose(one, tips, atol=0.05 * magnification * 1e-3)
    ]
    assert same
    longest = max(np.nanmax(np.abs(one.xm_um)) for one in evaluation.results) * 1e-3 * magnification
    assert 0.05 < longest / np.linalg.norm(np.ptp(travel, axis=1)) <= 0.161
    assert fits(figure)


def test_across_is_perpendicular_and_upwards() -> None:
    for axis in np.random.default_rng(0).normal(size=(50, 3)):
        axis /= np.linalg.norm(axis)
        direction = across(axis)
        assert abs(direction @ axis) < 1e-12
        assert np.linalg.norm(direction) == pytest.approx(1.0)


def test_a_placement_outside_the_travel_is_refused(evaluation) -> None:
    with pytest.raises(InputError, match=r"placement 1 is outside the travel of z; found .* expected 300 to 600 mm"):
        arrows_figure(evaluation.results, np.array([[0.0, 700.0], [0.0, 1200.0], [300.0, 600.0]]))


def test_run_chart_by_time_with_temperatures(recording, evaluation) -> None:
    tables = probing_errors(recording, evaluation)
    figure = run_chart_figure(tables)
    errors, temperatures = figure.axes
    np.testing.assert_allclose(
        points(errors, ">")[: tables[0]["front"].sum(), 0], tables[0]["time_s"][tables[0]["front"]] / 60
    )
    assert {line.get_label() for line in temperatures.get_lines()} == {"gauge", "scales x, y, z", "_more"}
    warmer = [table.assign(scale_temperature_y_C=table["scale_temperature_y_C"] + 0.1) for table in tables]
    lines = run_chart_figure(warmer).axes[1].get_lines()
    assert {line.get_label() for line in lines} == {"gauge", "scale x", "scale y", "scale z", "_more"}
    both = np.concatenate([points(errors, marker)[:, 1] for marker in "><"])
    both = both[np.isfinite(both)]
    np.testing.assert_allclose(
        np.sort(both), np.sort(np.concatenate([table["residual_um"] for table in tables])), atol=1e-9
    )
    assert fits(figure)


def test_without_times_and_temperatures_probings_are_counted() -> None:
    made = measured(GAUGE, noise_um=0.2, cycles=3)
    figure = run_chart_figure(probing_errors(made, evaluate(made, GAUGE)))
    (axes,) = figure.axes
    assert axes.get_xlabel() == "probing"
    assert "no times recorded" in axes.get_title(loc="left")
    assert sorted(np.r_[points(axes, ">")[:, 0], points(axes, "<")[:, 0]]) == list(range(1, 73))


def test_table_of_a_compensation() -> None:
    table = table_of(GAUGE, measured(GAUGE, reversal_um=3.0))
    figure = compensation_figure(table)
    errors, reversal = figure.axes
    np.testing.assert_allclose(points(errors, ">")[: len(table), 1], table.positive_um)
    np.testing.assert_allclose(points(reversal, "D")[:, 1], table.reversal_um)
    assert fits(figure)
    for travel, marker in (("mean", "o"), ("positive", ">"), ("negative", "<")):
        table = table_of(GAUGE, measured(GAUGE, reversal_um=3.0), travel=travel, step_mm=10.0)
        figure = compensation_figure(table)
        (axes,) = figure.axes
        np.testing.assert_allclose(points(axes, marker)[: len(table), 1], table.mean_um)
        assert fits(figure)


def test_history_with_limits_and_an_outlier() -> None:
    values = [0.1, -0.1, 0.05, 0.0, 0.12, 3.0, -0.05, 0.08]
    entries = [entry(90.0 * i, v) for i, v in enumerate(values)]
    entries += [entry(90.0 * i + 1, 0.5 * v, direction="y") for i, v in enumerate(values)]
    figure = history_figure(make_series(entries), {"scale_ppm": 2.0, "band_um": 3.0}, "CMM 4")
    assert len(figure.axes) == 5
    limits = [line.get_ydata()[0] for line in figure.axes[0].get_lines() if len(line.get_xdata()) == 2]
    assert {2.0, -2.0} <= set(limits)
    (ring,) = [line for line in figure.axes[0].get_lines() if line.get_label() == "_beyond" and len(line.get_xdata())][
        :1
    ]
    assert ring.get_ydata().tolist() == [3.0]
    assert fits(figure)


def test_history_of_two_dates_has_no_trend() -> None:
    figure = history_figure(make_series([entry(0, 1.0), entry(100, 2.0)]), {}, "CMM")
    assert all(len(line.get_xdata()) <= 2 for axes in figure.axes for line in axes.get_lines())
    assert fits(figure)
