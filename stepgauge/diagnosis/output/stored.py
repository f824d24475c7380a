"""A diagnosis read back from its file: what was said of a gauge on a machine, of an axis, or of the map of a probe."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import pandas as pd

from stepgauge.diagnosis.output.files import checksum
from stepgauge.diagnosis.output.summary import numbers_of, stored_line
from stepgauge.errors import InputError
from stepgauge.files.shown import Shown, as_lines
from stepgauge.files.text import in_folder, read_result, result_text, write_text

FILE = "diagnosis.json"
NEEDED = ("verdict", "effects", "unexplained", "fit", "inputs")
"""Keys that every diagnosis has."""


@dataclass(frozen=True)
class StoredDiagnosis(Shown):
    """``data``: all that ``diagnosis.json`` states, in JSON types; the readings are in the recordings that it names."""

    drawn_by: ClassVar[str] = "diagnosis.draw_probabilities"
    data: Mapping[str, Any] = field(repr=False)
    path: str = ""

    @property
    def verdict(self) -> str:
        """``adequate``, ``effects``, ``unknown`` or ``insufficient``."""
        return str(self.data["verdict"])

    def summary(self) -> str:
        """Verdict, effects and fit in a line."""
        return as_lines(stored_line(self.data))

    def to_frame(self) -> pd.DataFrame:
        """One row per number of an effect: its probability, value, standard uncertainty u, and the unit."""
        return numbers_of(self.data)

    def write(self, folder: str | Path) -> Path:
        """Write ``diagnosis.json`` into a folder, as it was read; returns its path."""
        path = Path(folder) / FILE
        write_text(path, result_text(self.data))
        return path

    def changed(self) -> list[str]:
        """Files that it was made from which are there, but are not as they were."""
        return [path for path, known in _files(self.data["inputs"]) if Path(path).is_file() and checksum(path) != known]


def read_diagnosis(path: str | Path) -> StoredDiagnosis:
    """Read a diagnosis of any kind, by its folder or its ``diagnosis.json``.

    Raises
    ------
    InputError
        a file that is no diagnosis
    """
    file = in_folder(path, FILE)
    data = read_result(file, "diagnosis", with_inputs=False)
    if not all(key in data for key in NEEDED):
        raise InputError(file, "not a complete diagnosis", expected="diagnosis.json of stepgauge diagnose")
    return StoredDiagnosis(data, str(file))


def _files(inputs: Any) -> Iterator[tuple[str, str]]:
    """Paths with the checksums that they had."""
    if isinstance(inputs, dict) and inputs.get("path") and inputs.get("sha256"):
        yield str(inputs["path"]), str(inputs["sha256"])
    for one in inputs.values() if isinstance(inputs, dict) else inputs if isinstance(inputs, list) else ():
        yield from _files(one)
