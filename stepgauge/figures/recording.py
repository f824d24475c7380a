"""A recording as it was made, on axes of somebody else."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stepgauge.figures.style import CYCLE
from stepgauge.recording import Recording

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw_recording(axes: Axes, recording: Recording) -> None:
    """Each reading less the mean of its face in its placement, along its approach, um, in the order of the table."""
    frame = recording.frame
    along_mm = (recording.position_mm * recording.approach).sum(axis=1)
    mean_mm = frame.assign(along=along_mm).groupby(["placement", "face"])["along"].transform("mean").to_numpy()
    row = np.arange(1, len(frame) + 1)
    for number, name in enumerate(("back faces", "front faces")):
        some = frame["face"].to_numpy() % 2 == number
        off_um = (along_mm - mean_mm)[some] * 1e3
        axes.plot(row[some], off_um, ".", color=CYCLE[1 - number], label=name)
    axes.set(xlabel="row of the recording", ylabel="reading less the mean of its face (µm)")
    axes.legend(frameon=False)
