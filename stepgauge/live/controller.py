"""The CMM behind a connection, as a client sees it: prepared for a program, moved, and asked for points.

:class:`stepgauge.live.measuring.measure` needs no more of a machine than this.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from stepgauge.errors import InputError, naming
from stepgauge.files.arrays import Array
from stepgauge.ippdme.codes import DmeError
from stepgauge.ippdme.commands import OWN_SIMULATED, OWN_TIME
from stepgauge.ippdme.values import Call, fixed, named
from stepgauge.live.connection import Connection, FalseAnswerError
from stepgauge.motion.moves import ProbingSettings
from stepgauge.programs import DIALECTS

REPORTS = (("X", "Y", "Z", "ER", OWN_TIME), ("X", "Y", "Z", "ER"), ("X", "Y", "Z"))
"""What is asked of a measurement: with the server's own time, which only stepgauge's has; without; the least."""
TEMPERATURES = {
    "Part.Temperature": "gauge_temperature_C",
    **{f"Scale{axis}.Temperature": f"scale_temperature_{axis.lower()}_C" for axis in "XYZ"},
}
"""Properties of servers, and the columns of a recording that they are."""
SPEED_TOLERANCE = 1e-3
"""Relative; a server that keeps another speed measures something else."""
SLOWER = 5.0
"""A real machine accelerates, and may take so many times as long as a move at full speed."""
HOMING_S = 300.0


@dataclass(frozen=True)
class ControllerOptions:
    """How to measure: ``tool``: what the server calls the probe; ``home``: the machine may home itself."""

    tool: str = DIALECTS["ippdme"].tool
    home: bool = False


class MeasuredPoint(NamedTuple):
    """The answer of a measurement: indicated tip centre, mm; effective tip radius and time where the server tells."""

    position_mm: list[float]
    radius_mm: float | None = None
    time_s: float | None = None


class Link(Protocol):
    """What a machine must be able to do to be measured on; errors as :meth:`Connection.ask` raises them."""

    @property
    def name(self) -> str:
        """Which machine it is, for messages."""

    @property
    def simulated(self) -> bool:
        """Whether the machine is a virtual one, as it tells by itself; known once it was prepared."""

    def prepare(self, wishes: ControllerOptions) -> None:
        """Be ready for the program, without a move but to home, where that is wished (:class:`InputError` if not)."""

    def position_mm(self) -> Array:
        """Where the machine stands, shape ``(3,)``."""

    def temperatures_C(self) -> dict[str, float]:
        """Temperatures that the machine tells, deg C, by the column of a recording."""

    def time_s(self) -> float | None:
        """The machine's own clock, s; None where it has none that it tells."""

    def go(self, place_mm: Array) -> None:
        """Move to a place, shape ``(3,)``."""

    def probe(self, surface_mm: Array, approach: Array, takes_s: float) -> MeasuredPoint:
        """Measure a point: nominal surface point and unit approach, both ``(3,)``; ``takes_s`` at full speed."""

    def touched_mm(self, approach: Array) -> Array:
        """Where the tip touched last, by where the machine stood and not by its answer; approach, both ``(3,)``."""

    def abort(self) -> None:
        """Motion stops at once."""

    def clear(self) -> None:
        """Errors are cleared; the wish to stop, which led here, is heeded no more."""

    def end(self) -> None:
        """End of the session."""


def refused(link: Link, what: str, found: str, expected: object) -> InputError:
    """The error of a machine that may not be measured on."""
    return InputError(link.name, what, found=found, expected=expected)


class Controller:
    """A CMM over an open I++ DME connection.

    Errors are those of :meth:`stepgauge.live.connection.Connection.ask`; ``travel_mm`` is the longest move that there
    may be.
    """

    def __init__(self, connection: Connection, settings: ProbingSettings, travel_mm: float) -> None:
        self.connection, self.settings = connection, settings
        self._longest_s = SLOWER * travel_mm / settings.travel_speed_mm_s
        self._temperatures: tuple[str, ...] = ()
        self.simulated = False
        self._report: tuple[str, ...] = REPORTS[-1]

    def prepare(self, wishes: ControllerOptions) -> None:
        """Start a session, and set what the program states; nothing moves but to home, where that is wished.

        :class:`InputError` for a machine that is none for this, is not homed, or does not take a setting.
        """
        ask, settings = self.connection.ask, self.settings
        ask("EndSession()")
        self.connection.forget_events()
        ask("StartSession()")
        ask("ClearAllErrors()")
        self.simulated = self._is_simulated()
        self._check_class()
        self._check_home(wishes)
        ask("SetCoordSystem(MachineCsy)")
        ask(f'SetTool("{wishes.tool}")')
        self._set("PtMeasPar.Speed", settings.measuring_speed_mm_s)
        self._set("PtMeasPar.Approach", settings.standoff_mm)
        self._set("PtMeasPar.Search", settings.search_mm)
        self._set("PtMeasPar.Retract", settings.retract_mm)
        self._set("GoToPar.Speed", settings.travel_speed_mm_s)
        self._ask_for_reports()
        self._temperatures = tuple(
            name for name in TEMPERATURES if self.connection.ask_if_known(f"GetProp({name}())") is not None
        )

    @property
    def name(self) -> str:
        """The address of the server."""
        return str(self.connection.address)

    def change_tool(self, name: str) -> bool:
        """The machine changes to a tool by itself; False where the server knows none of that name, or cannot."""
        if self.connection.ask_if_known(f'FindTool("{name}")') is None:
            return False
        self.connection.ask(f'ChangeTool("{name}")', takes_s=HOMING_S)
        return True

    def _is_simulated(self) -> bool:
        """The virtual CMM says what it is."""
        told = self.connection.ask_if_known(f"GetProp({OWN_SIMULATED}())")
        return told is not None and _number(_data(told, [OWN_SIMULATED]), OWN_SIMULATED) == 1.0

    def _check_class(self) -> None:
        said = ", ".join(self.connection.ask("GetMachineClass()"))
        if "CartCMM" not in said:
            raise refused(self, "the server is no Cartesian CMM", said or "nothing", "GetMachineClass(CartCMM)")

    def _check_home(self, wishes: ControllerOptions) -> None:
        if any("IsHomed(1)" in line for line in self.connection.ask("IsHomed()")):
            return
        if not wishes.home:
            expected = naming("homing", words="a machine that is homed, or {}")
            raise refused(self, "the machine is not homed", "IsHomed(0)", expected)
        self.connection.ask("Home()", takes_s=HOMING_S)

    def _set(self, name: str, value: float) -> None:
        """Set a parameter of the tool and read it back: a server may limit it."""
        path = f"Tool.{name}"
        self.connection.ask(f"SetProp({path}({fixed(value, 6)}))")
        found = _number(_data(self.connection.ask(f"GetProp({path}())"), [path]), path)
        if not abs(found - value) <= SPEED_TOLERANCE * value:
            raise refused(self, f"the server does not take {path} of the program", f"{found:g}", f"{value:g}")

    def _ask_for_reports(self) -> None:
        """The most that the server tells of a measurement (:class:`DmeError` where it does not take the least)."""
        *more, self._report = REPORTS
        for report in more:
            if self.connection.ask_if_known(_report_command(report)) is not None:
                self._report = report
                return
        self.connection.ask(_report_command(self._report))

    def position_mm(self) -> Array:
        """Where the machine stands, shape ``(3,)``."""
        return np.array(_xyz(_data(self.connection.ask("Get(X(), Y(), Z())"), "XYZ")))

    def temperatures_C(self) -> dict[str, float]:
        """What the server tells of temperatures now, deg C, by the column of a recording."""
        if not self._temperatures:
            return {}
        asked = f"GetProp({', '.join(f'{name}()' for name in self._temperatures)})"
        found = _data(self.connection.ask(asked), self._temperatures)
        return {TEMPERATURES[name]: _number(found, name) for name in self._temperatures}

    def time_s(self) -> float | None:
        """The machine's own clock, s; None where it has none that it tells."""
        told = self.connection.ask_if_known(f"GetProp({OWN_TIME}())")
        return None if told is None else _number(_data(told, [OWN_TIME]), OWN_TIME)

    def go(self, place_mm: Array) -> None:
        """Move to a place, shape ``(3,)``."""
        _data(self.connection.ask(f"GoTo({_written(place_mm)})", takes_s=self._longest_s), ())

    def probe(self, surface_mm: Array, approach: Array, takes_s: float) -> MeasuredPoint:
        """Measure a point: nominal surface point and unit approach, both ``(3,)``; ``takes_s`` at full speed."""
        ijk = ", ".join(fixed(-value, 9) for value in approach)
        command = f"PtMeas({_written(surface_mm)}, IJK({ijk}))"
        found = _data(self.connection.ask(command, SLOWER * (takes_s + 1.0)), self._report)
        told = [_number(found, name) if name in found else None for name in ("ER", OWN_TIME)]
        return MeasuredPoint(_xyz(found), *told)

    def touched_mm(self, approach: Array) -> Array:
        """Where the tip touched last, by where the machine stands after it was drawn back, shape ``(3,)``."""
        return self.position_mm() + self.settings.retract_mm * approach

    def points_by_hand(self, count: int, tell: Callable[[str], None]) -> Array:
        """Tip centres of points that a person measures, as the server sends them, mm, shape ``(count, 3)``."""
        self.connection.by_hand = texts = list[str]()
        self.connection.ask("EnableUser()")
        for number in range(1, count + 1):
            self.connection.wait_by_hand(number)
            tell(f"point {number} of {count}")
        self.connection.ask("DisableUser()")
        self.connection.by_hand = None
        data = (text.partition("(")[2].removesuffix(")") for text in texts[:count])
        return np.array([_xyz(_data([one], ("IJK", *REPORTS[0]))) for one in data])

    def abort(self) -> None:
        """Motion stops at once."""
        self.connection.abort()

    def clear(self) -> None:
        """Errors are cleared; the wish to stop, which led here, is heeded no more."""
        self.connection.heeds_stop = False
        self.connection.forget_errors()

    def end(self) -> None:
        """End of the session."""
        self.connection.ask("EndSession()")


def _report_command(names: Sequence[str]) -> str:
    return f"OnPtMeasReport({', '.join(f'{name}()' for name in names)})"


def _written(place_mm: Array) -> str:
    return ", ".join(f"{axis}({fixed(value, 6)})" for axis, value in zip("XYZ", place_mm, strict=True))


def _data(lines: Sequence[str], asked: Sequence[str]) -> dict[str, Call]:
    """Values by name, from all lines of an answer.

    :class:`FalseAnswerError` for what is no data of I++ DME, for a name that is there twice or was not asked for.
    """
    wanted, told = f"{', '.join(asked)} once each" if asked else "no data", repr("; ".join(lines)[:60])
    try:
        found = named(lines)
    except DmeError as error:
        raise FalseAnswerError(error.detail or "no data of I++ DME", told, wanted) from None
    if other := next((name for name in found if name not in asked), None):
        raise FalseAnswerError(f"the server tells {other}(..), which was not asked for", told, wanted)
    return found


def _number(found: dict[str, Call], name: str) -> float:
    if name not in found:
        told = ", ".join(f"{one}(..)" for one in found) or "no data"
        raise FalseAnswerError(f"the server did not answer {name}(..)", told, f"{name}(..)")
    try:
        return found[name].number()
    except DmeError as error:
        raise FalseAnswerError(error.detail, f"{name}{found[name].arguments}", f"{name}(number)") from None


def _xyz(found: dict[str, Call]) -> list[float]:
    return [_number(found, axis) for axis in "XYZ"]
