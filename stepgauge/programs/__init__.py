"""Program text: rendered from moves by a template, executed by the virtual controller of its dialect.

A dialect is a template, and a module here with the table of what its controller understands, what each statement of it
does, and its :class:`~stepgauge.programs.dialect.Dialect`.
"""

from __future__ import annotations

from pathlib import Path

from stepgauge.errors import InputError, nearest_first, plain
from stepgauge.files.text import read_text
from stepgauge.motion.moves import ProbingSettings, Program
from stepgauge.programs import dmis, fanuc, grbl, heidenhain, ippdme, jinyoung, linuxcnc, rrf, siemens
from stepgauge.programs.dialect import Dialect
from stepgauge.programs.reading import check_lines

__all__ = ["CONTROLLERS", "DIALECTS", "Dialect", "check_lines", "find_dialect", "read_program", "recognise"]
_MODULES = (jinyoung, dmis, linuxcnc, ippdme, fanuc, siemens, heidenhain, grbl, rrf)
DIALECTS: dict[str, Dialect] = {one.name: one for module in _MODULES for one in module.DIALECTS}
_CALLED = {
    "grbl": "grblHAL, FluidNC, grbl 1.1",
    "rrf": "RepRapFirmware, Duet, MillenniumOS",
    "linuxcnc": "EMC2",
    "dmis": "PC-DMIS, Calypso",
    "ippdme": "I++, I++ DME server",
    "siemens": "SINUMERIK, SINUMERIK ONE, 840D, 840D sl, 828D",
    "heidenhain": "TNC, TNC 640, iTNC 530, klartext",
}
CONTROLLERS = {plain(name): name for name in DIALECTS}
CONTROLLERS |= {plain(called): name for name, every in _CALLED.items() for called in every.split(", ")}
"""Dialects by the names of the controllers that understand them, as :func:`stepgauge.errors.plain` writes these."""


def find_dialect(name: str) -> Dialect:
    """A dialect by its name or that of a controller; :class:`InputError` with the nearest where there is none."""
    known = CONTROLLERS.get(plain(name))
    if known is None:
        expected = nearest_first(name, DIALECTS, CONTROLLERS)
        raise InputError("dialect", "not a dialect", found=repr(name), expected=expected)
    return DIALECTS[known]


def recognise(text: str, path: str | Path) -> Dialect:
    """The dialect of a program text; :class:`InputError` where it is none that is known."""
    special_first = sorted(DIALECTS.values(), key=lambda one: (not one.family, one.name == "linuxcnc"))
    for dialect in special_first:  # variants name themselves, and G38.2 alone is in programs of other controls, too
        if dialect.recognises(text):
            return dialect
    raise InputError(
        f"{path}:1",
        "this is not a measuring program in a known dialect",
        found=repr(text.strip().split("\n")[0][:60]),
        expected=", ".join(dialect.title for dialect in DIALECTS.values()),
    )


def read_program(path: str | Path, settings: ProbingSettings, dialect: str | None = None) -> Program:
    """Read a program file back into moves.

    Parameters
    ----------
    path : the program file
    settings : what holds where the text does not say (``Dialect.carries`` lists what it says)
    dialect : name of the dialect; recognised from the text by default

    Raises
    ------
    InputError
        the line of a statement that is not understood, and truncated or foreign programs
    """
    text = read_text(path)
    known = find_dialect(dialect) if dialect else recognise(text, path)
    return known.read(text, path, settings)
