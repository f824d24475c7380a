"""Errors of I++ DME 1.4.3: numbers, default severities and texts, as the specification fixes them."""

from __future__ import annotations

from typing import NamedTuple

ABORTING = 2
"""From this severity on all waiting commands are aborted, and the errors must be cleared before others are accepted."""


class Code(NamedTuple):
    """An error of the standard. Severities: 0 information, 1 warning, 2 error, 3 critical, 9 fatal."""

    severity: int
    text: str


CODES = {
    0: Code(0, "Buffer full"),
    1: Code(2, "Illegal tag"),
    2: Code(2, "No space at pos. 6"),
    6: Code(2, "Transaction aborted (Use ClearAllErrors To Continue)"),
    7: Code(3, "Illegal character"),
    8: Code(3, "Protocol error"),
    500: Code(3, "Emergency stop"),
    501: Code(3, "Unsupported command"),
    502: Code(3, "Incorrect arguments"),
    503: Code(9, "Controller communications failure"),
    504: Code(1, "Argument out of range"),
    505: Code(3, "Argument not recognized"),
    506: Code(3, "Argument not supported"),
    507: Code(3, "Illegal command"),
    508: Code(3, "Bad context"),
    509: Code(3, "Bad argument"),
    510: Code(3, "Bad property"),
    511: Code(3, "Error processing method"),
    512: Code(1, "No daemons are active"),
    513: Code(2, "Daemon does not exist"),
    514: Code(2, "Use ClearAllErrors to continue"),
    515: Code(2, "Daemon already exists"),
    1000: Code(3, "Machine in error state"),
    1001: Code(2, "Illegal touch"),
    1002: Code(9, "Axis does not exist"),
    1003: Code(2, "No touch"),
    1004: Code(9, "Number of angles not supported on current device"),
    1005: Code(3, "Error during home"),
    1006: Code(2, "Surface not found"),
    1007: Code(3, "Theta out of range"),
    1008: Code(3, "Target position out of machine volume"),
    1009: Code(3, "Air pressure out of range"),
    1010: Code(2, "Vector has no norm"),
    1011: Code(2, "Unable to move"),
    1012: Code(2, "Bad lock combinations"),
    1500: Code(3, "Failed to re-seat head"),
    1501: Code(3, "Probe not armed"),
    1502: Code(3, "Tool not found"),
    1503: Code(3, "Tool not defined"),
    2000: Code(3, "Tool not calibrated"),
    2001: Code(2, "Head error excessive force"),
    2002: Code(3, "Type of probe does not allow this operation"),
    2500: Code(3, "Machine limit encountered [Move Out Of Limits]"),
    2501: Code(3, "Axis not active"),
    2502: Code(3, "Axis position error"),
    2503: Code(9, "Scale read head failure"),
    2504: Code(3, "Collision"),
    2505: Code(2, "Specified angle out of range"),
    2506: Code(3, "Part not aligned"),
}


class DmeError(Exception):
    """An error as a server answers it.

    Parameters
    ----------
    number : of the standard's table, or one of the server's own (8000 to 8999)
    method : the command that failed
    severity, text : as the server gives them; those of the table by default
    detail : what was found, in words; not part of the answer, whose texts are fixed
    """

    def __init__(
        self, number: int, method: str = "", severity: int | None = None, text: str | None = None, detail: str = ""
    ) -> None:
        known = CODES.get(number, Code(3, "Unknown error"))
        self.number, self.method, self.detail = number, method, detail
        self.severity = known.severity if severity is None else severity
        self.text = known.text if text is None else text
        super().__init__(f"{number:04d} {self.text}")

    @property
    def aborts(self) -> bool:
        """Whether the commands that wait are aborted."""
        return self.severity >= ABORTING

    def line(self) -> str:
        """What stands after the tag: ``! Error(3, 0500, "GoTo", "Emergency stop")``."""
        return f'! Error({self.severity}, {self.number:04d}, "{self.method}", "{self.text}")'
