"""Reader of DMIS output: what a controller measured, as ``FA(name)=FEAT/POINT,CART,x,y,z,i,j,k``.

i,j,k is the outward normal of the surface, so the approach is minus that. PRCOMP says whether the points are
compensated by the tip radius, UNITS in what they are. Nominal points F(..) and the rest are counted and left out.
``TEXT/OUTFIL,'key: value'`` is kept as a comment, percent-encoded where the key ends in ``*``.
"""

from __future__ import annotations

import datetime
import re
from urllib.parse import unquote

import numpy as np

from stepgauge.correspondence.probe_log import ProbeLog
from stepgauge.files.arrays import Array
from stepgauge.files.units import LENGTH_MM
from stepgauge.importing.log_lines import LogLines, unit_vectors
from stepgauge.motion.moves import ProbingSettings
from stepgauge.programs.dmis import ENCODED, statements
from stepgauge.programs.reading import Reader

_STATEMENT = re.compile(r"(?:([A-Z]+)\(([^()]*)\)\s*=\s*)?([A-Z]+)(?:\s*[/=]\s*(.*))?", re.IGNORECASE | re.DOTALL)
_MM = {"MM": 1.0, "CM": 10.0, "M": 1000.0, "INCH": LENGTH_MM["inch"]}
_POINT = re.compile(r"C(\d{1,9})F(\d{1,9})|P(\d{1,9})C(\d{1,9})F(\d{1,9})", re.IGNORECASE | re.ASCII)
_LABELLED = ("SNSDEF", "DATSET")
_STATES = (*_LABELLED, "UNITS", "PRCOMP", "DMISMN", "FILNAM", "ENDFIL", "DATE", "TIME", "TECOMP")
"""Statements that say something of the points; with a label before them, and without."""
_UNIT_LENGTH = 0.01
"""Normals are printed with a few digits; a vector this far from length 1 is no direction."""


def recognises(text: str) -> bool:
    """Whether a measured point FA(..) is in the text."""
    return re.search(r"(?im)^[ \t]*FA\([^()\n]*\)[ \t]*=[ \t]*FEAT[ \t]*/", text) is not None


class _Output(LogLines):
    """What the statements say, collected one by one: position, normal and time of every point."""

    def __init__(self, text: str, path: str) -> None:
        super().__init__(text, path)
        self.reader = Reader(path, ProbingSettings())
        self.unit = ""
        self.surface: bool | None = None
        self.radii_mm: set[float] = set()
        self.labels: list[str] = []
        self.clock = np.nan
        self.comments: dict[str, str] = {}
        self.header = self.ended = False

    def statement(self, statement: str) -> None:
        """Take one statement; what is not about measured points is counted."""
        match = _STATEMENT.fullmatch(statement)
        kind, name, major, rest = match.groups() if match else (None, None, statement.split("/")[0], "")
        major, kind = major.upper(), (kind or "").upper()
        arguments = [part.strip() for part in (rest or "").split(",")]
        if kind == "FA" and major == "FEAT":
            self._measured(name or "", arguments)
            return
        if major == "TEXT":
            self._text(rest or "")
            return
        if major not in _STATES or (kind and major not in _LABELLED):
            self.dropped[f"{kind}()" if kind else major] += 1
        else:
            getattr(self, f"_{major.lower()}")(arguments)

    def _units(self, arguments: list[str]) -> None:
        name = arguments[0].upper()
        if name not in _MM:
            self.reader.fail("unit of length not understood", found=f"UNITS/{name}", expected=", ".join(_MM))
        self.unit = name

    def _prcomp(self, arguments: list[str]) -> None:
        state = arguments[0].upper()
        if state not in ("ON", "OFF"):
            self.reader.fail("PRCOMP not understood", found=state, expected="ON or OFF")
        if self.surface is not None and self.points and self.surface != (state == "ON"):
            self.reader.fail("PRCOMP changes between measured points", found=f"PRCOMP/{state}", expected="one state")
        self.surface = state == "ON"

    def _snsdef(self, arguments: list[str]) -> None:
        shape = next((word for word in map(str.upper, arguments) if word in ("CYLNDR", "DISK")), None)
        if shape is not None:
            self.reader.fail(
                "the tip is no ball", found=f"SNSDEF .. {shape}", expected="a diameter, or SPHERE behind it"
            )
        given = arguments[:-1] if arguments[-1].upper() == "SPHERE" else arguments
        diameter = self.reader.number(given[-1], "SNSDEF tip diameter")
        self.radii_mm.add(diameter * self._scale() / 2.0)

    def _datset(self, arguments: list[str]) -> None:
        if arguments[0].upper() != "MCS":
            self.notes.append(
                f"coordinates are those of the part, DATSET/{','.join(arguments)}, not of the machine's axes"
            )

    def _dmismn(self, _: list[str]) -> None:
        self.header = True

    _filnam = _dmismn

    def _tecomp(self, _: list[str]) -> None:
        """What is said of temperature is read from all logs alike (:mod:`stepgauge.importing.thermal`)."""

    def _endfil(self, _: list[str]) -> None:
        self.ended = True

    def _date(self, arguments: list[str]) -> None:
        self.comments["date"] = ",".join(arguments).strip("'").replace("/", "-")

    def _time(self, arguments: list[str]) -> None:
        text = ",".join(arguments).strip("'")
        try:
            clock = datetime.time.fromisoformat(text.zfill(8))
        except ValueError:
            self.reader.fail("TIME not understood", found=repr(text), expected="hh:mm:ss")
        self.clock = clock.hour * 3600.0 + clock.minute * 60.0 + clock.second + clock.microsecond * 1e-6

    def _text(self, rest: str) -> None:
        where, _, words = rest.partition(",")
        key, colon, value = words.strip().strip("'").partition(":")
        key, value = key.strip(), value.strip()
        if where.strip().upper() == "OUTFIL" and colon:
            if key.endswith(ENCODED):
                key, value = unquote(key.removesuffix(ENCODED)), unquote(value)
            self.comments[key] = value
        else:
            self.dropped["TEXT"] += 1

    def _measured(self, name: str, arguments: list[str]) -> None:
        if [part.upper() for part in arguments[:2]] != ["POINT", "CART"]:
            self.dropped["FA() that is no POINT,CART"] += 1
            return
        values = self.reader.numbers(arguments[2:], 6, f"FA({name})")
        size = float(np.linalg.norm(values[3:]))
        if abs(size - 1.0) > _UNIT_LENGTH:
            self.reader.fail(f"the normal of FA({name}) is not a unit vector", found=f"length {size:.4f}", expected="1")
        self.line = self.reader.line
        self.add([*(value * self._scale() for value in values[:3]), *values[3:], self.clock])
        self.labels.append(name)

    def _scale(self) -> float:
        return _MM[self.unit] if self.unit else 1.0


def read(text: str, path: str) -> ProbeLog:
    """The measured points of an output file; :class:`stepgauge.errors.InputError` names the line."""
    output = _Output(text, path)
    for statement in statements(text, output.reader):
        output.statement(statement)
    output.line = output.reader.line
    values = output.values("the file has no measured points", "FA(name)=FEAT/POINT,CART,x,y,z,i,j,k")
    columns, clock = _stated_faces(output.labels), _clock(values[:, 6])
    if len(output.radii_mm) > 1:
        output.notes.append("dropped: the radii of several tips")
    state = {None: "not stated", True: "on", False: "off"}[output.surface]
    unit = output.unit or "mm (not stated)"
    words = [f"FA() in {unit}, PRCOMP {state}; approach = minus the normal i,j,k"]
    words += ["cycle and face from the names"] * bool(columns) + ["time_s from TIME"] * (clock is not None)
    return output.log(
        "DMIS output",
        values[:, :3],
        label=output.labels,
        approach=-unit_vectors(values[:, 3:6]) + 0.0,
        time_s=clock,
        columns=columns,
        comments=output.comments,
        surface=output.surface,
        tip_radius_mm=output.radii_mm.pop() if len(output.radii_mm) == 1 else None,
        units=("mm",) if output.unit else (),
        cut="no ENDFIL" if output.header and not output.ended else "",
        dropped=sum(1 for line in text.splitlines() if not line.split("$$")[0].strip()),
        mapped=tuple(words),
    )


def _stated_faces(labels: list[str]) -> dict[str, Array]:
    """Cycle, face and placement of names like C1F2 or P1C1F2, if all are such."""
    matches = [_POINT.fullmatch(label) for label in labels]
    if not all(matches):
        return {}
    rows = [[int(m[3] or 0), int(m[1] or m[4]), int(m[2] or m[5])] for m in matches if m]
    placement, cycle, face = np.array(rows, dtype=np.int64).T
    columns = {"cycle": cycle, "face": face}
    return {"placement": placement, **columns} if placement.all() else columns


def _clock(seconds: Array) -> Array | None:
    """Seconds since the first point, where every point has a time of its own; midnight is passed at most once a row."""
    if np.isnan(seconds).any() or len(np.unique(seconds)) < len(seconds):
        return None
    return seconds + 86400.0 * np.cumsum(np.r_[0, np.diff(seconds) < 0.0]) - seconds[0]
