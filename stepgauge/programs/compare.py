"""Is a program that was read back from its text the program that was planned? If not, the first difference in words.

Compared are the number and order of moves, targets, directions, and what holds at every single move: speeds and
distances that the text must state, units, coordinate system, tool.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stepgauge.motion.moves import NO_WAY_MM, InForce, ProbingSettings, Program
from stepgauge.programs.dialect import Dialect

UNSTATED = float("nan")
STYLUS_TOLERANCE = 1e-6
SPEED_TOLERANCE = 1e-3
"""Relative; a speed that its digits round by more is another speed."""
_OF_TRAVEL = ("travel_speed_mm_s",)


def read_again(text: str, dialect: Dialect, settings: ProbingSettings) -> Program:
    """The program of a text; what the text must state itself is NaN where it does not.

    :class:`stepgauge.errors.InputError` names the line of what is not understood.
    """
    return dialect.read(text, "program", replace(settings, **dict.fromkeys(dialect.carries, UNSTATED)), own=True)


def difference(planned: Program, back: Program, dialect: Dialect) -> str | None:
    """The first difference between the planned program and the one that was read back, None where there is none."""
    return next(_differences(planned, back, dialect), None)


def _differences(planned: Program, back: Program, dialect: Dialect) -> Iterator[str]:
    for now, line in sorted(back.in_force.items(), key=lambda item: item[1]):
        for found in (*_settings(now, planned, dialect), *_states(now, planned, dialect)):
            yield f"line {line}: {found}"
    if not _same_stylus(planned, back, dialect):
        yield f"the stylus points along {back.stylus or 'nothing that is stated'}, planned {planned.stylus}"
    planned = planned if len(planned) == len(back) else going(planned)
    if planned.n_points != back.n_points:
        yield f"{back.n_points} measuring points, planned {planned.n_points}"
    if len(planned) != len(back):
        yield f"{len(back)} moves, planned {len(planned)}"
        return
    yield from _moves(planned, back, dialect.decimals)


def going(program: Program) -> Program:
    """Without the moves that go nowhere, which a text may leave out: no controller searches over hardly any length."""
    way = np.abs(np.diff(program.position_mm, axis=0)).max(axis=1, initial=0.0)
    kept = np.r_[True, way > NO_WAY_MM] | program.is_measure
    arrays = {name: getattr(program, name)[kept] for name in ("position_mm", "approach", "point", "line")}
    return replace(program, **arrays, names=[one for one, keep in zip(program.names, kept, strict=True) if keep])


def _settings(now: InForce, planned: Program, dialect: Dialect) -> Iterator[str]:
    """A move between the points has a travel speed only; a measuring one has all of the settings."""
    for name in dialect.carries if now.measuring else [one for one in dialect.carries if one in _OF_TRAVEL]:
        wanted, found = getattr(planned.settings, name), getattr(now.settings, name)
        speed = name.endswith("_mm_s")
        allowed = SPEED_TOLERANCE * wanted if speed else 10.0**-dialect.decimals
        if not abs(found - wanted) <= allowed:
            unit = "mm/s" if speed else "mm"
            words = name.removesuffix("_mm_s").removesuffix("_mm").replace("_", " ")
            yield f"{words} {_stated(found, unit)}, planned {wanted:g} {unit}"


def _stated(value: float, unit: str) -> str:
    if np.isnan(value):
        return "not stated"
    return f"{value:g} {unit}" if np.isfinite(value) else "as fast as the machine can"


def _states(now: InForce, planned: Program, dialect: Dialect) -> Iterator[str]:
    states = dict(now.states)
    tool = planned.tool or dialect.tool
    for name, wanted in {**dialect.required, **({"tool": tool} if tool else {})}.items():
        if states.get(name, "").upper() != wanted.upper():
            yield f"{name} {states.get(name, 'not stated')}, expected {wanted}"


def _same_stylus(planned: Program, back: Program, dialect: Dialect) -> bool:
    """Where the plan and the dialect say which way the stylus points, the text must say the same."""
    if planned.stylus is None or "tip_radius_mm" not in dialect.carries:
        return True
    return back.stylus is not None and bool(np.allclose(back.stylus, planned.stylus, rtol=0.0, atol=STYLUS_TOLERANCE))


def _moves(planned: Program, back: Program, decimals: int) -> Iterator[str]:
    kind = planned.is_measure != back.is_measure
    if kind.any():
        row = int(kind.argmax())
        names = ("a move", "a measuring move")
        yield (
            f"line {back.line[row]}: {names[bool(back.is_measure[row])]},"
            f" planned {names[bool(planned.is_measure[row])]} ({planned.names[row]})"
        )
        return
    off = np.abs(planned.position_mm - back.position_mm)
    away = ~(off <= _allowed_mm(planned, decimals)[:, None])
    if away.any():
        row = int(away.any(axis=1).argmax())
        axis = int(away[row].argmax())
        yield (
            f"line {back.line[row]}: {'xyz'[axis]} = {back.position_mm[row, axis]:.6f} mm,"
            f" planned {planned.position_mm[row, axis]:.6f} mm ({planned.names[row]})"
        )
    turned = _turned(planned, back, decimals)
    if turned.any():
        row = int(np.flatnonzero(planned.is_measure)[turned.argmax()])
        yield f"line {back.line[row]}: another direction of approach than planned ({planned.names[row]})"


def _allowed_mm(planned: Program, decimals: int) -> NDArray[np.float64]:
    """One unit of the last digit; two where a target follows from the printed end, start and length of a search."""
    return 10.0**-decimals * np.where(planned.is_measure, 2.0, 1.0)


def _turned(planned: Program, back: Program, decimals: int) -> NDArray[np.bool_]:
    """Directions agree to what rounding the two positions that define them can do over the stand-off."""
    measure = planned.is_measure
    off = np.abs(planned.approach[measure] - back.approach[measure])
    limit = 2.0 * 10.0**-decimals / planned.settings.standoff_mm + 1e-9
    return np.asarray(~(off <= limit).all(axis=1))
