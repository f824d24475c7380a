"""Commands that move the virtual CMM and that say where it is: Home, GoTo, PtMeas, Get, and their reports."""

from __future__ import annotations

import math
from collections.abc import Awaitable
from dataclasses import dataclass

import numpy as np

from stepgauge.files.arrays import Array
from stepgauge.ippdme.codes import DmeError
from stepgauge.ippdme.commands import OWN_TIME
from stepgauge.ippdme.values import Call, fixed
from stepgauge.live.machine_state import NO_TOOL, POSITIONS
from stepgauge.live.session import Data, Handler, Session


def _home(session: Session, call: Call) -> Awaitable[Data]:
    return _go_home(session)


async def _go_home(session: Session) -> Data:
    """Up, then across to the corner of the travel; a machine that stands there moves nowhere."""
    cmm, speed = session.cmm, session.state.active.number("GoToPar", "Speed")
    up = np.array([*cmm.position_mm[:2], cmm.home_mm[2]])
    session.state.user_enabled = False
    try:
        for target in (up, cmm.home_mm):
            await session.travel(cmm.leg(target, speed))
    except DmeError as error:
        raise error if error.number == 6 else DmeError(1005, "Home") from None
    cmm.homed = True
    return None


def _is_homed(session: Session, call: Call) -> Data:
    return [f"IsHomed({int(session.cmm.homed)})"]


def _position(session: Session, named: dict[str, Call]) -> Array:
    """The position that a command names, in machine coordinates; axes that it leaves out keep their place."""
    position = np.array(session.state.coordinates.to_part(session.cmm.position_mm), float)
    for axis, column in POSITIONS.items():
        if axis in named:
            position[column] = named[axis].number()
    return session.state.coordinates.to_machine(position)


def _ready(session: Session) -> None:
    if not session.cmm.homed:
        raise DmeError(1011)
    session.state.user_enabled = False


def _go_to(session: Session, call: Call) -> Awaitable[Data]:
    target = _position(session, call.named())
    _ready(session)
    if not session.cmm.inside(target):
        raise DmeError(1008)
    return _go(session, target)


async def _go(session: Session, target: Array) -> Data:
    await session.travel(session.cmm.leg(target, session.state.active.number("GoToPar", "Speed")))
    return None


@dataclass(frozen=True)
class _Probing:
    """Where a measurement starts its search, and where it gives up; ``normal`` points out of the surface."""

    normal: Array
    start: Array
    end: Array


def _pt_meas(session: Session, call: Call) -> Awaitable[Data]:
    named = call.named()
    surface = _position(session, named)
    _ready(session)
    if session.state.tool == NO_TOOL:
        raise DmeError(2002)
    probing = _probing(session, surface, _normal(session, named.get("IJK"), surface))
    if not session.cmm.inside(probing.start):
        raise DmeError(1008)
    return _measure(session, probing)


def _normal(session: Session, given: Call | None, surface: Array) -> Array:
    """The unit normal: as commanded, else towards where the machine stands (error 1010 where there is none)."""
    if given is None:
        vector = session.cmm.position_mm - surface
    else:
        vector = session.state.coordinates.direction_to_machine(np.array(given.numbers()))
    size = math.hypot(*vector)
    if not 1e-9 < size < 1e9:
        raise DmeError(1010)
    return vector / size


def _probing(session: Session, surface: Array, normal: Array) -> _Probing:
    """The search is along the normal, from the approach distance before the nominal contact to beyond it."""
    settings, radius = session.state.active, session.cmm.tip_radius_mm
    contact = surface + radius * normal
    return _Probing(
        normal,
        contact + settings.number("PtMeasPar", "Approach") * normal,
        contact - settings.number("PtMeasPar", "Search") * normal,
    )


async def _measure(session: Session, probing: _Probing) -> Data:
    cmm, settings = session.cmm, session.state.active
    travel = settings.number("GoToPar", "Speed")
    await session.travel(cmm.leg(probing.start, travel))
    if not (probing.start != probing.end).any():
        raise DmeError(1006)
    leg, touch = cmm.search(probing.start, probing.end, settings.number("PtMeasPar", "Speed"))
    try:
        await session.travel(leg)
    except DmeError as error:
        if error.number == 1006:  # nothing was met: it goes back to where the search began
            await session.travel(cmm.leg(probing.start, travel))
        raise
    assert touch is not None
    indicated = cmm.indicate(touch)
    session.report(_told(session, indicated, touch.time_s, probing.normal))
    retract = settings.number("PtMeasPar", "Retract")
    back = probing.start if retract < 0.0 else touch.trigger_mm + retract * probing.normal
    await session.travel(cmm.leg(np.clip(back, cmm.limits_mm[:, 0], cmm.limits_mm[:, 1]), travel))
    cmm.completed += 1
    return None


def _told(session: Session, indicated: Array, time_s: float, normal: Array) -> str:
    """The answer of a measurement, in the order that was asked for."""
    state = session.state
    ijk = ", ".join(fixed(value, 9) for value in state.coordinates.direction_to_part(normal))
    own = {"IJK": f"IJK({ijk})", "ER": f"ER({fixed(session.cmm.tip_radius_mm)})"}
    own[OWN_TIME] = f"{OWN_TIME}({fixed(time_s, 6)})"
    return ", ".join(own[name] if name in own else state.quantity(name, indicated) for name in state.report)


def _on_pt_meas_report(session: Session, call: Call) -> Data:
    session.state.report = tuple(call.named())
    return None


def _get(session: Session, call: Call) -> Data:
    here = session.cmm.position_mm
    return [", ".join(session.state.quantity(name, here) for name in call.named())]


MOTION: dict[str, Handler] = {
    "Home": _home,
    "IsHomed": _is_homed,
    "GoTo": _go_to,
    "PtMeas": _pt_meas,
    "OnPtMeasReport": _on_pt_meas_report,
    "Get": _get,
}
