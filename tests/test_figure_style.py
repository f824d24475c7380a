"""Figures: formats by extension, whole or not at all, printed sizes, and nothing left in matplotlib's state."""

import matplotlib
import pytest

from stepgauge.errors import InputError
from stepgauge.figures import style


def drawn():
    with style.figure_style():
        figure = style.new_figure(80.0, 60.0)
        figure.add_subplot().plot([0, 1], [0, 1])
    return figure


@pytest.mark.parametrize(("name", "magic"), [("a.png", b"\x89PNG"), ("a.PDF", b"%PDF"), ("a.svg", b"<?xml")])
def test_format_by_extension(tmp_path, name, magic):
    style.save_figure(drawn(), tmp_path / "new" / name, simulated=False)
    assert (tmp_path / "new" / name).read_bytes().startswith(magic)


@pytest.mark.parametrize("name", ["a.jpg", "a", "png"])
def test_other_extensions_are_refused(tmp_path, name):
    with pytest.raises(InputError, match=r"cannot tell the figure's format.*expected .png, .pdf or .svg"):
        style.save_figure(drawn(), tmp_path / name, simulated=False)
    assert not list(tmp_path.iterdir())


def test_a_failed_save_leaves_the_old_figure(tmp_path, monkeypatch):
    path = tmp_path / "a.png"
    path.write_bytes(b"old")
    figure = drawn()
    monkeypatch.setattr(figure, "draw", lambda *_, **__: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        style.save_figure(figure, path, simulated=False)
    assert path.read_bytes() == b"old"
    assert [p.name for p in tmp_path.iterdir()] == ["a.png"]


def test_a_figure_that_is_drawn_once_is_that_of_matplotlib(tmp_path):
    style.save_figure(drawn(), tmp_path / "a.png", simulated=False)
    with style.figure_style():
        drawn().savefig(tmp_path / "b.png", metadata={}, pil_kwargs=style.PACKED)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_size_is_the_printed_size():
    width, height = style.new_figure(80.0, 60.0).get_size_inches()
    assert (25.4 * width, 25.4 * height) == pytest.approx((80.0, 60.0))


def test_what_pyplot_sets_while_the_first_figure_is_drawn_stays():
    """IPython's integration sets ``interactive`` when pyplot loads the backend, inside our style."""
    before = matplotlib.rcParams["interactive"]
    try:
        with style.figure_style():
            matplotlib.rcParams["interactive"] = not before
        assert matplotlib.rcParams["interactive"] is not before
    finally:
        matplotlib.rcParams["interactive"] = before


def test_style_ends_with_the_block():
    before = dict(matplotlib.rcParams)
    with style.figure_style():
        assert matplotlib.rcParams["font.size"] == 8.0
        assert matplotlib.rcParams["axes.prop_cycle"].by_key()["color"][0] == style.COLORS["after"]
    assert dict(matplotlib.rcParams) == before


def test_the_same_figure_twice_is_the_same_file(tmp_path):
    for kind in style.FORMATS:
        for name in ("a", "b"):
            style.save_figure(drawn(), tmp_path / f"{name}.{kind}", simulated=False)
        assert (tmp_path / f"a.{kind}").read_bytes() == (tmp_path / f"b.{kind}").read_bytes()


def test_the_line_on_a_simulation_stands_on_nothing_else(tmp_path):
    """Below the labels of the axes, however often the figure is written, and once."""
    figure = drawn()
    (axes,) = figure.axes
    axes.set_xlabel("position along the gauge (mm), with a label as wide as the whole figure")
    for name in ("a.png", "b.png"):
        style.save_figure(figure, tmp_path / name, simulated=True)
    (mark,) = figure.texts
    figure.draw_without_rendering()
    assert mark.get_window_extent().y1 <= axes.xaxis.label.get_window_extent().y0
