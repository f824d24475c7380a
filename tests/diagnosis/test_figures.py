"""The figures of a diagnosis carry its numbers."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Text
from numpy.typing import NDArray
from scipy.integrate import trapezoid

from stepgauge.diagnosis.engine import diagnose
from stepgauge.diagnosis.laws.library import effect_families
from stepgauge.diagnosis.priors import shipped_priors
from stepgauge.diagnosis.residuals import make_residuals
from stepgauge.diagnosis.result import Diagnosis, GaugeDiagnosis, Located
from stepgauge.diagnosis.structure import covariate_of
from stepgauge.effects import along_approach_um, make_effects
from stepgauge.errors import InputError
from stepgauge.figures.diagnosis import (
    MOST_POINTS,
    drawn_of,
    effect_figure,
    residual_figure,
)
from stepgauge.figures.effect_panels import covariate_values, label_of, panels
from stepgauge.reports.diagnosis import read_story
from stepgauge.reports.render import set_in_print
from tests.diagnosis.made import ALONG_X, gauge, machine, made, made_insufficient, made_unknown, record, rms
from tests.diagnosis.test_further_laws import STEPS, measured, turned

Array = NDArray[np.float64]


def points(axes: Axes, label: str) -> Array:
    """Data of the lines of this label, one after the other, shape (n, 2)."""
    found = [line.get_xydata() for line in axes.get_lines() if line.get_label() == label]
    return np.vstack([np.asarray(one, float) for one in found])


def rows_of(found: GaugeDiagnosis, label: str) -> NDArray[np.bool_]:
    return found.data.side > 0 if label == "fronts" else found.data.side < 0


@pytest.mark.parametrize("label", ["fronts", "backs"])
def test_residuals_are_drawn_over_position_and_time_before_and_after(label: str) -> None:
    _, found = made("scale")
    axes = residual_figure(drawn_of(found)).axes
    rows = rows_of(found, label)
    width = len(axes) // 2
    assert [one.get_xlabel() for one in axes[width : width + 2]] == ["position along the gauge (mm)", "time (min)"]
    for first, um in ((0, found.before_um), (width, found.after_um)):
        for column, name in enumerate(("position", "time")):
            drawn = points(axes[first + column], label)
            expected = np.column_stack([covariate_values(name, found.data)[rows], um[rows]])
            np.testing.assert_allclose(drawn, expected, atol=1e-12)


def test_the_located_covariate_has_a_column() -> None:
    _, found = made("scale")
    assert found.located[0].covariate == "machine x"
    assert "machine x (mm)" in [axes.get_xlabel() for axes in residual_figure(drawn_of(found)).axes]


def test_noise_is_drawn_at_two_sigma_and_as_a_density() -> None:
    _, found = made("null")
    axes = residual_figure(drawn_of(found)).axes
    width = len(axes) // 2
    lines = points(axes[0], "± two sigma of the noise")
    assert set(np.round(np.abs(lines[:, 1]), 12)) == {round(2.0 * found.noise.sigma_um, 12)}
    density = points(axes[width - 1], "noise of a probing")
    area = float(trapezoid(density[:, 0], density[:, 1]))
    assert area == pytest.approx(1.0, abs=0.01)
    assert axes[width - 1].get_title(loc="left") == f"rms {rms(found.before_um):.3g} µm"


def test_the_histogram_is_that_of_the_residuals() -> None:
    _, found = made("null")
    axes = residual_figure(drawn_of(found)).axes[len(residual_figure(drawn_of(found)).axes) // 2 - 1]
    total = sum(bar.get_width() * bar.get_height() for bar in axes.patches)  # type: ignore[attr-defined]
    assert total == pytest.approx(1.0, abs=1e-9)


def test_outliers_are_ringed_and_do_not_squeeze_the_rest() -> None:
    _, found = made("outliers")
    axes = residual_figure(drawn_of(found)).axes[0]
    rings = points(axes, "outlier")
    np.testing.assert_allclose(rings[:, 0], found.data.probings.certified_mm()[found.noise.outliers])
    low, high = axes.get_ylim()
    assert high < 2.0
    assert (rings[:, 1] <= high).all()
    assert (rings[:, 1] >= low).all()


def test_the_law_goes_through_the_data_of_its_effect() -> None:
    _, found = made("scale")
    (axes,) = effect_figure(drawn_of(found)).axes
    assert axes.get_xlabel() == "machine x (mm)"
    assert axes.get_ylabel() == "along the gauge (µm)"
    law = points(axes, "fitted law")
    ppm = found.findings[0].parameters["ppm"].value
    np.testing.assert_allclose(law[:, 1], ppm * law[:, 0] * 1e-3, rtol=1e-5)
    seen = points(axes, "fronts")
    seen = seen[np.isfinite(seen[:, 1])]
    slope, _ = np.polyfit(seen[:, 0], seen[:, 1], 1)
    assert slope * 1e3 == pytest.approx(ppm, abs=4.0 * found.findings[0].parameters["ppm"].u)


def test_a_placement_that_does_not_see_the_effect_is_left_out() -> None:
    _, found = made("scale")
    (axes,) = effect_figure(drawn_of(found)).axes
    law = points(axes, "fitted law")
    first = found.data.probings.coordinate_mm("x")[found.data.placement == 0]
    assert len(law) == len(first)
    assert set(law[:, 0]) == set(first)


def test_what_repeats_is_drawn_over_its_period() -> None:
    _, found = made("pair")
    cycle = next(i for i, one in enumerate(found.findings) if one.kind == "temperature_cycle")
    period = found.findings[cycle].parameters["period_s"].value
    panel = panels(found)[cycle]
    assert panel.x.max() < period
    np.testing.assert_allclose(panel.share_um, found.findings[cycle].share_um)


def test_every_effect_and_every_law_without_a_name_has_a_panel() -> None:
    _, found = made("pair")
    assert len(panels(found)) == len(found.findings)
    _, unknown = made_unknown()
    titles = [panel.title for panel in panels(unknown)]
    assert all(title.startswith("no known law: ") for title in titles)
    assert unknown.forms[0].covariate in titles[0]
    assert len(titles) == len(unknown.forms)


def hidden(
    formula: str, located: tuple[str, str, str], axes: tuple[tuple[float, ...], ...] = (), numbers: object = None
) -> GaugeDiagnosis:
    """A diagnosis of a recording that holds this formula, um along the approach, described by covariate, side, form."""
    clean = diagnose(record(machine(), axes), gauge(), machine()) if axes else made("null")[1]
    (truth,) = make_effects([{"kind": "empirical", "formula": formula}], "test")
    moved = np.broadcast_to(along_approach_um(truth, clean.data.probings), (len(clean.data),))
    um = clean.data.without_origins(clean.after_um + moved)
    covariate, side, form = located
    described = (
        Located(covariate, side, form, [], 1.0, 1.0, numbers=numbers, share_um=clean.data.without_origins(moved)),
    )
    return replace(clean, verdict="unknown", before_um=um, after_um=um, unexplained=described)


def drawn(found: GaugeDiagnosis) -> Axes:
    (axes,) = effect_figure(drawn_of(found)).axes
    return axes


def test_another_shape_on_the_way_back_is_drawn_over_the_position_with_the_ways_apart() -> None:
    axes = drawn(hidden("0.8 * side * way", ("direction of travel", "both", "loop")))
    assert axes.get_xlabel() == "position along the gauge (mm)"
    assert axes.get_title(loc="left") == "no known law: another curve on the way back"
    there, back = points(axes, "on the way there"), points(axes, "on the way back")
    assert len(there) + len(back) == len(made("null")[1].data)
    law = {way: points(axes, f"fitted law {way}")[:, 1].mean() for way in ("there", "back")}
    assert law["there"] - law["back"] == pytest.approx(1.6, abs=0.3)
    for way, readings in (("there", there), ("back", back)):
        assert np.nanmean(readings[:, 1]) == pytest.approx(law[way], abs=3.0 * 0.3 / np.sqrt(len(readings)))


OBLIQUE = ((1.0, 0.0, 0.0), (0.8, 0.6, 0.0), (0.0, 1.0, 0.0))


def test_a_motion_along_one_machine_axis_is_drawn_along_it_wherever_the_gauge_lay() -> None:
    found = hidden("approach_i * 0.04 * max(x_mm - 350, 0)", ("machine x", "x", "smooth"), OBLIQUE)
    axes = drawn(found)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("machine x (mm)", "along machine x (µm)")
    law = points(axes, "fitted law")
    below, above = law[law[:, 0] < 340.0], law[law[:, 0] > 360.0]
    assert np.polyfit(*above.T, 1)[0] == pytest.approx(0.04, abs=0.004)
    assert np.polyfit(*below.T, 1)[0] == pytest.approx(0.0, abs=0.004)
    along_y = found.data.placement == 2
    assert len(law) == (~along_y).sum()


def test_a_changing_length_is_drawn_as_its_share_of_the_length() -> None:
    formula = "approach_i * (x_mm - 350) * 5e-5 * time_s"
    axes = drawn(hidden(formula, ("time", "x", "changing length")))
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("time (min)", "change along machine x (µm/m)")
    minutes, share = points(axes, "fitted law").T
    assert np.polyfit(minutes, share, 1)[0] == pytest.approx(5e-5 * 60.0 * 1e3, rel=0.1)


PANELS: list[tuple[str, tuple[str, str, str], object, str, str]] = [
    (
        "side * sin(3 * cycle + placement)",
        ("cycle", "both", "levels"),
        None,
        "cycle",
        "by an amount of its own",
    ),
    (
        "1e-4 * side * (turning_mm - 100)**2",
        ("way since turning round", "both", "smooth"),
        None,
        "round (mm)",
        "smooth",
    ),
    ("way * 0.6", ("direction of travel", "both", "loop"), None, "position along", "on the way back"),
    (
        "1.3 * step(placement - 1.5)",
        ("placement", "both", "levels"),
        None,
        "placement",
        "every placement off by an amount of its own",
    ),
    ("2 * side * sin(time_s / 10)", ("time", "both", "wave"), 20.0 * np.pi, "within the period of 62.83 s", "periodic"),
    ("0.8 * cos(2 * azimuth_rad)", ("azimuth", "both", "harmonics"), None, "azimuth", "direction of approach"),
]


@pytest.mark.parametrize(("formula", "located", "numbers", "label", "words"), PANELS)
def test_every_form_is_drawn_over_what_it_depends_on_and_named_in_words(
    formula: str, located: tuple[str, str, str], numbers: object, label: str, words: str
) -> None:
    axes = drawn(hidden(formula, located, numbers=numbers))
    assert label in axes.get_xlabel()
    assert words in axes.get_title(loc="left")
    law = np.vstack([line.get_xydata() for line in axes.get_lines() if str(line.get_label()).startswith("fitted law")])
    assert np.isfinite(law).all()
    assert np.ptp(law[:, 1]) > 0.3


def test_a_further_column_is_labelled_with_the_unit_in_its_name() -> None:
    assert label_of("scale_temperature_x_C") == "scale temperature x (°C)"
    assert label_of("humidity_percent") == "humidity (%)"
    assert label_of("humidity") == "humidity (as recorded)"


def test_the_residuals_after_are_those_that_the_line_on_the_terminal_says() -> None:
    found = hidden("0.8 * side * way", ("direction of travel", "both", "loop"))
    axes = residual_figure(drawn_of(found)).axes
    title = axes[-1].get_title(loc="left")
    left = found.rest_rms_um
    assert title == f"rms {left:.3g} µm"
    assert f"{left:.2f} um without the structure" in found.summary()
    assert left < 0.8 * rms(found.before_um)
    assert "without the structure" in axes[len(axes) // 2].get_ylabel()
    assert "without the structure" not in made("scale")[1].summary()


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
    assert len(points(residual_figure(drawn_of(many)).axes[0], "fronts")) == MOST_POINTS


@pytest.mark.parametrize(
    ("name", "suffix", "expected"),
    [
        ("null", "png", ["overview", "residuals"]),
        ("scale", "svg", ["overview", "residuals", "effects"]),
        ("insufficient", "pdf", ["overview", "residuals"]),
    ],
)
def test_files(name: str, expected: list[str], suffix: str, tmp_path: Path) -> None:
    _, found = made_insufficient() if name == "insufficient" else made(name)
    paths = [path for path in found.write(tmp_path, suffix) if path.suffix == f".{suffix}"]
    assert [path.name for path in paths] == [f"{one}.{suffix}" for one in expected]
    assert all(path.stat().st_size > 1000 for path in paths)


def test_figures_of_an_earlier_diagnosis_do_not_stay(tmp_path: Path) -> None:
    made("scale")[1].write(tmp_path)
    (tmp_path / "mine.png").write_text("mine")
    made("null")[1].write(tmp_path, "svg")
    pictures = {path.name for path in tmp_path.iterdir() if path.suffix in (".png", ".svg")}
    assert pictures == {"overview.svg", "residuals.svg", "mine.png"}


def test_other_formats_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.gif"):
        made("null")[1].write(tmp_path, "gif")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("share", [0.0, 1.0])
def test_a_law_that_shows_in_no_placement_is_still_drawn(share: float) -> None:
    """Its displacement is nothing, or the same along the gauge everywhere: no more than an origin."""
    _, found = made_unknown("pair")
    forms = tuple(replace(form, share_um=share * found.data.side) for form in found.forms)
    figure = effect_figure(drawn_of(replace(found, unexplained=forms)))
    assert all(
        len(axes.lines) + len(axes.collections) > 0 for axes in figure.axes if axes.get_visible() and axes.axison
    )


@pytest.mark.parametrize("clock", [True, False])
def test_what_every_law_depends_on_can_be_drawn_of_recordings_that_vary_little(clock: bool) -> None:
    """A law whose size is not determined is drawn against its covariate, as a delay that one speed does not show."""
    recording = measured((turned(4.0), turned(80.0, 20.0)), 3)
    kept = recording.frame if clock else recording.frame.drop(columns="time_s")
    data = make_residuals(replace(recording, frame=kept), STEPS, machine())
    families = list(effect_families(data, shipped_priors()))
    assert {"trigger_delay", "effective_radius", "scale_error"} <= {one.kind for one in families}
    for family in families:
        assert len(covariate_values(covariate_of(family, data), data)) == len(data), family.label


def test_lines_of_different_placements_are_named_and_one_line_of_all_is_not() -> None:
    """Backlash of x moves readings of a gauge along x by all of it, and of one at 45 deg by its component."""
    backlash = ({"kind": "reversal_error", "axis": "x", "um": 8.0},)
    diagonal = (0.7071067811865476, 0.7071067811865476, 0.0)
    found = diagnose(record(machine(backlash), (ALONG_X, diagonal)), gauge(), machine())
    named = {text.get_text() for axes in effect_figure(drawn_of(found)).axes for text in axes.texts}
    assert {"placement 1", "placement 2"} <= named
    _, alone = made("scale, one placement")
    assert not any(axes.texts for axes in effect_figure(drawn_of(alone)).axes)


def figure_content(figure: Figure) -> list[str]:
    """Every text of a figure, and every point of its lines."""
    figure.draw_without_rendering()
    lines = [str(np.asarray(line.get_xydata()).tolist()) for axes in figure.axes for line in axes.get_lines()]
    return [*(text.get_text() for text in figure.findobj(Text)), *lines]


def test_a_folder_has_what_its_figures_are_drawn_from(tmp_path: Path) -> None:
    """So that a report has them in its language, whatever was written first."""
    _, found = made("pair")
    found.write(tmp_path)
    made_now, again = found.figures(), Diagnosis.read(tmp_path).figures()
    assert set(again) == set(made_now) == {"overview", "residuals", "effects"}
    assert all(figure_content(again[name]) == figure_content(figure) for name, figure in made_now.items())
    page = set_in_print(read_story(tmp_path, "de"))
    told = "".join(block["svg"] for part in page["parts"] for block in part["blocks"] if block["kind"] == "figure")
    assert "längs des Stufenendmaßes (µm)" in told
    assert "along the gauge" not in told


def test_a_file_of_figures_that_is_not_whole_is_refused(tmp_path: Path) -> None:
    made("null")[1].write(tmp_path)
    file = tmp_path / "figures.npy"
    file.write_bytes(file.read_bytes()[:-9])
    with pytest.raises(InputError, match=r"figures\.npy: not whole"):
        Diagnosis.read(tmp_path).figures()
