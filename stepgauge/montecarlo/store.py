"""The values of all runs while they come in: in memory, or in a folder from which an interrupted run goes on."""

from __future__ import annotations

import hashlib
import json
import shutil
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stepgauge.errors import InputError
from stepgauge.files.arrays import Array
from stepgauge.files.text import write_text

_VALUES, _SUMS, _STATE = "values.f64", "blocks.sha256", "state.json"
_SIZE = hashlib.sha256().digest_size


@dataclass
class Store:
    """``values (rows, quantities)``; ``sums (blocks, 32)``: checksums of those that are done, else zeros.

    With a folder both are files mapped into memory.
    """

    values: Array
    sums: NDArray[np.uint8]
    folder: Path | None = None

    def put(self, block: int, rows: slice, values: Array) -> None:
        """Keep a block; it counts as done only after its values are in place."""
        self.values[rows] = values
        self.sums[block] = _checksum(values)

    def is_done(self, block: int, rows: slice) -> bool:
        """Whether its values are there as they were put; those that were damaged meanwhile are computed again."""
        return bool(self.sums[block].any() and (self.sums[block] == _checksum(self.values[rows])).all())

    def flush(self) -> None:
        """Write to the disk what is only in memory."""
        for array in (self.values, self.sums):
            if isinstance(array, np.memmap):
                array.flush()

    def discard(self) -> None:
        """Remove the folder: the results are elsewhere now."""
        if self.folder is not None:
            shutil.rmtree(self.folder, ignore_errors=True)


def open_store(folder: Path | None, fingerprint: str, rows: int, quantities: int, blocks: int) -> Store:
    """A store for one computation; one of the same fingerprint in the folder is continued, another one replaced."""
    if folder is None:
        return Store(np.empty((rows, quantities)), np.zeros((blocks, _SIZE), np.uint8))
    state = json.dumps({"fingerprint": fingerprint, "rows": rows, "quantities": quantities, "blocks": blocks})
    known = (folder / _STATE).is_file() and (folder / _STATE).read_text(encoding="utf-8") == state
    try:
        if not known:
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir(parents=True)
        mode = "r+" if known else "w+"
        values = np.memmap(folder / _VALUES, np.float64, mode, shape=(rows, quantities))  # type: ignore[call-overload]
        sums = np.memmap(folder / _SUMS, np.uint8, mode, shape=(blocks, _SIZE))  # type: ignore[call-overload]
        if not known:
            write_text(folder / _STATE, state, at_once=True)  # last: a folder without it is begun anew
    except (OSError, InputError) as error:
        if not known:
            shutil.rmtree(folder, ignore_errors=True)
        why = error.strerror or error if isinstance(error, OSError) else error.what
        raise InputError(folder, f"cannot keep the runs here: {why}") from None
    return Store(values, sums, folder)


def _checksum(values: Array) -> NDArray[np.uint8]:
    return np.frombuffer(hashlib.sha256(np.ascontiguousarray(values, float).tobytes()).digest(), np.uint8)
