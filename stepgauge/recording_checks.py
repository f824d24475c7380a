"""The checks of :mod:`stepgauge.recording.identity` under the name that older imports know."""

from __future__ import annotations

from stepgauge.recording.identity import axis_from_approaches, certified_mm, check_recording

__all__ = ["axis_from_approaches", "certified_mm", "check_recording"]
