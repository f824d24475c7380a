"""What a file states of itself (runs, targets, readings, one direction) compared with what was read from it."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np

from stepgauge.axis.recording import AxisRecording, places_of
from stepgauge.errors import InputError, naming

_COUNTED = r"(?:number of |no\.? of |anzahl )?(?:{})(?:[- ]count)?"
_RUNS, _TARGETS, _READINGS = (
    re.compile(_COUNTED.format(words))
    for words in (
        "runs?|cycles?|l[aä]ufe|zyklen|durchg[aä]nge",
        "targets?|target positions|target points|positions|sollpositionen|positionen|zielpositionen",
        "readings|samples?|records|rows|values|messwerte|ablesungen|werte|datens[aä]tze|count|anzahl",
    )
)
_WAYS = re.compile(r"direction|directions|mode|test type|richtung|modus|approach|anfahrt")


def check_stated(facts: Mapping[str, str], recording: AxisRecording, path: str) -> None:
    """:class:`InputError` where a count, or a word on the directions, is not what was read.

    A run may count there and back as one or as two.
    """
    frame = recording.frame
    if not any(pattern.fullmatch(key) for key in facts for pattern in (_RUNS, _TARGETS, _READINGS, _WAYS)):
        return
    runs = int(frame.groupby("placement")["cycle"].nunique().sum())
    both = int(frame[["placement", "cycle", "way"]].drop_duplicates().shape[0])
    targets = len(np.unique(places_of(frame["target"].to_numpy(float)))) if "target" in frame else None
    counted = [(_READINGS, {len(frame)}, "readings")]
    if targets is not None:
        counted += [(_RUNS, {runs, both}, "runs"), (_TARGETS, {targets}, "targets")]
    for key, text in facts.items():
        for pattern, right, what in counted:
            if pattern.fullmatch(key) and text.strip().isdigit() and int(text) not in right:
                found = " or ".join(map(str, sorted(right)))
                raise InputError(
                    path,
                    f"the file says {key} {text}, and {found} {what} were read: is it cut, or a column taken wrongly?",
                    expected=naming("columns", "header", words="a whole file; else the columns by {} or {}"),
                )
        if _WAYS.fullmatch(key):
            _check_ways(key, text, set(frame["way"].unique().tolist()), path)


def _check_ways(key: str, text: str, ways: set[int], path: str) -> None:
    said = text.casefold()
    one = "unidirectional" in said or "unidirektional" in said
    two = "bidirectional" in said or "bidirektional" in said
    if (one and len(ways) > 1) or (two and len(ways) < 2):
        found = f"{len(ways)} direction{'s' * (len(ways) > 1)}"
        expected = naming("constants", "columns", words="{} direction=+ for all rows, or the column by {} way=")
        raise InputError(path, f"the file says {key} {text}, and the readings are of another number of directions",
                         found=found, expected=expected)  # fmt: skip
