"""What every command of I++ DME does on the virtual CMM, but for motion.

A handler takes the session and the call, whose arguments are as the table of commands has them, and returns the lines
of data; one that moves returns something to await.
"""

from __future__ import annotations

import numpy as np

from stepgauge.ippdme.codes import CODES, DmeError
from stepgauge.ippdme.commands import COMMANDS, OWN_SIMULATED, OWN_TIME, TEMPERATURES
from stepgauge.ippdme.values import Call, fixed
from stepgauge.live.daemons import SHORTEST_S, Daemon
from stepgauge.live.machine_state import REPORTED, UNDEFINED, Transformation
from stepgauge.live.motion_methods import MOTION
from stepgauge.live.session import Data, Handler, Session

NEARLY = 0.01
"""How far the length of a unit vector that is written with two digits may be off 1."""


def _enum_tools(session: Session, call: Call) -> Data:
    return [f'"{name}"' for name in session.state.tools]


def _find_tool(session: Session, call: Call) -> Data:
    name = str(call.arguments[0])
    known = name in (*session.state.tools, "BaseTool")
    session.state.found_tool = name if known else UNDEFINED
    if not known:
        raise DmeError(1502)
    return None


def _change_tool(session: Session, call: Call) -> Data:
    """The stylus of that name is in the machine from now on, by whose hands is not asked."""
    session.state.change_to(_check_tool(session, str(call.arguments[0])))
    return None


def _check_tool(session: Session, name: str) -> str:
    """The name of a tool that there is (:class:`DmeError` 1503 for one that is none, 1502 for another)."""
    if name not in session.state.tools:
        raise DmeError(1503 if name == UNDEFINED else 1502)
    return name


def _get_change_tool_action(session: Session, call: Call) -> Data:
    _check_tool(session, str(call.arguments[0]))
    return ["ChangeToolAction(Switch, X(0), Y(0), Z(0))"]


def _align_tool(session: Session, call: Call) -> Data:
    """A fixed stylus is aligned as it is, where that is within the angle; the vectors have length 1."""
    numbers = call.numbers()
    count = len(numbers) // 4
    wanted = np.array(numbers[: 3 * count]).reshape(count, 3)
    reached = [session.cmm.upward, session.cmm.machine.sensor.frame[0]][:count]
    for vector, has, limit_deg in zip(wanted, reached, numbers[3 * count :], strict=True):
        with np.errstate(over="ignore"):
            size = float(np.linalg.norm(vector))
        if size == 0.0 or not abs(size - 1.0) <= NEARLY:
            raise DmeError(502 if size else 1010)
        if np.degrees(np.arccos(np.clip(vector @ has / size, -1.0, 1.0))) > limit_deg + 1e-6:
            raise DmeError(1502)
    return [", ".join(fixed(value, 9) for value in np.concatenate(reached)).join("()")]


def _value(session: Session, path: str) -> str:
    """The value of a property as it is answered (:class:`DmeError` 0510 where there is none)."""
    state = session.state
    if path == OWN_SIMULATED:
        return "1"
    if path == OWN_TIME or state.temperature_C(path) is not None:
        return state.quantity(path, session.cmm.position_mm).removeprefix(f"{path}(").removesuffix(")")
    tool, rest = state.tool_of(path)
    if rest in ("Name", "Id"):
        return f'"{tool}"'
    parameter, facet = state.parameters[tool].find(rest)
    return fixed(parameter.facet(facet), 6)


def _get_prop(session: Session, call: Call) -> Data:
    return [", ".join(f"{name}({_value(session, name)})" for name in call.named())]


def _set_prop(session: Session, call: Call) -> Data:
    """All or none are set; one beyond its limits is set to the limit, with a warning."""
    asked = [(session.state.tool_of(name), one.number()) for name, one in call.named().items()]
    found = [(session.state.parameters[tool].find(rest), value) for (tool, rest), value in asked]
    if any(facet != "Act" for (_, facet), _ in found):
        raise DmeError(510)
    kept = [parameter.set(value) for (parameter, _), value in found]
    if not all(kept):
        session.warn(DmeError(504, call.name))
    return None


def _children(session: Session, path: str) -> list[tuple[str, str]]:
    if f"{path}.Temperature" in TEMPERATURES:
        return [("Temperature", "Number")]
    if path == OWN_TIME.partition(".")[0]:
        return [("Time", "Number"), ("Simulated", "Number")]
    tool, rest = session.state.tool_of(path)
    own = [] if rest else [("Name", "String"), ("Id", "String")]
    return [*own, *session.state.parameters[tool].children(rest)]


def _enum_prop(session: Session, call: Call) -> Data:
    (path,) = call.named()
    return [f'"{name}", "{kind}"' for name, kind in _children(session, path)]


def _enum_all_prop(session: Session, call: Call) -> Data:
    """Children, and theirs, each by its path below what was asked for."""
    (path,) = call.named()
    lines: list[str] = []
    for name, kind in _children(session, path):
        lines.append(f'"{name}", "{kind}"')
        if kind == "Property":
            below = _children(session, f"{path}.{name}")
            lines += [f'"{name}.{child}", "{child_kind}"' for child, child_kind in below]
    return lines


TOOLS: dict[str, Handler] = {
    "EnumTools": _enum_tools,
    "FindTool": _find_tool,
    "ChangeTool": _change_tool,
    "SetTool": _change_tool,
    "GetChangeToolAction": _get_change_tool_action,
    "AlignTool": _align_tool,
    "GetProp": _get_prop,
    "GetPropE": _get_prop,
    "SetProp": _set_prop,
    "EnumProp": _enum_prop,
    "EnumAllProp": _enum_all_prop,
}


VERSION = "1.4"
MACHINE_CLASS = "CartCMM"


def _start_session(session: Session, call: Call) -> Data:
    if session.open:
        raise DmeError(8)
    session.open, session.failed = True, False
    session.state.report = REPORTED
    session.clock.start()
    return None


def _end_session(session: Session, call: Call) -> Data:
    session.close()
    return None


def _abort(session: Session, call: Call) -> Data:
    session.abort()
    return None


def _clear_all_errors(session: Session, call: Call) -> Data:
    session.failed = False
    return None


def _get_error_info(session: Session, call: Call) -> Data:
    number = round(call.number())
    if number not in CODES:
        raise DmeError(504)
    return [f'"{CODES[number].text}"']


def _get_err_status(session: Session, call: Call) -> Data:
    return [f"ErrStatus({int(session.failed)})"]


def _get_xtd_err_status(session: Session, call: Call) -> Data:
    state = session.state
    return [f"IsHomed({int(state.cmm.homed)})", f"IsUserEnabled({int(state.user_enabled)})"]


def _get_dme_version(session: Session, call: Call) -> Data:
    return [f'DMEVersion("{VERSION}")']


def _get_machine_class(session: Session, call: Call) -> Data:
    return [f"GetMachineClass({MACHINE_CLASS})"]


def _user(enabled: bool) -> Handler:
    def switch(session: Session, call: Call) -> Data:
        session.state.user_enabled = enabled
        return None

    return switch


def _is_user_enabled(session: Session, call: Call) -> Data:
    return [f"IsUserEnabled({int(session.state.user_enabled)})"]


def _on_move_report(session: Session, call: Call) -> Data:
    if session.daemons:
        raise DmeError(515)
    limits = {one.name: one.number() for one in call.calls() if one.arguments}
    names = tuple(one.name for one in call.calls() if not one.arguments)
    every_s, every_mm = limits.get("Time", SHORTEST_S), limits.get("Dis", 0.0)
    if every_s < SHORTEST_S or every_mm < 0.0:
        raise DmeError(510)
    session.start_daemon(Daemon(names or REPORTED, every_s, every_mm))
    return None


def _stop_daemon(session: Session, call: Call) -> Data:
    if session.daemons.pop(str(call.arguments[0]), None) is None:
        raise DmeError(513)
    return None


def _stop_all_daemons(session: Session, call: Call) -> Data:
    if not session.daemons:
        raise DmeError(512)
    session.daemons.clear()
    return None


def _set_coord_system(session: Session, call: Call) -> Data:
    session.state.coordinates.selected = str(call.arguments[0])
    return None


def _get_coord_system(session: Session, call: Call) -> Data:
    return [f"CoordSystem({session.state.coordinates.selected})"]


def _set_csy_transformation(session: Session, call: Call) -> Data:
    numbers = Call(call.name, call.arguments[1:]).numbers()
    session.state.coordinates.defined[str(call.arguments[0])] = Transformation.of(numbers)
    return None


def _get_csy_transformation(session: Session, call: Call) -> Data:
    found = session.state.coordinates.defined.get(str(call.arguments[0]), Transformation())
    return [f"GetCsyTransformation({', '.join(fixed(value) for value in found.numbers)})"]


HANDLERS: dict[str, Handler] = {
    "StartSession": _start_session,
    "EndSession": _end_session,
    "AbortE": _abort,
    "ClearAllErrors": _clear_all_errors,
    "GetErrorInfo": _get_error_info,
    "GetErrStatusE": _get_err_status,
    "GetXtdErrStatus": _get_xtd_err_status,
    "GetDMEVersion": _get_dme_version,
    "GetMachineClass": _get_machine_class,
    "EnableUser": _user(True),
    "DisableUser": _user(False),
    "IsUserEnabled": _is_user_enabled,
    "OnMoveReportE": _on_move_report,
    "StopDaemon": _stop_daemon,
    "StopAllDaemons": _stop_all_daemons,
    "SetCoordSystem": _set_coord_system,
    "GetCoordSystem": _get_coord_system,
    "SetCsyTransformation": _set_csy_transformation,
    "GetCsyTransformation": _get_csy_transformation,
    **MOTION,
    **TOOLS,
}
"""What each command of :data:`stepgauge.ippdme.commands.COMMANDS` does."""
assert HANDLERS.keys() == COMMANDS.keys()
