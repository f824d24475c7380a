"""A controller's log before it is known what its points are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class ProbeLog:
    """Rows of a log in the order in which they stand there.

    Parameters
    ----------
    path : the file, for messages
    form : what kind of log it is, in words
    position_mm : tip centres at the trigger, shape ``(n, 3)``, in the coordinates of the program
    line : line of the file of each row, shape ``(n,)``
    number : the point's number in the program, counted from 1, shape ``(n,)``; None where the log does not state it
    success : whether the controller saw a contact, shape ``(n,)``; None where the log does not state it
    skips_repeats : the controller leaves out a point that is identical to the one before
    time_s : when the points were logged, by the controller's clock, shape ``(n,)``; None where the log has no time
    dropped : how many lines were no points (blank lines and comments)
    """

    path: str
    form: str
    position_mm: NDArray[np.float64]
    line: NDArray[np.int64]
    number: NDArray[np.int64] | None = None
    success: NDArray[np.bool_] | None = None
    skips_repeats: bool = False
    time_s: NDArray[np.float64] | None = None
    dropped: int = 0

    def __len__(self) -> int:
        return len(self.position_mm)

    def at(self, row: int) -> str:
        """``file:line`` of a row (counted from 0)."""
        return f"{self.path}:{self.line[row]}"
