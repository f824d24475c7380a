"""The recordings of a project: which are of one state of a machine, and which are the same readings once more."""

from __future__ import annotations

import datetime
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stepgauge.errors import InputError
from stepgauge.web.folder import Stamp, existing, listed, relative, stamps
from stepgauge.web.forms import Form
from stepgauge.web.site import Site

if TYPE_CHECKING:
    from stepgauge.files.arrays import Array
    from stepgauge.gauge.certified import Gauge

MOST_LISTED = 200
ROUNDED_MM, LARGEST_SCATTER_MM = 1e-7, 1.0
ALIKE, BEYOND_CHANCE = 0.7, 5.0
"""Readings are the same where they differ by less, or scatter alike: their correlation, and so many standard deviations
of chance by Fisher's transformation of it (a zero set anew in each cycle takes a part of it away)."""


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
    readings, which tell nothing new; ``differs``: the conditions (:func:`_conditions`) in which it differs from the
    first, also where it is ticked.
    """

    name: str
    said: str
    ticked: bool
    copy_of: str = ""
    differs: tuple[str, ...] = ()


def recording_choices(site: Site, asked: Sequence[str] = ()) -> list[RecordingChoice]:
    """The recordings of the project; without any asked the newest is.

    Ticked are placements of one machine in one state: of the same gauge and machine, under the same conditions, and of
    the same day as the first that is asked, or of a diagnosis for which the first was laid as its further run.
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
        differs = _differing(first, own) if first and own and name != asked[0] else ()
        is_of_state = not differs or (differs == ("day",) and name in planned)
        ticked = name in asked or bool(first and own and is_of_state and not copy_of)
        said = f"{own['day']}, {own['warm']}" if own else ""
        choices.append(RecordingChoice(name, said, ticked, copy_of, differs))
    return choices


def _differing(first: Mapping[str, str], own: Mapping[str, str]) -> tuple[str, ...]:
    """The conditions in which a recording differs from the first; a day that is not known is none."""
    return tuple(key for key in own if key != "warm" and (own[key] != first[key] or (key == "day" and not own[key])))


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


@dataclass(frozen=True)
class _Proposal:
    """What a diagnosis was made from, the placements that it proposes, and the checksums of its gauge and machine."""

    made_from: list[str]
    plans: list[str]
    sha256: dict[str, str]

    @classmethod
    def read(cls, path: Path) -> _Proposal | None:
        """None for a file that is none of ours."""
        try:
            said = json.loads(path.read_text("utf-8"))
            inputs = said["inputs"]
            files = [inputs.get(kind) or {} for kind in ("gauge", "machine")]
            return cls(
                [str(one["path"]) for one in inputs.get("recordings", ())],
                [command.split()[2] for one in proposed_runs(said).values() for command in one["commands"]],
                {str(one["path"]): str(one["sha256"]) for one in files if one.get("sha256")},
            )
        except (OSError, ValueError, LookupError, TypeError, AttributeError):
            return None


def _planned_for(site: Site, name: str) -> set[str]:
    """The recordings of diagnoses of which this one is the further run that they proposed."""
    proposals = [_Proposal.read(path) for path in files_named(site, "diagnosis.json")]
    made_from = [set(one.made_from) for one in proposals if one and one.plans and _is_proposed(site, name, one)]
    return set[str]().union(*made_from)


def _is_proposed(site: Site, name: str, by: _Proposal) -> bool:
    """Whether a recording came after this plan and lies nearer to it than to all that had been measured.

    The files of gauge and machine are as they were: nobody has corrected them between.
    """
    from stepgauge.files.checksum import file_digest
    from stepgauge.gauge.certified import read_gauge
    from stepgauge.gauge.placement import read_placement

    came = (site.folder / name).stat().st_mtime
    before = [plan for one in by.plans if (plan := site.folder / one).is_file() and plan.stat().st_mtime <= came]
    if name in by.made_from or not before:
        return False
    try:
        if any(file_digest(site.folder / path) != known for path, known in by.sha256.items()):
            return False
        gauge = read_gauge(site.stated("gauge"))
        lain = [ends for one in by.made_from for ends in _lain_mm(site.folder / one, gauge)]
        laid = [read_placement(plan, gauge) for plan in before]
        planned = [_ends_mm(one.origin_mm(gauge), one.axis, gauge) for one in laid]
        return any(_nearest_mm(own, planned) < _nearest_mm(own, lain) for own in _lain_mm(site.folder / name, gauge))
    except (InputError, OSError, IndexError):  # what is not there any more, or is of another gauge
        return False


def _nearest_mm(own: Array, places: Sequence[Array]) -> float:
    """Distance of a placement from the nearest of others, as :func:`_ends_mm` has them."""
    import numpy as np

    return min((float(np.linalg.norm(one - own)) for one in places), default=math.inf)


def _ends_mm(origin: Array, axis: Array, gauge: Gauge) -> Array:
    """Where the first and the last face of a gauge are, (6,), mm."""
    import numpy as np

    return np.concatenate([origin, origin + axis * gauge.position_mm[-1]])


def _lain_mm(path: Path, gauge: Gauge) -> Iterator[Array]:
    """Where the ends of the gauge were in each placement of a recording, whichever faces were touched."""
    import numpy as np

    from stepgauge.recording import read_recording
    from stepgauge.recording.columns import POSITION

    for _, rows in read_recording(path).frame.groupby("placement"):
        faces = rows.groupby("face")[POSITION].mean()
        first, last = faces.loc[faces.index.min()].to_numpy(float), faces.loc[faces.index.max()].to_numpy(float)
        axis = (last - first) / np.linalg.norm(last - first)
        yield _ends_mm(first - axis * gauge.position_mm[faces.index.min() - 1], axis, gauge)
