"""The table of a result, drawn: every length, angle or temperature of one unit against the first number of a row."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from stepgauge.files.display import Summarized

if TYPE_CHECKING:
    import pandas as pd


def draw_table(axes: Axes, result: Summarized) -> None:
    """Draw the columns that have the unit of the second column of numbers; a table of one such column by row."""
    frame = result.to_frame()
    across, columns = _columns(frame)
    x = np.arange(1.0, len(frame) + 1.0) if across is None else frame[across].to_numpy(float)
    for name in columns:
        axes.plot(x, frame[name].to_numpy(float), marker="o", label=name)
    axes.set_xlabel(across or "row")
    axes.set_ylabel(columns[0].rpartition("_")[2] if columns else "")
    axes.legend()


def _columns(frame: pd.DataFrame) -> tuple[str | None, list[str]]:
    """What is drawn across, None for the number of the row, and what is drawn upwards."""
    numbers = [str(name) for name in frame.select_dtypes("number").columns if frame[name].notna().any()]
    if len(numbers) < 2:
        return None, numbers
    unit = numbers[1].rpartition("_")[2]
    return numbers[0], [name for name in numbers[1:] if name.rpartition("_")[2] == unit]
