"""The recording, the table that every later step reads, and whether its rows can be readings of a gauge."""

from __future__ import annotations

from stepgauge.recording.columns import APPROACH, COUNTS, OPTIONAL, POSITION, REQUIRED
from stepgauge.recording.lines import comment_lines
from stepgauge.recording.read import is_recording_file, no_gauge, read_recording, read_recordings, recording_of_frame
from stepgauge.recording.table import PROBINGS, Recording, join_recordings, write_recording

__all__ = [
    "APPROACH",
    "COUNTS",
    "OPTIONAL",
    "POSITION",
    "PROBINGS",
    "REQUIRED",
    "Recording",
    "comment_lines",
    "is_recording_file",
    "join_recordings",
    "no_gauge",
    "read_recording",
    "read_recordings",
    "recording_of_frame",
    "write_recording",
]
