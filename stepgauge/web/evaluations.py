"""Evaluations of a project, as its files have them: which there are, what they were made from, what a request shows."""

from __future__ import annotations

import datetime
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import urlencode

from starlette.requests import Request

from stepgauge.errors import InputError
from stepgauge.web.folder import Stamp, existing, inside, listed, relative, stamps
from stepgauge.web.forms import Form
from stepgauge.web.render import site_of
from stepgauge.web.site import Site

if TYPE_CHECKING:
    from stepgauge.files.arrays import Array
    from stepgauge.gauge.certified import Gauge
    from stepgauge.standards.budget_files import StoredBudget

ERRORS = ("xm", "xf", "xb", "xr")
MOST_OVER = 4
MOST_LISTED = 200
ROUNDED_MM, LARGEST_SCATTER_MM = 1e-7, 1.0
ALIKE, BEYOND_CHANCE = 0.7, 5.0
"""Readings are the same where they differ by less, or scatter alike: their correlation, and so many standard deviations
of chance by Fisher's transformation of it (a zero set anew in each cycle takes a part of it away)."""
PLACEMENTS = "placement*.toml"
"""Where the placements of a project lie: a new one does not replace that of readings that were taken."""


def evaluation_folders(site: Site) -> list[str]:
    """Folders of the project with an ``evaluation.json``, the latest measurement first."""
    found = []
    for path in files_named(site, "evaluation.json"):
        try:
            said = json.loads(path.read_text("utf-8"))
            when = str(said.get("measured_at") or "")
        except (OSError, ValueError, AttributeError):
            when = ""
        found.append((when, path.stat().st_mtime, str(path.parent.relative_to(site.folder))))
    return [name for _, _, name in sorted(found, reverse=True)]


def files_named(site: Site, name: str) -> list[Path]:
    """Files of this name below the project's folder, nothing hidden and no link that leads out."""
    found = [site.folder / one for one in listed(site.folder, [Path(name).suffix], deep=20) if Path(one).name == name]
    return [path for path in found if path.resolve().is_relative_to(site.folder)][:MOST_LISTED]


def recording_files(site: Site) -> list[str]:
    from stepgauge.project.create import RECORDINGS

    folder = site.folder / RECORDINGS
    there = sorted(folder.glob("*.csv")) + sorted(folder.glob("*.parquet")) if folder.is_dir() else []
    return [str(path.relative_to(site.folder)) for path in there]


@dataclass(frozen=True)
class RecordingChoice:
    """A recording that may be diagnosed with others.

    ``said``: when, how warm; ``ticked``: by default it is; ``copy_of``: an earlier one of the list with the same
    readings, which tell nothing new; ``differs``: the conditions (:func:`_conditions`) for which it is not ticked.
    """

    name: str
    said: str
    ticked: bool
    copy_of: str = ""
    differs: tuple[str, ...] = ()


def recording_choices(site: Site, asked: Sequence[str] = ()) -> list[RecordingChoice]:
    """The recordings of the project; without any asked the newest is.

    Ticked are those of the same gauge and machine, under the same conditions and of the same day as the first that is
    asked: placements of one machine in one state. So are those for which it was planned as the next measurement.
    """
    newest = sorted(recording_files(site), key=lambda one: -(site.folder / one).stat().st_mtime)[:MOST_LISTED]
    asked = list(asked) or newest[:1]
    names = dict.fromkeys([*asked, *newest])
    found = {name: _conditions(str(site.folder / name), stamps(site.folder / name)) for name in names}
    first = found.get(asked[0]) if asked else None
    planned = _planned_for(site, asked[0]) if first else set()
    choices: list[RecordingChoice] = []
    scatters: dict[str, Array | None] = {}
    for name, own in found.items():
        scatter = _scatter(str(site.folder / name), stamps(site.folder / name)) if own else None
        copy_of = next((one for one, other in scatters.items() if _is_same(scatter, other)), "")
        scatters[name] = scatter
        differs = _differing(first, own, name in planned) if first and own else ()
        ticked = name in asked or bool(first and own and not differs and not copy_of)
        said = f"{own['day']}, {own['warm']}" if own else ""
        choices.append(RecordingChoice(name, said, ticked, copy_of, () if name in asked else differs))
    return choices


def _differing(first: Mapping[str, str], own: Mapping[str, str], is_planned: bool) -> tuple[str, ...]:
    """The conditions in which a recording is none of the same state; the day does not count where it was planned."""
    counted = [key for key in own if key != "warm" and not (is_planned and key == "day")]
    return tuple(key for key in counted if own[key] != first[key] or (key == "day" and not own[key]))


@lru_cache(MOST_LISTED)
def _scatter(path: str, _: tuple[Stamp, ...]) -> Array | None:
    """How the readings of a recording scatter about the means of their faces and cycles, along the gauge, mm; of one
    cycle the lengths themselves. It is the same however the readings were imported, and in no two measurements."""
    import numpy as np

    from stepgauge.recording import read_recording
    from stepgauge.recording.columns import POSITION

    frame = read_recording(path).frame.sort_values(["placement", "face", "cycle"], kind="stable")
    position = frame[POSITION].to_numpy(float)
    length = frame.assign(mm=np.linalg.norm(position - position[0], axis=1))
    if length["cycle"].nunique() < 2:
        return length["mm"].to_numpy(float)
    for one in ("face", "cycle"):
        length["mm"] -= length.groupby(["placement", one])["mm"].transform("mean")
    return length["mm"].to_numpy(float)


def _is_same(one: Array | None, other: Array | None) -> bool:
    """Whether two recordings have the same readings, but for their rounding."""
    import numpy as np

    if one is None or other is None or len(one) != len(other):
        return False
    if np.allclose(one, other, rtol=0.0, atol=ROUNDED_MM):
        return True
    if max(np.ptp(one), np.ptp(other)) > LARGEST_SCATTER_MM or not (one.any() and other.any()):
        return False
    r = min(float(np.corrcoef(one, other)[0, 1]), 1.0 - 1e-9)
    return r > ALIKE and math.atanh(r) * math.sqrt(max(len(one) / 2.0 - 3.0, 0.0)) > BEYOND_CHANCE


def ticked_recordings(site: Site, form: Form) -> list[str]:
    """The recordings that are ticked, in the order of their days and, on one day, as they came.

    :class:`InputError` where none is, or one is not there.
    """
    names = [existing(site.folder, one.strip()) for one in form.text("recordings").split("\n") if one.strip()]
    if not names:
        raise InputError("recordings", "none is ticked", expected="one or more")

    def when(path: Path) -> tuple[str, float]:
        known, came = _conditions(str(path), stamps(path)), path.stat().st_mtime
        return known["day"] if known and known["day"] else datetime.date.fromtimestamp(came).isoformat(), came

    return [relative(site.folder, str(path)) for path in sorted(names, key=when)]


def stems(recordings: Sequence[str]) -> str:
    """What a result of these recordings is called by."""
    return "-and-".join(Path(one).stem for one in recordings)[:60]


@lru_cache(MOST_LISTED)
def _conditions(path: str, _: tuple[Stamp, ...]) -> dict[str, str] | None:
    """What recordings of one state of a machine have in common, by its name, and how ``warm`` the gauge was.

    None for what cannot be read, and for a recording of one axis.
    """
    from stepgauge.recording import read_recording
    from stepgauge.recording.columns import CORRECTED
    from stepgauge.recording.conventions import KEY
    from stepgauge.recording.simulated import is_simulated

    try:
        one = read_recording(path)
    except InputError:
        return None
    said = {key: one.comments.get(name, "") for key, name in {"gauge": "gauge_serial", "machine": "machine"}.items()}
    mean_C = one.columns["gauge_temperature_C"].mean() if "gauge_temperature_C" in one.columns else math.nan
    return said | {
        "convention": one.comments.get(KEY, ""),
        "simulated": str(is_simulated(one.comments)),
        "tip": str(CORRECTED in one.comments),
        "temperature": str(not math.isnan(mean_C)),
        "day": one.comments.get("measured_at", "")[:10],
        "warm": "" if math.isnan(mean_C) else f"{mean_C:.1f} °C",
    }


def proposed_runs(said: Mapping[str, Any]) -> dict[int, Mapping[str, Any]]:
    """Findings of a ``diagnosis.json`` and, numbered on, structure that propose a run, by their numbers."""
    every = enumerate((*said["effects"], *said["unexplained"]), 1)
    return {number: one for number, one in every if one.get("commands")}


def _planned_for(site: Site, name: str) -> set[str]:
    """The recordings of diagnoses whose next measurement was planned before this recording came, and not in them."""
    came, found = (site.folder / name).stat().st_mtime, set[str]()
    for path in files_named(site, "diagnosis.json"):
        try:
            said = json.loads(path.read_text("utf-8"))
            made_from = [str(one["path"]) for one in said["inputs"].get("recordings", ())]
            programs = [command.split()[-1] for one in proposed_runs(said).values() for command in one["commands"]]
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            continue
        written = [place.stat().st_mtime for one in programs if (place := site.folder / one).is_file()]
        if name not in made_from and any(moment <= came for moment in written):
            found |= set(made_from)
    return found


def evaluation_file(site: Site, name: str) -> Path:
    """The file of an evaluation, as one would type it."""
    return existing(site.folder, f"{name}/evaluation.json").relative_to(site.folder)


def read_evaluation(site: Site, name: str, with_inputs: bool = True) -> dict[str, Any]:
    """An ``evaluation.json`` of the project, checked."""
    place = evaluation_file(site, name)
    return _read_file(str(place), with_inputs, stamps(place, *(_inputs_stated(place) if with_inputs else ())))


@lru_cache(16)
def _read_file(place: str, with_inputs: bool, _: tuple[Stamp, ...]) -> dict[str, Any]:
    from stepgauge.reports.reading import read_checked_evaluation

    return read_checked_evaluation(place, with_inputs)


def _inputs_stated(place: Path) -> list[Path]:
    """The files that it was made from, whatever has become of them."""
    try:
        said = json.loads(place.read_text("utf-8")).get("inputs", [])
    except (ValueError, AttributeError):
        return []
    return [place.parent / str(one["file"]) for one in said if isinstance(one, dict) and "file" in one]


@dataclass(frozen=True)
class EvaluationView:
    """What a request asks to see: an evaluation, a placement of it, and others laid over it."""

    name: str
    data: Mapping[str, Any]
    index: int
    over: tuple[str, ...]
    error: str

    @classmethod
    def of(cls, request: Request) -> EvaluationView:
        """:class:`InputError` for what the project does not have."""
        site, query = site_of(request), request.query_params
        name = relative(site.folder, query.get("evaluation", ""))
        data = read_evaluation(site, name)
        over = tuple(relative(site.folder, one) for one in query.getlist("over") if one and one != name)[:MOST_OVER]
        numbers = [str(one["placement"]) for one in data["placements"]]
        asked = query.get("placement") or numbers[0]
        if asked not in numbers:
            raise InputError("placement", "the evaluation does not have it", found=asked, expected=", ".join(numbers))
        error = query.get("error", ERRORS[0])
        if error not in ERRORS:
            raise InputError("error", "not an error of an evaluation", found=error, expected=", ".join(ERRORS))
        return cls(name, data, numbers.index(asked), over, error)

    @property
    def placement(self) -> Mapping[str, Any]:
        """The placement asked for, as ``evaluation.json`` has it."""
        found: Mapping[str, Any] = self.data["placements"][self.index]
        return found

    def query(self) -> str:
        """As an address has it."""
        pairs = [("evaluation", self.name), ("placement", str(self.placement["placement"])), ("error", self.error)]
        return urlencode([*pairs, *(("over", one) for one in self.over)])


def budget_file(site: Site, name: str, data: Mapping[str, Any]) -> Path | None:
    """The budget of an evaluation, as ``report`` finds it; as one would type it."""
    from stepgauge.reports.made_from import budget_of

    found = budget_of(dict(data), site.folder / evaluation_file(site, name))
    return None if found is None else Path(relative(site.folder, str(found)))


def project_placements(site: Site) -> list[str]:
    """Where the project has, or will have, its placement, and all others, the newest first."""
    others = (str(path) for path in sorted(site.folder.glob(PLACEMENTS), reverse=True))
    return list(dict.fromkeys([site.placement, *others]))


def placement_files(site: Site, data: Mapping[str, Any]) -> list[str]:
    """The placement file of each placement of an evaluation, that whose axis is nearest; none if one is not there."""
    from stepgauge.gauge.certified import read_gauge

    gauge = read_gauge(site.stated("gauge"))
    files, found = project_placements(site), []
    for placed in data["placements"]:
        turned = {one: _turned_rad(one, gauge, placed) for one in files}
        nearest = min(turned, key=lambda one: turned[one])
        if not math.isfinite(turned[nearest]):
            return []
        found.append(relative(site.folder, nearest))
    return found


def placement_words(site: Site, name: str) -> list[str]:
    """The words by which a verb is given the placements of an evaluation."""
    return [word for one in placement_files(site, read_evaluation(site, name)) for word in ("--placement", one)]


def report_words(site: Site, name: str) -> list[str]:
    """The words by which ``report`` is given budget and placements of an evaluation; none for another result."""
    if not (site.folder / name / "evaluation.json").is_file():
        return []
    budget = budget_file(site, name, read_evaluation(site, name))
    return [*([] if budget is None else ["--budget", str(budget)]), *placement_words(site, name)]


def _turned_rad(file: str, gauge: Gauge, placed: Mapping[str, Any]) -> float:
    """How far the axis of a placement file is from that of the readings; infinite where it is another placement."""
    import numpy as np

    from stepgauge.gauge.placement import read_placement
    from stepgauge.reports.reading import check_placements

    try:
        placement = read_placement(file, gauge)
        check_placements({"placements": [placed]}, [placement], [file])
    except InputError:
        return math.inf
    return float(np.linalg.norm(np.cross(placement.axis, placed["axis"])))


def stored_budget(site: Site, shown: EvaluationView) -> StoredBudget | None:
    """The budget of this evaluation that the project has."""
    from stepgauge.standards.budget_files import check_budget, read_budget

    path = budget_file(site, shown.name, shown.data)
    if path is None:
        return None
    found = read_budget(site.folder / path)
    try:
        check_budget(found, dict(shown.data), path)
    except InputError:  # beside it lies one of another evaluation, which the report refuses by its reason
        return None
    return found


def recordings_and_gauge(site: Site, name: str) -> tuple[list[Path], str]:
    """The recordings of an evaluation and its gauge; :class:`InputError` where one lies outside of the project."""
    from stepgauge.reports.made_from import gauge_of, recordings_of

    data, place = read_evaluation(site, name), evaluation_file(site, name)
    recordings = [inside(site.folder, str(one)) for one in recordings_of(data, place)]
    try:
        return recordings, str(gauge_of(data, place))
    except InputError:  # written by a program that said nothing of its gauge; whether it is this one is checked
        return recordings, site.stated("gauge")


def evaluation_choices(site: Site, name: str) -> list[RecordingChoice]:
    """What may be diagnosed of an evaluation; nothing where its recordings are not there any more."""
    try:
        return recording_choices(site, recording_names(site, name, with_inputs=False))
    except InputError:
        return []


def recording_names(site: Site, name: str, with_inputs: bool = True) -> list[str]:
    """The recordings of an evaluation, as one would type them; ``with_inputs``: as they were, or an error."""
    from stepgauge.reports.made_from import recordings_of

    made_from = recordings_of(read_evaluation(site, name, with_inputs), evaluation_file(site, name))
    return [relative(site.folder, str(one)) for one in made_from]
