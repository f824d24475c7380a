"""Reader of the console of grbl, grblHAL and FluidNC: lines ``[PRB:x,y,z:1]``, as a sender keeps them.

A report without a contact (``:0``) is that of a protected move on the way. ``$#`` prints the last report once more,
behind the length of the tool. Reports are in machine coordinates, which are those of our programs for grbl, and in mm;
``$13=1`` makes them inches, and where that is not shown but a program was in inches (``G20``), geometry tells. The
interface of grbl 1.1 says of each alarm whether the position is kept; a program has lost a part of its moves by any.
"""

from __future__ import annotations

import re
from collections import Counter

import numpy as np

from stepgauge.errors import InputError
from stepgauge.importing.log import ProbeLog, check_other_axes, counted, numbered

_NUMBER = r"[-+]?\d+\.?\d*"
_REPORT = re.compile(rf"\[PRB:({_NUMBER}(?:,{_NUMBER}){{2,8}}):([01])\]", re.ASCII)
_STOPPED = re.compile(
    r"(?<!<)\b(ALARM|error): *(\d+|[a-z][^\r\n.]*)|<(Alarm)\b|\b(Grbl)(?:HAL)? \d\S* \[", re.IGNORECASE
)
"""By number (1.1) or in words (0.9); the state in a status report; and the greeting, which follows every reset."""
_INCHES = re.compile(r"\$13=([01])|\bG20\b", re.IGNORECASE)


def recognises(text: str) -> bool:
    """Whether a report of the probe is in the text."""
    return "[PRB:" in text


def read(text: str, path: str) -> ProbeLog:
    """The contacts; :class:`stepgauge.errors.InputError` names a report that is cut short."""
    points: list[tuple[int, list[float]]] = []
    failures: list[tuple[int, str]] = []
    dropped: Counter[str] = Counter()
    before = ""
    for number, line in numbered(text):
        report, stopped = _REPORT.search(line), _STOPPED.search(line)
        if "[PRB:" in line and not report:
            raise InputError(
                f"{path}:{number}", "the report is cut short", found=repr(line[:60]), expected="[PRB:x,y,z:1]"
            )
        if stopped:
            failures += _failure(number, stopped, bool(points))
        elif not report:
            dropped["other lines"] += 1
        elif report[2] == "0":
            dropped["reports of moves without a contact"] += 1
        elif "[TLO:" in before:
            dropped["reports that $# repeats"] += 1
        else:
            points.append((number, [float(value) for value in report[1].split(",")]))
        before = line
    if not points:
        raise InputError(path, "the console shows no contact", expected="lines [PRB:x,y,z:1]")
    lines = [number for number, _ in points]
    check_other_axes([values[3:] for _, values in points], path, lines)
    _check_stop(path, lines, failures)
    return ProbeLog(
        path,
        "console of grbl",
        np.array([values[:3] for _, values in points]),
        np.array(lines),
        failures=failures,
        alarms=[one for one in failures if not one[1].lower().startswith("error")],
        units=_units(text),
        left_out=counted(dropped),
    )


def _failure(number: int, stopped: re.Match[str], running: bool) -> list[tuple[int, str]]:
    """What the controller reported; a greeting before the first contact is none."""
    if stopped[4]:
        return [(number, "a restart of the controller")] if running else []
    return [(number, f"{stopped[1]}:{stopped[2]}" if stopped[1] else "state Alarm")]


def _units(text: str) -> tuple[str, ...]:
    """``$13`` states the unit of reports, G20 only that of the program."""
    found = _INCHES.findall(text)
    stated = [one for one in found if one]
    return ({"1": "inch", "0": "mm"}[stated[-1]],) if stated else ("mm", "inch") if found else ()


def _check_stop(path: str, lines: list[int], failures: list[tuple[int, str]]) -> None:
    """ALARM:4 follows a contact on the way, which is no reading."""
    last = next((one for one in failures[::-1] if one[1].upper() == "ALARM:4"), None)
    if last is not None and last[0] > lines[-1]:
        points_before = f"after {len(lines)} contacts, the last of them on the way"
        raise InputError(f"{path}:{last[0]}", "the program was stopped", found=f"ALARM:4 {points_before}")
