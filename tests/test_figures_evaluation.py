"""The figures of an evaluation carry its numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection

from stepgauge.errors import InputError
from stepgauge.evaluation.evaluate import PlacementResult
from stepgauge.evaluation.files import evaluation_to_dict
from stepgauge.figures.evaluation import describe, evaluation_figure
from stepgauge.figures.style import save_figure
from tests.measured import one_placement, with_gaps


def line(axes: Axes, label: str) -> np.ndarray:
    """Data of the line of this label, shape (n, 2)."""
    (found,) = [one for one in axes.get_lines() if one.get_label() == label]
    return np.asarray(found.get_xydata(), float)


def bands(axes: Axes) -> list[PolyCollection]:
    return [one for one in axes.collections if str(one.get_gid()).startswith("two-sigma")]


def expected(result: PlacementResult, values: np.ndarray, where: np.ndarray) -> np.ndarray:
    return np.column_stack([result.nominal_mm, values])[where]


@pytest.mark.parametrize("make", [one_placement, with_gaps])
def test_points_are_the_evaluation_and_hollow_where_interpolated(make) -> None:
    evaluation = make()
    result = evaluation.results[0]
    errors, reversal = evaluation_figure(evaluation_to_dict(evaluation)["placements"][0]).axes
    front = result.face % 2 == 1
    for label, values, measured in (("forward XF", result.xf_um, front), ("backward XB", result.xb_um, ~front)):
        for part, where in (("measured", measured), ("interpolated", ~measured)):
            found = line(errors, f"{label} {part}")
            np.testing.assert_allclose(found, expected(result, values, where), atol=1e-12)
            (artist,) = [one for one in errors.get_lines() if one.get_label() == f"{label} {part}"]
            assert (artist.get_markerfacecolor() == "white") == (part == "interpolated")
    every = np.ones(len(front), bool)
    np.testing.assert_allclose(line(errors, "mean XM"), expected(result, result.xm_um, every), atol=1e-12)
    np.testing.assert_allclose(line(reversal, "reversal XR"), expected(result, result.xr_um, every), atol=1e-12)


def test_missing_faces_leave_gaps() -> None:
    evaluation = with_gaps()
    mean = line(evaluation_figure(evaluation_to_dict(evaluation)["placements"][0]).axes[0], "mean XM")
    # Faces 4 and 7 are missing: means need the face and its two neighbours.
    gone = np.flatnonzero(np.isnan(mean[:, 1])) + 1
    assert list(gone) == [1, 3, 4, 5, 6, 7, 8, 12]


def test_bands_reach_two_sigma_to_both_sides() -> None:
    result = one_placement().results[0]
    errors = evaluation_figure(evaluation_to_dict(one_placement())["placements"][0]).axes[0]
    forward, backward = bands(errors)
    for band, mean, sigma in ((forward, result.xf_um, result.sf_um), (backward, result.xb_um, result.sb_um)):
        corners = np.vstack([path.vertices for path in band.get_paths()])
        for x, centre, s in zip(result.nominal_mm, mean, sigma, strict=True):
            if np.isfinite(s):
                there = corners[corners[:, 0] == x][:, 1]
                assert there.min() == pytest.approx(centre - 2 * s, abs=1e-12)
                assert there.max() == pytest.approx(centre + 2 * s, abs=1e-12)


def test_readings_left_out_are_crosses_and_in_the_legend() -> None:
    """A near one at its place, a far one at the edge with its distance; the sentence below counts them."""
    placement = evaluation_to_dict(one_placement())["placements"][0]
    plain = evaluation_figure(placement).axes[0]
    assert "left out" not in [one.get_label() for one in plain.get_lines()]
    readings = [{"face": 5, "cycle": 2, "off_um": 4.0}, {"face": 8, "cycle": 1, "off_um": -399.6}]
    marked = placement | {"left_out": readings}
    figure = evaluation_figure(marked)
    errors = figure.axes[0]
    near, far = line(errors, "left out")
    rows = {row["face"]: row for row in placement["faces"]}
    np.testing.assert_allclose(near, [rows[5]["nominal_mm"], rows[5]["xf_um"] + 4.0], atol=1e-12)
    low, high = errors.get_ylim()
    assert far[0] == rows[8]["nominal_mm"]
    assert low < far[1] < plain.get_ylim()[0]
    assert high - low < 2.5 * np.ptp(plain.get_ylim())
    assert "-399.6 µm" in [text.get_text() for text in errors.texts]
    assert "left out" in [text.get_text() for text in figure.legends[0].get_texts()]
    assert describe(marked).endswith("; 2 readings left out")


def test_worst_two_sigma_and_band_are_written() -> None:
    result = one_placement().results[0]
    placement = evaluation_to_dict(one_placement())["placements"][0]
    errors = evaluation_figure(placement).axes[0]
    assert f"range {result.band_um:.2f} µm" in [text.get_text() for text in errors.texts]
    measured = np.where(result.face % 2 == 1, result.sf_um, result.sb_um)
    face = result.face[np.nanargmax(measured)]
    assert errors.get_title(loc="right") == f"largest 2s: ±{result.worst_two_sigma_um:.2f} µm (face {face})"
    (bar,) = errors.containers
    segment = bar.lines[2][0].get_segments()[0]
    assert np.ptp(segment[:, 1]) == pytest.approx(2 * result.worst_two_sigma_um)
    assert f"face {face}" in describe(placement)


def test_a_single_cycle_has_no_bands_and_says_so() -> None:
    placement = evaluation_to_dict(one_placement(cycles=1))["placements"][0]
    figure = evaluation_figure(placement)
    assert bands(figure.axes[0]) == []
    assert "± 2s" not in [text.get_text() for text in figure.legends[0].get_texts()]
    assert "2s undefined" in describe(placement)


def test_axes_carry_units() -> None:
    errors, reversal = evaluation_figure(evaluation_to_dict(one_placement())["placements"][0]).axes
    assert "(µm)" in errors.get_ylabel()
    assert "(µm)" in reversal.get_ylabel()
    assert "(mm)" in reversal.get_xlabel()


@pytest.mark.parametrize("suffix", ["png", "svg", "pdf"])
def test_files_are_repeatable(tmp_path: Path, suffix: str) -> None:
    for name in "ab":
        figure = evaluation_figure(evaluation_to_dict(one_placement())["placements"][0])
        save_figure(figure, tmp_path / f"{name}.{suffix}", simulated=True)
    assert (tmp_path / f"a.{suffix}").read_bytes() == (tmp_path / f"b.{suffix}").read_bytes()


def test_an_unknown_suffix_leaves_no_file(tmp_path: Path) -> None:
    figure = evaluation_figure(evaluation_to_dict(one_placement())["placements"][0])
    with pytest.raises(InputError, match="gif"):
        save_figure(figure, tmp_path / "e.gif", simulated=True)
    assert list(tmp_path.iterdir()) == []
