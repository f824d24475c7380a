"""Figures of the standard tests: what is drawn is what was computed."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from stepgauge.figures.iso230 import positioning_figure
from stepgauge.figures.iso10360 import conformance_zone, length_test_figure
from stepgauge.reports.iso230 import caption
from stepgauge.standards.iso10360 import Choices, Specification, length_test
from stepgauge.standards.iso10360_files import verdicts
from stepgauge.standards.mpe import Mpe
from stepgauge.standards.positioning import positioning_test
from tests.build import make_gauge
from tests.standards.made import TIP_MM, joined, made

GAUGE = make_gauge(blocks=8)


def error(cycle: int, face: int) -> float:
    return 0.2 * face + 0.3 * (cycle % 2) + (0.4 if face % 2 else -0.4)


def test_every_repeat_is_a_mark_between_the_limits() -> None:
    spec = Specification(Mpe.parse("1.8 + L/350"))
    test = length_test(joined(made(GAUGE, error), made(GAUGE, error, (0, 1, 0))), GAUGE, spec, choices=Choices(TIP_MM))
    figure = length_test_figure(test)
    for axes, kind in zip(figure.axes, ("bidirectional", "unidirectional"), strict=True):
        marks = np.concatenate([line.get_ydata() for line in axes.lines if line.get_linestyle() == "None"])
        assert np.sort(marks) == pytest.approx(np.sort(np.concatenate([one.error_um for one in test.lengths(kind)])))
        limits = [line for line in axes.lines if len(line.get_xdata()) == 200]
        assert sorted(float(line.get_ydata()[0]) for line in limits) == pytest.approx([-1.8, 1.8])
        assert axes.get_title(loc="left").endswith("(test incomplete)")
        lengths = {float(x) for line in axes.lines if line.get_linestyle() == "None" for x in line.get_xdata()}
        assert lengths == {one.nominal_mm for one in test.lengths(kind)}  # beside each other, never moved


def test_the_zone_of_conformity_ends_where_the_uncertainty_is_the_larger() -> None:
    """Closed form: an MPE of 1 um and a U of 0.02 um per mm cross at 50 mm; beyond there is no zone to draw."""
    test = length_test(made(GAUGE, error), GAUGE, Specification(Mpe.parse("1")), choices=Choices(TIP_MM))
    grown = [replace(one, expanded_um=0.02 * one.nominal_mm) for one in test.lengths("bidirectional")]
    sizes, zone = conformance_zone(grown)
    assert sizes[zone == 0.0] == pytest.approx([50.0])
    assert zone[sizes < 50.0] == pytest.approx(1.0 - 0.02 * sizes[sizes < 50.0])
    assert np.isnan(zone[sizes > 50.0]).all()
    assert (sizes > 50.0).sum() > 1
    told = verdicts(replace(test, positions=(replace(test.positions[0], lengths=tuple(grown)),)))
    (said,) = [text for text in told if "no error proves conformity there" in text]
    assert said.startswith("Bidirectional lengths: at ")
    assert f"{max(one.nominal_mm for one in grown):g} mm U is larger than the MPE" in said


def test_titles_end_inside_the_figure() -> None:
    test = length_test(made(GAUGE, error), GAUGE, Specification(Mpe.parse("0.1"), 0.01), choices=Choices(TIP_MM))
    figure = length_test_figure(test)
    figure.canvas.draw()
    for axes in figure.axes:
        assert axes.get_tightbbox().x1 <= figure.bbox.x1  # type: ignore[union-attr]


@pytest.mark.parametrize("far_um", [9.0, -40.0])
def test_an_error_far_beyond_the_limit_is_on_the_page(far_um: float) -> None:
    """It decides, so it must be seen: marks that are moved aside had been cut off."""
    recording = made(GAUGE, lambda cycle, face: far_um * (cycle == 2 and face == 10))
    test = length_test(recording, GAUGE, Specification(Mpe.parse("1.8 + L/350")), choices=Choices(TIP_MM))
    axes = length_test_figure(test).axes[0]
    low, high = axes.get_ylim()
    marks = np.concatenate([line.get_ydata() for line in axes.lines if line.get_linestyle() == "None"])
    assert np.abs(marks).max() == pytest.approx(abs(far_um))
    assert low < marks.min() <= marks.max() < high


def test_fronts_alone_have_one_panel() -> None:
    spec = Specification(Mpe.parse("2"))
    figure = length_test_figure(length_test(made(GAUGE, faces=range(1, 16, 2)), GAUGE, spec))
    assert len(figure.axes) == 1


def test_a_long_name_of_the_axis_stands_above_the_parameters() -> None:
    """That of a line near an axis was printed over R; a short one stands beside it."""
    for axis, breaks in (((1, 0, 0), 0), ((1, 0.1, 0), 1)):
        (one,) = positioning_test(made(GAUGE, error, axis, cycles=5), GAUGE, TIP_MM).axes
        assert positioning_figure(one).axes[0].get_title(loc="left").count("\n") == breaks


def test_the_caption_of_positioning_is_set_in_print() -> None:
    (one,) = positioning_test(made(GAUGE, error, (-1, 0, 0), cycles=5, start_mm=np.zeros(3)), GAUGE, TIP_MM).axes
    assert re.search(r"targets from −\d+\.\d to −?\d+\.\d mm", caption(one))
    assert "-" not in caption(one)


def test_brackets_say_the_parameters() -> None:
    (one,) = positioning_test(made(GAUGE, error, cycles=5), GAUGE, TIP_MM).axes
    texts = [text.get_text() for text in positioning_figure(one).axes[0].texts]
    p = one.parameters
    for name, value in (("A", p.A_um), ("E", p.E_um), ("M", p.M_um), ("B", p.B_um)):
        assert f"{name} = {value:.2f} µm" in texts
