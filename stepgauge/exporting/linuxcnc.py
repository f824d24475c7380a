"""LinuxCNC's probe logs, as the controller writes them for (LOG,..) of the shipped template or for (PROBEOPEN ..)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stepgauge.exporting.options import Export, ExportOptions, left_out, one_placement, run_comments, tip_centres_in_mm
from stepgauge.files.controls import fixed
from stepgauge.recording import Recording


def render(recording: Recording, options: ExportOptions, _: str) -> Export:
    """Rows of a log; seconds are added to the numbered form where they rise from row to row."""
    one_placement(recording, "a probe log")
    tip_centres_in_mm(options, "linuxcnc", "the log")
    comments = "".join(f"# {key}: {value}\n" for key, value in run_comments(recording).items())
    if options.log_form == "probeopen":
        rows = [" ".join([*(fixed(v, 6) for v in xyz), *["0.000000"] * 6]) for xyz in recording.position_mm]
        kept = [row for before, row in zip(["", *rows], rows, strict=False) if row != before]
        words = (f"left out: {len(rows) - len(kept)} points identical to the one before",) if rows != kept else ()
        text = comments + "\n".join(kept) + "\n"
        return Export(text.encode(), (*words, *left_out(recording, ())))
    clock = _clock(recording)
    rows = [f"{n} {' '.join(fixed(v, 7) for v in xyz)} 1" for n, xyz in enumerate(recording.position_mm, 1)]
    if clock is not None:
        rows = [f"{row} {fixed(seconds, 4)}" for row, seconds in zip(rows, clock, strict=True)]
    written = [] if clock is None else ["time_s"]
    return Export((comments + "\n".join(rows) + "\n").encode(), left_out(recording, written))


def _clock(recording: Recording) -> NDArray[np.float64] | None:
    """Seconds of the points, where they rise from row to row as those of a controller do."""
    if "time_s" not in recording.frame:
        return None
    time_s = recording.frame["time_s"].to_numpy(float)
    return time_s if (np.diff(time_s.round(4)) > 0.0).all() else None
