"""Evaluations of a project, as its files have them: which there are, what they were made from, what a request shows."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import urlencode

from starlette.requests import Request

from stepgauge.errors import InputError
from stepgauge.web.folder import Stamp, existing, inside, relative, stamps
from stepgauge.web.recordings import RecordingChoice, files_named, recording_choices
from stepgauge.web.render import site_of
from stepgauge.web.site import Site

if TYPE_CHECKING:
    from stepgauge.gauge.certified import Gauge
    from stepgauge.standards.budget_files import StoredBudget

ERRORS = ("xm", "xf", "xb", "xr")
MOST_OVER = 4
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


def placement_axes(site: Site) -> dict[str, str]:
    """The placement files of the project with the axis of each in words, that of the project first."""
    from stepgauge.gauge.certified import read_gauge
    from stepgauge.gauge.placement import read_placement

    gauge, found = read_gauge(site.stated("gauge")), dict[str, str]()
    for path in project_placements(site):
        with suppress(InputError):  # what is no placement is no choice
            axis = read_placement(path, gauge).axis
            found[relative(site.folder, path)] = " ".join(f"{one:.2f}" for one in axis)
    return found


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
