"""Reader of the results file that inspection posts of CAM systems write on Fanuc, Haas, Mazak, SINUMERIK, HEIDENHAIN.

``G800 N X Y Z I J K ..`` is a nominal point with the outward normal of the surface, ``G801 N X Y Z R`` the measured tip
centre with the radius of the tip; START and END enclose them, and other lines (transformations, deviations, names) are
counted. Fanuc leaves out the zero before the point, or ends a number with it. Coordinates are those of the work offset;
a file that states a turned or shifted work plane (G330) is refused, for the control measures in that plane.
"""

from __future__ import annotations

import re

import numpy as np

from stepgauge.correspondence.probe_log import ProbeLog
from stepgauge.importing.log_lines import LogLines, unit_vectors

_WORD = re.compile(r"([A-Z])([-+]?(?:\d+\.?\d*|\.\d+))", re.ASCII)
LAYOUT = "lines like 'G801 N1 X.. Y.. Z.. R..'"
_LINE = re.compile(r"(?i) *(G\d{3})\b(.*)")


def recognises(text: str) -> bool:
    """Whether a measured point G801 is in the text."""
    return re.search(r"(?im)^ *G801 *N", text) is not None


def read(text: str, path: str) -> ProbeLog:
    """The measured points; :class:`stepgauge.errors.InputError` names the line that is not understood."""
    lines, row, normal = LogLines(text, path, "%"), "", dict[int, list[float]]()
    for row in lines:
        match = _LINE.fullmatch(row)
        code = match[1].upper() if match else ""
        words = {letter: float(value) for letter, value in _WORD.findall(row.upper().replace(" ", ""))}
        if code == "G800":
            point, *direction = _words(lines, words, "NIJK")
            normal[int(point)] = direction
        elif code == "G801":
            lines.add([*_words(lines, words, "NXYZR"), *(words.get(letter, 0.0) for letter in "ABC")])
        elif code == "G330" and any(words.get(letter, 0.0) for letter in "ABCXYZ"):
            expected = "A, B, C = 0: the work plane of the offset"
            lines.fail("the work plane of the results is turned or shifted", row, expected)
        elif row.upper() != "END":
            lines.dropped[f"{code or row.split()[0]} lines"] += 1
    values = lines.values("the file has no measured points", LAYOUT)
    lines.check_other_axes(values[:, 5:])
    number, radius = values[:, 0].astype(np.int64), values[:, 4]
    if np.ptp(radius) > 0.0:
        lines.fail("the points have several tip radii", f"R {radius.min():g} to {radius.max():g} mm", "one", line=0)
    directed = all(one in normal for one in number.tolist())
    return lines.log(
        "results of an inspection post (G800, G801)",
        values[:, 1:4],
        number=number,
        approach=unit_vectors(-np.array([normal[one] for one in number.tolist()])) if directed else None,
        tip_radius_mm=float(radius[0]) or None,
        cut="" if row.upper() == "END" else "no END",
    )


def _words(lines: LogLines, words: dict[str, float], letters: str) -> list[float]:
    """The values of letters, all of which a line must have; the first is the number of a point."""
    missing = [letter for letter in letters if letter not in words]
    if missing:
        lines.fail("the line is cut short", f"no {', '.join(missing)}")
    return [words[letter] for letter in letters]
