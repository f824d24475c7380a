"""The look of every figure: colours that the colour-blind can tell apart, sizes that are the printed ones.

Figures are made without pyplot, so that none of them lives in global state: a library that draws in a thread or a
server leaves nothing behind.
"""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import TYPE_CHECKING, Any
from weakref import WeakSet

from stepgauge.errors import InputError
from stepgauge.figures.legends import LEGEND_SIZE_PT, SIMULATED_LINE_PT, TICK_SIZE_PT, translate_legends
from stepgauge.files.arrays import Array
from stepgauge.files.text import replacing

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Okabe & Ito's palette (2008), in the order in which lines of one plot take them.
CYCLE = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")

COLORS = {
    "before": "#D55E00",
    "after": "#0072B2",
    "model": "#000000",
    "measured": "#009E73",
    "accent": "#CC79A7",
    "warning": "#E69F00",
    "light": "#56B4E9",
    "grey": "#808080",
}

# Of a measuring path past the gauge.
BLOCK_COLOR, RAIL_COLOR, EDGE_COLOR = "#B8C4CE", "#E6E6E6", "#5F6B75"
TRAVEL_COLOR, MEASURE_COLOR, STOP_COLOR = CYCLE[0], CYCLE[1], CYCLE[3]

# Points are printed points: the width given to new_figure is the width on paper.
STYLE: dict[str, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 8.0,
    "axes.titlesize": 8.5,
    "axes.labelsize": 8.0,
    "xtick.labelsize": TICK_SIZE_PT,
    "ytick.labelsize": TICK_SIZE_PT,
    "legend.fontsize": LEGEND_SIZE_PT,
    "axes.linewidth": 0.6,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#D9D9D9",
    "grid.linewidth": 0.5,
    "lines.linewidth": 1.3,
    "lines.markersize": 3.5,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "savefig.dpi": 300,
    "svg.fonttype": "path",
    "svg.hashsalt": "stepgauge",
    "pdf.fonttype": 42,
}

DATE_FORMATS = ["%Y", "%Y-%m", "%Y-%m-%d", "%Y-%m-%d", "%H:%M", "%H:%M:%S"]
"""Of ticks at years, months, days, hours, minutes and seconds (ISO 8601): a month's name is of some language."""
FORMATS = ("png", "pdf", "svg")
_MM_PER_INCH = 25.4
LOOKED_AT_MM = (160.0, 90.0)
# Without dates two runs on the same data give the same file.
PACKED = {"compress_level": 3}
"""A level of zlib with which a picture of dots and lines is a quarter larger and written in two thirds of the time."""
_UNDATED: dict[str, dict[str, Any]] = {"pdf": {"CreationDate": None}, "svg": {"Date": None}, "png": {}}


@contextmanager
def figure_style() -> Iterator[None]:
    """The package's style while a figure is drawn or saved; the user's own settings stand again after it.

    Only these settings are put back. ``rc_context`` would put back all of them, also what pyplot sets when it chooses
    its backend at the first figure: a notebook then shows no figure any more.
    """
    from cycler import cycler
    from matplotlib import rcParams

    settings: Any = {**STYLE, "axes.prop_cycle": cycler(color=CYCLE)}
    before = {name: rcParams[name] for name in settings}
    rcParams.update(settings)
    try:
        yield
    finally:
        rcParams.update(before)


def new_figure(width_mm: float, height_mm: float, solved: bool = True) -> Figure:
    """An empty figure of this printed size, laid out by matplotlib so that no label is cut.

    ``solved``: False for panels in a grid with numbers at their ticks, which :func:`add_legend` sets in place.

    Artists read the style when they are made: a drawing function works inside ``with figure_style():`` or is decorated
    with ``@figure_style()``.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    size = (width_mm / _MM_PER_INCH, height_mm / _MM_PER_INCH)
    layout: Any = "constrained" if solved else None
    with figure_style():
        if _ON_SCREEN.get():
            from matplotlib import pyplot

            return pyplot.figure(figsize=size, layout=layout)
        figure = Figure(figsize=size, layout=layout)
        FigureCanvasAgg(figure)
    return figure


_ON_SCREEN: ContextVar[bool] = ContextVar("_ON_SCREEN", default=False)


@contextmanager
def on_screen() -> Iterator[None]:
    """Figures that are made meanwhile are pyplot's: a notebook shows them, and so does ``pyplot.show()``."""
    before = _ON_SCREEN.set(True)
    try:
        yield
    finally:
        _ON_SCREEN.reset(before)


def own_axes() -> Axes:
    """Axes for a person who looks at them."""
    with on_screen(), figure_style():
        return new_figure(*LOOKED_AT_MM).subplots()


def figure_format(path: str | Path) -> str:
    """The format that the extension of ``path`` asks for; :class:`InputError` when it is not one of ours."""
    suffix = Path(path).suffix.lower().removeprefix(".")
    if suffix not in FORMATS:
        found = f".{suffix}" if suffix else "no extension"
        raise InputError(path, "cannot tell the figure's format", found=found, expected=".png, .pdf or .svg")
    return suffix


SIMULATED_LINE = "simulated: no machine was measured"


def save_figure(fig: Figure, path: str | Path, simulated: bool, translate: Callable[[str], str] = str) -> None:
    """Write a figure as PNG, PDF or SVG by the extension of ``path``, whole or not at all.

    ``simulated``: no machine was measured, and the figure says so; nobody draws without knowing.

    Raises :class:`InputError` for another extension or where the file cannot be written.
    """
    kind = figure_format(path)
    with figure_style(), replacing(path) as beside:
        if simulated:
            mark_simulated(fig)
        translate_figure(fig, translate)
        if kind == "png":
            _draw_once(fig, beside)
        else:
            fig.savefig(beside, format=kind, metadata=_UNDATED[kind])


def figure_svg(figure: Figure, translate: Callable[[str], str] = str) -> str:
    """A figure as SVG, letters as outlines: no font is needed to show it, and the same data give the same text."""
    buffer = io.StringIO()
    with figure_style():
        translate_figure(figure, translate)
        figure.savefig(buffer, format="svg", metadata=_UNDATED["svg"])
    return buffer.getvalue()


_TRANSLATED: WeakSet[Figure] = WeakSet()
"""A figure goes into a page and into a file of its own: it is translated once."""


def translate_figure(figure: Figure, translate: Callable[[str], str]) -> None:
    """Every text of a figure in another language; the labels of ticks when they are drawn."""
    from matplotlib.text import Text
    from matplotlib.ticker import Formatter

    class Translated(Formatter):
        def __init__(self, inner: Formatter) -> None:
            self.inner = inner

        def __call__(self, x: float, pos: int | None = None) -> str:
            return translate(self.inner(x, pos))

        def format_ticks(self, values: list[float]) -> list[str]:
            return [translate(text) for text in self.inner.format_ticks(values)]

        def set_locs(self, locs: list[float]) -> None:
            self.inner.set_locs(locs)

    if translate is not str and figure not in _TRANSLATED:
        _TRANSLATED.add(figure)
        for text in dict.fromkeys(figure.findobj(Text)):  # some are found twice
            text.set_text(translate(text.get_text()))
        for axes in figure.axes:
            for axis in (axes.xaxis, axes.yaxis):
                if not isinstance(axis.get_major_formatter(), Translated):  # shared axes have one
                    axis.set_major_formatter(Translated(axis.get_major_formatter()))
        translate_legends(figure, translate)


def mark_simulated(fig: Figure) -> None:
    """Once, below everything else: the layout leaves it a line, so that it stands on no label."""
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    if any(text.get_text() == SIMULATED_LINE for text in fig.texts):
        return
    # in 1/1024 of the height: the solver of the layout sums in no fixed order, and such numbers have no rounding
    line = math.ceil(1024.0 * SIMULATED_LINE_PT / (72.0 * fig.get_figheight())) / 1024.0
    layout = fig.get_layout_engine()
    if isinstance(layout, ConstrainedLayoutEngine):
        left, bottom, width, height = layout.get()["rect"]
        layout.set(rect=(left, bottom + line, width, height - line))
    fig.text(0.995, 0.005, SIMULATED_LINE, ha="right", color="red", fontsize=6.0)


def _draw_once(fig: Figure, path: Path) -> None:
    """The same file as by ``savefig``, which draws twice: the first time for nothing but the layout."""
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    dpi, canvas = fig.dpi, fig.canvas
    try:
        fig.dpi = matplotlib.rcParams["savefig.dpi"]
        FigureCanvasAgg(fig).print_png(path, metadata=_UNDATED["png"], pil_kwargs=PACKED)
    finally:
        fig.dpi = dpi
        fig.set_canvas(canvas)


def draw_before_and_after(axes: Axes, x: Array, before: Array, after: Array, verdict: str) -> None:
    """Residuals of a diagnosis before and after what it found, on axes of somebody else."""
    for values, name in ((before, "before"), (after, "after")):
        axes.plot(x, values, ".", color=COLORS[name], label=name, markersize=3.0)
    axes.set_title(f"verdict: {verdict}", loc="left")
    axes.legend(handles=axes.get_lines()[-2:], frameon=False)


def draw_dimension(axes: Axes, x: float, low: float, high: float, text: str, color: str) -> None:
    """An arrow with two heads from ``low`` to ``high`` with its length written along it."""
    arrow = {"arrowstyle": "<->", "color": color, "linewidth": 0.8, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 7}
    axes.annotate("", (x, high), (x, low), arrowprops=arrow)
    middle, offset = (x, (low + high) / 2.0), (4, 0)
    axes.annotate(text, middle, offset, textcoords="offset points", rotation=90, va="center", color=color)
