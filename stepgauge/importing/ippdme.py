"""Reader of I++ DME session logs: the lines that client and server exchanged, with or without a time before them.

A command has a tag, ``00010 PtMeas(X(..), Y(..), Z(..), IJK(..))``; the server answers with the same tag: ``&``
accepted, ``# X(..), Y(..), Z(..)`` data, ``! Error(..)`` failed, ``%`` complete. Answers may come after later commands.
The report is the tip centre, IJK the outward normal: the approach is minus that.
"""

from __future__ import annotations

import datetime
import math
import re
from collections import Counter
from dataclasses import dataclass, field
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError
from stepgauge.importing.log import ProbeLog, counted, unit_vectors
from stepgauge.numerals import number
from stepgauge.recording import comment_lines

Array = NDArray[np.float64]
_LINE = re.compile(r"(?P<before>.*?)(?<![\d.:])(?P<tag>\d{5}|E\d{4})\s+(?P<rest>[A-Za-z&%#!].*)")
_COMMAND = re.compile(r"(\w+)\((.*)\)")
_FIELD = re.compile(r"([A-Za-z][\w.]*)\(([^()]*)\)")
_TIME = re.compile(r"(?:(\d{4}-\d\d-\d\d)[T ])?(\d{1,2}:\d\d:\d\d(?:[.,]\d{1,6})?)")
_TEMPERATURES = {"part.temperature": "gauge_temperature_C", "parttemperature": "gauge_temperature_C"}
_TEMPERATURES |= {f"scale{axis}.temperature": f"scale_temperature_{axis}_C" for axis in "xyz"}


def recognises(text: str) -> bool:
    """Whether a tagged PtMeas and an answer with data are in the text."""
    return bool(re.search(r"(?m)\b\d{5}\s+PtMeas\(", text) and re.search(r"(?m)\b\d{5}\s+#", text))


@dataclass
class _Command:
    """A command that waits for its answer."""

    line: int
    name: str
    arguments: str
    fields: dict[str, str] = field(default_factory=dict)
    state: dict[str, float] = field(default_factory=dict)
    answer_line: int = 0
    seconds: float = math.nan
    failed: str = ""


class _Session:
    def __init__(self, path: str) -> None:
        self.path, self.line = path, 0
        self.open: dict[str, _Command] = {}
        self.points: list[_Command] = []
        self.failures: list[tuple[int, str]] = []
        self.state: dict[str, float] = {}
        self.dropped: Counter[str] = Counter()
        self.days, self.last_s, self.start_s = 0, -math.inf, math.nan
        self.ended = False
        self.seconds = math.nan

    def fail(self, what: str, found: object = None, expected: object = None) -> NoReturn:
        raise InputError(f"{self.path}:{self.line}", what, found=found, expected=expected)

    def take(self, text: str) -> None:
        """Take one line of the log."""
        match = _LINE.fullmatch(text)
        if match is None:
            self.dropped["lines without a tag"] += 1
            return
        tag, rest = match["tag"], match["rest"].strip()
        self.seconds = self._seconds(match["before"])
        self.start_s = self.seconds if math.isnan(self.start_s) else self.start_s
        if tag.startswith("E"):
            self.dropped["events"] += 1
        elif rest[0] in "&%#!":
            self._answer(tag, rest[0], rest[1:].strip())
        else:
            self._command(tag, rest)

    def _command(self, tag: str, rest: str) -> None:
        match = _COMMAND.fullmatch(rest)
        if match is None or rest.count("(") != rest.count(")"):
            self.fail("the command is cut, or not understood", found=repr(rest[:60]), expected="PtMeas(X(..), ..)")
        waiting = self.open.pop(tag, None)
        if waiting is not None and waiting.name == "PtMeas":
            self._unanswered(waiting)
        self.open[tag] = _Command(self.line, match[1], match[2])
        self.ended |= match[1] == "EndSession"
        if match[1] == "SetProp":
            self._note_temperatures(dict(_FIELD.findall(match[2])))

    def _answer(self, tag: str, kind: str, rest: str) -> None:
        command = self.open.get(tag)
        if command is None:
            self.dropped["answers without a command"] += 1
            return
        if kind == "#":
            self._data(command, rest)
        elif kind == "!":
            command.failed = rest
            self.failures.append((self.line, f"{command.name}: {rest}"))
        elif kind == "%":
            self._complete(self.open.pop(tag))

    def _data(self, command: _Command, rest: str) -> None:
        found = dict(_FIELD.findall(rest))
        if not found or rest.count("(") != rest.count(")"):
            self.fail("the answer is cut, or not understood", found=repr(rest[:60]), expected="# X(..), Y(..), Z(..)")
        command.fields |= found
        command.answer_line = self.line
        command.seconds = self.seconds
        self._note_temperatures(found)

    def _note_temperatures(self, fields: dict[str, str]) -> None:
        for name, value in fields.items():
            if name.lower() in _TEMPERATURES:
                self.state[_TEMPERATURES[name.lower()]] = self._number(value, name)

    def _complete(self, command: _Command) -> None:
        if command.name != "PtMeas":
            self.dropped[command.name] += 1
        elif command.failed:
            self.dropped["PtMeas that failed"] += 1
        elif {"X", "Y", "Z"} <= set(command.fields):
            command.state = dict(self.state)
            self.points.append(command)
        else:
            self.failures.append((command.line, "PtMeas complete without X, Y and Z"))

    def _unanswered(self, command: _Command) -> None:
        self.failures.append((command.line, "PtMeas without an answer"))

    def finish(self) -> None:
        """Points in the order of their commands, in which they were measured; what was left unanswered."""
        self.points.sort(key=lambda point: point.line)
        for command in self.open.values():
            if command.name == "PtMeas" and not command.failed:
                self._unanswered(command)

    def _seconds(self, before: str) -> float:
        match = _TIME.search(before)
        if match is None:
            return math.nan
        hours, minutes, rest = match[2].replace(",", ".").split(":")
        seconds = int(hours) * 3600.0 + int(minutes) * 60.0 + float(rest)
        if match[1]:
            return datetime.date.fromisoformat(match[1]).toordinal() * 86400.0 + seconds
        self.days += seconds < self.last_s - 43200.0
        self.last_s = seconds
        return self.days * 86400.0 + seconds

    def _number(self, text: str, what: str) -> float:
        value = number(text.strip())
        if not math.isfinite(value):
            self.fail(f"{what} is not a number", found=repr(text))
        return value


def read(text: str, path: str) -> ProbeLog:
    """The points of a session; :class:`stepgauge.errors.InputError` names the line."""
    session = _Session(path)
    lines = text.splitlines()
    for session.line, line in enumerate(lines, 1):
        if line.strip() and not line.lstrip().startswith("#") and set(line.strip()) != {"\\"}:
            session.take(line.strip())
    session.finish()
    if not session.points:
        session.fail("the session has no measured points", expected="PtMeas answered with # X(..), Y(..), Z(..)")
    position = np.array([_position(session, point) for point in session.points])
    seconds = np.array([point.seconds for point in session.points])
    timed = bool(np.isfinite(seconds).all() and (np.diff(seconds) >= 0.0).all())
    columns, kept = _columns(session)
    comments = {key: value for key, value in comment_lines(lines).items() if not key[:5].isdigit()}
    return ProbeLog(
        path,
        "I++ DME session",
        position,
        np.array([point.answer_line for point in session.points]),
        approach=_approaches(session),
        time_s=(seconds - session.start_s).round(6) if timed else None,
        columns=columns,
        comments=comments,
        cut="" if session.ended else "no EndSession()",
        failures=tuple(session.failures),
        dropped=sum(1 for line in lines if not line.strip() or line.lstrip().startswith("#")),
        mapped=("X, Y, Z are tip centres, approach = minus IJK" + (", time_s from the clock" if timed else ""), *kept),
        left_out=(*counted(session.dropped), *_no_clock(seconds, timed)),
    )


def _no_clock(seconds: Array, timed: bool) -> tuple[str, ...]:
    return (
        () if timed or np.isnan(seconds).all() else ("dropped: times that are not there for all points, or run back",)
    )


def _position(session: _Session, point: _Command) -> list[float]:
    session.line = point.answer_line
    return [session._number(point.fields[axis], axis) for axis in "XYZ"]


def _approaches(session: _Session) -> Array | None:
    """Minus the normals, from the answers where they report IJK, else from the commands; None unless all state one."""
    approach = np.full((len(session.points), 3), np.nan)
    for row, point in enumerate(session.points):
        stated = point.fields.get("IJK") or dict(_FIELD.findall(point.arguments)).get("IJK")
        if stated is None:
            return None
        session.line = point.line
        normal = np.array([session._number(part, "IJK") for part in stated.split(",")])
        if normal.shape != (3,) or np.linalg.norm(normal) < 1e-9:
            session.fail("IJK is no direction", found=stated, expected="three numbers, not all 0")
        approach[row] = -normal
    return unit_vectors(approach) + 0.0


def _columns(session: _Session) -> tuple[dict[str, Array], tuple[str, ...]]:
    """Temperatures that were asked for before each point, and further numbers that every answer reports."""
    columns: dict[str, Array] = {}
    for name in sorted(set().union(*(point.state for point in session.points))):
        values = [point.state.get(name, math.nan) for point in session.points]
        if np.isfinite(values).all():
            columns[name] = np.array(values)
    for name in session.points[0].fields:
        values = [number(point.fields.get(name, "").strip()) for point in session.points]
        if name not in ("X", "Y", "Z", "IJK") and name.lower() not in _TEMPERATURES and np.isfinite(values).all():
            columns[name] = np.array(values)
    return columns, ((f"kept: {', '.join(columns)}",) if columns else ())
