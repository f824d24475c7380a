"""Waves that close after a turn of a rotary axis: each whole number of periods is a cause with an exact period.

Whatever turns with the axis has the same error after a turn, a Fourier series of the angle. Its first terms have causes
of their own (eccentricity, tilt), which stand together, and periods that no reading has to tell. Shorter waves are of
gears, lines and poles, of which one of many is there: a law with a period to be found.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from stepgauge.diagnosis.laws.library import Family
from stepgauge.effects.probings import Probings
from stepgauge.files.arrays import Rows

SAME = 1e-9
"""Share of a period by which one on the grid may differ from a whole part of a turn."""


def apart(family: Family, probings: Probings) -> Iterator[Family]:
    """A family without its few periods in a turn, and each of these by itself; any other family as it is."""
    turn_mm, per_turn = probings.setting.turn_mm, {} if family.law is None else family.law.per_turn()
    if turn_mm is None or not per_turn:
        yield family
        return
    assert family.law is not None
    name = family.law.rhythm()[0]
    count = turn_mm / np.array([atom[name] for atom in family.atoms])
    whole = {n: np.flatnonzero(np.abs(count - n) < SAME * n) for n in per_turn}
    rest = np.setdiff1d(np.arange(len(count)), np.concatenate(list(whole.values())))
    if rest.size:
        yield _select(family, rest)
    for n, atoms in whole.items():
        if atoms.size:
            one = _select(family, atoms)
            yield replace(one, taken=one.taken | {name}, alone=per_turn[n], log_weight=np.zeros(1))


def _select(family: Family, rows: Rows) -> Family:
    """A family with some of its shapes."""
    kept = [family.atoms[int(row)] for row in rows]
    return replace(family, atoms=kept, pattern=family.pattern[rows], log_weight=family.log_weight[rows])
