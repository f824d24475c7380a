"""Readings of the virtual CMM say so in the comments of their recording, whichever way they came."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from stepgauge.recording.lines import table_comments

SIMULATED = "simulated"
"""The comment of a recording, and the key of a point in a journal."""
SIMULATED_COMMENT = {SIMULATED: "by the virtual CMM, no machine was measured"}
SIMULATED_LINE = f"# {SIMULATED}: {SIMULATED_COMMENT[SIMULATED]}\n"
SIMULATED_WARNING = "Simulated recording: no machine was measured."


def table_is_simulated(path: str | Path) -> bool:
    """Whether a table (CSV) says so of itself; what was never in a file, or is there no longer, says nothing."""
    return is_simulated(table_comments(path))


def content_comments(comments: Mapping[str, str]) -> dict[str, str]:
    """The comments that are content: when the virtual CMM ran is none, so that equal seeds give what is known again
    (:func:`stepgauge.files.checksum.file_digest` has the same of files)."""
    clock = {"measured_at"} if is_simulated(comments) else set[str]()
    return {key: value for key, value in comments.items() if key not in clock}


def is_simulated(comments: Mapping[str, str]) -> bool:
    """Whether any part of a recording with these comments was simulated; a seed is stated of a simulation alone."""
    return SIMULATED in comments or "seed" in comments
