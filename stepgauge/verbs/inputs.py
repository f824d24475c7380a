"""Files or objects: what a public function takes as either, read where it is a file."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

from stepgauge.errors import InputError, naming
from stepgauge.gauge.certified import Gauge, read_gauge
from stepgauge.gauge.placement import Placement, read_placement
from stepgauge.planning.plan import parse_block_list, parse_blocks

if TYPE_CHECKING:
    import pandas as pd

    from stepgauge.axis.recording import AxisRecording
    from stepgauge.evaluation.evaluate import Evaluation
    from stepgauge.machine.file import Machine
    from stepgauge.machine.virtual import Run
    from stepgauge.motion.moves import Program
    from stepgauge.recording import Recording

File = str | Path
Blocks = str | Sequence[int] | None
"""First and last block, ``"1:21"`` or ``(1, 21)``; None: all, or what was measured."""
T = TypeVar("T")


def resolve_gauge(gauge: File | Gauge) -> Gauge:
    """A gauge, or the one of a file or shipped name."""
    return read_gauge(gauge) if isinstance(gauge, File) else require_kind(gauge, Gauge, "gauge")


def resolve_machine(machine: File | Machine) -> Machine:
    """A machine, or the one of a file or shipped name."""
    from stepgauge.machine.file import Machine, read_machine

    return read_machine(machine) if isinstance(machine, File) else require_kind(machine, Machine, "machine")


def resolve_machine_with_styli(machine: File | Machine, styli: File | Machine | Iterable[File | Machine]) -> Machine:
    """A machine with its further styli, each by a machine file that differs in the stylus only."""
    from stepgauge.machine.styli import add_styli

    return add_styli(resolve_machine(machine), map(resolve_machine, several(styli)))


def moves_of_plan(plan: object) -> Program:
    """The moves of a plan; :class:`InputError` for anything else."""
    from stepgauge.planning.planned import Plan  # with all that plans, which a program's text does not need

    return require_kind(plan, Plan, "program").program


def resolve_placement(placement: File | Placement, gauge: Gauge) -> Placement:
    """A placement, or the one of a file, checked against its gauge."""
    if isinstance(placement, File):
        return read_placement(placement, gauge)
    return require_kind(placement, Placement, "placement")


def resolve_placements(placements: File | Placement | Iterable[File | Placement], gauge: Gauge) -> list[Placement]:
    """One placement or several, in order."""
    return [resolve_placement(one, gauge) for one in several(placements)]


def resolve_recordings(
    recordings: File | Recording | Run | pd.DataFrame | Iterable[File | Recording | Run | pd.DataFrame],
) -> list[Recording]:
    """Recordings, runs of the virtual CMM, tables or files, one or several."""
    from stepgauge.axis.recording import AxisRecording
    from stepgauge.recording import Recording, no_gauge, read_recording, recording_of_frame

    def one(given: File | Recording | Run | pd.DataFrame) -> Recording:
        if isinstance(given, File):
            return read_recording(given)
        if hasattr(given, "columns") and not isinstance(given, Recording) and hasattr(given, "iloc"):
            return recording_of_frame(cast("pd.DataFrame", given))
        if isinstance(given, AxisRecording):
            raise no_gauge(given.path or "recording", given.form)
        return require_kind(getattr(given, "recording", given), Recording, "recording")

    found = [one(given) for given in several(recordings)]
    if not found:
        raise InputError("recordings", "there is none", expected="one recording or more")
    return found


def joined_recordings(recordings: Any, convention: str | None = None, machine: Machine | None = None) -> Recording:
    """One recording of all that are given, several as several placements, with what is stated beside each."""
    from stepgauge.recording import join_recordings
    from stepgauge.recording.conventions import complete_by_machine, state_convention

    found = [state_convention(one, convention) for one in resolve_recordings(recordings)]
    tables = [complete_by_machine(one, machine.table if machine else None) for one in found]
    return tables[0] if len(tables) == 1 else join_recordings(tables)


def resolve_axis(given: File | AxisRecording | pd.DataFrame) -> AxisRecording:
    """A recording of an axis, a spot or distances, or that of a file or a table."""
    from stepgauge.axis.recording import AxisRecording, axis_recording_of_frame, read_axis_recording

    if isinstance(given, File):
        return read_axis_recording(given)
    if not isinstance(given, AxisRecording) and hasattr(given, "iloc"):
        return axis_recording_of_frame(given)
    return require_kind(given, AxisRecording, "recording")


def are_of_axis(given: Iterable[object]) -> bool:
    """Whether all recordings are of an axis, a spot or distances; some beside those of a gauge are a mistake."""
    given = list(given)
    if not given:
        raise InputError(naming("recordings"), "there is none", expected="one recording or more")
    found = [_is_of_axis(one) for one in given]
    if any(found) and not all(found):
        one = given[found.index(True)]
        where = one if isinstance(one, str | Path) else getattr(one, "path", "") or "recordings"
        raise InputError(where, "this is of one axis, the others are of a gauge", expected="recordings of one kind")
    return all(found)


def _is_of_axis(one: object) -> bool:
    from stepgauge.axis.recording import FORM, FORMS, AxisRecording, is_axis_recording
    from stepgauge.recording import POSITION

    if isinstance(one, File):
        return is_axis_recording(one)
    columns = getattr(one, "columns", None) if hasattr(one, "iloc") else None
    if columns is not None and FORM not in one.attrs and not set(POSITION) & set(map(str, columns)):  # type: ignore[attr-defined]
        found, expected = (
            ", ".join(map(str, columns)),
            "what import_recording(table, ..) makes of it: with sensor of an axis, else with gauge and placement",
        )
        raise InputError(naming("recordings"), "a table that is no recording", found=found, expected=expected)
    return isinstance(one, AxisRecording) or getattr(one, "attrs", {}).get(FORM) in FORMS


def stated_together(name: str, value: object, other: str, beside: object, both: bool = False) -> None:
    """:class:`InputError` where an argument lacks the one that it needs (``both``: they need each other)."""
    if value is not None and beside is None:
        raise InputError(naming(name), naming(other, words="needs {}"))
    if both and beside is not None and value is None:
        raise InputError(naming(other), naming(name, words="needs {}"))


def resolve_sources(sources: Any) -> list[File | Recording]:
    """Recordings or a program: files stay files, for a program is known by its text."""
    return [one if isinstance(one, File) else resolve_recordings(one)[0] for one in several(sources)]


def stored_evaluation(evaluation: File | Evaluation) -> tuple[dict[str, Any], File]:
    """The content of an ``evaluation.json``, and its path for messages."""
    from stepgauge.axis.recording import AxisRecording
    from stepgauge.evaluation.evaluate import Evaluation
    from stepgauge.evaluation.files import evaluation_to_dict
    from stepgauge.recording import no_gauge
    from stepgauge.reports.reading import find_evaluation, read_checked_evaluation

    if isinstance(evaluation, File):
        return read_checked_evaluation(evaluation), find_evaluation(evaluation)
    if isinstance(evaluation, AxisRecording):
        raise no_gauge(evaluation.path or "evaluation", evaluation.form)
    return evaluation_to_dict(require_kind(evaluation, Evaluation, "evaluation")), "evaluation"


def resolve_blocks(blocks: Blocks, gauge: Gauge) -> tuple[int, int] | None:
    """First and last block of a section of the gauge; None where nobody stated one."""
    if blocks is None or isinstance(blocks, str):
        return parse_blocks(blocks, gauge) if blocks else None
    return parse_blocks(":".join(str(block) for block in blocks), gauge)


def resolve_block_list(blocks: Blocks, gauge: Gauge) -> tuple[tuple[int, int], tuple[int, ...] | None]:
    """The section, and the blocks in it that are measured (None: all), of a range ``"1:21"`` or a list ``"1,2,13"``."""
    if (isinstance(blocks, str) and "," not in blocks) or blocks is None:
        return parse_blocks(blocks or ":", gauge), None
    if not isinstance(blocks, str) and len(blocks) == 2:
        return parse_blocks(f"{blocks[0]}:{blocks[1]}", gauge), None
    only = parse_block_list(blocks if isinstance(blocks, str) else ",".join(map(str, blocks)), gauge)
    return (only[0], only[-1]), only


def several(given: Any) -> list[Any]:
    """What is given once or several times, as a list."""
    return list(given) if isinstance(given, list | tuple) else [given]


def require_kind(given: object, kind: type[T], name: str) -> T:
    """What is given, where it is of the kind that ``name`` says (:class:`InputError` if not)."""
    if not isinstance(given, kind):
        expected = f"{kind.__name__}, or its file"
        raise InputError(naming(name), f"this is no {name}", found=type(given).__name__, expected=expected)
    return given


def one_of(name: str, given: str, choices: Iterable[str]) -> str:
    """A choice by its name (:class:`InputError` where it is none)."""
    if given not in choices:
        raise InputError(naming(name), "not a choice", found=repr(given), expected=", ".join(choices))
    return given
