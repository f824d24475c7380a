"""A foreign file, imported as a person does it who knows what was measured: right, asked, refused, lost or wrong.

A layout states its true readings. A refusal that names options is answered with what the person knows; only options
that the message itself names are used, and an answer that does not settle the question is a refusal in vain. Lost:
the readings are right, and their times, or a column beside them, are not there.
"""

from __future__ import annotations

import contextlib
import io
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

from stepgauge.axis.recording import read_axis_recording
from stepgauge.cli import main
from stepgauge.files.units import LENGTH_MM, column_name
from stepgauge.gauge.certified import read_gauge
from stepgauge.gauge.placement import read_placement
from stepgauge.recording import read_recording

AXIS, SPOT, DISTANCES, GAUGE, POINTS, CERTIFICATE = "axis", "spot", "distances", "gauge", "points", "certificate"
RIGHT, ASKED, REFUSED, LOST, WRONG = "right", "asked", "refused", "lost", "wrong"
MOST_OPTIONS = 2
TOLERANCE = 2e-5
"""Of a number in its unit (mm, um, arcsec, s): the digits of a recording, not of a file."""
_KEYS = {
    AXIS: ("target", "way", "cycle"),
    SPOT: ("reading",),
    DISTANCES: ("from_station", "to_station"),
    GAUGE: ("placement", "cycle", "face"),
    POINTS: (),
    CERTIFICATE: ("face",),
}
_OPTION = re.compile(r"--[a-z][a-z-]*")


@dataclass(frozen=True)
class Layout:
    """A file of some make.

    Parameters
    ----------
    name : make and form, in words
    source : the public description of the form, or ``unconfirmed``
    kind : what was measured: one of the words above
    content : what stands in the file
    truth : the readings, a row each; None for a file that nobody can read and that must be refused
    options : given from the beginning; ``@name`` is a file of ``beside``
    knows : what the person can answer, by the option that asks for it (``--column reading``: a role of --column)
    beside : other files of the same folder
    units : in which the truth states positions and deviations
    covariates : columns that must be kept under these names
    must_ask : nothing in the file settles it, so that an import without a question is a guess
    """

    name: str
    source: str
    kind: str
    content: str | bytes
    truth: pd.DataFrame | None
    suffix: str = ".csv"
    sensor: str = "laser"
    options: Sequence[str] = ()
    knows: Mapping[str, str] = field(default_factory=dict)
    beside: Mapping[str, str] = field(default_factory=dict)
    units: tuple[str, str] = ("mm", "um")
    covariates: Sequence[str] = ()
    must_ask: bool = False

    @property
    def data(self) -> bytes:
        return self.content.encode() if isinstance(self.content, str) else self.content


@dataclass(frozen=True)
class Verdict:
    """``kind``: one of the five words; ``options``: how many were used; ``text``: message, difference or report."""

    kind: str
    options: int
    text: str
    answers: Mapping[str, str] = field(default_factory=dict)


def call(arguments: Sequence[str]) -> tuple[int, str]:
    """Exit code and everything that a command says."""
    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        try:
            main(list(arguments))
            code = 0
        except SystemExit as stop:
            code = int(stop.code or 0)
    return code, said.getvalue()


def judge(layout: Layout, folder: Path, known: Mapping[str, str] | None = None) -> Verdict:
    """Import a layout in an empty folder, with the options that its messages ask for.

    ``known``: answers given from the beginning; no question is then answered.
    """
    path = folder / f"file{layout.suffix}"
    path.write_bytes(layout.data)
    for name, text in layout.beside.items():
        (folder / name).write_text(text)
    given = [str(folder / option[1:]) if option.startswith("@") else option for option in layout.options]
    answers = dict(known or {})
    while True:
        output = folder / ("result.toml" if layout.kind in (POINTS, CERTIFICATE) else "result.csv")
        output.unlink(missing_ok=True)
        code, said = call([*_command(layout, path), *given, *_arguments(answers), "-o", str(output)])
        used = len([option for option in given if option.startswith("--")]) + len(answers)
        if code == 0:
            wrong = difference(layout, output)
            if not wrong and layout.must_ask and not answers:
                wrong = "accepted without the question that only a person can answer"
            lost = "" if wrong else lost_columns(layout, output)
            kind = WRONG if wrong else LOST if lost else ASKED if answers else RIGHT
            return Verdict(kind, used, wrong or lost or said, answers)
        assert code == 2, said
        assert not output.exists(), "a refusal left a file behind"
        more = {option: layout.knows[option] for option in asked(said, layout.knows) if option not in answers}
        if known is not None or not more:
            return Verdict(REFUSED, used, said, answers)
        answers |= more


def asked(message: str, knows: Mapping[str, str]) -> list[str]:
    """The options of a message that the person can answer; of --column the roles that it names, else all."""
    named = set(_OPTION.findall(message))
    roles = [option for option in knows if " " in option and f'{option.split()[1]}="' in message]
    columns = roles or [option for option in knows if " " in option]
    return [option for option in knows if option.split()[0] in named and (" " not in option or option in columns)]


def _arguments(answers: Mapping[str, str]) -> list[str]:
    out = []
    for option, value in answers.items():
        name, _, role = option.partition(" ")
        out += [name, f"{role}={value}" if role else value]
    return out


def _command(layout: Layout, path: Path) -> list[str]:
    return {
        GAUGE: ["import", str(path)],
        POINTS: ["locate", str(path)],
        CERTIFICATE: ["dcc", "import-gauge", str(path)],
    }.get(layout.kind, ["import", str(path), "--sensor", layout.sensor])


def difference(layout: Layout, output: Path) -> str:
    """What an accepted result has other than the truth, in words; empty where it is right."""
    if layout.truth is None:
        return "accepted, and nobody can know what it says"
    frame, wrong = read_back(layout, output)
    truth = layout.truth.drop(columns="time_s", errors="ignore")
    wrong = wrong or compared(truth, frame, _KEYS[layout.kind])
    return wrong or compared(*_timed(layout.truth, frame), ("time_s",))


def read_back(layout: Layout, output: Path) -> tuple[pd.DataFrame, str]:
    """The readings of a result in the units of the truth, and whether they have another form than they should."""
    if layout.kind == POINTS:
        centre = read_placement(output, read_gauge("step-gauge-420")).c1_mm
        return pd.DataFrame([centre], columns=list("xyz")).round(3), ""
    if layout.kind == CERTIFICATE:
        position = read_gauge(output).position_mm
        return pd.DataFrame({"face": np.arange(1, len(position) + 1), "position": position}), ""
    if layout.kind == GAUGE:
        return read_recording(output).frame, ""
    back = read_axis_recording(output)
    frame = back.frame.assign(deviation=back.deviation * _ratio(back.units.deviation, layout.units[1]))
    for name in {"target", "reading"} & set(frame):
        frame[name] *= _ratio(back.units.position, layout.units[0])
    return frame, "" if back.form == layout.kind else f"a recording of form {back.form}"


def _ratio(unit: str, wanted: str) -> float:
    """The factor from a unit to another of lengths; NaN between a length and an angle."""
    if unit == wanted:
        return 1.0
    return LENGTH_MM.get(unit, np.nan) / LENGTH_MM.get(wanted, np.nan)


def _timed(truth: pd.DataFrame, found: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Readings with their times since the first, where both have times."""
    if "time_s" not in set(truth) & set(found):
        return truth[[]], found[[]]
    return truth, found.assign(time_s=found["time_s"] - found["time_s"].min())


def lost_columns(layout: Layout, output: Path) -> str:
    """Times and columns that the truth has, and a recording of one axis has not."""
    if layout.kind not in (AXIS, SPOT) or layout.truth is None:
        return ""
    frame = read_axis_recording(output).frame
    wanted = (*({"time_s"} & set(layout.truth)), *map(column_name, layout.covariates))
    lost = [name for name in wanted if name not in frame]
    return f"lost {lost}; there are {list(frame)}" if lost else ""


def compared(truth: pd.DataFrame, found: pd.DataFrame, keys: Sequence[str]) -> str:
    """The first difference between two tables of readings, in any order of rows."""
    by = [name for name in (*keys, *truth.columns) if name in truth]
    missing = [name for name in by if name not in found]
    if missing:
        return f"no column {missing}"
    if len(truth) != len(found):
        return f"{len(found)} readings, not {len(truth)}"
    if not by:
        return ""
    want, have = (_ordered(table, list(dict.fromkeys(by))) for table in (truth, found))
    off = ~(np.abs(want - have) <= TOLERANCE)
    if not off.any():
        return ""
    row, column = (int(part[0]) for part in np.nonzero(off))
    name = list(dict.fromkeys(by))[column]
    return f"{name} is {have[row, column]:.9g}, not {want[row, column]:.9g}; {int(off.any(axis=1).sum())} rows differ"


def _ordered(table: pd.DataFrame, by: list[str]) -> np.ndarray:
    values = table[by].astype(float)
    return values.round(5).sort_values(by).to_numpy()
