"""What every command of I++ DME does on the virtual CMM, but for motion and tools.

A handler takes the session and the call, whose arguments are as the table of commands has them, and returns the lines
of data; one that moves returns something to await.
"""

from __future__ import annotations

from stepgauge.ippdme.codes import CODES, DmeError
from stepgauge.ippdme.commands import COMMANDS
from stepgauge.ippdme.values import Call, fixed
from stepgauge.live.coordinates import Transformation
from stepgauge.live.daemons import SHORTEST_S, Daemon
from stepgauge.live.machine_state import REPORTED
from stepgauge.live.motion_methods import MOTION
from stepgauge.live.session import Data, Handler, Session
from stepgauge.live.tool_methods import TOOLS

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
