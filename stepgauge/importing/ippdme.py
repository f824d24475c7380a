"""Reader of I++ DME session logs: the lines that client and server exchanged, with or without a time before them.

A command has a tag, ``00010 PtMeas(X(..), Y(..), Z(..), IJK(..))``; the server answers with the same tag: ``&``
accepted, ``# X(..), Y(..), Z(..)`` data, ``! Error(..)`` failed, ``%`` complete. Answers may come after later commands.
The report is the tip centre. The approach is minus the commanded IJK, the outward normal: what a server reports as IJK
is its own affair. Only PtMeas is read strictly; what the answers to other commands look like is not stated here.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field

import numpy as np

from stepgauge.correspondence.probe_log import ProbeLog
from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.files.numerals import number
from stepgauge.importing.log_lines import LogLines, unit_vectors
from stepgauge.importing.tables.clock import Clock, read_clock, stamp_in
from stepgauge.ippdme.codes import DmeError
from stepgauge.ippdme.commands import OWN_SIMULATED, OWN_TIME
from stepgauge.ippdme.values import once
from stepgauge.recording import comment_lines
from stepgauge.recording.simulated import SIMULATED_COMMENT

_LINE = re.compile(r"(?P<before>.*?)(?<![\d.:])(?P<tag>\d{5}|E\d{4})\s+(?P<rest>[A-Za-z&%#!].*)", re.ASCII)
_COMMAND = re.compile(r"(\w+)\((.*)\)")
_FIELD = re.compile(r"([A-Za-z][\w.]{0,99})\(([^()]*)\)")
OTHER_NORMAL = 0.02
"""A reported IJK that differs from the commanded one by more is said to be another."""
_FATAL = re.compile(r"Error\(\s*9\b")
"""Severity of an error after which a server must be started and homed again (I++ DME 1.7, 8.1)."""
_RADIUS_MM = (0.05, 20.0)
_TEMPERATURES = {"part.temperature": "gauge_temperature_C", "parttemperature": "gauge_temperature_C"}
_TEMPERATURES |= {f"scale{axis}.temperature": f"scale_temperature_{axis}_C" for axis in "xyz"}


def recognises(text: str) -> bool:
    """Whether a tagged PtMeas and an answer with data are in the text."""
    return bool(re.search(r"\b\d{5}[ \t]+PtMeas\(", text) and re.search(r"\b\d{5}[ \t]+#", text))


@dataclass
class _Command:
    """A command that waits for its answer."""

    line: int
    name: str
    arguments: str
    fields: dict[str, str] = field(default_factory=dict)
    state: dict[str, float] = field(default_factory=dict)
    answer_line: int = 0
    stamp: str | None = None
    failed: str = ""


class _Session(LogLines):
    def __init__(self, text: str, path: str) -> None:
        super().__init__(text, path, "\\")
        self.open: dict[str, _Command] = {}
        self.measured: list[_Command] = []
        self.state: dict[str, float] = {}
        self.first: str | None = None
        self.stamp: str | None = None
        self.ended = self.simulated = False

    def take(self, text: str) -> None:
        """Take one line of the log."""
        match = _LINE.fullmatch(text)
        if match is None:
            self.dropped["lines without a tag"] += 1
            return
        tag, rest = match["tag"], match["rest"].strip()
        self.stamp = stamp_in(match["before"])
        self.first = self.first or self.stamp
        if tag.startswith("E") and rest[0] == "!":  # of no command: the machine stopped by itself
            self.alarms.append((self.line, rest))
        elif tag.startswith("E"):
            self.dropped["events"] += 1
        elif rest[0] in "&%#!":
            self._answer(tag, rest[0], rest[1:].strip())
        else:
            self._command(tag, rest)

    def _command(self, tag: str, rest: str) -> None:
        match = _COMMAND.fullmatch(rest)
        whole = match is not None and rest.count("(") == rest.count(")")
        if match is None or (match[1] == "PtMeas" and not whole):
            if not rest.startswith("PtMeas"):
                self.dropped["commands that are not understood"] += 1
                return
            self.fail("the command is cut, or not understood", found=repr(rest[:60]), expected="PtMeas(X(..), ..)")
        waiting = self.open.pop(tag, None)
        if waiting is not None and waiting.name == "PtMeas":
            self._unanswered(waiting)
        if match[1] == "PtMeas":
            self._once(_FIELD.findall(match[2]))
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
            if _FATAL.match(rest):
                self.alarms.append(self.failures.pop())
        elif kind == "%":
            self._complete(self.open.pop(tag))

    def _data(self, command: _Command, rest: str) -> None:
        if command.name != "PtMeas":
            self._note_temperatures(dict(_FIELD.findall(rest)))
            return
        found = _FIELD.findall(rest)
        if not found or rest.count("(") != rest.count(")"):
            self.fail("the answer is cut, or not understood", found=repr(rest[:60]), expected="# X(..), Y(..), Z(..)")
        command.fields = self._once([*command.fields.items(), *found])
        command.answer_line = self.line
        command.stamp = self.stamp
        self._note_temperatures(dict(found))

    def _once(self, pairs: list[tuple[str, str]]) -> dict[str, str]:
        """Values by name; nothing says which of two is true, in one line of an answer or in two."""
        try:
            return once(pairs)
        except DmeError as error:
            self.fail(error.detail, expected="every name once")

    def _note_temperatures(self, fields: dict[str, str]) -> None:
        self.simulated |= fields.get(OWN_SIMULATED, "").strip() == "1"
        for name, value in fields.items():
            if name.lower() in _TEMPERATURES:
                self.state[_TEMPERATURES[name.lower()]] = self.read_number(value, name)

    def _complete(self, command: _Command) -> None:
        if command.name != "PtMeas":
            self.dropped[command.name] += 1
        elif command.failed:
            self.dropped["PtMeas that failed"] += 1
        elif {"X", "Y", "Z"} <= set(command.fields):
            command.state = dict(self.state)
            self.measured.append(command)
        else:
            self.failures.append((command.line, "PtMeas complete without X, Y and Z"))

    def _unanswered(self, command: _Command) -> None:
        self.failures.append((command.line, "PtMeas without an answer"))

    def finish(self) -> None:
        """Points in the order of their commands, in which they were measured; what was left unanswered."""
        self.measured.sort(key=lambda point: point.line)
        for command in self.open.values():
            if command.name == "PtMeas" and not command.failed:
                self._unanswered(command)

    def read_number(self, text: str, what: str) -> float:
        value = number(text.strip())
        if not math.isfinite(value):
            self.fail(f"{what} is not a number", found=repr(text))
        return value


def read(text: str, path: str) -> ProbeLog:
    """The points of a session; :class:`stepgauge.errors.InputError` names the line."""
    session, lines = _Session(text, path), text.splitlines()
    for line in session:
        if not line.startswith("#"):
            session.take(line)
    session.finish()
    if not session.measured:
        session.fail("the session has no measured points", expected="PtMeas answered with # X(..), Y(..), Z(..)")
    for point in session.measured:
        session.line = point.answer_line
        session.add([session.read_number(point.fields.get(name, "0"), name) for name in ("X", "Y", "Z", "R")])
    values = np.array(session.points)
    session.check_other_axes(values[:, 3:])
    stamps = [session.first, *(point.stamp for point in session.measured)]
    time_s, clock = _time_s(session, stamps)
    approach, directions = _approaches(session)
    radius, tool = _tip_radius_mm(session)
    columns, kept = _columns(session)
    comments = {key: value for key, value in comment_lines(lines).items() if not key[:5].isdigit()}
    started = _read_clock(stamps[:1], path)
    date = {"measured_at": started.start} if isinstance(started, Clock) and started.start is not None else {}
    session.notes += clock[1:]
    return session.log(
        "I++ DME session",
        values[:, :3],
        approach=approach,
        time_s=time_s,
        columns=columns,
        comments=date | comments | (SIMULATED_COMMENT if session.simulated else {}),
        tip_radius_mm=radius,
        cut="" if session.ended else "no EndSession()",
        units=("mm",),
        dropped=sum(1 for line in lines if not line.strip() or line.lstrip().startswith("#")),
        mapped=("X, Y, Z are tip centres, approach = minus IJK", *clock[:1], *directions, *tool, *kept),
    )


def _time_s(session: _Session, stamps: list[str | None]) -> tuple[Array | None, tuple[str, ...]]:
    """Seconds of the machine's own clock where every answer tells them, else since the first line of the session.

    With words on what was mapped, or left out and why.
    """
    told = np.array([number(point.fields.get(OWN_TIME, "").strip()) for point in session.measured])
    if np.isfinite(told).all() and (np.diff(told) >= 0.0).all():
        return told, (f"time_s is {OWN_TIME} of the answers",)
    if not any(stamps):
        return None, ()
    found = _read_clock(stamps, session.path)
    if isinstance(found, str):
        return None, ("no time_s", f"dropped: times that are not understood ({found})")
    seconds = np.array([np.nan]) if found is None else found.elapsed_s
    if not (np.diff(seconds, prepend=seconds[0]) >= 0.0).all():
        return None, ("no time_s", "dropped: times that are not there for all points, or run back")
    if len(seconds) > 2 and not np.ptp(seconds[1:]):
        return None, ("no time_s", f"dropped: times, for the clock stands at {stamps[-1]}")
    return seconds[1:].round(6), ("time_s from the clock",)


def _read_clock(stamps: list[str | None], path: str) -> Clock | str | None:
    """The times, the one that is not understood, or None where some are not there."""
    if None in stamps:
        return None
    try:
        return read_clock(stamps, lambda _: path, "time")
    except InputError as error:
        return str(error.found)


def _tip_radius_mm(session: _Session) -> tuple[float | None, tuple[str, ...]]:
    """The effective radius ER of the server's tool, where all answers report the same."""
    stated = {number(point.fields.get("ER", "").strip()) for point in session.measured}
    radius = next(iter(stated))
    if len(stated) > 1 or not _RADIUS_MM[0] <= radius <= _RADIUS_MM[1]:
        return None, ()
    return radius, (f"the tool of the server has an effective radius ER of {radius:g} mm",)


def _approaches(session: _Session) -> tuple[Array | None, tuple[str, ...]]:
    """Minus the normals of the commands, or of the answers where these alone state them; None unless all state one.

    With a word on answers that report another normal than was commanded.
    """
    approach, off = np.full((len(session.measured), 3), np.nan), []
    for row, point in enumerate(session.measured):
        commanded = dict(_FIELD.findall(point.arguments)).get("IJK")
        reported = point.fields.get("IJK")
        stated = commanded or reported
        if stated is None:
            return None, ()
        session.line = point.line
        approach[row] = -_normal(session, stated)
        if commanded and reported:
            session.line = point.answer_line
            off.append(float(np.linalg.norm(_normal(session, reported) + approach[row])))
    differ = sum(one > OTHER_NORMAL for one in off)
    words = (f"IJK as commanded; {differ} of {len(off)} answers report another one, which was not used",)
    return unit_vectors(approach) + 0.0, words if differ else ()


def _normal(session: _Session, text: str) -> Array:
    normal = np.array([session.read_number(part, "IJK") for part in text.split(",")])
    if normal.shape != (3,) or np.linalg.norm(normal) < 1e-9:
        session.fail("IJK is no direction", found=text, expected="three numbers, not all 0")
    return np.asarray(normal / np.linalg.norm(normal)) if abs(np.linalg.norm(normal) - 1.0) > 1e-9 else normal


def _columns(session: _Session) -> tuple[dict[str, Array], tuple[str, ...]]:
    """Temperatures that were asked for before each point, and further numbers that every answer reports."""
    points = session.measured
    told: dict[str, list[float]] = {
        name: [point.state.get(name, math.nan) for point in points]
        for name in sorted({n for p in points for n in p.state})
    }
    for name in points[0].fields:
        if name not in ("X", "Y", "Z", "IJK", OWN_TIME) and name.lower() not in _TEMPERATURES:
            told[name] = [number(point.fields.get(name, "").strip()) for point in points]
    columns = {name: np.array(values) for name, values in told.items() if np.isfinite(values).all()}
    return columns, ((f"kept: {', '.join(columns)}",) if columns else ())
