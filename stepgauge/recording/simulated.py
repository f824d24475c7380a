"""Readings of the virtual CMM say so in the comments of their recording, whichever way they came."""

from __future__ import annotations

from collections.abc import Mapping

SIMULATED = "simulated"
"""The comment of a recording, and the key of a point in a journal."""
SIMULATED_COMMENT = {SIMULATED: "by the virtual CMM, no machine was measured"}
SIMULATED_WARNING = "Simulated recording: no machine was measured."


def is_simulated(comments: Mapping[str, str]) -> bool:
    """Whether any part of a recording with these comments was simulated; a seed is stated of a simulation alone."""
    return SIMULATED in comments or "seed" in comments
