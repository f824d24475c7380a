"""The figures of a diagnosis carry its numbers."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from numpy.typing import NDArray
from scipy.integrate import trapezoid

from stepgauge.diagnose.result import Diagnosis
from stepgauge.diagnose.unknown_law import model_unknown
from stepgauge.errors import InputError
from stepgauge.figures.diagnosis import (
    MOST_POINTS,
    draw_diagnosis,
    effect_figure,
    figure_names,
    residual_figure,
)
from stepgauge.figures.effect_panels import covariate_values, panels
from tests.diagnose.made import made, made_insufficient, made_unknown, rms

Array = NDArray[np.float64]


def points(axes: Axes, label: str) -> Array:
    """Data of the lines of this label, one after the other, shape (n, 2)."""
    found = [line.get_xydata() for line in axes.get_lines() if line.get_label() == label]
    return np.vstack([np.asarray(one, float) for one in found])


def rows_of(found: Diagnosis, label: str) -> NDArray[np.bool_]:
    return found.data.side > 0 if label == "fronts" else found.data.side < 0


@pytest.mark.parametrize("label", ["fronts", "backs"])
def test_residuals_are_drawn_over_position_and_time_before_and_after(label: str) -> None:
    _, found = made("scale")
    axes = residual_figure(found).axes
    rows = rows_of(found, label)
    width = len(axes) // 2
    assert [one.get_xlabel() for one in axes[width : width + 2]] == ["position along the gauge / mm", "time / min"]
    for first, um in ((0, found.before_um), (width, found.after_um)):
        for column, name in enumerate(("position", "time")):
            drawn = points(axes[first + column], label)
            expected = np.column_stack([covariate_values(name, found.data)[rows], um[rows]])
            np.testing.assert_allclose(drawn, expected, atol=1e-12)


def test_the_located_covariate_has_a_column() -> None:
    _, found = made("scale")
    assert found.located[0].covariate == "machine x"
    assert "machine x / mm" in [axes.get_xlabel() for axes in residual_figure(found).axes]


def test_noise_is_drawn_at_two_sigma_and_as_a_density() -> None:
    _, found = made("null")
    axes = residual_figure(found).axes
    width = len(axes) // 2
    lines = points(axes[0], "± two sigma of the noise")
    assert set(np.round(np.abs(lines[:, 1]), 12)) == {round(2.0 * found.noise.sigma_um, 12)}
    density = points(axes[width - 1], "noise of a probing")
    area = float(trapezoid(density[:, 0], density[:, 1]))
    assert area == pytest.approx(1.0, abs=0.01)
    assert axes[width - 1].get_title(loc="left") == f"rms {rms(found.before_um):.3g} µm"


def test_the_histogram_is_that_of_the_residuals() -> None:
    _, found = made("null")
    axes = residual_figure(found).axes[len(residual_figure(found).axes) // 2 - 1]
    total = sum(bar.get_width() * bar.get_height() for bar in axes.patches)  # type: ignore[attr-defined]
    assert total == pytest.approx(1.0, abs=1e-9)


def test_outliers_are_ringed_and_do_not_squeeze_the_rest() -> None:
    _, found = made("outliers")
    axes = residual_figure(found).axes[0]
    rings = points(axes, "outlier")
    np.testing.assert_allclose(rings[:, 0], found.data.probings.certified_mm()[found.noise.outliers])
    low, high = axes.get_ylim()
    assert high < 2.0
    assert (rings[:, 1] <= high).all()
    assert (rings[:, 1] >= low).all()


def test_the_law_goes_through_the_data_of_its_effect() -> None:
    _, found = made("scale")
    (axes,) = effect_figure(found).axes
    assert axes.get_xlabel() == "machine x / mm"
    assert axes.get_ylabel() == "along the gauge / µm"
    law = points(axes, "fitted law")
    ppm = found.findings[0].parameters["ppm"].value
    np.testing.assert_allclose(law[:, 1], ppm * law[:, 0] * 1e-3, rtol=1e-5)
    seen = points(axes, "fronts")
    seen = seen[np.isfinite(seen[:, 1])]
    slope, _ = np.polyfit(seen[:, 0], seen[:, 1], 1)
    assert slope * 1e3 == pytest.approx(ppm, abs=4.0 * found.findings[0].parameters["ppm"].u)


def test_a_placement_that_does_not_see_the_effect_is_left_out() -> None:
    _, found = made("scale")
    (axes,) = effect_figure(found).axes
    law = points(axes, "fitted law")
    first = found.data.probings.coordinate_mm("x")[found.data.placement == 0]
    assert len(law) == len(first)
    assert set(law[:, 0]) == set(first)


def test_what_repeats_is_drawn_over_its_period() -> None:
    _, found = made("pair")
    cycle = next(i for i, one in enumerate(found.findings) if one.kind == "temperature_cycle")
    period = found.findings[cycle].parameters["period_s"].value
    panel = panels(found, [])[cycle]
    assert panel.x.max() < period
    np.testing.assert_allclose(panel.share_um, found.findings[cycle].share_um)


def test_every_effect_and_every_law_without_a_name_has_a_panel() -> None:
    _, found = made("pair")
    assert len(panels(found, [])) == 2
    _, unknown = made_unknown()
    laws = model_unknown(unknown)
    titles = [panel.title for panel in panels(unknown, laws)]
    assert titles[0] == f"no known law: {laws[0].located.form} in {laws[0].located.covariate}"
    assert len(titles) == len(laws)


def test_many_points_are_thinned_evenly() -> None:
    _, found = made("null")
    times = 2 * MOST_POINTS // len(found.data) * 2
    data = found.data
    wide = replace(
        data,
        um=np.tile(data.um, times),
        side=np.tile(data.side, times),
        placement=np.tile(data.placement, times),
        face=np.tile(data.face, times),
        frame=data.frame.loc[np.tile(data.frame.index, times)].reset_index(drop=True),
    )
    wide = replace(wide, probings=type(data.probings)(wide.frame, data.probings.setting))  # type: ignore[arg-type]
    noise = replace(found.noise, by_row_um=np.tile(found.noise.by_row_um, times))
    many = replace(
        found,
        data=wide,
        noise=noise,
        before_um=np.tile(found.before_um, times),
        after_um=np.tile(found.after_um, times),
    )
    assert len(points(residual_figure(many).axes[0], "fronts")) == MOST_POINTS


@pytest.mark.parametrize(
    ("name", "expected"),
    [("null", ["residuals"]), ("scale", ["residuals", "effects"]), ("insufficient", ["residuals"])],
)
@pytest.mark.parametrize("suffix", ["png", "svg", "pdf"])
def test_files(name: str, expected: list[str], suffix: str, tmp_path: Path) -> None:
    _, found = made_insufficient() if name == "insufficient" else made(name)
    paths = draw_diagnosis(tmp_path, found, [], suffix)
    assert [path.name for path in paths] == [f"{one}.{suffix}" for one in expected] == figure_names(found, [], suffix)
    assert all(path.stat().st_size > 1000 for path in paths)


def test_figures_of_an_earlier_diagnosis_do_not_stay(tmp_path: Path) -> None:
    draw_diagnosis(tmp_path, made("scale")[1], [])
    (tmp_path / "mine.png").write_text("mine")
    draw_diagnosis(tmp_path, made("null")[1], [], "svg")
    assert {path.name for path in tmp_path.iterdir()} == {"residuals.svg", "mine.png"}


def test_other_formats_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.gif"):
        draw_diagnosis(tmp_path, made("null")[1], [], "gif")
    assert list(tmp_path.iterdir()) == []
