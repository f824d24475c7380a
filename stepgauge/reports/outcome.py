"""A test by a standard as a result: what is said of it, its table, its figure, its files and report."""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stepgauge.errors import InputError
from stepgauge.files.display import Summarized, Written, figures, join_lines
from stepgauge.files.outputs import open_set
from stepgauge.files.stored import result_shown
from stepgauge.reports.page import UserStatements

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Reported = Callable[[Path, UserStatements, "str | Path | None", str], Written]
"""Given folder, statements, template and format of the figures, writes; returns the paths with notes."""


@dataclass(frozen=True, repr=False)
class StandardTest(Summarized):
    """The outcome of a test: ``test`` has its values; ``lines`` say them, with what leaves the test incomplete."""

    test: Any
    lines: tuple[str, ...]
    table: str
    reported: Reported
    drawn: Callable[[], Figure]

    def summary(self) -> str:
        """Notes on the readings, values and decisions, and rules of the standard that are not met."""
        return join_lines(*self.lines)

    def to_frame(self) -> pd.DataFrame:
        """The table that is written beside the report, with the units in the names of its columns."""
        import pandas as pd

        return pd.read_csv(io.StringIO(self.table), comment="#")

    def plot(self, axes: Axes | None = None) -> Axes:
        """The figure of the standard; returns the axes of its first panel, whose ``figure`` has the others.

        ``axes``: :class:`InputError`, for panels and legend are a figure of their own.
        """
        if axes is not None:
            what = "a test by a standard is drawn as a figure of several panels"
            raise InputError("axes", what, found=type(axes).__name__, expected="plot() alone, which gives it")
        with figures("style").on_screen():
            return self.drawn().axes[0]

    def write(
        self,
        folder: str | Path,
        figure: str = "png",
        *,
        stated: UserStatements | None = None,
        template: str | Path | None = None,
    ) -> Written:
        """Write JSON, CSV, figures and the report (PDF) into a folder; returns paths with ``notes``."""
        import datetime

        with open_set(lambda: result_shown(self)):
            return self.reported(Path(folder), stated or UserStatements(datetime.date.today()), template, figure)
