"""Every command of I++ DME that the server understands, with the arguments that it may have; anything else is refused.

Pages are those of specification 1.40. Where it is not explicit, numbers of errors are those of NIST's test suite 3.0
(parserCmd, checkerCmd): a wrong count, and a name that is there twice, 0502; an argument of another kind 0509; a
command that needs an event tag and has none, and the reverse, 0001. For names that are not known the suite has 0502 and
0509; the standard's own 0505, 0506 and 0510 say more.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

from stepgauge.ippdme.codes import DmeError
from stepgauge.ippdme.lines import is_event_tag
from stepgauge.ippdme.values import Call, QuotedText, Value, Word

POSITION = ("X", "Y", "Z")
TEMPERATURES = ("Part.Temperature", *(f"Scale{axis}.Temperature" for axis in "XYZ"))
OWN_TIME, OWN_SIMULATED = "Server.Time", "Server.Simulated"
"""Properties of stepgauge's own server: time of the machine's clock, s; 1 for a virtual machine."""
QUANTITIES = (*POSITION, *TEMPERATURES, OWN_TIME)
"""What Get and reports of moves tell (temperatures and time are the server's own)."""
OF_A_POINT = (*POSITION, "IJK", "ER", OWN_TIME)
NOT_HERE = ("R", "Phi", "C", "Tool.A", "Tool.B", "Tool.C", "A", "B")
"""Quantities of the standard that need a rotary table or a head (error 0506)."""
SELECTABLE = ("MachineCsy", "MoveableMachineCsy", "MultipleArmCsy", "PartCsy")
DEFINABLE = ("MoveableMachineCsy", "MultipleArmCsy", "PartCsy", "JogDisplayCsy", "JogMoveCsy", "SensorCsy")


def _count(arguments: Sequence[Value], *counts: int) -> None:
    if len(arguments) not in counts:
        raise DmeError(502, detail=f"{len(arguments)} arguments instead of {' or '.join(map(str, counts))}")


@dataclass(frozen=True)
class NumberArguments:
    """So many numbers; none at all where ``counts`` is 0."""

    counts: tuple[int, ...] = (0,)

    def check(self, arguments: Sequence[Value]) -> None:
        """:class:`DmeError` 0502 for another count, 0509 for what is no number."""
        _count(arguments, *self.counts)
        if not all(isinstance(one, float) for one in arguments):
            raise DmeError(509, detail="not all are numbers")

    def __str__(self) -> str:
        return "" if self.counts == (0,) else " or ".join(f"{count} numbers" for count in self.counts)


@dataclass(frozen=True)
class One:
    """One argument of a kind, ``title`` in words."""

    title: str
    fits: Callable[[Value], bool]

    def check(self, arguments: Sequence[Value]) -> None:
        """:class:`DmeError` 0502 for another count, 0509 for another kind."""
        _count(arguments, 1)
        if not self.fits(arguments[0]):
            raise DmeError(509, detail=f"not {self.title}")

    def __str__(self) -> str:
        return self.title


INTEGER = One("a whole number", lambda value: isinstance(value, float) and value.is_integer())
TEXT = One('"a name"', lambda value: isinstance(value, QuotedText))
EVENT_TAG = One("the tag of an event", lambda value: isinstance(value, Word) and is_event_tag(value))


@dataclass(frozen=True)
class ArgumentChoice:
    """A word of a list, then so many numbers."""

    words: tuple[str, ...]
    numbers: int = 0

    def check(self, arguments: Sequence[Value]) -> None:
        """:class:`DmeError` 0502 for another count or kind, 0505 for another word."""
        _count(arguments, 1 + self.numbers)
        if not isinstance(arguments[0], Word):
            raise DmeError(502, detail="no word")
        if arguments[0] not in self.words:
            raise DmeError(505, detail=f"{arguments[0]} is none of {', '.join(self.words)}")
        NumberArguments((self.numbers,)).check(arguments[1:])

    def __str__(self) -> str:
        return " | ".join(self.words) + (f", {self.numbers} numbers" if self.numbers else "")


class Inside(StrEnum):
    """What the parentheses of a name hold."""

    NOTHING = ""
    NUMBER = ".."
    VECTOR = "i, j, k"


SIZES = {Inside.NOTHING: 0, Inside.NUMBER: 1, Inside.VECTOR: 3}


@dataclass(frozen=True)
class Names:
    """Names with parentheses, each at most once.

    Parameters
    ----------
    known : what the parentheses of each name hold; None: any name, :attr:`inside` for all, as paths of properties are
    least : how many there are at least
    one_of : at least one of these names must be there
    unknown, empty : errors of a name that is not known, and of too few
    """

    known: Mapping[str, Inside] | None
    least: int = 1
    most: int | None = None
    one_of: tuple[str, ...] = ()
    inside: Inside = Inside.NOTHING
    unknown: int = 505
    empty: int = 502

    def check(self, arguments: Sequence[Value]) -> None:
        """:class:`DmeError` 0502 for too few, too many or two of a name, 0505 and 0506 for others, 0509 for numbers."""
        found = Call("command", tuple(arguments)).named()
        if len(found) < self.least:
            raise DmeError(self.empty, detail="names are missing")
        if self.most is not None and len(found) > self.most:
            raise DmeError(502, detail=f"more than {self.most} names")
        for call in found.values():
            self._check_inside(call)
        if self.one_of and not set(self.one_of) & set(found):
            raise DmeError(502, detail=f"none of {', '.join(self.one_of)}")

    def _check_inside(self, call: Call) -> None:
        if self.known is not None and call.name not in self.known:
            raise DmeError(506 if call.name in NOT_HERE else self.unknown, detail=f"{call.name} is not known")
        inside = self.inside if self.known is None else self.known[call.name]
        if inside is Inside.NOTHING and call.arguments:
            raise DmeError(502, detail=f"{call.name}() holds nothing")
        if not all(isinstance(one, float) for one in call.arguments):
            raise DmeError(509, detail=f"{call.name}({inside}) holds numbers")
        if len(call.arguments) != SIZES[inside]:
            raise DmeError(509 if inside is Inside.NUMBER else 502, detail=f"{call.name}({inside}) holds other numbers")

    def __str__(self) -> str:
        if self.known is None:
            return f"PATH({self.inside})" + ("" if self.most == 1 else ", ..")
        return ", ".join(f"{name}({inside})" for name, inside in self.known.items())


def _empty(*names: str) -> dict[str, Inside]:
    return dict.fromkeys(names, Inside.NOTHING)


_PLACE = dict.fromkeys(POSITION, Inside.NUMBER)
Arguments = NumberArguments | One | ArgumentChoice | Names


@dataclass(frozen=True)
class Signature:
    """A command: its arguments, where the specification has them, and whether it is executed at once, as an event."""

    pages: str
    arguments: Arguments = NumberArguments()
    at_once: bool = False

    def check(self, call: Call, tag: str) -> None:
        """:class:`DmeError` where the tag or the arguments are not those of the command."""
        if is_event_tag(tag) != self.at_once:
            raise DmeError(1, call.name)
        try:
            self.arguments.check(call.arguments)
        except DmeError as error:
            raise DmeError(error.number, call.name, detail=error.detail) from None


COMMANDS = {
    "StartSession": Signature("38, 41, 77"),
    "EndSession": Signature("41, 77"),
    "ClearAllErrors": Signature("40 to 43, 75"),
    "AbortE": Signature("9, 42", at_once=True),
    "GetErrorInfo": Signature("43, 76", INTEGER),
    "GetErrStatusE": Signature("50", at_once=True),
    "GetXtdErrStatus": Signature("50"),
    "GetDMEVersion": Signature("46"),
    "GetMachineClass": Signature("50"),
    "OnMoveReportE": Signature(
        "49 to 50",
        Names({"Time": Inside.NUMBER, "Dis": Inside.NUMBER, **_empty(*QUANTITIES)}, least=0),
        at_once=True,
    ),
    "StopDaemon": Signature("42, 50", EVENT_TAG),
    "StopAllDaemons": Signature("42, 50"),
    "Home": Signature("48"),
    "IsHomed": Signature("48"),
    "EnableUser": Signature("48, 51"),
    "DisableUser": Signature("48, 51, 53"),
    "IsUserEnabled": Signature("49"),
    "SetCoordSystem": Signature("59", ArgumentChoice(SELECTABLE)),
    "GetCoordSystem": Signature("59"),
    "SetCsyTransformation": Signature("60", ArgumentChoice(DEFINABLE, 6)),
    "GetCsyTransformation": Signature("60", ArgumentChoice(DEFINABLE)),
    "EnumTools": Signature("53, 54"),
    "FindTool": Signature("54", TEXT),
    "ChangeTool": Signature("54, 57, 78", TEXT),
    "SetTool": Signature("54, 55", TEXT),
    "GetChangeToolAction": Signature("57 to 58", TEXT),
    "AlignTool": Signature("55", NumberArguments((4, 8))),
    "GetProp": Signature("45, 66", Names(None)),
    "GetPropE": Signature("45", Names(None), at_once=True),
    "SetProp": Signature("45, 65, 77", Names(None, inside=Inside.NUMBER)),
    "EnumProp": Signature("45", Names(None, most=1)),
    "EnumAllProp": Signature("46", Names(None, most=1)),
    "GoTo": Signature("51 to 53, 62", Names(_PLACE)),
    "PtMeas": Signature("52 to 53, 62", Names({**_PLACE, "IJK": Inside.VECTOR}, one_of=POSITION)),
    "OnPtMeasReport": Signature("41, 49, 53", Names(_empty(*OF_A_POINT), unknown=510, empty=510)),
    "Get": Signature("49, 51, 61", Names(_empty(*QUANTITIES))),
}
"""The table; :data:`stepgauge.live.methods.HANDLERS` does what each says."""

_ELSEWHERE = """
AlignPart CenterPart LockAxis OnScanReport ReQualify ScanInCylEndIsPlane ScanInCylEndIsSphere ScanInPlaneEndIsCyl
ScanInPlaneEndIsPlane ScanInPlaneEndIsSphere ScanOnCircle ScanOnCircleHint ScanOnLine ScanOnLineHint ScanUnknownHint
ScanUnknownDensity ScanOnHelix ScanOnCurve TiltCenterPart TiltPart PtMeasSelfCenter PtMeasSelfCenterLocked
SaveActiveCoordSystem LoadCoordSystem DeleteCoordSystem EnumCoordSystem GetNamedCsyTransformation
SaveNamedCsyTransformation EnumToolCollection EnumAllToolCollections OpenToolCollection IsAlignable Alignment
CalcToolAlignment CalcToolAngles UseSmallestAngleToAlignTool GetSupportedCommands GetSupportedArguments Step
"""
ELSEWHERE = frozenset(_ELSEWHERE.split())
"""Commands of the standard that this machine has no device for: error 0501, any other unknown one is 0507."""


def check_command(call: Call, tag: str) -> None:
    """:class:`DmeError` 0501 or 0507 for a command that is not in the table, and what its signature refuses."""
    if call.name not in COMMANDS:
        raise DmeError(501 if call.name in ELSEWHERE else 507, call.name)
    COMMANDS[call.name].check(call, tag)
