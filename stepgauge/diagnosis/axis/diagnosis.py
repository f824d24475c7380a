"""Recordings of an axis, a spot or distances to a diagnosis in a folder, without gauge and machine files."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import pandas as pd

from stepgauge.axis.order import is_order_known
from stepgauge.axis.recording import AxisRecording, join_axis_recordings, places_of
from stepgauge.axis.sensors import SENSORS, not_candidates
from stepgauge.axis.units import AxisUnits
from stepgauge.conditions import NOTHING, Conditions
from stepgauge.conditions.axis import recording_conditions
from stepgauge.conditions.condition import Name
from stepgauge.diagnosis.axis.conversion import UnitConversion
from stepgauge.diagnosis.axis.residuals import AxisData, axis_data, placed_targets
from stepgauge.diagnosis.engine import diagnose_with_search, insufficient
from stepgauge.diagnosis.output.files import statements_to_dict
from stepgauge.diagnosis.output.rows import ROWS_FILE, row_table, rows_csv
from stepgauge.diagnosis.priors import Priors, kind_probabilities, possible_kinds, shipped_priors, stated_kind
from stepgauge.diagnosis.result import ComputedDiagnosis, GaugeDiagnosis
from stepgauge.diagnosis.wording.aliases import EvenSpacing, bounded, even, uneven_targets
from stepgauge.diagnosis.wording.findings import meaning, subject
from stepgauge.diagnosis.wording.limits import limits
from stepgauge.diagnosis.wording.phrases import Phrase, covariate_name, number, worded, worded_all
from stepgauge.files.arrays import Array
from stepgauge.files.checksum import file_sha256
from stepgauge.files.json_types import json_types
from stepgauge.inference.search import Progress
from stepgauge.recording.simulated import is_simulated

if TYPE_CHECKING:
    from stepgauge.figures.axis import DrawnAxis


SOUGHT: tuple[Name, ...] = ("outliers", "drift")
"""Conditions that are findings here: the search looks for single readings that are off, and for what moves in time."""
OF_PLACES = ("position", "machine x", "face", "target")
"""Covariates of forms that are told as a reversal error where they have opposite signs in the two directions."""


@dataclass(frozen=True, repr=False)
class AxisDiagnosis(ComputedDiagnosis):
    """The diagnosis of an axis, a spot or distances: as it was computed, with its data, and in the user's units.

    ``recordings``: as they were read; ``kinds``: probability of each kind of axis that it may be of;
    ``u_laws_um (n,)``: standard uncertainty of what the stated laws move together, as computed; empty where none are.
    """

    drawn_by: ClassVar[str] = "axis.draw_laws"
    verdict: str
    found: GaugeDiagnosis
    data: AxisData
    conditions: Conditions = NOTHING
    recordings: tuple[AxisRecording, ...] = ()
    path: str = ""
    kinds: Mapping[str, float] = field(default_factory=dict)
    u_laws_um: Array = field(default_factory=lambda: np.zeros(0), compare=False)

    @cached_property
    def contents(self) -> dict[str, Any]:
        """All that is stated, in JSON types and the user's units."""
        files = [{"path": str(one.path), "sha256": file_sha256(one.path)} for one in self.recordings]
        simulated = any(is_simulated(one.comments) for one in self.recordings)
        said = _said(self.found, self.data, self.conditions)
        said["axis"]["kinds"] = dict(self.kinds)
        return {**said, "inputs": {"recordings": files, "simulated": simulated}}

    def drawn(self) -> DrawnAxis:
        from stepgauge.figures.axis import drawn_of

        return drawn_of(self)

    def outputs(self, folder: Path) -> tuple[Mapping[str, Any], Mapping[str, str]]:
        return self.contents, {ROWS_FILE: rows_csv(_rows(self))}


def diagnose_axis(
    recording: AxisRecording,
    without: Collection[str] = (),
    priors: Priors | None = None,
    kind: str | None = None,
    progress: Progress | None = None,
) -> AxisDiagnosis:
    """What is behind the deviations of an axis; parameters as :func:`stepgauge.diagnosis.engine.diagnose`.

    ``kind``: of the axis, in place of the comment ``kind`` of its recording. Only effects that the sensor and the form
    of the recording can have are candidates. Nothing is stated of readings whose conditions prevent a statement.
    """
    table = priors or shipped_priors()
    kind = stated_kind(kind, recording.comments, table, recording.path)
    kinds = possible_kinds(kind, recording.units.axis, table)
    data, conditions = axis_data(recording, table.kinds.get(kind or "")), _axis_conditions(recording)
    absent = {*not_candidates(recording.sensor, recording.form, recording.units.axis == "rotary"), *without}
    if conditions.preventing:
        return AxisDiagnosis("insufficient", insufficient(data.residuals), data, conditions, (recording,))
    found, searched = diagnose_with_search(data.residuals, absent, table.adapt(kinds), progress=progress)
    found = replace(found, unexplained=tuple(sorted(found.unexplained, key=lambda one: -one.probability)))
    told = AxisDiagnosis(found.verdict, found, data, conditions, (recording,))
    if searched is None:
        return told
    u_um = searched.model.fitted.u_um * searched.model.wider
    return replace(told, kinds=kind_probabilities(searched.answer, kinds, table), u_laws_um=u_um)


def _axis_conditions(recording: AxisRecording) -> Conditions:
    """The conditions of the readings without those that are findings here.

    A unit that is unlikely prevents nothing: what is said of an axis does not depend on its size, and its numbers are
    in the unit that is stated.
    """
    found = recording_conditions(recording).without(*SOUGHT)
    unlikely = [one for one in found.preventing if one.name == "units"]
    noted = (replace(one, state="contribution") if one in unlikely else one for one in found.entries)
    return Conditions(tuple(noted))


def diagnose_axes(
    recordings: Sequence[AxisRecording],
    without: Collection[str] = (),
    priors: Priors | None = None,
    kind: str | None = None,
    progress: Progress | None = None,
) -> AxisDiagnosis:
    """Recordings of one axis together, as its settings up."""
    whole = recordings[0] if len(recordings) == 1 else join_axis_recordings(recordings)
    return replace(diagnose_axis(whole, without, priors, kind, progress), recordings=tuple(recordings))


def _rows(told: AxisDiagnosis) -> pd.DataFrame:
    """Every reading with its residual, in the user's units and with the sign of a reading."""
    recording, data = told.data.recording, told.data
    frame, units = recording.frame, recording.units
    places = frame["target" if "target" in frame else "reading"].to_numpy(float)
    factor = frame["way"].to_numpy(float) / data.scaling.deviation / units.base_deviation
    found = replace(told.found, recordings=told.recordings)  # type: ignore[arg-type]
    return row_table(found, (units.position, places), (units.deviation, factor))


def _said(found: GaugeDiagnosis, data: AxisData, conditions: Conditions) -> dict[str, Any]:
    recording = data.recording
    units = recording.units
    raw = statements_to_dict(replace(found, recordings=(recording,)))  # type: ignore[arg-type]
    conversion = UnitConversion(units, data.scaling)
    said = conversion.converted(raw)
    said["axis"] = {**_axis(recording), "repeatability": data.repeatability / units.base_deviation}
    said["conditions"] = conditions.to_dicts()
    at, steps = subject(said), even(placed_targets(recording)) if recording.form == "axis" else None
    for effect in said["effects"]:
        effect["separate_by"], effect["commands"], effect["reason"] = "", [], ""
        effect["where"] = conversion.condition(effect["where"])
        for one in (effect, *effect["set"]):
            one["aliases"] = _aliases(one["parameters"], steps, units)
            one["parameters"] = bounded(one["parameters"], one["aliases"])
            one["meaning"] = meaning(one, at)
        if effect["aliases"] and steps is not None:
            effect["separate_by"] = uneven_targets(steps, units.position)
        for row in effect.get("rows", []):
            row["target"] = _target_of(recording, int(row["row"]))
            row[f"off_{units.deviation}"] *= float(recording.frame["way"].iloc[int(row["row"]) - 1])  # as it was read
            row.pop("face", None)
            row.pop("pair", None)
    for one in (*said["unexplained"], *said["located"]):
        if is_reversal(recording, one["covariate"], any(phrase["say"] == "approach" for phrase in one["phrases"])):
            one["phrases"] = [reversal_phrase(recording)]
        one["covariate"], one["where"] = covariate_name(one["covariate"], at), worded(one["phrases"], at)
    for one in (*said["probabilities"].get("statements", ()), *said["probabilities"].get("possible", ())):
        one |= {"covariate": covariate_name(one["covariate"], at)} if "covariate" in one else {}
    for check in said["checks"]:
        check["words"] = worded(check["phrase"], at)
    said["measured"] = {name: said["measured"][name] for name in ("duration_s", "time_recorded")}
    said["noise"].pop(f"machine_file_{units.deviation}")
    said["fit"]["holdout"] = {"targets" if by == "faces" else by: one for by, one in said["fit"]["holdout"].items()}
    said["axis"]["even_step"] = None if steps is None else steps.spacing
    said["limits"] = [*limits(said), *worded_all(conversion.converted(found.remarks), at)]
    said.pop("remarks")
    return dict(json_types(said))


def _axis(recording: AxisRecording) -> dict[str, Any]:
    """What was measured, by what, in which units."""
    units, frame = recording.units, recording.frame
    return {
        "form": recording.form,
        "sensor": recording.sensor,
        "sensor_words": SENSORS[recording.sensor].words,
        "artefact": recording.comments.get("artefact", "none"),
        "kind": units.axis,
        "unit": units.position,
        "deviation_unit": units.deviation,
        "readings": len(frame),
        "targets": len(np.unique(places_of(frame["target"].to_numpy(float)))) if "target" in frame else 0,
        "cycles": int(frame["cycle"].nunique()),
        "both_ways": recording.both_ways,
        "order_known": is_order_known(recording),
        "covariates": recording.covariates,
        "largest": float(np.abs(recording.deviation).max()) if recording.form == "axis" else None,
    }


def _aliases(parameters: Mapping[str, Any], steps: EvenSpacing | None, units: AxisUnits) -> dict[str, Any]:
    """Periods along the axis that evenly spaced targets cannot tell from that of a law; none for other laws."""
    period = parameters.get(f"period_{units.position}")
    if steps is None or period is None:
        return {}
    unit_mm = units.base_position if units.axis == "linear" else None
    return steps.aliases(float(period["value"]), float(period.get("u") or 0.0), units.position, unit_mm)


def _target_of(recording: AxisRecording, row: int) -> str:
    frame = recording.frame.iloc[row - 1]
    if recording.form == "distances":
        return f"{frame['from_station']} to {frame['to_station']}"
    return f"{frame['target']:.12g} {recording.units.position}" if "target" in frame else "-"


def reversal_by_target(recording: AxisRecording) -> tuple[Array, Array]:
    """Targets ``(t,)`` that were read from both sides, and the reversal error at each, in units of deviation.

    Mean reading in positive minus that in negative direction (ISO 230-2:2014, 2.11).
    """
    target, way = recording.frame["target"].to_numpy(float), recording.frame["way"].to_numpy(float)
    place, away = places_of(target), recording.deviation
    count, total = (
        np.array([np.bincount(place, own * (way == sign), int(place.max()) + 1) for sign in (1.0, -1.0)])
        for own in (np.ones(len(away)), away)
    )
    both = count.min(axis=0) > 0
    where = np.bincount(place, target) / np.bincount(place)
    mean = total[:, both] / count[:, both]
    return where[both], mean[0] - mean[1]


def reversal_phrase(recording: AxisRecording) -> Phrase:
    """That the reversal error differs along the axis, with its least and largest value and where these are."""
    where, um = reversal_by_target(recording)
    least, largest = int(np.abs(um).argmin()), int(np.abs(um).argmax())
    deviation, position = recording.units.deviation, recording.units.position
    return {
        "say": "reversal",
        "least": number(um[least], deviation),
        "largest": number(um[largest], deviation),
        "least_at": number(where[least], position),
        "largest_at": number(where[largest], position),
    }


def is_reversal(recording: AxisRecording, covariate: str, opposite: bool) -> bool:
    """Whether a form over a covariate is a reversal error by position; ``opposite``: in sign by direction.

    There is none where each target is come to from one side, whichever it is.
    """
    both = recording.form == "axis" and len(reversal_by_target(recording)[0]) > 0
    return both and opposite and covariate in OF_PLACES
