"""A new project: its file, its folders, and copies of the shipped files that it starts from."""

from __future__ import annotations

import json
import os
import shlex
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from stepgauge.errors import InputError
from stepgauge.files.resources import find_data, folder
from stepgauge.files.text import read_text, write_text
from stepgauge.gauge.certified import read_gauge
from stepgauge.machine.file import read_machine
from stepgauge.project.find import NAME

RECORDINGS, RESULTS = "recordings", "results"
OUTPUTS: Mapping[str, str] = {
    "locate": "placement.toml",
    "simulate": f"{RECORDINGS}/virtual.csv",
    "import": f"{RECORDINGS}/measured.csv",
    "evaluate": f"{RESULTS}/evaluation",
    "budget": f"{RESULTS}/budget",
    "report": f"{RESULTS}/report.pdf",
    "diagnose": f"{RESULTS}/diagnosis",
    "history": f"{RESULTS}/history",
}
"""Where a verb writes in a new project unless it is told otherwise with -o."""


@dataclass(frozen=True)
class NewProject:
    """What a new project states: paths or names of gauge and machine, and texts by their keys; empty ones are open.

    Without a gauge or a machine the project is one to be completed.
    """

    gauge: str
    machine: str
    texts: Mapping[str, str]
    dialect: str | None = None


class CreatedProject(list[Path]):
    """The files that were written."""

    def __init__(self, written: Iterable[Path], place: Path) -> None:
        super().__init__(written)
        self.place = place

    def summary(self) -> str:
        """What was written, and what comes next."""
        enter = "" if str(self.place) == "." else f"cd {shlex.quote(str(self.place))}; "
        return f"wrote {', '.join(map(str, self))}\nnext: {enter}stepgauge status"


def create_project(place: str | Path, new: NewProject) -> CreatedProject:
    """Write the project file and its folders into ``place``; the files that were written.

    Shipped files are copied, for they are there to be changed. :class:`InputError` where there is a project file, and
    for a gauge or a machine file that cannot be read.
    """
    place = Path(place)
    path = place / NAME
    if path.exists():
        raise InputError(path, "exists already", expected="a folder without a project; nothing is overwritten")
    if new.gauge:
        read_gauge(new.gauge)
    if new.machine:
        read_machine(new.machine)
    written = [path]
    gauge = _own(find_data(new.gauge, "gauge"), place, "gauge", written) if new.gauge else ""
    machine = _own(find_data(new.machine, "machine", "machines"), place, "machine", written) if new.machine else ""
    for name in (RECORDINGS, RESULTS):
        (place / name).mkdir(parents=True, exist_ok=True)
    write_text(path, _text(gauge, machine, new))
    return CreatedProject(written, place)


def _own(source: Path, place: Path, room: str, written: list[Path]) -> str:
    """The path that the project states; a shipped file is copied into the folder ``room`` first."""
    if folder("calibration_data").resolve() not in source.resolve().parents:
        return os.path.relpath(source, place)
    for one in (source, source.with_suffix(".csv")):
        if one.exists():
            target = place / room / one.name
            if target.exists():
                raise InputError(target, "exists already", expected="an empty folder; nothing is overwritten")
            write_text(target, read_text(one))
            written.append(target)
    return f"{room}/{source.name}"


def _text(gauge: str, machine: str, new: NewProject) -> str:
    stated = {"gauge": gauge, "machine": machine, "placement": OUTPUTS["locate"], **new.texts}
    lines = ["# A stepgauge project. What several verbs share stands at the top, options of one verb in its table.", ""]
    lines += [f"{key} = {json.dumps(value, ensure_ascii=False)}" for key, value in stated.items() if value]
    if new.dialect:
        lines += ["", "[plan]", f'dialect = "{new.dialect}"', f'output = "program{program_suffix(new.dialect)}"']
    for verb, output in OUTPUTS.items():
        lines += ["", f"[{verb}]", f'output = "{output}"']
        lines += [f'placement = "{OUTPUTS["locate"]}"'] if verb in ("budget", "report") else []
    return "\n".join(lines) + "\n"


def program_suffix(dialect: str) -> str:
    """The usual suffix of a program; that of DMIS where there is no such dialect."""
    from stepgauge.programs import DIALECTS

    return DIALECTS.get(dialect, DIALECTS["dmis"]).suffix
