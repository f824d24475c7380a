"""Legends that lie on no curve: of a figure outside of its panels, of a panel above it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple
from weakref import WeakKeyDictionary

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LEGEND_SIZE_PT, TICK_SIZE_PT = 7.5, 7.0
"""Sizes of the fonts of a legend and of the numbers at ticks."""
SIMULATED_LINE_PT = 9.0
"""Height that the line on a simulation takes at the foot of a figure."""


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
    letter, em = LETTER_EM * LEGEND_SIZE_PT, LEGEND_SIZE_PT
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
        width += TICK_PT + LETTER_EM * TICK_SIZE_PT * longest
    return width


def _below_pt(axes: Axes) -> float:
    """Height of what stands below a panel."""
    ticks = TICK_PT + TICK_SIZE_PT if axes.xaxis.get_tick_params().get("labelbottom", True) else 0.0
    return float(ticks + 1.5 * LINE_PT * bool(axes.get_xlabel()))


def translate_legends(figure: Figure, translate: Callable[[str], str]) -> None:
    """The legends of a figure and of its panels in another language, in other columns where it needs them."""
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
