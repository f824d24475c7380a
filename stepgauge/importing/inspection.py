"""Reader of the results file that inspection posts of CAM systems write on Fanuc, Haas, Mazak, SINUMERIK, HEIDENHAIN.

``G800 N X Y Z I J K ..`` is a nominal point with the outward normal of the surface, ``G801 N X Y Z R`` the measured tip
centre with the radius of the tip; START and END enclose them, and other lines (transformations, deviations, names) are
counted. Fanuc leaves out the zero before the point, or ends a number with it. Coordinates are those of the work offset;
a file that states a turned or shifted work plane (G330) is refused, for the control measures in that plane.
"""

from __future__ import annotations

import re
from collections import Counter
from typing import Any

import numpy as np

from stepgauge.errors import InputError
from stepgauge.importing.log import ProbeLog, check_other_axes, counted, numbered, unit_vectors

_WORD = re.compile(r"([A-Z])([-+]?(?:\d+\.?\d*|\.\d+))", re.ASCII)
_LINE = re.compile(r"(?i) *(G\d{3})\b(.*)")


def recognises(text: str) -> bool:
    """Whether a measured point G801 is in the text."""
    return re.search(r"(?im)^ *G801 *N", text) is not None


def read(text: str, path: str) -> ProbeLog:
    """The measured points; :class:`stepgauge.errors.InputError` names the line that is not understood."""
    normal: dict[int, list[float]] = {}
    points: list[tuple[int, int, list[float]]] = []
    dropped: Counter[str] = Counter()
    for line, row in numbered(text, "%"):
        match = _LINE.fullmatch(row)
        code = match[1].upper() if match else ""
        words = {letter: float(value) for letter, value in _WORD.findall(row.upper().replace(" ", ""))}
        other = {letter: words[letter] for letter in "ABC" if letter in words}
        if code == "G800":
            point, *normal[point] = _words(words, "NIJK", f"{path}:{line}")
        elif code == "G801":
            check_other_axes([list(other.values())], path, [line])
            point, *measured = _words(words, "NXYZR", f"{path}:{line}")
            points.append((line, point, measured))
        elif code == "G330" and any(words.get(letter, 0.0) for letter in "ABCXYZ"):
            expected = "A, B, C = 0: the work plane of the offset"
            what = "the work plane of the results is turned or shifted"
            raise InputError(f"{path}:{line}", what, found=row, expected=expected)
        elif row.upper() != "END":
            dropped[f"{code or row.split()[0]} lines"] += 1
    lines, numbers, values = zip(*points, strict=True)
    radius = [one[3] for one in values]
    if np.ptp(radius) > 0.0:
        found = f"R {min(radius):g} to {max(radius):g} mm"
        raise InputError(path, "the points have several tip radii", found=found, expected="one")
    normals = [normal[one] for one in numbers if one in normal]
    return ProbeLog(
        path,
        "results of an inspection post (G800, G801)",
        np.array(values)[:, :3],
        np.array(lines),
        np.array(numbers, dtype=np.int64),
        approach=unit_vectors(-np.array(normals)) if len(normals) == len(numbers) else None,
        tip_radius_mm=radius[0] or None,
        cut="" if row.upper() == "END" else "no END",
        left_out=counted(dropped),
    )


def _words(words: dict[str, float], letters: str, where: str) -> Any:
    """The values of letters, all of which a line must have; the first is the number of a point."""
    missing = [letter for letter in letters if letter not in words]
    if missing:
        raise InputError(where, "the line is cut short", found=f"no {', '.join(missing)}")
    return [int(words[letters[0]]), *(words[letter] for letter in letters[1:])]
