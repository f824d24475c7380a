"""Does the log that a program writes hold what the probe says? The text is run with known contacts, its log read."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from stepgauge.errors import InputError
from stepgauge.motion.moves import Program
from stepgauge.programs.dialect import Dialect
from stepgauge.programs.reading import Contact, ReadingProbe

COARSEST_MM = 1e-4
"""Digits of a log, mm, where the controller has no coarser ones: rounding them is 0.03 um, a quarter of the smallest
standard uncertainty of a certificate."""
NOT_KNOWN = "the log is in no form that 'stepgauge import' knows, and was not checked"


class _KnownContacts(ReadingProbe):
    """Contacts beside the nominal ones by a few hundredths of a millimetre, each by another way."""

    def __init__(self) -> None:
        self.contacts: list[list[float]] = []

    def answer(self, move: int, measuring: bool, end: Sequence[float], target: Sequence[float]) -> Contact:
        """A contact of a search; nothing on the way; a second for every move."""
        if not measuring:
            return Contact(end, False, float(move))
        step = 1.0 + len(self.contacts) % 7
        self.contacts.append([value + step * d for value, d in zip(target, (0.0031, -0.0052, 0.0073), strict=True)])
        return Contact(self.contacts[-1], True, float(move))


def log_difference(text: str, program: Program, dialect: Dialect) -> str | None:
    """What the log has otherwise than the probe, None where nothing; :data:`NOT_KNOWN` where nothing can be said."""
    from stepgauge.importing.formats import FORMATS, gist  # which imports the plan's orders

    probe = _KnownContacts()
    log, alarm = dialect.log_of(text, "log", program.settings, probe)
    if alarm is not None:
        return f"the program stops itself: {alarm}"
    form = next((one for one in FORMATS.values() if one.recognises(gist(log))), None)
    if form is None:
        return NOT_KNOWN
    try:
        read = form.read(log, "log")
    except InputError as error:
        return str(error)
    if len(read) != len(probe.contacts):
        return f"{len(read)} points in the log, {len(probe.contacts)} in the program"
    if read.number is not None and read.number.tolist() != list(range(1, len(read) + 1)):
        return "the points of the log are not numbered 1, 2, 3 .."
    off = np.abs(read.position_mm - np.array(probe.contacts))
    row, axis = divmod(int(off.argmax()), 3)
    if off.max() <= 0.6 * max(COARSEST_MM, 10.0 ** -(dialect.log_decimals or 0)):
        return None
    found, wanted = read.position_mm[row, axis], probe.contacts[row][axis]
    return f"line {read.line[row]} of the log: {'xyz'[axis]} = {found:.6f} mm, the probe was at {wanted:.6f} mm"
