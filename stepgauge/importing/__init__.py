"""What a controller wrote down while it ran a program, read back as a recording.

A log format is one module here with two functions: ``recognises(text) -> bool`` and ``read(text, path) -> ProbeLog``.
What a log has to say about the program that made it is checked once for all formats in
:mod:`stepgauge.importing.matching`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from stepgauge.errors import InputError
from stepgauge.files import read_text
from stepgauge.gauge import Gauge
from stepgauge.importing.log import ProbeLog
from stepgauge.importing.matching import Import, RunLabels, match_log
from stepgauge.moves import Program
from stepgauge.placement import Placement


@dataclass(frozen=True)
class LogFormat:
    """A form in which a controller writes what it probed; ``layout`` says its rows in words."""

    name: str
    title: str
    layout: str

    def _function(self, name: str) -> Callable[..., object]:
        function: Callable[..., object] = getattr(import_module(f"stepgauge.importing.{self.name}"), name)
        return function

    def recognises(self, text: str) -> bool:
        """Whether a text looks like this format."""
        return bool(self._function("recognises")(text))

    def read(self, text: str, path: str | Path) -> ProbeLog:
        """The rows of a log; :class:`InputError` names the line of what is not understood."""
        log = self._function("read")(text, str(path))
        assert isinstance(log, ProbeLog)
        return log


FORMATS = {
    known.name: known
    for known in (
        LogFormat(
            "linuxcnc",
            "LinuxCNC probe log",
            "rows of 'n x y z success [seconds]' from (LOG,..), or of 9 coordinates from (PROBEOPEN ..)",
        ),
    )
}


def read_log(path: str | Path, source: str) -> ProbeLog:
    """Read a probe log; ``source`` is a name in :data:`FORMATS`.

    :class:`InputError` for a file of another kind, and for the first line that is not as the format wants it.
    """
    text = read_text(path)
    known = FORMATS[source]
    if not known.recognises(text):
        lines = text.split("\n")
        first = next((number for number, line in enumerate(lines, 1) if line.strip()), 0)
        raise InputError(
            f"{path}:{first}" if first else path,
            f"this is not a {known.title}",
            found=repr(lines[first - 1].strip()[:60]) if first else "an empty file",
            expected=known.layout,
        )
    return known.read(text, path)


def import_log(
    path: str | Path,
    source: str,
    program: Program,
    gauge: Gauge,
    placement: Placement,
    labels: RunLabels | None = None,
) -> Import:
    """The recording of a run, from the controller's log and the program it ran.

    Parameters
    ----------
    path : the log
    source : name of its format in :data:`FORMATS`
    program : what the controller ran, read from its text (:func:`stepgauge.programs.read_program`)
    gauge, placement : which faces the program's measuring moves meet
    labels : number of the placement and temperature of the gauge, which no log states

    Raises
    ------
    InputError
        names the log's line: a foreign or truncated file, points missing, repeated, out of order or missed, and a log
        that another program made; or the program's line where it does not measure this gauge as placed
    """
    return match_log(read_log(path, source), program, gauge, placement, labels or RunLabels())
