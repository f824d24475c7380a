"""A test by a standard as a result: what is said of it, its table, its figure, its files and report."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stepgauge.conditions.decision import ConformityDecision
from stepgauge.errors import InputError
from stepgauge.files.display import Written, join_lines
from stepgauge.files.stored import StoredResult, WrittenResult
from stepgauge.files.text import write_files
from stepgauge.reports.page import UserStatements

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False)
class StandardTest(WrittenResult):
    """The outcome of a test: ``test`` has its values, ``decision`` what follows for its limits; ``lines`` say both.

    ``name`` begins the names of its files: ``said`` is written as JSON, ``tables`` as CSV by the end of their names;
    ``content`` is that of the report, from what a person states; ``figures`` by the end of their names. The first table
    and the first figure are those of the test.
    """

    test: Any
    decision: ConformityDecision
    lines: tuple[str, ...]
    name: str
    said: dict[str, Any]
    tables: Mapping[str, str]
    content: Callable[[UserStatements], dict[str, Any]] = field(compare=False)
    figures: Callable[[], dict[str, Figure]] = field(compare=False)

    def summary(self) -> str:
        """Notes on the readings, values and decisions, and rules of the standard that are not met."""
        return join_lines(*self.lines)

    def to_frame(self) -> pd.DataFrame:
        """The table that is written beside the report, with the units in the names of its columns."""
        import pandas as pd

        return pd.read_csv(io.StringIO(next(iter(self.tables.values()))), comment="#")

    def plot(self, axes: Axes | None = None) -> Axes:
        """The figure of the standard; returns the axes of its first panel, whose ``figure`` has the others.

        ``axes``: :class:`InputError`, for panels and legend are a figure of their own.
        """
        if axes is not None:
            what = "a test by a standard is drawn as a figure of several panels"
            raise InputError("axes", what, found=type(axes).__name__, expected="plot() alone, which gives it")
        from stepgauge.figures.style import on_screen

        with on_screen():
            return next(iter(self.figures().values())).axes[0]

    def write(
        self,
        folder: str | Path,
        figure: str = "png",
        *,
        template: str | Path | None = None,
        **stated: Any,
    ) -> Written:
        """Write JSON, CSV, figures and the report (PDF) into a folder; returns paths with ``notes``.

        ``figure``: png, svg or pdf; ``template``: your own Typst template (:class:`InputError` where it fails, before
        anything is written); ``stated``: number, operator, customer, location, date, remarks and language, printed.
        """
        import datetime

        from stepgauge.figures.style import save_figure
        from stepgauge.reports.render import translator, write_report

        with self.keeping():
            content = self.content(UserStatements(**{"date": datetime.date.today(), **stated}))
            report = Path(folder) / f"{self.name}.pdf"
            notes = write_report(report, content, template)  # first, for a template may fail
            drawn = {Path(folder) / f"{self.name}-figure{end}.{figure}": one for end, one in self.figures().items()}
            for path, one in drawn.items():
                save_figure(one, path, bool(content["simulated"]), translator(content))
            tables = {f"{self.name}{end}.csv": text for end, text in self.tables.items()}
            values = write_files(folder, {f"{self.name}.json": self.said} | tables)
            return Written([*values, *drawn, report], [f"note: {note}" for note in notes])


class StoredTest(StoredResult):
    """A test by a standard as its file has it."""

    @property
    def decision(self) -> ConformityDecision:
        """What followed for its limits."""
        return ConformityDecision.read(self.values["decision"])
