"""From recordings in files to diagnoses in folders: all of one machine together, or each separately in processes."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from stepgauge.diagnosis.engine import diagnose
from stepgauge.diagnosis.priors import Priors
from stepgauge.diagnosis.result import FILE, Diagnosis
from stepgauge.errors import InputError, naming
from stepgauge.executors.processes import InProcess, Processes
from stepgauge.executors.run import run
from stepgauge.files.outputs import one_set, refuse_own
from stepgauge.gauge.certified import Gauge, read_gauge
from stepgauge.machine.file import Machine, read_machine
from stepgauge.machine.styli import add_styli, numbered
from stepgauge.recording import Recording, join_recordings, read_recording
from stepgauge.recording.rows import check_seeds


@dataclass(frozen=True)
class Outcome:
    """Result of one diagnosis: its name, the verdict in a line, what to do first, and the files written (none where it
    failed)."""

    name: str
    summary: str
    files: tuple[Path, ...] = ()
    first: tuple[str, ...] = ()


@dataclass
class Separately:
    """Recordings that are to be diagnosed each by itself: :meth:`write` does it, in processes, into a folder for each.

    ``of_axis`` diagnoses one without a gauge; ``known``: files of gauge and machine of the others.
    """

    paths: Sequence[str]
    of_axis: Callable[[str], Any] | None
    known: tuple[str, str] = ("", "")
    styli: tuple[str, ...] = ()
    jobs: int | None = 1
    without: tuple[str, ...] = ()
    priors: Priors | None = None
    kind: str | None = None
    outcomes: list[Outcome] = field(default_factory=list)

    @property
    def left_out(self) -> tuple[str, ...]:
        """Those that could not be diagnosed, with the reason."""
        return tuple(f"{one.name}: {one.summary}" for one in self.outcomes if not one.files)

    def summary(self) -> str:
        """The verdict of each."""
        return "\n".join(f"{one.name}: {one.summary}" for one in self.outcomes if one.files)

    def write(self, folder: str | Path, figure: str = "png") -> list[Path]:
        """Diagnose and write all; returns the paths."""
        if self.of_axis is None:
            given = (
                self.paths,
                *self.known,
                folder,
                self.jobs,
                figure,
                self.without,
                self.priors,
                self.styli,
                self.kind,
            )
            self.outcomes = list(diagnose_each(*given))
        else:
            self.outcomes = [self._axis(path, Path(folder) / Path(path).stem, figure) for path in self.paths]
        return [path for one in self.outcomes for path in one.files]

    def _axis(self, path: str, folder: Path, figure: str) -> Outcome:
        assert self.of_axis is not None
        refuse_own(folder / FILE)
        found = self.of_axis(path)
        with one_set():
            files = found.write(folder, figure)
        return Outcome(folder.name, found.summary(), tuple(files))


def diagnose_each(
    paths: Sequence[str],
    gauge: str,
    machine: str,
    folder: str | Path,
    jobs: int | None = None,
    suffix: str = "png",
    without: Collection[str] = (),
    priors: Priors | None = None,
    styli: Sequence[str] = (),
    kind: str | None = None,
) -> Iterator[Outcome]:
    """Diagnose recordings one by one into folders named after their files, in the order given.

    All files are read and checked before the first diagnosis begins; a recording of another gauge, or one that is too
    small, gives an outcome without files and does not stop the others.

    Parameters
    ----------
    paths : recording files; their names without the suffix must differ
    gauge, machine : files, or names of shipped ones
    folder : for one folder per recording
    jobs : processes; by default as many as there are processors
    suffix : format of the figures
    without : kinds of effects that are no candidates
    priors : the table of priors, the shipped one by default
    styli : machine files with further styli
    kind : of the machine, in place of that in its file

    Raises
    ------
    InputError
        wrong files, equal names, folders with somebody's own files of the names that are written
    """
    _check_names(paths)
    for path in paths:
        refuse_own(Path(folder) / Path(path).stem / FILE)
    steps, cmm = read_gauge(gauge), add_styli(read_machine(machine), map(read_machine, styli))
    recordings = [read_recording(path) for path in paths]
    how = (steps, cmm, Path(folder), suffix, without, priors, kind)
    count = min(jobs or os.cpu_count() or 1, len(recordings))
    tasks = [(Path(recording.path).stem, recording) for recording in recordings]
    done = run(partial(_one, how=how), tasks, InProcess() if count == 1 else Processes(count))
    return (each.value or Outcome(each.key, f"error: {each.error}") for each in done)


How = tuple[Gauge, Machine, Path, str, Collection[str], Priors | None, str | None]
"""Gauge, machine, folder, format of the figures, excluded kinds of effects, priors, kind of machine."""


def _one(recording: Recording, how: How) -> Outcome:
    """One of several: its files are in place before the next one begins."""
    name = Path(recording.path).stem
    try:
        with one_set():
            return _diagnose(recording, name, how)
    except InputError as error:
        return Outcome(name, f"error: {error.cli_text()}")


def _diagnose(recording: Recording, name: str, how: How) -> Outcome:
    gauge, machine, folder, suffix, without, priors, kind = how
    recordings, whole = join_stylus_recordings([recording], machine)
    found = replace(diagnose(whole, gauge, machine, without, priors, kind=kind), recordings=tuple(recordings))
    files = tuple(found.write(folder / name, suffix))
    return Outcome(name, found.summary(), files, tuple(_first(files[0])))


def join_stylus_recordings(recordings: Sequence[Recording], machine: Machine) -> tuple[list[Recording], Recording]:
    """The recordings with the numbers of their styli, and all of them as one.

    :class:`InputError` where one was made with another tip, or where two share the random numbers of a simulation.
    """
    check_seeds(recordings)
    told = [numbered(one, machine) for one in recordings]
    return told, told[0] if len(told) == 1 else join_recordings(told)


def _first(path: Path) -> list[str]:
    """What to do first, from the ``diagnosis.json`` that was written."""
    from stepgauge.reports.diagnosis import first_of

    return first_of(Diagnosis.read(path).contents)


def _check_names(paths: Sequence[str]) -> None:
    name, count = Counter(Path(path).stem for path in paths).most_common(1)[0]
    if count > 1:
        raise InputError(
            next(path for path in paths if Path(path).stem == name),
            f"{count} recordings would be diagnosed into the same folder {name!r}",
            expected=naming("each", words="files of different names with {}"),
        )
