"""What a project has, what is wrong with it or older than what it was made from, and what to do next."""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from stepgauge.axis.recording import LONGEST_COMMENT, is_axis_recording, read_axis_recording
from stepgauge.conditions import stored_conditions
from stepgauge.diagnosis.result import Diagnosis
from stepgauge.errors import InputError
from stepgauge.files.checksum import file_digest
from stepgauge.files.notation import counted
from stepgauge.files.text import read_result
from stepgauge.gauge.certified import Gauge, read_gauge
from stepgauge.gauge.placement import Placement, read_placement
from stepgauge.machine.file import read_machine
from stepgauge.project.create import OUTPUTS, RECORDINGS, RESULTS, program_suffix
from stepgauge.project.file import Project, lacking, stated_file
from stepgauge.recording import read_recording
from stepgauge.recording.columns import REQUIRED
from stepgauge.recording.simulated import is_simulated
from stepgauge.standards.budget_given import check_given

MOST = 1000
"""Recordings and results that are looked at; more belong into a store."""
RESULT_KINDS = ("evaluation", "budget", "diagnosis")
_REASONS = {
    "evaluation": ("evaluate", "find the errors of the machine"),
    "budget": ("budget", "state the uncertainty of these errors"),
    "diagnosis": ("diagnose", "find what the machine file does not explain"),
}
"""The verb that makes each of them of a recording, and why."""
_REASON_OF_AXIS = "find what explains its deviations"


@dataclass(frozen=True)
class ProjectItem:
    """One thing of a project: what it is, its path as typed, what is in it; ``wrong``: it cannot be used.

    ``files``: SHA-256 of a recording, and of all files that a result was made from; ``of_axis``: it has no gauge;
    ``lacking``: what nothing can be decided without, each with how it is stated.
    """

    what: str
    path: str
    said: str
    wrong: bool = False
    files: frozenset[str] = frozenset()
    of_axis: bool = False
    lacking: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Status:
    """What is there, and the next command with the reason for it; ``step``: what is next, in a word; ``lacking``: see
    :class:`ProjectItem`."""

    items: tuple[ProjectItem, ...]
    step: str
    command: str
    reason: str
    place: str = ""
    lacking: tuple[tuple[str, str], ...] = ()

    def summary(self) -> str:
        """A line or two for each thing, then the next command."""
        lines = [f"project     {self.place}"]
        lines += [f"{one.what:11} {one.path}\n{'':11} {'! ' if one.wrong else ''}{one.said}" for one in self.items]
        reason = ": ".join(filter(None, (self.reason, "; ".join(how for _, how in self.lacking))))
        return "\n".join([*lines, f"next        {self.command}\n{'':11} {reason}"])


def project_status(project: Project) -> Status:
    """Read what the project names and what lies in its folders; nothing is raised for what is wrong with a file."""
    items = [_named(project, "gauge", _gauge_words), _named(project, "machine", _machine_words)]
    gauge = None if items[0].wrong else read_gauge(stated_file(project, "gauge"))
    items.append(_placement(project, gauge))
    items += [
        ProjectItem("project", str(project.path), error.cli_text(), wrong=True) for error in _lacking(project, items[2])
    ]
    recordings = list(_recordings(project))
    results = list(_results(project))
    reports = list(_reports(project))
    found = (*items, *recordings, *results, *reports)
    step, command, reason, lacking = _next(project, items, recordings, results)
    return Status(found, step, command, reason, os.path.relpath(project.path), lacking)


def _lacking(project: Project, placement: ProjectItem) -> list[InputError]:
    """Files that the project states and has not; that ``locate`` has not written its own yet is said already."""
    return [
        one for one in lacking(project) if not (placement.wrong and project.place(str(one.found)) == placement.path)
    ]


def _named(project: Project, key: str, words: Callable[[str], str]) -> ProjectItem:
    try:
        path = stated_file(project, key)
        return ProjectItem(key, path, words(path))
    except InputError as error:
        return ProjectItem(key, str(project.values.get(key, "")), error.cli_text(), wrong=True)


def _gauge_words(path: str) -> str:
    gauge = read_gauge(path)
    stated = gauge.certificate
    return f"{gauge.table.name}, serial number {gauge.table.serial}; certificate {stated.number} of {stated.date}"


def _machine_words(path: str) -> str:
    machine = read_machine(path)
    return f"{machine.table.name}; {len(machine.effects)} systematic effects stated"


def _placement(project: Project, gauge: Gauge | None) -> ProjectItem:
    value = project.values.get("placement", OUTPUTS["locate"])
    path = project.place(value) if isinstance(value, str) else str(value)
    if not isinstance(value, str) or not Path(path).exists():
        return ProjectItem("placement", path, "not there yet", wrong=True)
    if gauge is None:
        return ProjectItem("placement", path, "not read: there is no gauge", wrong=True)
    try:
        return ProjectItem("placement", path, _placement_words(read_placement(path, gauge)))
    except InputError as error:
        return ProjectItem("placement", path, error.cli_text(), wrong=True)


def _placement_words(placement: Placement) -> str:
    along = ", ".join(f"{value:+.4f}" for value in placement.axis)
    return f"blocks {placement.first_block} to {placement.last_block}, axis ({along})"


def _recordings(project: Project) -> Iterator[ProjectItem]:
    """Those in their folder, those beside the project file among other tables, and farther down those of an axis."""
    own = sorted((project.folder / RECORDINGS).glob("*"))
    beside = [path for path in sorted(project.folder.glob("*.csv")) if _is_recording(path)]
    below = [path for path in sorted(project.folder.glob("*/**/*.csv")) if path not in own and is_axis_recording(path)]
    for path in [*own, *beside, *below][:MOST]:
        if path.suffix.lower() in (".csv", ".parquet"):
            shown, of_axis = os.path.relpath(path), is_axis_recording(path)
            try:
                yield ProjectItem(
                    "recording", shown, _recording_words(path), files=frozenset([file_digest(path)]), of_axis=of_axis
                )
            except InputError as error:
                yield ProjectItem("recording", shown, error.cli_text(), wrong=True)


def _is_recording(path: Path) -> bool:
    """Whether a table has the columns of a recording, of whatever is measured."""
    if is_axis_recording(path):
        return True
    try:
        with path.open(encoding="utf-8-sig") as file:
            lines = iter(lambda: file.readline(LONGEST_COMMENT), "")
            header = next((line for line in lines if not line.startswith("#")), "")
    except (OSError, UnicodeDecodeError):
        return False
    return set(REQUIRED) <= set(header.strip().split(","))


def _recording_words(path: Path) -> str:
    if is_axis_recording(path):
        return read_axis_recording(path).summary().splitlines()[0]
    recording = read_recording(path)
    placements, rows = len(recording.placements), len(recording.frame)
    simulated = "; simulated" if is_simulated(recording.comments) else ""
    return f"{rows} probings in {counted(placements, 'placement')}{simulated}"


def _results(project: Project) -> Iterator[ProjectItem]:
    for kind in RESULT_KINDS:
        for path in sorted(project.folder.glob(f"**/{kind}.json"))[:MOST]:
            shown = os.path.relpath(path.parent)
            try:
                said, inputs, lacking = _result_words(path, kind, project)
                yield ProjectItem(kind, shown, said, files=frozenset(_digests(inputs)), lacking=lacking)
            except InputError as error:
                yield ProjectItem(kind, shown, error.cli_text(), wrong=True)


def _result_words(path: Path, kind: str, project: Project) -> tuple[str, Any, tuple[tuple[str, str], ...]]:
    """What a result says of itself, its inputs, and what it lacks for a decision.

    :class:`InputError` where it is not what its inputs now give.
    """
    if kind != "diagnosis":
        data = read_result(path, kind)
        if kind == "budget":
            _check_stated(data, path, project)
        gaps = data.get("not_included", [])
        open_ = f"; incomplete: not stated are {', '.join(str(one['what']) for one in gaps)}" if gaps else ""
        lacking = [(str(one["what"]), str(one["state_by"])) for one in gaps]
        lacking += [(one.name, one.expected or one.sentence) for one in stored_conditions(data).preventing]
        return f"up to date{open_}", data.get("made_from", data.get("inputs", [])), tuple(lacking)
    found = Diagnosis.read(path)
    if found.changed():
        what = f"{found.changed()[0]} has changed since this was made from it"
        raise InputError(path, what, expected="this made again, with what is there now")
    return found.verdict, found.contents["inputs"], ()


def _check_stated(budget: dict[str, Any], path: Path, project: Project) -> None:
    """:class:`InputError` where gauge and machine of the project state something else than the budget was made with."""
    gauge, machine = read_gauge(stated_file(project, "gauge")), read_machine(stated_file(project, "machine"))
    for serial, own in ((budget["gauge_serial"], gauge.table.serial), (budget["machine"], machine.table.name)):
        if serial != own:  # of another one, which it does not claim to be of
            return
    check_given(budget.get("given"), path, gauge, machine)


def _digests(inputs: Any) -> Iterator[str]:
    """The SHA-256 of all files in the inputs of a result, whatever their form."""
    if isinstance(inputs, dict) and isinstance(inputs.get("sha256"), str):
        yield inputs["sha256"]
    for one in inputs.values() if isinstance(inputs, dict) else inputs if isinstance(inputs, list) else ():
        yield from _digests(one)


def _reports(project: Project) -> Iterator[ProjectItem]:
    """What was printed, with the time at which it was."""
    for path in _printed(project):
        written = datetime.fromtimestamp(path.stat().st_mtime).isoformat(" ", "minutes")
        yield ProjectItem("PDF", os.path.relpath(path), f"written {written}")


def _printed(project: Project) -> list[Path]:
    """The PDFs beside the project file and in the folder of results."""
    return [*sorted(project.folder.glob("*.pdf")), *sorted((project.folder / RESULTS).glob("*.pdf"))][:MOST]


def _next(
    project: Project, items: list[ProjectItem], recordings: list[ProjectItem], results: list[ProjectItem]
) -> tuple[str, str, str, tuple[tuple[str, str], ...]]:
    """The next step, its command, why, and what a decision lacks: of what is missing or wrong the first."""
    for item in items[:2]:
        if item.wrong:
            return item.what, "stepgauge list files", f"state a {item.what} in the project file; these are shipped", ()
    if items[2].wrong:
        why = "probe the 16 points, and find how the gauge lies"
        return "locate", _command(project, "locate", "POINTS.csv"), why, ()
    usable = [one for one in recordings if not one.wrong]
    if not usable:
        reason = "write the measuring program; run it, and 'import' what was measured"
        return "plan", _command(project, "plan", items[2].path), reason, ()
    done = [one for one in results if not one.wrong]
    for kind, (verb, reason) in _REASONS.items():
        own = [one for one in done if one.what == kind]
        made = frozenset[str]().union(*(one.files for one in own))
        asked = [one for one in usable if kind == "diagnosis" or not one.of_axis]
        lacking = sorted((one for one in asked if not one.files <= made), key=lambda one: not one.of_axis)
        if lacking:
            one = lacking[-1]
            command = _command(project, verb, one.path, _elsewhere(project, kind, one, done))
            return verb, command, _REASON_OF_AXIS if one.of_axis else reason, ()
        undecided = [one for one in own if one.lacking and (kind == "evaluation" or _has_limit(project))]
        if undecided:
            one = undecided[-1]
            made_from = next((every.path for every in usable if every.files <= one.files), usable[-1].path)
            why = "nothing can be decided yet: state what is lacking, and do this again"
            return "decide", _command(project, verb, made_from, one.path), why, one.lacking
    evaluations = [one.path for one in done if one.what == "evaluation"]
    if evaluations and not _is_reported(project, evaluations[-1]):
        return "report", _command(project, "report", evaluations[-1]), "write the report", ()
    reason = "all is there, the report too: compare it with what was found before; measure again when it is due"
    return "history", _command(project, "history", os.path.relpath(project.folder / RESULTS)), reason, ()


def _has_limit(project: Project) -> bool:
    """Whether a maximum permissible error is stated, by which something is decided."""
    return bool(project.stated("report").get("mpe") or read_machine(stated_file(project, "machine")).table.mpe)


def _command(project: Project, verb: str, path: str, output: str = "") -> str:
    """A command as it is typed, with what its verb needs and the project file does not state; paths are quoted."""
    words, stated = ["stepgauge", verb, path], project.table((verb,))
    dialect = str(stated.get("dialect", "dmis"))
    if verb == "plan" and "dialect" not in stated:
        words += ["--dialect", dialect]
    if not output and "output" not in stated:
        usual = f"program{program_suffix(dialect)}" if verb == "plan" else OUTPUTS[verb]
        output = os.path.relpath(project.folder / usual)
    return shlex.join([*words, *(["-o", output] if output else [])])


def _elsewhere(project: Project, kind: str, recording: ProjectItem, done: list[ProjectItem]) -> str:
    """A folder of its own for a result where the usual one may hold that of another recording; else empty."""
    if not any(one.what == kind for one in done):
        return ""
    return os.path.relpath(project.folder / RESULTS / f"{kind}-{Path(recording.path).stem}")


def _is_reported(project: Project, evaluation: str) -> bool:
    """Whether something was printed after an evaluation."""
    since = (Path(evaluation) / "evaluation.json").stat().st_mtime
    return any(one.stat().st_mtime >= since for one in _printed(project))
