"""The values of all runs while they come in: in memory, or in a folder from which an interrupted run goes on."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError
from stepgauge.files.text import write_text

Array = NDArray[np.float64]
_VALUES, _DONE, _STATE = "values.f64", "done.u8", "state.json"


@dataclass
class Store:
    """``values (rows, quantities)`` and ``done (blocks,)``; with a folder both are files mapped into memory."""

    values: Array
    done: NDArray[np.uint8]
    folder: Path | None = None

    def put(self, block: int, rows: slice, values: Array) -> None:
        """Keep a block; it counts as done only after its values are in place."""
        self.values[rows] = values
        self.done[block] = 1

    def missing(self) -> Iterator[int]:
        """Blocks still to be computed."""
        return (int(block) for block in np.flatnonzero(self.done == 0))

    def flush(self) -> None:
        """Write to the disk what is only in memory."""
        for array in (self.values, self.done):
            if isinstance(array, np.memmap):
                array.flush()

    def discard(self) -> None:
        """Remove the folder: the results are elsewhere now."""
        if self.folder is not None:
            shutil.rmtree(self.folder, ignore_errors=True)


def open_store(folder: Path | None, fingerprint: str, rows: int, quantities: int, blocks: int) -> Store:
    """A store for one computation; one of the same fingerprint in the folder is continued, another one replaced."""
    if folder is None:
        return Store(np.empty((rows, quantities)), np.zeros(blocks, np.uint8))
    state = json.dumps({"fingerprint": fingerprint, "rows": rows, "quantities": quantities, "blocks": blocks})
    known = (folder / _STATE).is_file() and (folder / _STATE).read_text(encoding="utf-8") == state
    try:
        if not known:
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir(parents=True)
        mode = "r+" if known else "w+"
        values = np.memmap(folder / _VALUES, np.float64, mode, shape=(rows, quantities))  # type: ignore[call-overload]
        done = np.memmap(folder / _DONE, np.uint8, mode, shape=(blocks,))  # type: ignore[call-overload]
        if not known:
            write_text(folder / _STATE, state, at_once=True)  # last: a folder without it is begun anew
    except (OSError, InputError) as error:
        if not known:
            shutil.rmtree(folder, ignore_errors=True)
        why = error.strerror or error if isinstance(error, OSError) else error.what
        raise InputError(folder, f"cannot keep the runs here: {why}") from None
    return Store(values, done, folder)
