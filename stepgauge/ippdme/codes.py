"""Errors of I++ DME 1.4.3: numbers, default severities and texts, as the specification fixes them."""

from __future__ import annotations

from typing import NamedTuple

ABORTING = 2
"""From this severity on all waiting commands are aborted, and the errors must be cleared before others are accepted."""


class ErrorCode(NamedTuple):
    """An error of the standard. Severities: 0 information, 1 warning, 2 error, 3 critical, 9 fatal."""

    severity: int
    text: str


CODES = {
    0: ErrorCode(0, "Buffer full"),
    1: ErrorCode(2, "Illegal tag"),
    2: ErrorCode(2, "No space at pos. 6"),
    6: ErrorCode(2, "Transaction aborted (Use ClearAllErrors To Continue)"),
    7: ErrorCode(3, "Illegal character"),
    8: ErrorCode(3, "Protocol error"),
    500: ErrorCode(3, "Emergency stop"),
    501: ErrorCode(3, "Unsupported command"),
    502: ErrorCode(3, "Incorrect arguments"),
    503: ErrorCode(9, "Controller communications failure"),
    504: ErrorCode(1, "Argument out of range"),
    505: ErrorCode(3, "Argument not recognized"),
    506: ErrorCode(3, "Argument not supported"),
    507: ErrorCode(3, "Illegal command"),
    508: ErrorCode(3, "Bad context"),
    509: ErrorCode(3, "Bad argument"),
    510: ErrorCode(3, "Bad property"),
    511: ErrorCode(3, "Error processing method"),
    512: ErrorCode(1, "No daemons are active"),
    513: ErrorCode(2, "Daemon does not exist"),
    514: ErrorCode(2, "Use ClearAllErrors to continue"),
    515: ErrorCode(2, "Daemon already exists"),
    1000: ErrorCode(3, "Machine in error state"),
    1001: ErrorCode(2, "Illegal touch"),
    1002: ErrorCode(9, "Axis does not exist"),
    1003: ErrorCode(2, "No touch"),
    1004: ErrorCode(9, "Number of angles not supported on current device"),
    1005: ErrorCode(3, "Error during home"),
    1006: ErrorCode(2, "Surface not found"),
    1007: ErrorCode(3, "Theta out of range"),
    1008: ErrorCode(3, "Target position out of machine volume"),
    1009: ErrorCode(3, "Air pressure out of range"),
    1010: ErrorCode(2, "Vector has no norm"),
    1011: ErrorCode(2, "Unable to move"),
    1012: ErrorCode(2, "Bad lock combinations"),
    1500: ErrorCode(3, "Failed to re-seat head"),
    1501: ErrorCode(3, "Probe not armed"),
    1502: ErrorCode(3, "Tool not found"),
    1503: ErrorCode(3, "Tool not defined"),
    2000: ErrorCode(3, "Tool not calibrated"),
    2001: ErrorCode(2, "Head error excessive force"),
    2002: ErrorCode(3, "Type of probe does not allow this operation"),
    2500: ErrorCode(3, "Machine limit encountered [Move Out Of Limits]"),
    2501: ErrorCode(3, "Axis not active"),
    2502: ErrorCode(3, "Axis position error"),
    2503: ErrorCode(9, "Scale read head failure"),
    2504: ErrorCode(3, "Collision"),
    2505: ErrorCode(2, "Specified angle out of range"),
    2506: ErrorCode(3, "Part not aligned"),
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
        known = CODES.get(number, ErrorCode(3, "Unknown error"))
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
