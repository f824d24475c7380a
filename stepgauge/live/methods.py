"""What every command of I++ DME does on the virtual CMM, but for motion and tools.

A handler takes the session and the call and returns the lines of data; one that moves returns something to await.
"""

from __future__ import annotations

from stepgauge.ippdme.codes import CODES, DmeError
from stepgauge.ippdme.values import Call, Text, Word, fixed
from stepgauge.live.coordinates import DEFINABLE, SELECTABLE, Transformation
from stepgauge.live.daemons import SHORTEST_S, Daemon
from stepgauge.live.machine_state import REPORTED
from stepgauge.live.motion_methods import MOTION
from stepgauge.live.session import Data, Handler, Session
from stepgauge.live.tool_methods import TOOLS

VERSION = "1.4"
MACHINE_CLASS = "CartCMM"
_NOT_HERE = """
AlignPart CenterPart LockAxis OnScanReport ReQualify ScanInCylEndIsPlane ScanInCylEndIsSphere ScanInPlaneEndIsCyl
ScanInPlaneEndIsPlane ScanInPlaneEndIsSphere ScanOnCircle ScanOnCircleHint ScanOnLine ScanOnLineHint ScanUnknownHint
ScanUnknownDensity ScanOnHelix ScanOnCurve TiltCenterPart TiltPart PtMeasSelfCenter PtMeasSelfCenterLocked
SaveActiveCoordSystem LoadCoordSystem DeleteCoordSystem EnumCoordSystem GetNamedCsyTransformation
SaveNamedCsyTransformation EnumToolCollection EnumAllToolCollections OpenToolCollection IsAlignable Alignment
CalcToolAlignment CalcToolAngles UseSmallestAngleToAlignTool GetSupportedCommands GetSupportedArguments Step
"""
NOT_HERE = frozenset(_NOT_HERE.split())
"""Commands of the standard that this machine has no device for: error 0501, any other unknown one is 0507."""


def no_arguments(call: Call) -> None:
    """:class:`DmeError` 0502 where a command that takes no arguments has some."""
    if call.arguments:
        raise DmeError(502, call.name)


def _start_session(session: Session, call: Call) -> Data:
    no_arguments(call)
    if session.open:
        raise DmeError(8, call.name)
    session.open, session.failed = True, False
    session.state.report = REPORTED
    session.clock.start()
    return None


def _end_session(session: Session, call: Call) -> Data:
    no_arguments(call)
    session.close()
    return None


def _abort(session: Session, call: Call) -> Data:
    no_arguments(call)
    session.abort()
    return None


def _clear_all_errors(session: Session, call: Call) -> Data:
    no_arguments(call)
    session.failed = False
    return None


def _get_error_info(session: Session, call: Call) -> Data:
    number = round(call.number())
    return [f'"{CODES[number].text if number in CODES else "Unknown error"}"']


def _get_err_status(session: Session, call: Call) -> Data:
    no_arguments(call)
    return [f"ErrStatus({int(session.failed)})"]


def _get_xtd_err_status(session: Session, call: Call) -> Data:
    no_arguments(call)
    state = session.state
    return [f"IsHomed({int(state.cmm.homed)})", f"IsUserEnabled({int(state.user_enabled)})"]


def _get_dme_version(session: Session, call: Call) -> Data:
    no_arguments(call)
    return [f'DMEVersion("{VERSION}")']


def _get_machine_class(session: Session, call: Call) -> Data:
    no_arguments(call)
    return [f"GetMachineClass({MACHINE_CLASS})"]


def _user(enabled: bool) -> Handler:
    def switch(session: Session, call: Call) -> Data:
        no_arguments(call)
        session.state.user_enabled = enabled
        return None

    return switch


def _is_user_enabled(session: Session, call: Call) -> Data:
    no_arguments(call)
    return [f"IsUserEnabled({int(session.state.user_enabled)})"]


def _on_move_report(session: Session, call: Call) -> Data:
    if session.daemons:
        raise DmeError(515, call.name)
    names, limits = list[str](), {"Time": SHORTEST_S, "Dis": 0.0}
    for one in call.arguments:
        if not isinstance(one, Call) or one.name in names:
            raise DmeError(502, call.name)
        if one.name in limits:
            limits[one.name] = one.number()
        elif one.arguments:
            raise DmeError(502, call.name)
        else:
            session.state.quantity(one.name, session.cmm.position_mm, call.name)
            names.append(one.name)
    if limits["Time"] < SHORTEST_S or limits["Dis"] < 0.0:
        raise DmeError(509, call.name)
    daemon = Daemon(tuple(names or REPORTED), limits["Time"], limits["Dis"])
    session.start_daemon(daemon)
    return None


def _stop_daemon(session: Session, call: Call) -> Data:
    if len(call.arguments) != 1:
        raise DmeError(502, call.name)
    tag = call.arguments[0]
    name = f"{tag:05.0f}" if isinstance(tag, float) else str(tag) if isinstance(tag, Word | Text) else ""
    if session.daemons.pop(name, None) is None:
        raise DmeError(513, call.name)
    return None


def _stop_all_daemons(session: Session, call: Call) -> Data:
    no_arguments(call)
    if not session.daemons:
        raise DmeError(512, call.name)
    session.daemons.clear()
    return None


def _csy(call: Call, known: tuple[str, ...]) -> str:
    name = call.arguments[0] if call.arguments else ""
    if not isinstance(name, Word):
        raise DmeError(502, call.name)
    if name not in known:
        raise DmeError(505, call.name)
    return name


def _set_coord_system(session: Session, call: Call) -> Data:
    if len(call.arguments) != 1:
        raise DmeError(502, call.name)
    session.state.coordinates.selected = _csy(call, SELECTABLE)
    return None


def _get_coord_system(session: Session, call: Call) -> Data:
    no_arguments(call)
    return [f"CoordSystem({session.state.coordinates.selected})"]


def _set_csy_transformation(session: Session, call: Call) -> Data:
    name = _csy(call, DEFINABLE)
    numbers = Call(call.name, call.arguments[1:]).numbers()
    session.state.coordinates.defined[name] = Transformation.of(numbers, call.name)
    return None


def _get_csy_transformation(session: Session, call: Call) -> Data:
    if len(call.arguments) != 1:
        raise DmeError(502, call.name)
    found = session.state.coordinates.defined.get(_csy(call, DEFINABLE), Transformation())
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
"""Every command that the server has."""
