"""Reader of the results file that inspection posts of CAM systems write on Fanuc, Haas, Mazak, SINUMERIK, HEIDENHAIN.

``G800 N X Y Z I J K ..`` is a nominal point with the outward normal of the surface, ``G801 N X Y Z R`` the measured tip
centre with the radius of the tip; START and END enclose them, and other lines (transformations, deviations, names) are
counted. Fanuc leaves out the zero before the point, or ends a number with it. Coordinates are those of the work offset;
a file that states a turned or shifted work plane (G330) is refused, for the control measures in that plane.
"""

from __future__ import annotations

import re
from collections import Counter

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
    results = _Results(path)
    for number, line in numbered(text, "%"):
        results.take(number, line)
    return results.log()


class _Results:
    def __init__(self, path: str) -> None:
        self.path = path
        self.normal: dict[int, list[float]] = {}
        self.points: list[tuple[int, int, list[float], float]] = []
        self.dropped: Counter[str] = Counter()
        self.ended = False

    def take(self, number: int, line: str) -> None:
        """A line of the file."""
        match = _LINE.fullmatch(line)
        code = match[1].upper() if match else ""
        words = (
            {letter: float(value) for letter, value in _WORD.findall(match[2].upper().replace(" ", ""))}
            if match
            else {}
        )
        self.ended = line.upper() == "END"
        if code == "G800":
            self.normal[self.point(words, "IJK", number)] = [words[letter] for letter in "IJK"]
        elif code == "G801":
            point = self.point(words, "XYZR", number)
            check_other_axes([[words.get(letter, 0.0) for letter in "ABC"]], self.path, [number])
            self.points.append((number, point, [words[letter] for letter in "XYZ"], words["R"]))
        elif code == "G330" and any(words.get(letter, 0.0) for letter in "ABCXYZ"):
            what = "the work plane of the results is turned or shifted"
            raise InputError(
                f"{self.path}:{number}", what, found=line, expected="A, B, C = 0: the work plane of the offset"
            )
        elif not self.ended:
            self.dropped[f"{code or line.split()[0]} lines"] += 1

    def point(self, words: dict[str, float], letters: str, line: int) -> int:
        """The number of a point; all of the letters must be there."""
        missing = [letter for letter in "N" + letters if letter not in words]
        if missing:
            raise InputError(f"{self.path}:{line}", "the line is cut short", found=f"no {', '.join(missing)}")
        return int(words["N"])

    def log(self) -> ProbeLog:
        """Everything as a log."""
        line, number, position, radius = zip(*self.points, strict=True)
        if np.ptp(radius) > 0.0:
            raise InputError(
                self.path,
                "the points have several tip radii",
                found=f"R {min(radius):g} to {max(radius):g} mm",
                expected="one",
            )
        normals = [self.normal.get(one) for one in number]
        known = all(normal is not None for normal in normals)
        return ProbeLog(
            self.path,
            "results of an inspection post (G800, G801)",
            np.array(position),
            np.array(line),
            np.array(number, dtype=np.int64),
            approach=unit_vectors(-np.array(normals, dtype=float)) if known else None,
            tip_radius_mm=radius[0] or None,
            cut="" if self.ended else "no END",
            left_out=counted(self.dropped),
        )
