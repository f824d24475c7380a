"""Recordings in files that are diagnosed each by itself, in processes, into a folder for each."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from stepgauge.diagnosis.result import FILE, Diagnosis
from stepgauge.errors import InputError, naming
from stepgauge.executors.processes import InProcess, Processes
from stepgauge.executors.run import run
from stepgauge.files.outputs import one_set, refuse_own
from stepgauge.machine.file import Machine
from stepgauge.machine.styli import numbered
from stepgauge.recording import Recording, join_recordings
from stepgauge.recording.conventions import complete_by_machine
from stepgauge.recording.rows import check_seeds


@dataclass(frozen=True)
class Outcome:
    """Result of one diagnosis: its name, the verdict in a line, and the files written (none where it failed)."""

    name: str
    summary: str
    files: tuple[Path, ...] = ()


@dataclass
class Separately:
    """Recordings that are to be diagnosed each by itself: :meth:`write` does it.

    ``diagnose``: the diagnosis of one, by its path; ``jobs``: processes, None for as many as there are processors.
    """

    paths: Sequence[str]
    diagnose: Callable[[str], Diagnosis]
    jobs: int | None = 1
    outcomes: list[Outcome] = field(default_factory=list)

    @property
    def left_out(self) -> tuple[str, ...]:
        """Those that could not be diagnosed, with the reason."""
        return tuple(f"{one.name}: {one.summary}" for one in self.outcomes if not one.files)

    def summary(self) -> str:
        """The verdict of each."""
        return "\n".join(f"{one.name}: {one.summary}" for one in self.outcomes if one.files)

    def write(self, folder: str | Path, figure: str = "png") -> list[Path]:
        """Diagnose and write all into folders named after their files; returns the paths.

        A recording that cannot be diagnosed does not stop the others. :class:`InputError` for equal names, and for
        folders with somebody's own files of the names that are written.
        """
        _check_names(self.paths)
        for path in self.paths:
            refuse_own(Path(folder) / Path(path).stem / FILE)
        one = partial(_write_one, diagnose=self.diagnose, folder=Path(folder), figure=figure)
        count = min(self.jobs or os.cpu_count() or 1, len(self.paths))
        tasks = [(Path(path).stem, path) for path in self.paths]
        done = run(one, tasks, InProcess() if count == 1 else Processes(count))
        self.outcomes = [each.value or Outcome(each.key, f"error: {each.error}") for each in done]
        return [path for one in self.outcomes for path in one.files]


def _write_one(path: str, diagnose: Callable[[str], Diagnosis], folder: Path, figure: str) -> Outcome:
    """One of several: its files are in place before the next one begins."""
    name = Path(path).stem
    try:
        with one_set():
            found = diagnose(path)
            return Outcome(name, found.summary(), tuple(found.write(folder / name, figure)))
    except InputError as error:
        return Outcome(name, f"error: {error.cli_text()}")


def join_stylus_recordings(recordings: Sequence[Recording], machine: Machine) -> tuple[list[Recording], Recording]:
    """The recordings with the numbers of their styli, and all of them as one.

    :class:`InputError` where one was made with another tip, or where two share the random numbers of a simulation.
    """
    check_seeds(recordings)
    told = [complete_by_machine(numbered(one, machine), machine.table) for one in recordings]
    return told, told[0] if len(told) == 1 else join_recordings(told)


def _check_names(paths: Sequence[str]) -> None:
    name, count = Counter(Path(path).stem for path in paths).most_common(1)[0]
    if count > 1:
        raise InputError(
            next(path for path in paths if Path(path).stem == name),
            f"{count} recordings would be diagnosed into the same folder {name!r}",
            expected=naming("each", words="files of different names with {}"),
        )
