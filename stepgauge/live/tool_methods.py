"""Commands for tools and for the properties of tools, of the part and of the scales."""

from __future__ import annotations

import numpy as np

from stepgauge.importing.ippdme import OWN_SIMULATED, OWN_TIME
from stepgauge.ippdme.codes import DmeError
from stepgauge.ippdme.values import Call, Text, fixed
from stepgauge.live.machine_state import UNDEFINED
from stepgauge.live.session import Data, Handler, Session

TEMPERATURES = ("Part", *(f"Scale{axis}" for axis in "XYZ"))


def _enum_tools(session: Session, call: Call) -> Data:
    if call.arguments:
        raise DmeError(502, call.name)
    return [f'"{name}"' for name in session.state.tools]


def _name(call: Call) -> str:
    if len(call.arguments) != 1 or not isinstance(call.arguments[0], Text):
        raise DmeError(502, call.name)
    return call.arguments[0]


def _find_tool(session: Session, call: Call) -> Data:
    name = _name(call)
    known = name in (*session.state.tools, "BaseTool")
    session.state.found_tool = name if known else UNDEFINED
    if not known:
        raise DmeError(1502, call.name)
    return None


def _change_tool(session: Session, call: Call) -> Data:
    """The stylus of that name is in the machine from now on, by whose hands is not asked."""
    name = _name(call)
    if name == UNDEFINED:
        raise DmeError(1503, call.name)
    if name not in session.state.tools:
        raise DmeError(1502, call.name)
    session.state.change_to(name)
    return None


def _get_change_tool_action(session: Session, call: Call) -> Data:
    if _name(call) not in session.state.tools:
        raise DmeError(1502, call.name)
    return ["ChangeToolAction(Switch, X(0), Y(0), Z(0))"]


def _align_tool(session: Session, call: Call) -> Data:
    """A fixed stylus is aligned as it is, where that is within the angle."""
    numbers = call.numbers()
    if len(numbers) not in (4, 8):
        raise DmeError(502, call.name)
    count = len(numbers) // 4
    wanted = np.array(numbers[: 3 * count]).reshape(count, 3)
    reached = [session.cmm.upward, session.cmm.machine.sensor.frame[0]][:count]
    for vector, has, limit_deg in zip(wanted, reached, numbers[3 * count :], strict=True):
        with np.errstate(over="ignore"):
            size = float(np.linalg.norm(vector))
        if not 1e-9 < size < 1e9:
            raise DmeError(1010, call.name)
        if np.degrees(np.arccos(np.clip(vector @ has / size, -1.0, 1.0))) > abs(limit_deg) + 1e-6:
            raise DmeError(1502, call.name)
    return [", ".join(fixed(value, 9) for value in np.concatenate(reached)).join("()")]


def _calls(call: Call) -> list[Call]:
    """Arguments that all are names with parentheses, at least one."""
    found = [one for one in call.arguments if isinstance(one, Call)]
    if not found or len(found) != len(call.arguments):
        raise DmeError(502, call.name)
    return found


def _value(session: Session, path: str, method: str) -> str:
    """The value of a property as it is answered (:class:`DmeError` 0510 where there is none)."""
    state = session.state
    if path == OWN_SIMULATED:
        return "1"
    if path == OWN_TIME or state.temperature_C(path) is not None:
        return state.quantity(path, session.cmm.position_mm, method).removeprefix(f"{path}(").removesuffix(")")
    tool, rest = state.tool_of(path, method)
    if rest in ("Name", "Id"):
        return f'"{tool}"'
    parameter, facet = state.parameters[tool].find(rest, method)
    return fixed(parameter.facet(facet), 6)


def _get_prop(session: Session, call: Call) -> Data:
    asked = _calls(call)
    if any(one.arguments for one in asked):
        raise DmeError(502, call.name)
    return [", ".join(f"{one.name}({_value(session, one.name, call.name)})" for one in asked)]


def _set_prop(session: Session, call: Call) -> Data:
    """All or none are set; one beyond its limits is set to the limit, with a warning."""
    asked = [(session.state.tool_of(one.name, call.name), one.number()) for one in _calls(call)]
    found = [(session.state.parameters[tool].find(rest, call.name), value) for (tool, rest), value in asked]
    if any(facet != "Act" for (_, facet), _ in found):
        raise DmeError(510, call.name)
    kept = [parameter.set(value) for (parameter, _), value in found]
    if not all(kept):
        session.warn(DmeError(504, call.name))
    return None


def _children(session: Session, path: str, method: str) -> list[tuple[str, str]]:
    if path in TEMPERATURES:
        return [("Temperature", "Number")]
    if path == OWN_TIME.partition(".")[0]:
        return [("Time", "Number"), ("Simulated", "Number")]
    tool, rest = session.state.tool_of(path, method)
    own = [] if rest else [("Name", "String"), ("Id", "String")]
    return [*own, *session.state.parameters[tool].children(rest, method)]


def _enum_prop(session: Session, call: Call) -> Data:
    asked = _calls(call)
    if len(asked) != 1 or asked[0].arguments:
        raise DmeError(502, call.name)
    return [f'"{name}", "{kind}"' for name, kind in _children(session, asked[0].name, call.name)]


def _enum_all_prop(session: Session, call: Call) -> Data:
    """Children, and theirs, each by its path below what was asked for."""
    asked = _calls(call)
    if len(asked) != 1 or asked[0].arguments:
        raise DmeError(502, call.name)
    lines: list[str] = []
    for name, kind in _children(session, asked[0].name, call.name):
        lines.append(f'"{name}", "{kind}"')
        if kind == "Property":
            below = _children(session, f"{asked[0].name}.{name}", call.name)
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
