"""Reader of the console of grbl, grblHAL and FluidNC: lines ``[PRB:x,y,z:1]``, as a sender keeps them.

A report without a contact (``:0``) is that of a protected move on the way; an ALARM or an error after the last report
says that the program was stopped. Everything else of a console is counted and left out. Coordinates are those of the
machine, which are those of our programs for grbl.
"""

from __future__ import annotations

import re
from collections import Counter

import numpy as np

from stepgauge.errors import InputError
from stepgauge.importing.log import ProbeLog, counted

_NUMBER = r"([-+]?\d+\.?\d*)"
_REPORT = re.compile(rf".*\[PRB:{_NUMBER},{_NUMBER},{_NUMBER}(?:,[-+.\d]+)*:([01])\].*", re.ASCII)
_STOPPED = re.compile(r".*\b(ALARM|error):(\d+)", re.IGNORECASE | re.ASCII)


def recognises(text: str) -> bool:
    """Whether a report of the probe is in the text."""
    return "[PRB:" in text


def read(text: str, path: str) -> ProbeLog:
    """The contacts; :class:`stepgauge.errors.InputError` names a report that is cut short."""
    lines: list[int] = []
    points: list[list[float]] = []
    failures: list[tuple[int, str]] = []
    dropped: Counter[str] = Counter()
    for number, line in enumerate(text.split("\n"), 1):
        report, stopped = _REPORT.fullmatch(line.rstrip("\r")), _STOPPED.match(line)
        if report and report[4] == "1":
            lines.append(number)
            points.append([float(value) for value in report.groups()[:3]])
        elif "[PRB:" in line and not report:
            raise InputError(
                f"{path}:{number}", "the report is cut short", found=repr(line[:60]), expected="[PRB:x,y,z:1]"
            )
        elif stopped:
            failures.append((number, f"{stopped[1]}:{stopped[2]}"))
        elif line.strip():
            dropped["reports of moves without a contact" if report else "other lines"] += 1
    if not points:
        raise InputError(path, "the console shows no contact", expected="lines [PRB:x,y,z:1]")
    _check_stop(path, points, failures)
    return ProbeLog(
        path, "console of grbl", np.array(points), np.array(lines), failures=failures, left_out=counted(dropped)
    )


def _check_stop(path: str, points: list[list[float]], failures: list[tuple[int, str]]) -> None:
    """ALARM:4 follows a contact on the way, which is no reading."""
    if failures and failures[-1][1].upper() == "ALARM:4":
        points_before = f"after {len(points)} contacts, the last of them on the way"
        raise InputError(f"{path}:{failures[-1][0]}", "the program was stopped", found=f"ALARM:4 {points_before}")
