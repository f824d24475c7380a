"""Reader of what our programs print on a control: a line ``N17 X 12.3456 Y -3.2000 Z 0.1000`` per point.

DPRNT of Fanuc and its kin, WRITE of SINUMERIK, FN16 of HEIDENHAIN and echo of RepRapFirmware print the same words; what
differs is blanks, zeros in front and decimals. The first line says how many points there will be, the last is END.
"""

from __future__ import annotations

import re

import numpy as np

from stepgauge.errors import InputError
from stepgauge.importing.log import ProbeLog, numbered

_NUMBER = r"([-+]?(?:\d+\.?\d*|\.\d+)(?:E[-+]?\d+)?)"
_POINT = re.compile(rf"N(\d{{1,9}})\.?X{_NUMBER}Y{_NUMBER}Z{_NUMBER}", re.ASCII | re.IGNORECASE)
"""Without blanks: controls put them before numbers and between a sign and its digits."""
_HEAD = re.compile(r"STEPGAUGE +(\d+)\.? +POINTS.*", re.ASCII | re.IGNORECASE)
LAYOUT = "a line 'STEPGAUGE n POINTS ..', lines 'N1 X.. Y.. Z..', and END"


def recognises(text: str) -> bool:
    """Whether the head stands in the text (a control may print lines of its own before it)."""
    return any(_HEAD.fullmatch(line) for _, line in numbered(text))


def read(text: str, path: str) -> ProbeLog:
    """The points of a log; :class:`stepgauge.errors.InputError` names the line that is not understood."""
    lines = list(numbered(text, "%"))
    heads = [(place, _HEAD.fullmatch(line)) for place, (_, line) in enumerate(lines)]
    first, head = next((place, head) for place, head in heads if head)
    rows = [(number, line) for number, line in lines[first + 1 :] if not _HEAD.fullmatch(line)]
    points = [(number, _point(line, f"{path}:{number}")) for number, line in rows if line.upper() != "END"]
    if not points:
        raise InputError(path, "the log has no points", expected=LAYOUT)
    values = np.array([point for _, point in points])
    ended = rows[-1][1].upper() == "END"
    return ProbeLog(
        path,
        "printed by the control",
        values[:, 1:],
        np.array([number for number, _ in points]),
        values[:, 0].astype(np.int64),
        dropped=first,
        cut="" if ended else f"no END after {len(points)} of {int(head[1])} points",
        units=("mm",),
    )


def _point(line: str, where: str) -> list[float]:
    match = _POINT.fullmatch(line.replace(" ", ""))
    if match is None:
        raise InputError(where, "not a point of a log", found=repr(line[:60]), expected="N1 X.. Y.. Z..")
    return [float(value) for value in match.groups()]
