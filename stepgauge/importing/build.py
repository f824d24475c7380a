"""A log and what is known besides -> a recording, with a report of what was mapped and what was dropped."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from stepgauge.correspondence.expected_points import ExpectedPoints, expected_by_log, expected_by_program
from stepgauge.correspondence.faces import nearest_faces, tip_distance_mm
from stepgauge.correspondence.log_conventions import count_placements, settle
from stepgauge.correspondence.pairing import Pairing, match
from stepgauge.correspondence.probe_log import ProbeLog
from stepgauge.correspondence.search_line import point_distances
from stepgauge.errors import InputError, naming
from stepgauge.files.arrays import Array
from stepgauge.files.numerals import number
from stepgauge.files.units import find_unit, unit_hint
from stepgauge.gauge.certified import Gauge
from stepgauge.gauge.placement import Placement
from stepgauge.importing.result import Imported, ask_together
from stepgauge.importing.tip_centres import are_surface_points, unseen_question, width_radius_mm
from stepgauge.motion.moves import Program
from stepgauge.recording import APPROACH, OPTIONAL, POSITION, Recording
from stepgauge.recording.columns import CORRECTED, near_miss
from stepgauge.recording.identity import stated_serials
from stepgauge.recording.temperatures import no_temperature

if TYPE_CHECKING:
    import pandas as pd

_OURS = ("import", "points", "probings", "log", "tip_radius_mm")
"""Comments that an exported recording carries and that are made anew."""
SAME_K = 0.05
"""Difference of a stated temperature from the recorded ones within which it is the same, rounded."""


@dataclass(frozen=True)
class ImportOptions:
    """What the log does not state, and what may be wrong with it.

    ``placement``: number in the recording; ``gauge_temperature_C``: of the gauge during the run; ``tip_radius_mm``;
    ``surface``: True for points that are compensated by the tip radius, False for tip centres, None for what the log
    says; ``accept``: departures from the program (:data:`stepgauge.correspondence.pairing.KINDS`);
    ``nominal_radius_mm``: of the machine file, the same for all placements, each of which has an effective one.
    """

    placement: int = 1
    gauge_temperature_C: float | None = None
    tip_radius_mm: float | None = None
    surface: bool | None = None
    accept: Sequence[str] = ()
    nominal_radius_mm: float | None = None


def build_recording(
    log: ProbeLog,
    gauge: Gauge | None,
    placement: Placement | None,
    program: Program | None,
    options: ImportOptions,
) -> Imported:
    """The recording of a log (see :func:`stepgauge.importing.logs.import_log`)."""
    return ask_together(
        lambda accept: _build(log, gauge, placement, program, replace(options, accept=accept)), options.accept
    )


def _build(
    log: ProbeLog, gauge: Gauge | None, placement: Placement | None, program: Program | None, options: ImportOptions
) -> Imported:
    stated = number(log.comments.get("tip_radius_mm", ""))
    if log.tip_radius_mm is None and np.isfinite(stated):
        log = replace(log, tip_radius_mm=float(stated))
    _check_names(log)
    if gauge is not None and placement is not None:
        return _build_matched(log, gauge, placement, program, options)
    _check_end(log, options)
    return _build_stated(log, gauge, options)


def _build_matched(
    log: ProbeLog, gauge: Gauge, placement: Placement, program: Program | None, options: ImportOptions
) -> Imported:
    log, placement, program, settled = settle(_one_placement(log), gauge, placement, program, options.accept)
    _check_directions(log, gauge, placement)
    stated = options.tip_radius_mm or log.tip_radius_mm
    before_mm = tip_distance_mm(log.position_mm, gauge, placement)
    surface = are_surface_points(log, before_mm, options.surface, stated or placement.tip_radius_mm)
    if surface is None:
        raise unseen_question(log, before_mm)
    radius = stated or options.nominal_radius_mm or placement.tip_radius_mm if surface else stated
    log = replace(log, surface=surface)
    if program is None:
        _check_end(log, options)
    expected = expected_by_program(program, gauge, placement) if program else expected_by_log(log, gauge, placement)
    there = expected.at_surface(radius) if program and surface and radius else expected
    matched = match(log, there, options.accept)
    frame = _frame(log, matched, options, radius if surface else None)
    comments = {} if program is None else {"program": program.name}
    report = [
        *_matched_words(log, frame, matched),
        *settled,
        *_surface_words(surface, radius, log, before_mm),
        *log.mapped,
        *_dropped(log),
    ]
    return _finish(log, frame, gauge, radius, comments | _corrected(surface, radius, log), report)


def _build_stated(log: ProbeLog, gauge: Gauge | None, options: ImportOptions) -> Imported:
    """A log that states cycle, face and direction of every row needs nothing else."""
    import pandas as pd

    lacking = [name for name in ("cycle", "face") if name not in log.columns]
    if lacking or log.approach is None:
        raise InputError(
            log.path,
            "the file does not say which face each point belongs to",
            found=f"no {', '.join([*lacking, *(['direction'] if log.approach is None else [])])}",
            expected=naming(
                "gauge",
                "placement",
                "program",
                words="{} and {} (faces follow from the positions), and {} where it is known",
            ),
        )
    log, placements = count_placements(log, options.accept)
    assert log.approach is not None
    radius = options.tip_radius_mm or log.tip_radius_mm
    found = are_surface_points(log, width_radius_mm(log, gauge), options.surface, radius)
    surface = bool(found)
    position = log.position_mm - _radius(radius, log) * log.approach if surface else log.position_mm
    frame = pd.DataFrame({"placement": options.placement, "cycle": log.columns["cycle"], "face": log.columns["face"]})
    frame[POSITION], frame[APPROACH] = position, log.approach
    _add_columns(frame, log, np.arange(len(log)), options)
    words = (
        _surface_words(surface, radius, log) if found is not None else ["points are taken as tip centres (not stated)"]
    )
    report = [f"{log.form}: {len(log)} rows, faces as stated", *placements, *words]
    return _finish(log, frame, gauge, radius, _corrected(surface, radius, log), [*report, *log.mapped, *_dropped(log)])


def _check_names(log: ProbeLog) -> None:
    """A column that is nearly one of ours would be a covariate, and what it says would not count."""
    there = {*log.columns, *(["time_s"] if log.time_s is not None else [])}
    absent = [name for name in OPTIONAL if name not in there]
    for name in log.columns:
        near = None if name in (*OPTIONAL, "cycle", "face", "temperature_C") else near_miss(name, absent)
        if near is not None:
            expected = naming("columns", words=f'{{}} {near}="{name}" if it is that, or another name if it is not')
            raise InputError(log.path, f"column {name!r} looks like {near}", found=name, expected=expected)


def _finish(
    log: ProbeLog,
    frame: pd.DataFrame,
    gauge: Gauge | None,
    radius: float | None,
    comments: dict[str, str],
    report: list[str],
) -> Imported:
    comments["log"] = f"{Path(log.path).name} ({log.form})"
    if radius is not None:
        comments["tip_radius_mm"] = f"{radius:.9g}"
    said = {key: value for key, value in log.comments.items() if key not in (*OPTIONAL, *_OURS)}
    ours: dict[str, str] = {}
    if gauge is not None and not stated_serials(said):  # else it is compared with the gauge that was given
        ours = {"gauge": gauge.table.name, "gauge_serial": gauge.table.serial}
    report = [*report, *_doubtful(log, frame)]
    comments = {**ours, **said, **comments, "import": "\n".join(report)}
    return Imported(Recording(frame, comments, log.path), tuple(report))


def _doubtful(log: ProbeLog, frame: pd.DataFrame) -> list[str]:
    """The warning where a column may be the temperature of the gauge and nothing says which one is.

    :class:`InputError` where such a column has a unit and no name: it may as well be that of the gauge.
    """
    if not log.degrees or "gauge_temperature_C" in frame:
        return []
    nameless = [header for header in log.degrees if find_unit(header.strip("[]()")) is not None]
    if nameless:
        header = f'{{}} gauge_temperature_C="{nameless[0]}" if it is the gauge\'s, or that of the gauge with {{}}'
        expected = naming("columns", "gauge_temperature_C", words=header)
        raise InputError(log.path, f"whose temperature is column {nameless[0]!r}?", expected=expected)
    one, every = log.degrees[0], ", ".join(map(repr, log.degrees))
    return [
        "warning: no temperature of the gauge is recognised, and lengths will not be corrected for it; whose"
        f' temperature is {every}? If it is the gauge\'s: --column gauge_temperature_C="{one}"; else state that of'
        " the gauge: --gauge-temperature"
    ]


def _one_placement(log: ProbeLog) -> ProbeLog:
    numbers = np.unique(log.columns.get("placement", [1]))
    if len(numbers) > 1:
        raise InputError(
            log.path,
            "the file has several placements of the gauge",
            found=", ".join(f"{number:g}" for number in numbers),
            expected=naming(
                "placement", words="one placement with {}, or cycle, face and directions in the file and none of it"
            ),
        )
    return log


def _check_end(log: ProbeLog, options: ImportOptions) -> None:
    """Without a program only the file itself can say that it is cut."""
    if log.cut and "missing" not in options.accept:
        raise InputError(
            log.at(len(log) - 1),
            "the file is cut, or the run was stopped",
            found=f"{len(log)} points and {log.cut}",
            expected=naming("accept", words="the whole file, or {} missing"),
        )


def _check_directions(log: ProbeLog, gauge: Gauge, placement: Placement) -> None:
    """Directions of a file must point into the faces, and the faces that it states be those it touched."""
    face, _ = nearest_faces(log.position_mm, gauge, placement)
    into = np.where(face % 2 == 1, 1.0, -1.0)
    if log.approach is not None:
        against = (log.approach @ placement.axis) * into < 0.0
        if against.mean() > 0.5:
            raise InputError(
                log.at(int(against.argmax())),
                "the directions point out of the faces: normals taken for approaches, or fronts and backs swapped",
                found=f"{int(against.sum())} of {len(log)} directions against the approach to the face they are at",
                expected="approaches into the material, or normals out of it, named as what they are",
            )
    stated = log.columns.get("face")
    if stated is None or not (stated != face).any():
        return
    row = int((stated != face).argmax())
    spans = [float(np.ptp(along)) for along in (log.position_mm @ placement.axis, _certified(stated, gauge))]
    swapped = float(np.mean(stated == np.where(face % 2 == 1, face + 1, face - 1)))
    hint = " (fronts and backs are swapped)" if swapped > 0.5 else unit_hint(*spans)
    raise InputError(
        log.at(row),
        f"the stated face is not the one that the point lies at{hint}",
        found=f"face {stated[row]:g}, {int((stated != face).sum())} of {len(log)} rows differ",
        expected=f"face {face[row]} of {gauge.table.name} as placed",
    )


def _certified(face: Array, gauge: Gauge) -> Array:
    known = (face >= 1) & (face <= gauge.n_faces)
    return gauge.position_mm[face[known].astype(int) - 1] if known.any() else np.zeros(1)


def _radius(radius: float | None, log: ProbeLog) -> float:
    if radius is None:
        raise InputError(
            log.path,
            "the points are compensated by the tip radius, a recording has tip centres, and the radius is not known",
            expected=naming("tip_radius_mm", words="{}, the radius that the controller compensated with"),
        )
    return radius


def _frame(log: ProbeLog, matched: Pairing, options: ImportOptions, surface_radius: float | None) -> pd.DataFrame:
    import pandas as pd

    expected, point, row = matched.expected, matched.point, matched.row
    approach = expected.approach[point] if log.approach is None else log.approach[row]
    position = log.position_mm[row]
    if log.surface:
        position = position - _radius(surface_radius, log) * approach
    number = int(log.columns["placement"][0]) if "placement" in log.columns else options.placement
    frame = pd.DataFrame({"placement": number, "cycle": expected.cycle[point], "face": expected.face[point]})
    frame[POSITION], frame[APPROACH] = position, approach
    if expected.speed_mm_s is not None:
        frame["speed_mm_s"] = expected.speed_mm_s
    _add_columns(frame, log, row, options)
    return frame


def _add_columns(frame: pd.DataFrame, log: ProbeLog, row: NDArray[np.int64], options: ImportOptions) -> None:
    """What the log has besides, row by row or for the whole run, and what the person says."""
    if log.time_s is not None:
        frame["time_s"] = log.time_s[row]
    for name, values in log.columns.items():
        if name not in ("cycle", "face"):
            frame[name] = values[row]
    for name in OPTIONAL:
        value = number(log.comments.get(name, ""))
        if np.isfinite(value) and name not in log.columns and name != "time_s":
            frame[name] = value
    if options.gauge_temperature_C is not None:
        _check_stated_once(log, frame, options.gauge_temperature_C)
        frame["gauge_temperature_C"] = options.gauge_temperature_C
    frame["placement"] = frame["placement"].astype(np.int64)
    for name in frame.columns:
        if name.endswith("_C") and name in OPTIONAL:
            _check_temperature(log, row, frame, name)


def _check_stated_once(log: ProbeLog, frame: pd.DataFrame, stated_C: float) -> None:
    """The temperature of the gauge is recorded or stated: a log that says another one is not overruled unseen."""
    name = "gauge_temperature_C"
    if name in frame and not np.allclose(frame[name].to_numpy(float), stated_C, atol=SAME_K, rtol=0.0):
        found = f"{stated_C:g} deg C, and {frame[name].mean():.6g} deg C on average in the log"
        expected = naming("gauge_temperature_C", words="a log without temperatures of the gauge, or no {}")
        raise InputError(log.path, "two temperatures of the gauge", found=found, expected=expected)


def _check_temperature(log: ProbeLog, row: NDArray[np.int64], frame: pd.DataFrame, name: str) -> None:
    wrong = no_temperature(frame[name].to_numpy(float), frame["placement"].to_numpy())
    if wrong is not None:
        where = log.at(row[wrong.row])
        raise InputError(where, f"{name} {wrong.why}", found=wrong.found, expected=wrong.expected)


def _matched_words(log: ProbeLog, frame: pd.DataFrame, matched: Pairing) -> list[str]:
    face, expected = frame["face"], matched.expected
    visits = face.value_counts()
    cycles = f"{visits.max()}" if visits.min() == visits.max() else f"{visits.min()} to {visits.max()}"
    words = [
        f"{log.form}: {len(log)} rows, {len(expected)} points of {expected.source}",
        f"faces {face.min()} to {face.max()} ({face.nunique()} of them), cycles per face: {cycles}",
        *matched.differences,
    ]
    if np.isfinite(expected.search_mm):
        words.append(_triggers(log, expected, matched))
    return words


def _triggers(log: ProbeLog, expected: ExpectedPoints, matched: Pairing) -> str:
    along, beside = point_distances(log.position_mm[matched.row], expected, matched.point)
    return (
        f"triggers {along.min():+.4f} to {along.max():+.4f} mm from the nominal contact along the approach, at most"
        f" {beside.max():.4f} mm beside it (search distance {expected.search_mm:g} mm)"
    )


def _corrected(surface: bool, radius: float | None, log: ProbeLog) -> dict[str, str]:
    return {CORRECTED: f"{_radius(radius, log):.9g}"} if surface else {}


def _surface_words(surface: bool, radius: float | None, log: ProbeLog, before_mm: float | None = None) -> list[str]:
    """What the points are; of centres how far before the certified faces, which shows a wrong tip."""
    if surface:
        return [f"surface points, turned back into tip centres with the tip radius {_radius(radius, log):g} mm"]
    tip = "" if before_mm is None else f"{before_mm:.3f} mm before their faces"
    told = f"points are tip centres, {tip}: the tip radius less pre-travel and backlash"
    return [told if tip else "points are tip centres"]


def _dropped(log: ProbeLog) -> list[str]:
    return [*log.left_out, *([f"dropped: {log.dropped} lines that are blank or comments"] if log.dropped else [])]
