"""Reader of the console of grbl, grblHAL and FluidNC: lines ``[PRB:x,y,z:1]``, as a sender keeps them.

A report without a contact (``:0``) is that of a protected move on the way. ``$#`` prints the last report once more,
behind the length of the tool. Reports are in machine coordinates, which are those of our programs for grbl, and in mm;
``$13=1`` makes them inches, and where that is not shown but a program was in inches (``G20``), geometry tells. The
interface of grbl 1.1 says of each alarm whether the position is kept; a program has lost a part of its moves by any.
"""

from __future__ import annotations

import re

from stepgauge.correspondence.probe_log import NO_CONTACT, ProbeLog
from stepgauge.importing.log_lines import LogLines

_NUMBER = r"[-+]?\d+\.?\d*"
_REPORT = re.compile(rf"\[PRB:({_NUMBER}(?:,{_NUMBER}){{2,8}}):([01])\]", re.ASCII)
_STOPPED = re.compile(
    r"(?<!<)\b(ALARM|error): *(\d+|[a-z][^\r\n.]*)|<(Alarm)\b|\b(Grbl)(?:HAL)? \d\S* \[", re.IGNORECASE
)
"""By number (1.1) or in words (0.9); the state in a status report; and the greeting, which follows every reset."""
_MEANT = {
    "1": "a limit switch was touched",
    "2": "a move goes beyond the travel",
    "3": "it was reset in motion",
    "4": "the probe was in contact before its search",
    "5": NO_CONTACT,
    **dict.fromkeys("6789", "homing failed"),
}
"""Alarms of grbl 1.1 and grblHAL (doc/csv/alarm_codes_en_US.csv of grbl)."""
_INCHES = re.compile(r"\$13=([01])|\bG20\b", re.IGNORECASE)


def recognises(text: str) -> bool:
    """Whether a report of the probe is in the text."""
    return "[PRB:" in text


def read(text: str, path: str) -> ProbeLog:
    """The contacts; :class:`stepgauge.errors.InputError` names a report that is cut short."""
    lines, before = LogLines(text, path), ""
    for line in lines:
        report, stopped = _REPORT.search(line), _STOPPED.search(line)
        if "[PRB:" in line and not report:
            lines.fail("the report is cut short", repr(line[:60]), "[PRB:x,y,z:1]")
        if stopped:
            _note(lines, stopped)
        elif not report:
            lines.dropped["other lines"] += 1
        elif report[2] == "0":
            lines.dropped["reports of moves without a contact"] += 1
        elif "[TLO:" in before:
            lines.dropped["reports that $# repeats"] += 1
        else:
            lines.add([float(value) for value in report[1].split(",")])
        before = line
    values = lines.values("the console shows no contact", "lines [PRB:x,y,z:1]")
    lines.check_other_axes(values[:, 3:])
    last = next((one for one in lines.alarms[::-1] if one[1].upper()[:7] == "ALARM:4"), None)
    if last is not None and last[0] > lines.at[-1]:  # it follows a contact on the way, which is no reading
        found = f"ALARM:4 after {len(values)} contacts, the last of them on the way"
        lines.fail("the program was stopped", found, line=last[0])
    time_s = lines.clock_s()
    mapped = () if time_s is None else ("time_s from the clock",)
    return lines.log("console of grbl", values[:, :3], units=_units(text), time_s=time_s, mapped=mapped)


def _note(lines: LogLines, stopped: re.Match[str]) -> None:
    """What the controller reported; a greeting before the first contact is nothing."""
    words = f"{stopped[1]}:{stopped[2]}" if stopped[1] else "state Alarm"
    if stopped[4] and not lines.points:
        return
    words = "a restart of the controller" if stopped[4] else words
    if words.lower().startswith("alarm") and (meant := _MEANT.get(stopped[2])):
        words = f"{words} ({meant})"
    (lines.failures if words.lower().startswith("error") else lines.alarms).append((lines.line, words))


def _units(text: str) -> tuple[str, ...]:
    """``$13`` states the unit of reports, G20 only that of the program."""
    found = _INCHES.findall(text)
    stated = [one for one in found if one]
    return ({"1": "inch", "0": "mm"}[stated[-1]],) if stated else ("mm", "inch") if found else ()
