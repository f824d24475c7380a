"""The forms in which controllers and people write down what was probed, and what each is known by."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

from stepgauge.correspondence.probe_log import ProbeLog
from stepgauge.errors import reading
from stepgauge.importing import control, dmis, grbl, inspection, ippdme, linuxcnc
from stepgauge.programs import check_lines


@dataclass(frozen=True)
class LogFormat:
    """A form in which a controller writes what it probed; ``layout`` says its rows in words.

    ``reader``: a module with ``recognises(text) -> bool`` and ``read(text, path) -> ProbeLog``; None for tables.
    """

    name: str
    title: str
    layout: str
    reader: ModuleType | None = None

    def recognises(self, text: str) -> bool:
        """Whether the gist of a text (:func:`gist`) looks like this format; tables are what no log is."""
        return self.reader is not None and bool(self.reader.recognises(text))

    def read(self, text: str, path: str | Path) -> ProbeLog:
        """The rows of a log; :class:`InputError` names the line of what is not understood."""
        check_lines(text, path)
        with reading(path, self.title):
            assert self.reader is not None
            log: ProbeLog = self.reader.read(text, str(path))
        return log


_OF_PROGRAMS = "log of our programs on a control (fanuc and its kin, siemens, heidenhain, rrf)"
_OF_LINUXCNC = "rows of 'n x y z success [seconds]' from (LOG,..), or of 9 coordinates from (PROBEOPEN ..)"
_OF_POINTS = "a header with x, y and z, and columns separated by ; , | or tabs"
FORMATS = {
    one.name: one
    for one in (
        LogFormat("linuxcnc", "LinuxCNC probe log", _OF_LINUXCNC, linuxcnc),
        LogFormat("dmis", "DMIS output", "lines like FA(name)=FEAT/POINT,CART,x,y,z,i,j,k", dmis),
        LogFormat(
            "ippdme", "I++ DME session log", "lines like '00010 PtMeas(X(..), ..)' and '00010 # X(..), ..'", ippdme
        ),
        LogFormat("control", _OF_PROGRAMS, control.LAYOUT, control),
        LogFormat("grbl", "console of grbl, grblHAL or FluidNC", "lines like '[PRB:1.000,2.000,3.000:1]'", grbl),
        LogFormat("inspection", "results file of an inspection post (G800, G801)", inspection.LAYOUT, inspection),
        LogFormat("csv", "table of points as text", _OF_POINTS),
        LogFormat("xlsx", "Excel workbook", "a sheet with a header that has x, y and z"),
    )
}
TABLES = ("csv", "xlsx")
GIST = 200_000
"""Characters of each end of a text that a log is recognised by."""
LINE_GIST = 500
"""Characters of a line that a log is recognised by."""


def gist(text: str) -> str:
    """The lines of a text that are not blank, without the ends of long ones: what a format is known by.

    Of a long text both ends. Patterns that look for the beginning of a line take the square of the number of blank
    lines before it.
    """
    text = text if len(text) <= 2 * GIST else f"{text[:GIST]}\n{text[-GIST:]}"
    return "\n".join(line[:LINE_GIST] for line in text.split("\n") if line.strip())
