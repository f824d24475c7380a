"""Reader of what our programs print on a control: a line ``N17 X 12.3456 Y -3.2000 Z 0.1000`` per point.

DPRNT of Fanuc and its kin, WRITE of SINUMERIK, FN16 of HEIDENHAIN and echo of RepRapFirmware print the same words; what
differs is blanks, zeros in front and decimals. The first line says how many points there will be, the last is END.
"""

from __future__ import annotations

import re

import numpy as np

from stepgauge.correspondence.probe_log import ProbeLog
from stepgauge.importing.log_lines import LogLines

_NUMBER = r"([-+]?(?:\d+\.?\d*|\.\d+)(?:E[-+]?\d+)?)"
_POINT = re.compile(rf"N(\d{{1,9}})\.?X{_NUMBER}Y{_NUMBER}Z{_NUMBER}", re.ASCII | re.IGNORECASE)
"""Without blanks: controls put them before numbers and between a sign and its digits."""
_HEAD = re.compile(r"STEPGAUGE +(\d+)\.? +POINTS.*", re.ASCII | re.IGNORECASE)
LAYOUT = "a line 'STEPGAUGE n POINTS ..', lines 'N1 X.. Y.. Z..', and END"


def recognises(text: str) -> bool:
    """Whether the head stands in the text (a control may print lines of its own before it)."""
    return any(map(_HEAD.fullmatch, LogLines(text, "")))


def read(text: str, path: str) -> ProbeLog:
    """The points of a log; :class:`stepgauge.errors.InputError` names the line that is not understood."""
    lines, before, count, line = LogLines(text, path, "%"), 0, "", ""
    for line in lines:
        head = _HEAD.fullmatch(line)
        point = _POINT.fullmatch(line.replace(" ", ""))
        if head:
            count = count or head[1]
        elif not count:
            before += 1
        elif point:
            lines.add([float(value) for value in point.groups()])
        elif line.upper() != "END":
            lines.fail("not a point of a log", repr(line[:60]), "N1 X.. Y.. Z..")
    values = lines.values("the log has no points", LAYOUT)
    return lines.log(
        "printed by the control",
        values[:, 1:],
        number=values[:, 0].astype(np.int64),
        dropped=before,
        cut="" if line.upper() == "END" else f"no END after {len(values)} of {int(count)} points",
        units=("mm",),
    )
