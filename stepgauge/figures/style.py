"""The look of every figure: colours that the colour-blind can tell apart, sizes that are the printed ones.

Figures are made without pyplot, so that none of them lives in global state: a library that draws in a thread or a
server leaves nothing behind.
"""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple
from weakref import WeakKeyDictionary

from stepgauge.errors import InputError
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
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "legend.fontsize": 7.5,
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


def add_legend(of: Figure | Axes, entries: Mapping[str, Any], where: str = "upper center", title: str = "") -> None:
    """A legend that lies on no curve, in as many columns as the width has room for: of a figure outside of its panels,
    of a panel above it and below its titles.

    ``entries``: marks by what they are; of a tuple of marks all are shown. ``where``: of a figure ``upper center``,
    ``upper left``, ``upper right`` or at the foot. ``title``: what all entries are.
    """
    from matplotlib.figure import Figure
    from matplotlib.legend_handler import HandlerTuple

    columns = _columns(list(entries), _width_pt(of, where))
    legend = of.legend(
        list(entries.values()),
        list(entries),
        handler_map={tuple: HandlerTuple(ndivide=None, pad=0.3)},
        ncols=columns,
        frameon=False,
        columnspacing=SPACING_EM,
        title=title or None,
        **(_outside(of, where) if isinstance(of, Figure) else ABOVE),
    )
    for mark in legend.legend_handles:
        if mark is not None:
            mark.set_alpha(None if mark.get_alpha() is None else max(float(mark.get_alpha() or 0.0), LEAST_ALPHA))
    made = _Legend(dict(entries), where, -(-len(entries) // columns) + bool(title), title)
    _LEGENDS[legend] = made
    if isinstance(of, Figure):
        _lay_out(of)
    else:
        _raise_titles(of, made.rows)


ABOVE: Mapping[str, Any] = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "borderaxespad": 0.2}
"""Where the legend of a panel stands."""
PANEL_SHARE, BESIDE_SHARE = 0.85, 0.5
"""Of the width of its column of a figure that a panel has; of a figure, that a legend beside another one has."""


def _width_pt(of: Figure | Axes, where: str) -> float:
    """Width that a legend may take."""
    from matplotlib.figure import Figure

    if isinstance(of, Figure):
        return 72.0 * of.get_figwidth() * (1.0 if "center" in where else BESIDE_SHARE)
    at = of.get_subplotspec()
    share = 1.0 if at is None else len(at.colspan) / at.get_gridspec().ncols
    return 72.0 * float(of.get_figure(root=True).get_figwidth()) * share * PANEL_SHARE  # type: ignore[union-attr]


def _outside(figure: Figure, where: str) -> dict[str, Any]:
    """Where the legend of a figure stands, with its layout solved or not."""
    solved = figure.get_layout_engine() is not None
    return {"loc": f"outside {where}"} if solved else {"loc": where, "borderaxespad": 0.2}


def _raise_titles(axes: Axes, rows: int) -> None:
    """Titles of a panel above its legend."""
    for place in ("left", "center", "right"):
        if text := axes.get_title(place):
            axes.set_title(text, loc=place, pad=rows * LEGEND_PT + GAP_PT)


def axes_entries(*panels: Axes) -> dict[str, Any]:
    """What the legend of some panels says, every entry once."""
    entries: dict[str, Any] = {}
    for axes in panels:
        for mark, label in zip(*axes.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, mark)
    return entries


def _columns(labels: Sequence[str], width_pt: float) -> int:
    """The most columns of about equal length that fit into a width."""
    letter, em = LETTER_EM * STYLE["legend.fontsize"], STYLE["legend.fontsize"]
    for rows in range(1, len(labels)):
        widest = [max(map(len, labels[first : first + rows])) for first in range(0, len(labels), rows)]
        if sum(letter * one + (MARK_EM + SPACING_EM) * em for one in widest) <= width_pt:
            return len(widest)
    return 1


LETTER_EM, MARK_EM, SPACING_EM = 0.6, 2.8, 1.4
"""Mean width of a letter, of a mark with the space behind it, and between columns, in sizes of the font."""
LEAST_ALPHA = 0.6
"""A mark in a legend is not fainter: it stands alone."""


class _Legend(NamedTuple):
    """What a legend was made of: in another language it may need other columns."""

    entries: dict[str, Any]
    where: str
    rows: int
    title: str


_LEGENDS: WeakKeyDictionary[Any, _Legend] = WeakKeyDictionary()


def _lay_out(figure: Figure) -> None:
    """Margins of a figure of panels in a grid, from what stands beside them; of none whose layout is solved.

    A layout that is solved takes as long as drawing: it lays out every text twice before anything is drawn.
    """
    if figure.get_layout_engine() is not None:
        return
    panels: list[tuple[Axes, Any]] = [(one, one.get_subplotspec()) for one in figure.axes if one.axison]
    grid: Any = figure.axes[0].get_gridspec()
    left, beside = (
        max((_left_pt(one) for one, at in panels if at.is_first_col() is first), default=0.0) for first in (True, False)
    )
    foot, below = (
        max((_below_pt(one) for one, at in panels if at.is_last_row() is last), default=0.0) for last in (True, False)
    )
    titles = [one.get_title(place) for one, _ in panels for place in ("left", "right")]
    above = TITLE_PT * max(title.count("\n") + 1 if title else 0 for title in titles)
    head = above + LEGEND_PT * sum(_LEGENDS[one].rows for one in figure.legends if one in _LEGENDS) + GAP_PT
    width, height = (72.0 * one for one in figure.get_size_inches())
    foot += SIMULATED_LINE_PT
    between, over = beside + GAP_PT, below + above + GAP_PT
    across = (width - left - GAP_PT - between * (grid.ncols - 1)) / grid.ncols
    down = (height - foot - head - over * (grid.nrows - 1)) / grid.nrows
    figure.subplots_adjust(
        left / width, foot / height, 1.0 - GAP_PT / width, 1.0 - head / height, between / across, over / down
    )


GAP_PT, TITLE_PT, LEGEND_PT, LINE_PT, TICK_PT = 7.0, 13.0, 12.5, 10.0, 7.0
"""Between panels; height of a line of a title, of a legend and of a label; a tick with the space behind it."""


def _left_pt(axes: Axes) -> float:
    """Width of what stands left of a panel."""
    label, ticks = axes.get_ylabel(), axes.yaxis
    width = LINE_PT * (label.count("\n") + 1.5) if label else 0.0
    if ticks.get_tick_params().get("labelleft", True):
        longest = max(map(len, ticks.get_major_formatter().format_ticks(list(ticks.get_majorticklocs()))), default=0)
        width += TICK_PT + LETTER_EM * STYLE["ytick.labelsize"] * longest
    return width


def _below_pt(axes: Axes) -> float:
    """Height of what stands below a panel."""
    ticks = TICK_PT + STYLE["xtick.labelsize"] if axes.xaxis.get_tick_params().get("labelbottom", True) else 0.0
    return float(ticks + 1.5 * LINE_PT * bool(axes.get_xlabel()))


def figure_format(path: str | Path) -> str:
    """The format that the extension of ``path`` asks for; :class:`InputError` when it is not one of ours."""
    suffix = Path(path).suffix.lower().removeprefix(".")
    if suffix not in FORMATS:
        found = f".{suffix}" if suffix else "no extension"
        raise InputError(path, "cannot tell the figure's format", found=found, expected=".png, .pdf or .svg")
    return suffix


SIMULATED_LINE = "simulated: no machine was measured"
SIMULATED_LINE_PT = 9.0
"""Height that the line on a simulation takes at the foot of a figure."""


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


def translate_figure(figure: Figure, translate: Callable[[str], str]) -> None:
    """Every text of a figure in another language; the labels of ticks when they are drawn."""
    from matplotlib.text import Text
    from matplotlib.ticker import Formatter

    class Translated(Formatter):
        def __init__(self, inner: Formatter) -> None:
            self.inner = inner

        def __call__(self, x: float, pos: int | None = None) -> str:
            return translate(self.inner(x, pos))

        def set_locs(self, locs: list[float]) -> None:
            self.inner.set_locs(locs)

    if translate is not str:
        for text in figure.findobj(Text):
            text.set_text(translate(text.get_text()))
        for axes in figure.axes:
            for axis in (axes.xaxis, axes.yaxis):
                axis.set_major_formatter(Translated(axis.get_major_formatter()))
        both: list[Figure | Axes] = [figure, *figure.axes]
        for of in both:
            for legend in [one for one in _legends(of) if one in _LEGENDS]:
                made = _LEGENDS[legend]
                legend.remove()
                entries = {translate(label): mark for label, mark in made.entries.items()}
                add_legend(of, entries, made.where, translate(made.title))


def _legends(of: Figure | Axes) -> list[Any]:
    """The legends of a figure beside its panels, or that of a panel."""
    from matplotlib.figure import Figure

    own = list(of.legends) if isinstance(of, Figure) else [of.get_legend()]
    return [one for one in own if one is not None]


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
