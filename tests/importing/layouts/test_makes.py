"""The commands of docs/makes.md, run on files of the make that their line is about."""

from __future__ import annotations

import re
import shlex
from dataclasses import replace
from pathlib import Path

import pytest

from tests.conftest import ROOT
from tests.importing.layouts.judge import call, difference
from tests.importing.layouts.layouts import LAYOUTS

PAGE = (ROOT / "docs/makes.md").read_text()
COMMANDS = re.findall(r"`stepgauge ((?:import|dcc) [^`]*)`", PAGE.partition("## Axes")[2])
NAMED = {layout.name: layout for layout in LAYOUTS}
FILES = {
    "x-axis.rtl": "laser file, both directions",
    "c-axis.rtl": "laser file of an axis of rotation",
    "averages.pos": "averages of both directions in three tables (.pos)",
    "tchpr.txt": "measuring log of a HEIDENHAIN cycle for one coordinate",
    "protocol.csv": "Soll, Ist and Diff, decimal comma",
    "soll-ist.csv": "difference Soll-Ist",
    "iso230.csv": "a column for every run of ISO 230-2, target numbers beside",
    "pcdmis.txt": "PC-DMIS text report, X and Y of every point",
    "pcdmis.xlsx": "PC-DMIS report in Excel",
    "calypso_chr.txt": "Calypso table of characteristics",
    "calypso.txt": "Calypso protocol, a feature a line",
    "report.csv": "report of any make: feature and axis in columns",
    "sinumerik.csv": "measuring protocol of SINUMERIK as a table",
    "klipper.txt": "Klipper, PROBE_ACCURACY in its own console",
    "m48.log": "Marlin, M48",
    "g30.log": "Marlin, G30 at one place",
    "rrf.txt": "RepRapFirmware, G30 S-1 again and again",
    "scope.txt": "TwinCAT scope, tabs and decimal commas",
    "camonitor.txt": "EPICS, camonitor",
    "drift.csv": "date and time joined by a hyphen",
    "archive.csv": "archiver, nanoseconds and a zone",
    "judged.csv": "logger with a word per row and one overflow",
    "guide.txt": "guide log",
    "circle.csv": "circular test, radius over angle",
    "console.log": "grbl console",
    "inches.log": "grbl in inches, stated nowhere",
    "probe-log.txt": "LinuxCNC (LOG,..)",
    "printed.txt": "printed by a control",
    "results.txt": "results of an inspection post",
    "output.dmo": "DMIS output",
    "session.log": "I++ session",
    "points.csv": "points of a CMM, decimal commas, names of points",
    "certificate.xml": "certificate with deviations, nominal minus measured",
}
"""The file that a command names, and the layout that it is."""


def test_every_line_has_a_command_or_says_why_not() -> None:
    rows = [line for line in PAGE.splitlines() if line.startswith("|") and not line.startswith(("| make", "|---"))]
    assert len(rows) >= 20
    assert [row for row in rows if "`stepgauge " not in row and "no command: " not in row] == []
    assert all(row.count("|") == 6 for row in rows)


@pytest.mark.parametrize("command", COMMANDS)
def test_the_command_of_a_line_reads_such_a_file(command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    words = shlex.split(command)
    name = next(word for word in words if word in FILES)
    layout = NAMED[FILES[name]]
    monkeypatch.chdir(tmp_path)
    Path(name).write_bytes(layout.data)
    for beside, text in layout.beside.items():
        Path(beside).write_text(text)
    code, said = call(words)
    assert code == 0, said
    assert difference(replace(layout, options=()), Path(words[-1])) == ""
