"""How a result shows itself: the lines of the command line, a table, a figure, and what a notebook displays."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import wraps
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any, ClassVar

from stepgauge.errors import one_line, python_text

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

MOST_ROWS = 60
"""Rows of a table in a notebook; of a longer one the middle is left out."""
LONGEST_LINE = 2000
"""Characters of a line of a summary."""
MOST_LINES, LONGEST_SHOWN = 6, 160
"""Lines of a result as Python shows it, and their characters."""


class Summarized:
    """What says itself in lines and in a table: how stands in :meth:`summary` and :meth:`to_frame` of each.

    Two are equal (``==``) if their files say the same: what was written equals what is read back, NaN beside NaN.
    """

    def __init_subclass__(cls, **words: Any) -> None:
        """The ``==`` that is inherited, before that of a dataclass, which would compare arrays as one truth; and a
        summary for Python, in words of its arguments."""
        super().__init_subclass__(**words)
        cls.__eq__ = cls.__eq__  # type: ignore[method-assign]
        if "summary" in vars(cls):
            cls.summary = _for_python(cls.summary)  # type: ignore[method-assign, assignment]

    def __eq__(self, other: object) -> bool:
        from stepgauge.files.arrays import same_content

        return same_content(self._stated(), other._stated()) if isinstance(other, Summarized) else NotImplemented

    __hash__ = object.__hash__

    def _stated(self) -> Any:
        """What a file says of it; by default all of its fields."""
        from stepgauge.files.arrays import compared_fields

        return type(self), compared_fields(self)

    def summary(self) -> str:
        """The lines that the command line prints."""
        raise NotImplementedError

    def to_frame(self) -> pd.DataFrame:
        """The result as a table, with the units in the names of the columns."""
        raise NotImplementedError

    def __repr__(self) -> str:
        """The kind, and the first lines of the summary."""
        lines = self.summary().splitlines()
        shown = [one_line(line, LONGEST_SHOWN) for line in lines[:MOST_LINES]]
        return "\n".join([f"{type(self).__name__}:", *shown, *([".."] if len(lines) > MOST_LINES else [])])

    def _repr_html_(self) -> str:
        """The summary and the table for a notebook; every value is escaped."""
        from html import escape

        lines = "".join(f"<p>{escape(line)}</p>" for line in self.summary().splitlines())
        table = self.to_frame().to_html(max_rows=MOST_ROWS, index=False, na_rep="", float_format="{:.10g}".format)
        return lines + str(table)


def _for_python(summary: Callable[[Any], str]) -> Callable[[Any], str]:
    """The summary with arguments in place of options, but for the command line."""

    @wraps(summary)
    def said(result: Any) -> str:
        """As the class says it."""
        return python_text(summary(result))

    return said


class Plotted(Summarized):
    """What can also be drawn.

    ``drawn_by`` names the function of :mod:`stepgauge.figures` that draws the result on given axes: figures stand above
    the results, so it is imported when a figure is asked for. By default it is the table that is drawn.
    """

    drawn_by: ClassVar[str] = "table.draw_table"

    def plot(self, axes: Axes | None = None) -> Axes:
        """Draw the result on ``axes``, or on new ones of pyplot; returns the axes."""
        return self._drawn(axes)

    def _drawn(self, axes: Axes | None, **options: Any) -> Axes:
        module, function = self.drawn_by.split(".")
        on: Axes = figures("style").own_axes() if axes is None else axes
        with figures("style").figure_style():
            getattr(figures(module), function)(on, self, **options)
        return on


class Written(list[Any]):
    """Paths that were written (None: was not asked for), and ``notes``: what is to be said of them."""

    def __init__(self, paths: Iterable[Any] = (), notes: Iterable[str] = ()) -> None:
        super().__init__(paths)
        self.notes = tuple(notes)


def figures(module: str) -> ModuleType:
    """A module of the figures, which are imported only when one is drawn."""
    return import_module(f"stepgauge.figures.{module}")


def join_lines(*lines: str) -> str:
    """A summary of these lines, each of them on one line."""
    return "\n".join(one_line(line, LONGEST_LINE) for line in lines)
