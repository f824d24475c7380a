"""An I++ DME session as client and server would have exchanged it, with the time before each line where it is known."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count

import numpy as np

from stepgauge import __version__
from stepgauge.exporting.options import (
    Export,
    ExportOptions,
    left_out,
    one_placement,
    run_comments,
    tip_centres_in_mm,
    tip_radius_mm,
)
from stepgauge.files.controls import fixed
from stepgauge.recording import Recording
from stepgauge.recording.columns import SCALE_TEMPERATURES

STATES = ["speed_mm_s", *SCALE_TEMPERATURES]


def render(recording: Recording, options: ExportOptions, _: str) -> Export:
    """The lines of a session. PtMeas commands name the point that was measured: what was planned is not recorded."""
    one_placement(recording, "an I++ DME session")
    tip_centres_in_mm(options, "ippdme", "a session")
    comments = [f"# {key}: {value}" for key, value in run_comments(recording, STATES).items()]
    head = [f"# written by stepgauge {__version__} as the session of {len(recording)} points", *comments]
    lines = [*head, *_session(recording, tip_radius_mm(recording, options) or 0.0)]
    return Export(
        "".join(line + "\r\n" for line in lines).encode(), left_out(recording, ["time_s", "gauge_temperature_C"])
    )


def _session(recording: Recording, radius_mm: float) -> Iterator[str]:
    tags = (f"{n % 99999 + 1:05d}" for n in count())
    frame = recording.frame
    time_s = frame["time_s"].to_numpy(float) if "time_s" in frame else np.full(len(frame), np.nan)
    part_C = frame["gauge_temperature_C"].to_numpy(float) if "gauge_temperature_C" in frame else None
    start = "" if np.isnan(time_s).any() else _clock(0.0)
    for command in ("StartSession()", "ClearAllErrors()", "OnPtMeasReport(X(), Y(), Z())"):
        yield from _exchange(next(tags), command, start)
    for row, (tip, approach) in enumerate(zip(recording.position_mm, recording.approach, strict=True)):
        clock = "" if not start else _clock(float(time_s[row]))
        if part_C is not None and (row == 0 or part_C[row] != part_C[row - 1]):
            yield from _exchange(next(tags), f"SetProp(Part.Temperature({fixed(float(part_C[row]), 12)}))", clock)
        ijk = ", ".join(fixed(-value, 10) for value in approach)
        command = f"PtMeas({_xyz(tip + radius_mm * approach, 4)}, IJK({ijk}))"
        yield from _exchange(next(tags), command, clock, _xyz(tip, 7))
    yield from _exchange(next(tags), "EndSession()", clock)


def _exchange(tag: str, command: str, clock: str, data: str = "") -> Iterator[str]:
    yield f"{clock}{tag} {command}"
    yield f"{clock}{tag} &"
    if data:
        yield f"{clock}{tag} # {data}"
    yield f"{clock}{tag} %"


def _xyz(position_mm: np.ndarray, decimals: int) -> str:
    return ", ".join(f"{axis}({fixed(value, decimals)})" for axis, value in zip("XYZ", position_mm, strict=True))


def _clock(seconds: float) -> str:
    ticks = round(seconds * 1e4) % 864000000
    hours, rest = divmod(ticks, 36000000)
    minutes, rest = divmod(rest, 600000)
    return f"{hours:02d}:{minutes:02d}:{rest // 10000:02d}.{rest % 10000:04d} "
